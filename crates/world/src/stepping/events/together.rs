//! Bodies that are dealt with together at a moment: what they touch, who presses, and what is booked. The stages of the
//! scheme in the other files work on this. Indices are the set's own.

use super::aim::Aiming;
use super::arrival::Arrivals;
use super::flow::Stick;
use super::limits::Limits;
use super::memory::Memory;
use super::tape::Tape;
use crate::assembly;
use crate::bodies::{Bodies, Motion};
use crate::error::StepError;
use crate::force::Wrench;
use crate::impact::Impacts;
use crate::joint::{JointImpulse, add_all};
use crate::narrow_phase::{Touch, restitution_of, touches_of};
use crate::observe::accounts::Accounts;
use crate::observe::event_log::{Acted, EventKind, EventLog, PieceKind};
use crate::observe::ledger::Ledger;
use crate::observe::report::{Events, ImpactReport, SolveReport};
use crate::settings::Settings;
use crate::warm_start::WarmStart;
use carom_geometry::{ContactPoint, Geometry};
use carom_solver::{
    ContactProblem, ImpulseChoice, ImpulseSolver, Impulses, SolveSettings, Stop, Twist, Watch,
};

/// Bodies at one moment of the step, to be struck, moved and looked at together.
pub struct Together<'a, S: Geometry> {
    /// The choices of the run.
    pub settings: &'a Settings<S>,
    /// The bodies: movable ones and obstacles in their way.
    pub bodies: Bodies<S>,
    /// Their indices in the world, ascending.
    pub members: Vec<usize>,
    /// Pairs that may meet, ascending.
    pub pairs: Vec<(usize, usize)>,
    /// Loads through the step, gravity apart.
    pub wrenches: Vec<Wrench<S>>,
    /// How far surfaces may come in the step \[m\].
    pub reaches: Vec<f64>,
    /// Bounds of the step.
    pub limits: &'a Limits,
    /// Time of the step's start \[s\].
    pub time: f64,
    /// When they were gathered, from the step's start \[s\].
    pub moment: f64,
    /// How long they have moved since \[s\].
    pub moved: f64,
    /// Lines of what has been done with them.
    pub ledger: Ledger,
    /// The same body by body, where that is asked for.
    pub accounts: Accounts<S>,
    /// What their joints have given.
    pub joints: Vec<JointImpulse<S>>,
    /// What happened to them.
    pub events: Events,
    /// Projections, impacts and the like that they went through; flows are told by `last` when they are kept.
    pub log: EventLog<S>,
    /// What their impacts came to.
    pub struck: ImpactReport,
    /// What the last flow tells of its contacts; `None` before the step's first, where the step before counts.
    pub memory: Option<Memory>,
    /// The pair whose arrival is due (indices in the world): it has arrived wherever rounding put it.
    pub due: Option<(usize, usize)>,
    /// Forces of the step before, and what it tells of its contacts.
    pub warm: &'a WarmStart<S>,
    /// Forces of the last flow, once there was one.
    pub forces: Option<WarmStart<S>>,
    /// The last flow's problem and impulses.
    pub last: LastFlow<S>,
    /// Worst solves: persistent contacts, impacts.
    pub worst: [Option<SolveReport>; 2],
    /// Memory for contact points.
    pub points: Vec<ContactPoint<S>>,
    /// Names of all joints of the world.
    pub joint_names: &'a [String],
}

/// What solves, and who watches.
pub struct Tools<'a, 'w, S: Geometry> {
    /// The solver.
    pub solver: &'a mut dyn ImpulseSolver<S>,
    /// The impact phase's memory.
    pub impacts: &'a mut Impacts<S>,
    /// The search for arrivals.
    pub arrivals: &'a mut Arrivals<S>,
    /// Told of long solves.
    pub watch: &'a mut Watch<'w>,
    /// Told of what is done, where someone differentiates it.
    pub tape: Option<&'a mut Tape<S>>,
}

/// What a flow solved last.
#[derive(Clone)]
pub struct LastFlow<S: Geometry> {
    /// Its contacts.
    pub touches: Vec<Touch<S>>,
    /// Its problem; velocities are sums of start and end, twice the mean.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Its length \[s\]; 0 where there was none.
    pub time: f64,
    /// How friction held in it.
    pub stick: Stick,
    /// How fast each contact's gap closed \[m/s\].
    pub closing: Vec<f64>,
}

impl<S: Geometry> Default for LastFlow<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        let impulses = Impulses::zero(&problem);
        let (touches, closing) = (Vec::new(), Vec::new());
        LastFlow { touches, problem, impulses, time: 0.0, stick: Stick::Mean, closing }
    }
}

