//! Groups of bodies with books of their own: the lines of the ledger as work done on a group's bodies, and the same of
//! momentum and angular momentum. Groups that divide the world add up to it; groups may also overlap.

use crate::bodies::Bodies;
use crate::error::BuildError;
use crate::observe::accounts::{Account, Accounts, MomentumLedger};
use crate::observe::energy::{Energy, Momenta};
use crate::observe::ledger::Ledger;
use carom_geometry::Geometry;
use carom_math::{Column, Space};
use serde::{Deserialize, Serialize};

/// A group as users name it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LedgerGroup {
    /// Its name.
    pub name: String,
    /// Names of its bodies; `None` for all that can move, also those that are added later.
    pub bodies: Option<Vec<String>>,
}

/// The books of a group: of a step, or since they are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct GroupReport<S: Space> {
    /// The group's name.
    pub name: String,
    /// Its energy afterwards.
    pub energy: Energy,
    /// Its momenta afterwards.
    pub momenta: Momenta<S>,
    /// Where its energy went \[J\].
    pub ledger: Ledger,
    /// What changed its momentum \[kg m/s\].
    pub momentum: MomentumLedger<S::Vector>,
    /// What changed its angular momentum about the world's origin \[kg m^2/s\].
    pub angular_momentum: MomentumLedger<S::Spin>,
}

/// The groups of a world, and their books since they were named.
#[derive(Clone, Debug)]
pub struct Groups<S: Space> {
    groups: Vec<LedgerGroup>,
    /// The books since the groups were named, in their order.
    pub totals: Vec<GroupReport<S>>,
}

impl<S: Space> Default for Groups<S> {
    fn default() -> Self {
        Groups { groups: Vec::new(), totals: Vec::new() }
    }
}

/// Energy, momentum and angular momentum.
type State<S> = (Energy, Momenta<S>);

impl<S: Geometry> Groups<S> {
    /// Groups with nothing on their books.
    ///
    /// # Errors
    /// [`BuildError`] for a name that is empty or taken, or a body that is not there, named twice or cannot move.
    pub fn new(groups: Vec<LedgerGroup>, bodies: &Bodies<S>) -> Result<Self, BuildError> {
        for (k, group) in groups.iter().enumerate() {
            let refuse = |problem: String, remedy: &str| {
                Err(BuildError::body(&group.name, "ledger group", problem, remedy))
            };
            if group.name.is_empty() || groups[..k].iter().any(|g| g.name == group.name) {
                return refuse(
                    "has a name that is empty or taken".into(),
                    "give each group a name of its own",
                );
            }
            let names = group.bodies.as_deref().unwrap_or_default();
            for (n, name) in names.iter().enumerate() {
                let i = bodies.find(name).ok_or_else(|| bodies.unknown(name))?;
                if !bodies.is_dynamic(i) {
                    return refuse(
                        format!("names '{name}', an obstacle"),
                        "name bodies that forces move: obstacles have no energy of their own",
                    );
                }
                if names[..n].contains(name) {
                    return refuse(format!("names '{name}' twice"), "name each body once");
                }
            }
        }
        let totals = groups.iter().map(|g| empty(&g.name)).collect();
        Ok(Groups { groups, totals })
    }
    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }
    /// The groups.
    pub fn list(&self) -> &[LedgerGroup] {
        &self.groups
    }
    /// Takes a body out of all groups.
    pub fn forget(&mut self, name: &str) {
        for group in &mut self.groups {
            if let Some(names) = &mut group.bodies {
                names.retain(|n| n != name);
            }
        }
    }

    fn members(&self, group: &LedgerGroup, bodies: &Bodies<S>) -> Vec<usize> {
        match &group.bodies {
            Some(names) => names.iter().filter_map(|n| bodies.find(n)).collect(),
            None => (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)).collect(),
        }
    }

    /// Energies and momenta of the groups now.
    pub fn states(&self, bodies: &Bodies<S>, gravity: S::Vector) -> Vec<State<S>> {
        let of = |group| {
            let members = self.members(group, bodies);
            (Energy::of_some(bodies, &members, gravity), Momenta::of_some(bodies, &members))
        };
        self.groups.iter().map(of).collect()
    }

    /// The books of a step, from the states before it and what its bodies were given; adds them to the totals.
    pub fn close(
        &mut self,
        before: &[State<S>],
        accounts: &Accounts<S>,
        bodies: &Bodies<S>,
        gravity: S::Vector,
    ) -> Vec<GroupReport<S>> {
        let after = self.states(bodies, gravity);
        let mut reports = Vec::with_capacity(after.len());
        for (k, ((energy, momenta), (energy0, momenta0))) in after.iter().zip(before).enumerate() {
            let mut sum = Account::<S>::default();
            for i in self.members(&self.groups[k], bodies) {
                sum.add(&accounts.of_bodies[i]);
            }
            let Account { energy: mut ledger, mut momentum, mut angular_momentum } = sum;
            ledger.closure = energy.total() - energy0.total() - ledger.sum();
            momentum.closure = momenta.linear - momenta0.linear - momentum.sum();
            angular_momentum.closure = momenta.angular - momenta0.angular - angular_momentum.sum();
            let total = &mut self.totals[k];
            total.ledger.add(&ledger);
            total.momentum.add(&momentum);
            total.angular_momentum.add(&angular_momentum);
            (total.energy, total.momenta) = (*energy, *momenta);
            let name = total.name.clone();
            let (energy, momenta) = (*energy, *momenta);
            reports.push(GroupReport { name, energy, momenta, ledger, momentum, angular_momentum });
        }
        reports
    }
}

fn empty<S: Space>(name: &str) -> GroupReport<S> {
    GroupReport {
        name: name.into(),
        energy: Energy::default(),
        momenta: Momenta { linear: S::Vector::ZERO, angular: S::Spin::ZERO },
        ledger: Ledger::default(),
        momentum: MomentumLedger::default(),
        angular_momentum: MomentumLedger::default(),
    }
}
