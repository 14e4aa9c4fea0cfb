//! Soft steps (theory chapter 11): fast, for scenes that must look right rather than be exact. Contacts are found once a
//! step; substeps of loads, springs, motion and relaxation follow, in lanes of f32 on velocities and on what bodies moved
//! since the step began; poses and velocities stay in f64 and take the changes. Bodies that touch nothing fly exactly.
//! What it does not do: find moments of impact, hold joints, or solve to a tolerance; its report tells how far from done
//! the last sweep was.

mod again;
mod anew;
mod batch;
mod face;
mod find;
mod given;
mod join;
mod kept;
mod memory;
mod motion;
mod patches;
mod problem;
mod standing;
mod tally;

pub use again::AGAIN;
use face::{Face, Met, NONE};
pub use memory::PatchList;
use memory::Seen;
pub(crate) use standing::Standing;

use crate::ahead::Ahead;
use crate::bodies::Bodies;
use crate::error::StepError;
use crate::force::Wrench;
use crate::impact::Impacts;
use crate::integrate::{Loads, Step};
use crate::joint::JointImpulse;
use crate::material::Coefficients;
use crate::narrow_phase::{Chunk, NarrowPhase, Touch};
use crate::observe::accounts::{Accounts, Cause};
use crate::observe::energy::Energy;
use crate::observe::ledger::Ledger;
use crate::observe::report::SolveReport;
use crate::settings::{OnInaccurate, Settings};
use crate::stepping::fixed_step::slop;
use crate::stepping::{CameTo, Outside, SchemeReport, damp};
use crate::warm_start::WarmStart;
use carom_geometry::Geometry;
use carom_math::workers::Memory;
use carom_math::{Column, Workers};
use carom_solver::soft::{Patches, Rigid as RigidSweeps, SoftChoice, SoftSolver, Told};
use carom_solver::{SolverKind, Stop, Twist};
use find::{Finding, Found};
use given::Given;
use kept::Kept;
use motion::Booked;
use problem::Rigid;
use standing::Renewed;
use std::sync::{Arc, OnceLock};
use tally::Tally;

/// Memory of the scheme: nothing in it changes an answer but the warm start, which the world keeps.
pub struct SoftStep<S: Geometry> {
    solver: SoftSolver<S>,
    /// Faces of contact where the step began, in the order of their pairs, and the patch of each.
    met: Vec<Met<S>>,
    patches: Patches<S>,
    /// What the steps before saw of the patches that they had, and what this one saw of new ones.
    before: Arc<Vec<Seen<S>>>,
    fresh: Vec<Seen<S>>,
    /// Places of faces that something is remembered of, and room for a list of those seen.
    kept: Kept,
    spare: Vec<Seen<S>>,
    /// Their coefficients.
    kinds: Vec<Coefficients>,
    tally: Tally,
    found: Memory<Chunk<Found<S>>>,
    /// The number of the faces that the solver's packs are of, 0 for none, and what that will be at the step's end.
    packed: u64,
    packing: u64,
    /// The step's faces are those of the step before, laid in packs; those of them that were looked at anew, and room for these.
    goes_again: bool,
    anew: Vec<u32>,
    renewed: Memory<Chunk<Renewed<S>>>,
    /// The faces' points as touches, made when asked for.
    touches: OnceLock<Vec<Touch<S>>>,
    /// Record of each body: 0 for obstacles at rest, `u32::MAX` for bodies that touch nothing. Those of fixed bodies may be
    /// of an earlier step.
    record_of: Vec<u32>,
    /// Body of each record, and room for the order that bodies come in.
    body_of: Vec<u32>,
    given_order: Vec<u32>,
    /// Records before this one are those of obstacles: impulses do not move them.
    obstacles: u32,
    /// Velocities at the step's start, turning as free motion does in the mean.
    start: Vec<Twist<S>>,
    /// What free rotation adds to the spin at the step's end.
    after: Vec<S::Spin>,
    /// Room for what workers book of each body that moves.
    booked: Vec<Booked<S>>,
    /// For which standing bodies, and which sleeping ones, the columns over all bodies hold what does not change.
    made_for: Option<(u64, u64)>,
    /// The loads are zeros.
    quiet: bool,
    /// The applied loads of the last step.
    pub loads: Vec<Wrench<S>>,
    /// None: impacts are part of the substeps.
    pub impacts: Impacts<S>,
    /// None: joints are refused.
    pub(crate) joints: Vec<JointImpulse<S>>,
    /// What each body was given in the last step, where that is asked for.
    pub accounts: Accounts<S>,
    /// The solve that a step was refused for.
    pub failed: Option<SolveReport>,
    /// The rigid problem of the last step, made when asked for.
    rigid: Rigid<S>,
}