impl<S: Geometry> LastFlow<S> {
    /// Tells a log of the flow, begun at a moment \[s\] by a set with these members, of which some move; nothing where there
    /// was none.
    pub fn tell(&self, moment: f64, members: &[usize], moves: impl Fn(usize) -> bool, log: &mut EventLog<S>) {
        let LastFlow { touches, problem, impulses, time, stick, closing } = self;
        if *time > 0.0 {
            let acted = Acted { time: moment, length: *time, touches, problem, impulses };
            let kind = if *stick == Stick::Mean { EventKind::Flow } else { EventKind::FlowToEnd };
            log.add(&acted, |k| if closing[k] > 0.0 { EventKind::Closing } else { kind }, |i| members[i]);
            let movers = members.iter().copied().filter(|&i| moves(i));
            log.end_act(PieceKind::Flow, moment, *time, movers);
            log.add_rows(problem, impulses, |i| members[i]);
        }
    }
}

/// What a trial flow may have to give back.
pub struct Saved<S: Geometry> {
    motion: Motion<S>,
    moved: f64,
    ledger: Ledger,
    accounts: Accounts<S>,
    joints: Vec<JointImpulse<S>>,
    memory: Option<Memory>,
    worst: Option<SolveReport>,
}

impl<S: Geometry> Saved<S> {
    /// The motion that was saved.
    pub fn motion(&self) -> &Motion<S> {
        &self.motion
    }
    /// What the flow before it told of its contacts, if there was one in the step.
    pub fn memory(&self) -> Option<&Memory> {
        self.memory.as_ref()
    }
    /// The motion, to be kept.
    pub fn into_motion(self) -> Motion<S> {
        self.motion
    }
}

/// Why a step ended early.
pub enum Halt {
    /// Bodies left their reaches (their indices in the world, and how far they came \[m\]): the step must begin again
    /// with larger ones.
    Outgrown(Vec<(usize, f64)>),
    /// Impacts between two bodies (their indices in the world) gain energy \[J\], and the settings refuse that.
    Gains((usize, usize), f64),
    /// The step is refused.
    Refused(Box<Refusal>),
}

/// Why a step is refused, and the solve that was the reason.
pub struct Refusal {
    /// Why.
    pub error: StepError,
    /// The solve.
    pub solve: Option<SolveReport>,
}

