//! Clusters of a flow: bodies that its contacts join. Each settles in rounds of its own, solved as well as its own places
//! are known; those that are done cost no more. Where there are joints, all are one cluster.

use super::aim::Aiming;
use super::together::{Halt, LastFlow, Together, Tools};
use crate::assembly;
use crate::narrow_phase::Touch;
use crate::observe::report::SolveReport;
use carom_geometry::Geometry;
use carom_math::Space;
use carom_solver::{
    ContactProblem, Impulse, ImpulseChoice, ImpulseSolver, Impulses, IslandReport, Outcome, Partition,
    SolveSettings, Stop,
};

/// Clusters whose tolerances differ by less than this factor are solved at once, to the smallest of them.
const CLASS: f64 = 100.0;

/// How far the rounds of a cluster are.
#[derive(Debug, Default)]
pub struct Cluster {
    /// Rounds taken since contacts were added.
    pub taken: usize,
    /// How much the last change of places was over what may be \[1\].
    pub change: f64,
    /// Largest error of a gap at the end that had to be corrected \[m\].
    pub off: f64,
    /// Residual that the last round was solved to \[m/s\].
    pub tolerance: f64,
    /// The least error of its places that a round has come to, over what may be \[1\], and how many rounds since did not
    /// come well below it.
    pub least: Option<f64>,
    /// See `least`.
    pub stalled: usize,
    /// True when the round that was taken is its last.
    pub is_last: bool,
    /// True when it needs no more rounds.
    pub settled: bool,
    /// True where something turns on corners or edges.
    pub angular: bool,
    /// True where that is so while its gap closes.
    pub corners: bool,
    /// How far it is with contacts that do not press.
    pub left_out: LeftOut,
    solved: Option<Solved>,
}

/// What the rounds of a cluster do with contacts that do not press: once it shows who presses, they are left out until
/// its places are known, and looked at then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LeftOut {
    /// It does not show yet who presses.
    #[default]
    NotYet,
    /// They are left out.
    Now,
    /// None is left out any more: they were looked at, or the round to come is the last.
    NoMore,
}

/// What the last solve said of a cluster.
#[derive(Debug)]
struct Solved {
    residual: f64,
    relative: f64,
    worst: Option<(usize, usize)>,
    stop: Stop,
    islands: Vec<IslandReport>,
}

/// All clusters of a flow.
#[derive(Debug)]
pub struct Clusters {
    /// The clusters, by their first contacts.
    pub all: Vec<Cluster>,
    of_contact: Vec<usize>,
    /// Whether a contact is left out of its cluster's rounds.
    is_out: Vec<bool>,
    of_body: Vec<usize>,
    jointed: bool,
    iterations: usize,
    /// Those that are not settled, those of like tolerance beside each other.
    open: Vec<usize>,
}

/// No cluster.
const NONE: usize = usize::MAX;

impl Clusters {
    /// Those of so many bodies without contacts.
    pub fn new(bodies: usize, jointed: bool) -> Self {
        let all = if jointed { vec![Cluster::default()] } else { Vec::new() };
        let of_body = vec![if jointed { 0 } else { NONE }; bodies];
        Clusters {
            all,
            of_contact: Vec::new(),
            is_out: Vec::new(),
            of_body,
            jointed,
            iterations: 0,
            open: Vec::new(),
        }
    }

    /// Takes in contacts that come after those it knows; what they join begins anew, the rest stays as it is.
    pub fn join<S: Geometry>(&mut self, touches: &[Touch<S>], moves: impl Fn(usize) -> bool) {
        if self.jointed {
            self.of_contact.resize(touches.len(), 0);
            self.is_out.resize(touches.len(), false);
            self.all[0] = Cluster::default();
            return;
        }
        let mut sets = Partition::default();
        sets.reset(self.of_body.len());
        touches.iter().filter(|t| moves(t.a) && moves(t.b)).for_each(|t| sets.join(t.a, t.b));
        let mut old = std::mem::take(&mut self.all);
        let stalled: Vec<usize> = old.iter().map(|c| c.stalled).collect();
        let before = std::mem::take(&mut self.of_contact);
        self.of_body.fill(NONE);
        for (k, t) in touches.iter().enumerate() {
            let root = sets.root(if moves(t.a) { t.a } else { t.b });
            if self.of_body[root] == NONE {
                self.of_body[root] = self.all.len();
                // where nothing new comes it is the cluster that it was
                self.all.push(before.get(k).map_or_else(Cluster::default, |&c| std::mem::take(&mut old[c])));
            }
            let cluster = self.of_body[root];
            match before.get(k) {
                Some(&c) => self.all[cluster].stalled = self.all[cluster].stalled.max(stalled[c]),
                // features that came and went go on doing so
                None => {
                    self.all[cluster] =
                        Cluster { stalled: self.all[cluster].stalled.min(1), ..Cluster::default() }
                }
            }
            self.of_contact.push(cluster);
        }
        for (&cluster, t) in self.of_contact.iter().zip(touches) {
            for i in [t.a, t.b].into_iter().filter(|&i| moves(i)) {
                self.of_body[i] = cluster;
            }
        }
        self.is_out.resize(touches.len(), false);
        self.take_back();
    }