impl<S: Geometry> Default for SoftStep<S> {
    fn default() -> Self {
        SoftStep {
            solver: SoftSolver::default(),
            met: Vec::new(),
            patches: Patches::default(),
            before: Arc::default(),
            fresh: Vec::new(),
            kept: Kept::default(),
            spare: Vec::new(),
            kinds: Vec::new(),
            tally: Tally::default(),
            found: Memory::default(),
            packed: 0,
            packing: 0,
            goes_again: false,
            anew: Vec::new(),
            renewed: Memory::default(),
            touches: OnceLock::new(),
            record_of: Vec::new(),
            body_of: Vec::new(),
            given_order: Vec::new(),
            obstacles: 0,
            start: Vec::new(),
            after: Vec::new(),
            booked: Vec::new(),
            made_for: None,
            quiet: false,
            loads: Vec::new(),
            impacts: Impacts::default(),
            joints: Vec::new(),
            accounts: Accounts::default(),
            failed: None,
            rigid: Rigid::default(),
        }
    }
}

impl<S: Geometry> SoftStep<S> {
    /// Finds the faces of contact of a step, and their patches with the forces that they had in the step before.
    pub(crate) fn find(
        &mut self,
        (narrow_phase, standing): (&mut NarrowPhase<S>, &mut Standing<S>),
        ahead: Ahead<'_, S>,
        before: &PatchList<S>,
    ) {
        self.touches = OnceLock::new();
        // the list that the step before last began with is nobody's now, as a rule
        let old = std::mem::replace(&mut self.before, before.seen.clone());
        if let Ok(list) = Arc::try_unwrap(old)
            && list.capacity() > self.spare.capacity()
        {
            self.spare = list;
        }
        let h = substep(ahead.settings, ahead.dt) as f32;
        let finding = Finding { ahead, before, h };
        narrow_phase.pair(&ahead);
        // a step that does not end leaves nothing to go by
        self.packing = std::mem::take(&mut self.packed);
        if self.find_again(narrow_phase, standing, &finding, self.packing) {
            return;
        }
        self.goes_again = false;
        self.give_back();
        narrow_phase.look(&ahead, &finding, &mut self.found);
        self.join(&narrow_phase.workers);
        self.packing = standing.learn(self, narrow_phase, &ahead);
    }

    /// Whether the last step's faces were those of the step before, and how many of them were looked at anew.
    #[cfg(test)]
    pub(crate) fn went_again(&self) -> Option<usize> {
        self.goes_again.then_some(self.anew.len())
    }

    /// Drops the faces of bodies that sleep.
    pub(crate) fn leave_sleepers(&mut self, bodies: &Bodies<S>) {
        let wakes = |met: &Met<S>| !bodies.is_asleep(met.a as usize) && !bodies.is_asleep(met.b as usize);
        let stay: Vec<bool> = self.met.iter().map(wakes).collect();
        self.patches.retain(|k| stay[k]);
        self.met.retain(wakes);
        self.tally = Tally::default();
        for met in &self.met {
            self.tally.add(met, &self.kinds[met.kind as usize]);
        }
    }