impl<S: Geometry> Together<'_, S> {
    /// Contacts of a pair with gaps up to a margin \[m\], appended.
    pub fn find(&mut self, pair: (usize, usize), margin: f64, out: &mut Vec<Touch<S>>) {
        self.find_points(pair, margin);
        touches_of(&self.bodies, self.settings, pair, &self.points, out);
    }

    /// Contact points of a pair with gaps up to a margin \[m\], in `points`.
    pub fn find_points(&mut self, pair: (usize, usize), margin: f64) {
        self.points.clear();
        self.bodies.contact_points(pair, margin, &mut self.points);
    }

    /// Brings the movable bodies to where those of the world are.
    pub fn take_motion(&mut self, world: &Motion<S>) {
        for (k, &i) in self.members.iter().enumerate() {
            if self.bodies.is_dynamic(k) {
                self.bodies.motion.position[k] = world.position[i];
                self.bodies.motion.rotation[k] = world.rotation[i];
                self.bodies.motion.set_twist(k, &world.twist(i));
            }
        }
    }

    /// All contacts that touch.
    pub fn touches(&mut self) -> Vec<Touch<S>> {
        // balls in a heap have about three each, of which two bodies share one
        let mut out = Vec::with_capacity(self.pairs.len().min(2 * self.bodies.len()));
        for k in 0..self.pairs.len() {
            let (a, b) = self.pairs[k];
            let margin = self.limits.touching(&self.bodies.data[a], &self.bodies.data[b]);
            self.find((a, b), margin, &mut out);
        }
        out
    }

    /// Marks the pairs of which there is nothing to be found beside these contacts: those that touch in one point at most.
    pub fn settled_pairs(&self, known: &[Touch<S>]) -> Vec<bool> {
        let mut settled = vec![false; self.pairs.len()];
        for t in known {
            let collider = |i: usize| self.bodies.data[i].collider.as_ref();
            let (Some(a), Some(b)) = (collider(t.a), collider(t.b)) else { continue };
            if let Ok(k) = self.pairs.binary_search(&(t.a, t.b)) {
                settled[k] = S::touch_once(a, b);
            }
        }
        settled
    }

    /// True where a pair that may meet has restitution.
    pub fn may_bounce(&self) -> bool {
        self.pairs.iter().any(|&pair| restitution_of(&self.bodies, self.settings, pair) > 0.0)
    }

    /// Keeps what a trial flow changes.
    pub fn save(&self) -> Saved<S> {
        let (motion, memory) = (self.bodies.motion.clone(), self.memory.clone());
        let (accounts, joints) = (self.accounts.clone(), self.joints.clone());
        let (moved, worst) = (self.moved, self.worst[0].clone());
        Saved { motion, moved, ledger: self.ledger, accounts, joints, memory, worst }
    }

    /// Takes a trial flow back, its lines in the ledger and its solves included.
    pub fn restore(&mut self, saved: &Saved<S>) {
        self.bodies.motion.copy_from(&saved.motion);
        self.moved = saved.moved;
        self.ledger = saved.ledger;
        self.accounts.clone_from(&saved.accounts);
        self.joints.clone_from(&saved.joints);
        self.memory.clone_from(&saved.memory);
        self.worst[0].clone_from(&saved.worst);
    }

    /// Starts new lines and reports: what there was has been taken over.
    pub fn forget(&mut self) {
        self.ledger = Ledger::default();
        self.accounts.clear();
        self.joints.clear();
        self.events = Events::default();
        self.log.clear();
        self.struck = ImpactReport::default();
        self.worst = [None, None];
    }

    /// Those that impulses move.
    pub fn movers(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.bodies.len()).filter(|&i| self.bodies.is_dynamic(i))
    }

    /// Keeps what joints gave in a flow.
    pub fn keep_joints(&mut self, problem: &ContactProblem<S>, impulses: &Impulses<S>) {
        let flows = crate::joint::wrenches(&self.bodies.joints.all, problem, impulses);
        let given = |flows| JointImpulse { flows, impacts: Twist::default() };
        let given: Vec<JointImpulse<S>> = flows.into_iter().map(given).collect();
        add_all(&mut self.joints, &given);
    }

    /// Velocities before the step's loads, per body.
    pub fn twists(&self) -> Vec<Twist<S>> {
        (0..self.bodies.len()).map(|i| self.bodies.motion.twist(i)).collect()
    }

    /// Solves a problem of the set and keeps the report if it is the worst of its phase.
    pub fn solve(
        &mut self,
        problem: &ContactProblem<S>,
        impulses: &mut Impulses<S>,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        self.solve_to(self.limits.tolerance, problem, impulses, tools)
    }

    /// The same to a residual of one's own \[m/s\].
    pub fn solve_to(
        &mut self,
        tolerance: f64,
        problem: &ContactProblem<S>,
        impulses: &mut Impulses<S>,
        tools: &mut Tools<S>,
    ) -> Result<(), Halt> {
        let report = self.work_to(tolerance, problem, impulses, tools);
        self.keep(0, report, "contact")
    }

    /// The same without keeping what it came to.
    pub fn work_to(
        &self,
        tolerance: f64,
        problem: &ContactProblem<S>,
        impulses: &mut Impulses<S>,
        tools: &mut Tools<S>,
    ) -> SolveReport {
        let solve = SolveSettings { tolerance, ..self.settings.solve() };
        let is_last = tolerance <= self.limits.tolerance;
        let enough = if is_last { self.settings.tolerance } else { f64::INFINITY };
        let outcome = Aiming { solver: &mut *tools.solver, enough, after: self.limits.aim }.solve_watched(
            problem,
            &solve,
            impulses,
            tools.watch,
        );
        let worst = assembly::bodies_of(problem, outcome.residual.worst);
        let worst = worst.map(|(a, b)| (self.members[a], self.members[b]));
        SolveReport::new(outcome, problem.contacts.len(), worst)
    }

    /// Keeps a solve's report if it is its phase's worst, its iterations in any case; refuses where the solver did.
    pub fn keep(&mut self, phase: usize, mut report: SolveReport, name: &'static str) -> Result<(), Halt> {
        for island in &mut report.islands {
            // entries are those of a problem that is gone when the step is over
            (island.first_body, island.worst) = (self.members[island.first_body], None);
        }
        let spent = matches!(report.stop, Stop::OutOfIterations | Stop::OutOfFactorisations);
        let any = self.settings.impulses == ImpulseChoice::Any;
        if spent && any && report.residual <= self.settings.tolerance {
            // within what was asked for, if not within what the scheme aimed at
            report.stop = Stop::Converged;
        }
        let report = self.unless_refused(report, name)?;
        let iterations = report.iterations + self.worst[phase].as_ref().map_or(0, |w| w.iterations);
        let worse = self.worst[phase].as_ref().is_none_or(|w| report.residual >= w.residual);
        if worse {
            self.worst[phase] = Some(report);
        }
        if let Some(kept) = &mut self.worst[phase] {
            kept.iterations = iterations;
        }
        Ok(())
    }

    /// A solve's report, unless the solver refused or was interrupted: then the step ends.
    pub fn unless_refused(&self, report: SolveReport, phase: &'static str) -> Result<SolveReport, Halt> {
        let (contacts, time) = (report.contacts, self.time);
        let error = match &report.stop {
            Stop::Interrupted => StepError::Interrupted { phase, contacts, time },
            Stop::Refused(reason) => {
                let (solver, reason) = (self.settings.solver_kind().name(), reason.clone());
                StepError::SolverRefused { solver, phase, contacts, reason, time }
            }
            _ => return Ok(report),
        };
        Err(Halt::Refused(Box::new(Refusal { error, solve: Some(report) })))
    }
}