    /// True for a contact that is left out of its cluster's rounds.
    pub fn is_out(&self, contact: usize) -> bool {
        self.is_out[contact]
    }
    /// Leaves contacts without an impulse out of the rounds of a cluster.
    pub fn leave_out<S: Space>(&mut self, cluster: usize, impulses: &[Impulse<S>]) {
        self.all[cluster].left_out = LeftOut::Now;
        for ((out, &of), impulse) in self.is_out.iter_mut().zip(&self.of_contact).zip(impulses) {
            *out |= of == cluster && impulse.normal == 0.0;
        }
    }
    /// Takes contacts back where clusters leave none out.
    pub fn take_back(&mut self) {
        for (out, &of) in self.is_out.iter_mut().zip(&self.of_contact) {
            *out &= self.all[of].left_out == LeftOut::Now;
        }
    }
    /// Takes in that a contact of a cluster leaves a residual \[m/s\].
    pub fn leaves(&mut self, contact: usize, residual: f64) {
        if let Some(solved) = &mut self.all[self.of_contact[contact]].solved {
            solved.residual = solved.residual.max(residual);
        }
    }

    /// The cluster of a contact.
    pub fn of_contact(&self, contact: usize) -> &Cluster {
        &self.all[self.of_contact[contact]]
    }
    /// The same to change.
    pub fn of_contact_mut(&mut self, contact: usize) -> &mut Cluster {
        &mut self.all[self.of_contact[contact]]
    }
    /// True when none needs more rounds.
    pub fn are_settled(&self) -> bool {
        self.all.iter().all(|c| c.settled)
    }
    /// Takes the errors of gaps that were corrected \[m\], by contact.
    pub fn set_off(&mut self, off: &[f64]) {
        self.all.iter_mut().filter(|c| !c.settled).for_each(|c| c.off = 0.0);
        for (k, off) in off.iter().enumerate() {
            let cluster = &mut self.all[self.of_contact[k]];
            if !cluster.settled {
                cluster.off = cluster.off.max(*off);
            }
        }
    }

    /// Clusters that are not settled, by their tolerances.
    fn find_open(&mut self) -> Vec<usize> {
        let mut open = std::mem::take(&mut self.open);
        open.clear();
        open.extend((0..self.all.len()).filter(|&c| !self.all[c].settled));
        let tolerance = |c: usize| self.all[c].tolerance;
        open.sort_unstable_by(|&c, &d| tolerance(c).total_cmp(&tolerance(d)).then(c.cmp(&d)));
        open
    }

    /// How many of those that are left are solved at once, to the tolerance of the first.
    fn class_of(&self, open: &[usize]) -> usize {
        let tolerance = |c: usize| self.all[c].tolerance;
        let is_like = |c: &&usize| tolerance(**c) < CLASS * tolerance(open[0]);
        1 + open[1..].iter().take_while(is_like).count()
    }

    /// Keeps what a solve said of these clusters.
    fn keep<S: Geometry>(
        &mut self,
        class: &[usize],
        problem: &ContactProblem<S>,
        (outcome, asked): (Outcome, &SolveSettings),
    ) {
        self.iterations += outcome.iterations;
        let by_island = !outcome.islands.is_empty();
        let worst = assembly::bodies_of(problem, outcome.residual.worst);
        let (whole, relative) = (outcome.residual.absolute, outcome.residual.relative);
        for &c in class {
            let (residual, relative) = if by_island { (0.0, 0.0) } else { (whole, relative) };
            let mut islands = self.all[c].solved.take().map_or_else(Vec::new, |before| before.islands);
            islands.clear();
            islands.reserve_exact(usize::from(by_island));
            self.all[c].solved = Some(Solved { residual, relative, worst, stop: Stop::Converged, islands });
        }
        for island in outcome.islands {
            let Some(solved) = &mut self.all[self.of_body[island.first_body]].solved else { continue };
            if island.residual >= solved.residual {
                (solved.residual, solved.relative) = (island.residual, island.relative_residual);
            }
            solved.islands.push(island);
        }
        for &c in class {
            let Some(solved) = &mut self.all[c].solved else { continue };
            let is_within = solved.residual <= asked.tolerance;
            if asked.impulses != ImpulseChoice::Any || !is_within {
                solved.stop = outcome.stop.clone();
            }
        }
    }

    /// The report of all clusters' last solves, with the iterations of all; `None` where nothing was solved.
    pub fn report(&mut self, contacts: usize) -> Option<SolveReport> {
        let mut all: Option<SolveReport> = None;
        for solved in self.all.iter_mut().filter_map(|c| c.solved.take()) {
            let Solved { residual, relative: relative_residual, worst, stop, islands } = solved;
            let Some(so_far) = &mut all else {
                let iterations = self.iterations;
                all = Some(SolveReport {
                    contacts,
                    iterations,
                    residual,
                    relative_residual,
                    worst,
                    stop,
                    islands,
                });
                continue;
            };
            if residual > so_far.residual || residual.is_nan() {
                (so_far.residual, so_far.relative_residual, so_far.worst) =
                    (residual, relative_residual, worst);
            }
            if so_far.stop == Stop::Converged {
                so_far.stop = stop;
            }
            so_far.islands.extend(islands);
        }
        all
    }
}