    /// Bodies of the faces of contact where the step began.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.met.iter().map(|met| met.pair())
    }

    /// What was seen of a face when its pair was looked at.
    fn seen(&self, met: &Met<S>) -> &Seen<S> {
        &self.seen_in(met.again)[met.seen as usize]
    }

    /// What was seen of faces whose points are used again, or of the others.
    fn seen_in(&self, again: bool) -> &[Seen<S>] {
        if again { &self.before } else { &self.fresh }
    }

    /// The faces.
    fn faces(&self) -> impl Iterator<Item = Face<S>> {
        (0..self.met.len()).map(|k| self.face(k))
    }

    /// Their points as touches.
    pub(crate) fn touches(&self) -> &[Touch<S>] {
        let of_face = |face: Face<S>| (0..face.len()).map(move |k| face.touch(k));
        self.touches.get_or_init(|| self.faces().flat_map(of_face).collect())
    }

    /// How many points they have, and the smallest gap \[m\] with its bodies.
    pub(crate) fn met(&self) -> (usize, Option<(f64, usize, usize)>) {
        (self.tally.points, self.tally.deepest)
    }

    /// Advances all bodies by one step that has begun, whose faces were found.
    ///
    /// # Errors
    /// [`StepError`] for what the scheme has no law for, for loads that fail, and for a step that is less accurate than
    /// the settings demand.
    pub(crate) fn advance(
        &mut self,
        bodies: &mut Bodies<S>,
        settings: &Settings<S>,
        step: &Step<S>,
        outside: Outside<S>,
        (warm, standing): (&mut WarmStart<S>, &mut Standing<S>),
    ) -> Result<SchemeReport<S>, StepError> {
        self.make_room(bodies);
        self.rigid.begin(bodies, step);
        refuse(bodies, &self.tally, step.time)?;
        let workers = outside.workers;
        let mut report = SchemeReport::default();
        self.turn_freely(bodies, settings, step, &mut report.ledger);
        let choice = choice(bodies, settings, step);
        if !self.goes_again {
            self.gather(bodies, &choice, workers);
        }
        self.fill(bodies, step, &choice, workers);
        let columns = self.goes_again.then(|| standing.room());
        self.solver.advance((&mut self.patches, columns), self.obstacles, &choice, workers);
        let told = self.solver.told();
        report.contact_solve = self.solved(step, &choice, &told);
        self.judge(&report.contact_solve, settings, step.time)?;
        report.ledger.contact_normal += told.pressing_work;
        report.ledger.friction += told.rubbing_work;
        let kicked = self.kick(bodies, step, (&mut report.ledger, choice.substeps), workers);
        let came_to = self.move_on(bodies, step, (&mut report.ledger, kicked), workers);
        report.came_to = came_to.filter(|_| !bodies.may_be_damped());
        damp(bodies, 0.5 * step.dt, &mut report.ledger, &mut self.accounts);
        self.remember((warm, standing), &choice, workers);
        Ok(report)
    }

    /// Makes before a step what it keeps over all bodies, as a step without loads would.
    pub(crate) fn prepare(&mut self, bodies: &Bodies<S>) {
        self.make_room(bodies);
        self.load_nothing(bodies);
    }

    /// Columns over all bodies; what they hold of fixed ones is made where those are others than before.
    fn make_room(&mut self, bodies: &Bodies<S>) {
        let wanted = bodies.standing().map(|number| (number, bodies.sleep_number()));
        if wanted.is_some() && self.made_for.is_some_and(|made| Some(made.0) == bodies.standing()) {
            if self.made_for != wanted {
                self.let_sleep(bodies);
            }
            self.made_for = wanted;
            return;
        }
        self.made_for = wanted;
        let count = bodies.len();
        self.start.clear();
        self.after.clear();
        self.record_of.clear();
        self.start.resize(count, Twist::default());
        self.after.resize(count, S::Spin::ZERO);
        self.record_of.resize(count, NONE);
        self.rigid.position.clone_from(&bodies.motion.position);
        self.rigid.rotation.clone_from(&bodies.motion.rotation);
        self.let_sleep(bodies);
    }

    /// What the columns hold of bodies that sleep.
    fn let_sleep(&mut self, bodies: &Bodies<S>) {
        for i in bodies.asleep().iter().map(|i| *i as usize) {
            (self.start[i], self.after[i]) = (Twist::default(), S::Spin::ZERO);
            self.record_of[i] = NONE;
        }
        self.rigid.let_sleep(bodies);
    }

    /// What comes before contacts are looked for: half of the damping, and the loads in the middle of the step.
    ///
    /// # Errors
    /// A load that fails; the caller restores the bodies then.
    pub fn begin(
        &mut self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        quiet: bool,
        loads: &mut Loads<S>,
        ledger: &mut Ledger,
    ) -> Result<(), StepError> {
        damp(bodies, 0.5 * step.dt, ledger, &mut self.accounts);
        if !quiet {
            self.quiet = false;
            return loads(step.time + 0.5 * step.dt, bodies, &mut self.loads);
        }
        self.load_nothing(bodies);
        Ok(())
    }

    /// Loads of zero on all bodies.
    fn load_nothing(&mut self, bodies: &Bodies<S>) {
        if !self.quiet || self.loads.len() != bodies.len() {
            self.loads.clear();
            self.loads.resize(bodies.len(), Wrench::default());
            self.quiet = true;
        }
    }

    /// How far from done the last sweep was.
    fn solved(&self, step: &Step<S>, choice: &SoftChoice, told: &Told) -> Option<SolveReport> {
        if self.patches.is_empty() {
            return None;
        }
        let body = |record: u32| self.body_of[record as usize] as usize;
        let contacts = self.tally.points;
        // of no impulses at all: what gravity gives in a step
        let nothing = step.gravity.norm() * step.dt;
        Some(SolveReport {
            contacts,
            iterations: choice.rigid.map_or(0, |rigid| 2 * choice.substeps * rigid.sweeps),
            residual: told.changed,
            relative_residual: if nothing > 0.0 { told.changed / nothing } else { 0.0 },
            worst: told.worst.map(|(a, b)| (body(a), body(b))),
            stop: Stop::OutOfIterations,
            islands: Vec::new(),
        })
    }

    fn judge(
        &mut self,
        solve: &Option<SolveReport>,
        settings: &Settings<S>,
        time: f64,
    ) -> Result<(), StepError> {
        let Some(solve) = solve else { return Ok(()) };
        if settings.on_inaccurate != OnInaccurate::Raise || solve.is_within(settings.tolerance) {
            return Ok(());
        }
        self.failed = Some(solve.clone());
        Err(StepError::Inaccurate {
            solver: settings.solver.map_or("soft_step", |solver| solver.name()),
            phase: "contact",
            contacts: solve.contacts,
            residual: solve.residual,
            tolerance: settings.tolerance,
            explanation: String::new(),
            time,
        })
    }

    /// Velocities after all impulses of the step, at the places where it began; every joule booked by the kick identity,
    /// the contacts' own by the solver. Tells the energy of that.
    fn kick(
        &mut self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        (ledger, substeps): (&mut Ledger, usize),
        workers: &Workers,
    ) -> Energy {
        let energy = self.kick_all(bodies, step, (&mut *ledger, substeps), workers);
        ledger.driven += self.driven(bodies);
        if self.accounts.are_kept() {
            let after: Vec<Twist<S>> = (0..bodies.len()).map(|i| bodies.motion.twist(i)).collect();
            let (problem, impulses, _) = self.rigid.get(bodies, || self.solution());
            self.accounts.loads(bodies, (&self.start, &after), step.dt, step.gravity, &self.loads);
            self.accounts.kick(bodies, problem, impulses, (&self.start, &after), |_| Cause::Contact);
        }
        energy
    }

    /// Work that moving obstacles did \[J\]; it is part of the contacts' lines.
    fn driven(&self, bodies: &Bodies<S>) -> f64 {
        let moves = |i: usize| !bodies.is_dynamic(i) && self.start[i] != Twist::default();
        if !bodies.movers().iter().any(|i| moves(*i as usize)) {
            return 0.0;
        }
        let of_face = |(k, (a, b)): (usize, (usize, usize))| {
            if !moves(a) && !moves(b) {
                return 0.0;
            }
            let given = Given::of(&self.face(k), &self.solver.result(k));
            let work = |i: usize| given.work(self.rigid.position[i], &self.start[i]);
            (if moves(b) { work(b) } else { 0.0 }) - (if moves(a) { work(a) } else { 0.0 })
        };
        self.pairs().enumerate().map(of_face).sum()
    }

    /// The step's rigid contact problem, the impulses that the springs gave over it, and the touch of each contact.
    pub fn contact(&self, bodies: &Bodies<S>) -> problem::Told<'_, S> {
        self.rigid.get(bodies, || self.solution())
    }

    fn solution(&self) -> problem::Solution<'_, S> {
        let faces = self.faces().collect();
        problem::Solution { solver: &self.solver, faces, start: &self.start, loads: &self.loads }
    }
}

