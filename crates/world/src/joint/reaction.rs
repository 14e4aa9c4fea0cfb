//! What joints give their bodies: impulses of a step, told apart as those of its flows and those of its impacts.

use super::frame::Joint;
use super::list::rows_of;
use carom_math::{Column, Space};
use carom_solver::{ContactProblem, Impulses, Twist};
use serde::{Deserialize, Serialize};

/// What body a of a joint got from b in the last step; b got the opposite. World axes; torques about the anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Reaction<S: Space> {
    /// Force, the mean over the step without its impacts \[N\].
    pub force: S::Vector,
    /// Torque, the mean over the step without its impacts \[N m\]; zero but for fixed joints.
    pub torque: S::Spin,
    /// Impulse of the step's impacts \[N s\].
    pub impact: S::Vector,
    /// Angular impulse of the step's impacts \[N m s\].
    pub impact_moment: S::Spin,
}

/// Impulses of a joint: of flows, of impacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JointImpulse<S: Space> {
    pub flows: Twist<S>,
    pub impacts: Twist<S>,
}

impl<S: Space> JointImpulse<S> {
    /// As users read it, after a step of this length \[s\].
    pub fn told(&self, dt: f64) -> Reaction<S> {
        Reaction {
            force: self.flows.linear * (1.0 / dt),
            torque: self.flows.angular * (1.0 / dt),
            impact: self.impacts.linear,
            impact_moment: self.impacts.angular,
        }
    }
}

/// Adds other impulses to some, one by one.
pub(crate) fn add_all<S: Space>(to: &mut Vec<JointImpulse<S>>, more: &[JointImpulse<S>]) {
    if to.len() < more.len() {
        to.resize(more.len(), JointImpulse::default());
    }
    for (t, m) in to.iter_mut().zip(more) {
        t.flows.add_scaled(&m.flows, 1.0);
        t.impacts.add_scaled(&m.impacts, 1.0);
    }
}

/// Force and torque about the anchor, as impulses, that each joint's rows gave its body a; the rows are all of the
/// problem's, joint after joint.
pub(crate) fn wrenches<S: Space>(
    joints: &[Joint<S>],
    problem: &ContactProblem<S>,
    impulses: &Impulses<S>,
) -> Vec<Twist<S>> {
    let mut first = 0;
    let of = |j: &Joint<S>| {
        let from = first;
        let mut sum = Twist::default();
        for (row, l) in rows_of(&problem.rows, &mut first, j).iter().zip(&impulses.rows[from..]) {
            sum.linear += row.on_a.linear * *l;
            if row.on_a.linear == S::Vector::ZERO {
                sum.angular += row.on_a.angular * *l;
            }
        }
        sum
    };
    joints.iter().map(of).collect()
}