impl<S: Geometry> Together<'_, S> {
    /// Solves for the impulses of clusters that are not settled, each as well as it asks.
    pub(super) fn solve_clusters(
        &mut self,
        clusters: &mut Clusters,
        (last, part): (&mut LastFlow<S>, &mut Option<Part<S>>),
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let open = clusters.find_open();
        let mut left = open.as_slice();
        while !left.is_empty() {
            let (class, others) = left.split_at(clusters.class_of(left));
            left = others;
            let tolerance = clusters.all[class[0]].tolerance;
            let settings = SolveSettings { tolerance, ..self.settings.solve() };
            if class.len() == clusters.all.len() && !clusters.is_out.contains(&true) {
                let outcome = self.work(&last.problem, &settings, &mut last.impulses, tools)?;
                clusters.keep(class, &last.problem, (outcome, &settings));
                continue;
            }
            let part = part.get_or_insert_with(|| Part::of(&last.problem));
            part.take(clusters, class, last);
            let outcome = self.work(&part.problem, &settings, &mut part.impulses, tools)?;
            clusters.keep(class, &part.problem, (outcome, &settings));
            part.give(&mut last.impulses);
        }
        clusters.open = open;
        Ok(())
    }

    fn work(
        &mut self,
        problem: &ContactProblem<S>,
        settings: &SolveSettings,
        impulses: &mut Impulses<S>,
        tools: &mut Tools<S>,
    ) -> Result<Outcome, Halt> {
        let is_last = settings.tolerance <= self.limits.tolerance;
        let enough = if is_last { self.settings.tolerance } else { f64::INFINITY };
        let mut aiming = Aiming { solver: &mut *tools.solver, enough, after: self.limits.aim };
        let outcome = aiming.solve_watched(problem, settings, impulses, tools.watch);
        if matches!(outcome.stop, Stop::Interrupted | Stop::Refused(_)) {
            let worst = assembly::bodies_of(problem, outcome.residual.worst);
            let worst = worst.map(|(a, b)| (self.members[a], self.members[b]));
            self.keep(0, SolveReport::new(outcome.clone(), problem.contacts.len(), worst), "contact")?;
        }
        Ok(outcome)
    }
}

/// Some clusters' problem, over all bodies; keeps its memory, and what the bodies are like, from round to round of a flow.
pub(super) struct Part<S: Geometry> {
    problem: ContactProblem<S>,
    impulses: Impulses<S>,
    contacts: Vec<usize>,
    resistances: Vec<usize>,
    chosen: Vec<bool>,
}

impl<S: Geometry> Part<S> {
    /// Of a flow in which bodies have these inverse masses, and velocities without impulses, in all rounds.
    pub fn of(whole: &ContactProblem<S>) -> Self {
        let mut problem = ContactProblem::new(whole.inverse_masses.clone(), whole.velocities.clone());
        problem.space.clone_from(&whole.space);
        problem.friction_law = whole.friction_law;
        let impulses = Impulses::default();
        Part { problem, impulses, contacts: Vec::new(), resistances: Vec::new(), chosen: Vec::new() }
    }

    /// Takes the contacts of a class of clusters.
    fn take(&mut self, clusters: &Clusters, class: &[usize], last: &LastFlow<S>) {
        let Part { problem, impulses, contacts, resistances, chosen } = self;
        chosen.clear();
        chosen.resize(clusters.all.len(), false);
        class.iter().for_each(|&c| chosen[c] = true);
        let whole = &last.problem;
        let is_in = |k: &usize| chosen[clusters.of_contact[*k]] && !clusters.is_out[*k];
        contacts.clear();
        contacts.reserve(whole.contacts.len());
        contacts.extend((0..whole.contacts.len()).filter(is_in));
        problem.contacts.clear();
        problem.contacts.extend(contacts.iter().map(|&k| whole.contacts[k]));
        impulses.contacts.clear();
        impulses.contacts.extend(contacts.iter().map(|&k| last.impulses.contacts[k]));
        problem.resistances.clear();
        impulses.moments.clear();
        resistances.clear();
        for (k, r) in whole.resistances.iter().enumerate() {
            if let Ok(contact) = contacts.binary_search(&r.contact) {
                let mut r = *r;
                r.contact = contact;
                problem.resistances.push(r);
                impulses.moments.push(last.impulses.moments[k]);
                resistances.push(k);
            }
        }
    }

    fn give(&self, impulses: &mut Impulses<S>) {
        for (&k, impulse) in self.contacts.iter().zip(&self.impulses.contacts) {
            impulses.contacts[k] = *impulse;
        }
        for (&k, moment) in self.resistances.iter().zip(&self.impulses.moments) {
            impulses.moments[k] = *moment;
        }
    }
}