/// Length of a substep \[s\].
fn substep<S: Geometry>(settings: &Settings<S>, dt: f64) -> f64 {
    dt / settings.soft.substeps as f64
}

/// The soft solver's choices for a step.
fn choice<S: Geometry>(bodies: &Bodies<S>, settings: &Settings<S>, step: &Step<S>) -> SoftChoice {
    let soft = &settings.soft;
    let h = substep(settings, step.dt);
    SoftChoice {
        substeps: soft.substeps,
        h: h as f32,
        // a spring stiffer than this rings between substeps
        hertz: soft.hertz.min(0.25 / h) as f32,
        damping_ratio: soft.damping_ratio as f32,
        push_speed: soft.push_speed as f32,
        rest_speed: (settings.rest_speed_factor * step.gravity.norm() * step.dt) as f32,
        rigid: settings.solver.map(|solver| RigidSweeps {
            sweeps: settings.iterations,
            accelerated: solver == SolverKind::Nncg,
            push: settings.correction_fraction as f32,
            slop: slop(bodies, settings, step) as f32,
        }),
    }
}

/// Refuses what the scheme has no law for.
fn refuse<S: Geometry>(bodies: &Bodies<S>, tally: &Tally, time: f64) -> Result<(), StepError> {
    if let Some(joint) = bodies.joints.names.first() {
        return Err(StepError::Joint {
            joint: joint.clone(),
            problem: "scheme soft_step holds no joints".into(),
            remedy: "take scheme fixed_step or events".into(),
            time,
        });
    }
    if let Some((turned, a, b)) = tally.turns_slip {
        let (a, b) = (&bodies.names[a], &bodies.names[b]);
        return Err(StepError::Argument {
            field: "tangential_restitution",
            problem: format!(
                "is {turned} between bodies '{a}' and '{b}', and scheme soft_step turns no slip round"
            ),
            remedy: "set it to 0, or take scheme fixed_step or events".into(),
        });
    }
    Ok(())
}

impl<S: Geometry> SoftStep<S> {
    /// Moves the poses by what the lanes moved them, and books what that did to the energy; tells what bodies came to, where that is
    /// sound.
    fn move_on(
        &mut self,
        bodies: &mut Bodies<S>,
        step: &Step<S>,
        (ledger, before): (&mut Ledger, Energy),
        workers: &Workers,
    ) -> Option<CameTo<S>> {
        let marks = self.accounts.marks(bodies, step.gravity);
        let (after, came_to) = self.displace(bodies, step, workers);
        ledger.integrator += after.total() - before.total() + ledger.gravity;
        self.accounts.moved(&marks, bodies, step.gravity, crate::observe::accounts::Motive::Integrator);
        for account in &mut self.accounts.of_bodies {
            account.energy.integrator += account.energy.gravity;
        }
        came_to
    }
}
