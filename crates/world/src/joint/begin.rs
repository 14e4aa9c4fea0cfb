//! Before a step: joints that are new, or whose bodies were changed since the last step, are made consistent with all that
//! hangs together with them: poses first (Gauss-Newton on g, the least in the metric of masses), then velocities, G v = 0.
//! Joints that were left alone keep the small G v that a step ends with, which belongs to the motion (theory 9.2).

use super::frame::Joint;
use super::list::mover;
use super::reaction::{JointImpulse, wrenches};
use crate::assembly;
use crate::bodies::Bodies;
use crate::error::StepError;
use crate::observe::energy::Energy;
use crate::observe::ledger::Ledger;
use crate::settings::{ImpactLaw, Settings};
use carom_geometry::Geometry;
use carom_math::Space;
use carom_solver::{ContactProblem, Impulses, Partition, SolveSettings, SolverKind, Twist};

/// What a step left of each joint, by serial number, ascending: g \[m\] and G v \[m/s\], row by row.
pub type Memory = Vec<(u64, Vec<f64>)>;

/// Error over its size beyond which a joint's bodies are not put together but refused \[1\].
const TORN: f64 = 1e-2;
/// Error over its size that must be reached \[1\].
const CLOSED: f64 = 1e-9;
/// Gauss-Newton rounds; each squares what is left.
const ROUNDS: usize = 30;

/// What the present state is to the joints.
pub fn left<S: Geometry>(bodies: &Bodies<S>) -> Memory {
    let of = |j: &Joint<S>| {
        let mut values = Vec::new();
        j.errors(&bodies.motion, &mut values);
        let mut rows = Vec::new();
        j.push_rows(&bodies.motion, &j.frame(bodies), &mut rows);
        let twist = |i: usize| bodies.motion.twist(i);
        values.extend(rows.iter().map(|r| r.on_a.dot(&twist(r.a)) + r.on_b.dot(&twist(r.b))));
        (j.serial, values)
    };
    bodies.joints.all.iter().map(of).collect()
}

/// Makes joints consistent where they are not as the last step left them; gives their impulses.
///
/// # Errors
/// [`StepError::Joint`] where the bodies are not where the joint holds them, or cannot be.
pub(crate) fn begin<S: Geometry>(
    bodies: &mut Bodies<S>,
    memory: &Memory,
    settings: &Settings<S>,
    time: f64,
    ledger: &mut Ledger,
) -> Result<Vec<JointImpulse<S>>, StepError> {
    let mut impulses = vec![JointImpulse::default(); bodies.joints.len()];
    if bodies.joints.is_empty() {
        return Ok(impulses);
    }
    if settings.impact_law() == ImpactLaw::Sequential {
        let problem = "impact law 'sequential' resolves collisions one by one and knows no joints";
        let remedy = "choose impact = \"newton\", \"generalized_reflections\", \"moreau\" or \"poisson\"";
        return Err(refused(bodies, 0, problem.into(), remedy, time));
    }
    let now = left(bodies);
    let is_new = |entry: &(u64, Vec<f64>)| match memory.binary_search_by_key(&entry.0, |m| m.0) {
        Ok(k) => memory[k].1 != entry.1,
        Err(_) => true,
    };
    let new: Vec<bool> = now.iter().map(is_new).collect();
    if !new.contains(&true) {
        return Ok(impulses);
    }
    let chosen = together_with(bodies, &new);
    close(bodies, &chosen, settings, time, ledger)?;
    still(bodies, &chosen, ledger, &mut impulses);
    Ok(impulses)
}

/// The joints that hang together with some of them.
fn together_with<S: Geometry>(bodies: &Bodies<S>, some: &[bool]) -> Vec<bool> {
    let mut sets = Partition::default();
    sets.reset(bodies.len());
    bodies.jointed().for_each(|(a, b)| sets.join(a, b));
    let mut meant = vec![false; bodies.len()];
    let joints = &bodies.joints.all;
    for (j, _) in joints.iter().zip(some).filter(|(_, some)| **some) {
        meant[sets.root(mover(bodies, j))] = true;
    }
    joints.iter().map(|j| meant[sets.root(mover(bodies, j))]).collect()
}

fn refused<S: Geometry>(
    bodies: &Bodies<S>,
    joint: usize,
    problem: String,
    remedy: &str,
    time: f64,
) -> StepError {
    let joint = bodies.joints.names[joint].clone();
    StepError::Joint { joint, problem, remedy: remedy.into(), time }
}

/// Error of a joint \[m\].
fn error_of<S: Space>(j: &Joint<S>, bodies: &crate::bodies::Motion<S>) -> f64 {
    let mut errors = Vec::new();
    j.errors(bodies, &mut errors);
    errors.iter().fold(0.0, |m, e| m.max(e.abs()))
}

/// Puts the bodies of some joints where the joints hold them.
fn close<S: Geometry>(
    bodies: &mut Bodies<S>,
    chosen: &[bool],
    settings: &Settings<S>,
    time: f64,
    ledger: &mut Ledger,
) -> Result<(), StepError> {
    let joints = bodies.joints.all.clone();
    let some = || joints.iter().enumerate().filter(|(k, _)| chosen[*k]);
    let remedy = "put the bodies where the joint holds them, or give the joint other anchors";
    for (k, j) in some() {
        let error = error_of(j, &bodies.motion);
        // NaN is apart too
        let is_near = error <= TORN * j.size;
        if !is_near {
            let problem =
                format!("its anchors are {error:.3e} m apart at the start, more than {TORN} of its size");
            return Err(refused(bodies, k, problem, remedy, time));
        }
    }
    let before = Energy::of(bodies, settings.gravity).total();
    let mut moved = false;
    for _ in 0..ROUNDS {
        if some().all(|(_, j)| error_of(j, &bodies.motion) <= j.rounding(&bodies.motion)) {
            break;
        }
        moved = true;
        let mut problem = ContactProblem::new(Vec::new(), Vec::new());
        assembly::begin(&mut problem, bodies, settings.friction_law);
        problem.velocities.fill(Twist::default());
        let mut errors = Vec::new();
        for (_, j) in some() {
            j.push_rows(&bodies.motion, &j.frame(bodies), &mut problem.rows);
            j.errors(&bodies.motion, &mut errors);
        }
        problem.rows.iter_mut().zip(&errors).for_each(|(row, e)| row.target = -e);
        let displacements = problem.velocities_after(&solved(&problem));
        assembly::displace(bodies, &displacements);
    }
    for (k, j) in some() {
        let error = error_of(j, &bodies.motion);
        let is_closed = error <= CLOSED * j.size;
        if !is_closed {
            let problem = format!("its anchors stay {error:.3e} m apart: the joints contradict each other");
            return Err(refused(bodies, k, problem, remedy, time));
        }
    }
    if moved {
        ledger.projection += Energy::of(bodies, settings.gravity).total() - before;
    }
    Ok(())
}

fn solved<S: Geometry>(problem: &ContactProblem<S>) -> Impulses<S> {
    let mut impulses = Impulses::zero(problem);
    let to_rounding = SolveSettings { tolerance: 0.0, ..SolveSettings::default() };
    SolverKind::Exact.make::<S>().solve(problem, &to_rounding, &mut impulses);
    impulses
}

/// Ends what some joints' bodies do against them: the impulse for which G v = 0, booked as the joints' own.
pub(crate) fn still<S: Geometry>(
    bodies: &mut Bodies<S>,
    chosen: &[bool],
    ledger: &mut Ledger,
    impulses: &mut [JointImpulse<S>],
) {
    let mut problem = ContactProblem::new(Vec::new(), Vec::new());
    assembly::begin(&mut problem, bodies, Default::default());
    let joints: Vec<Joint<S>> = bodies.joints.all.clone();
    let numbers: Vec<usize> = (0..joints.len()).filter(|&k| chosen[k]).collect();
    let some: Vec<Joint<S>> = numbers.iter().map(|&k| joints[k]).collect();
    for j in &some {
        j.push_rows(&bodies.motion, &j.frame(bodies), &mut problem.rows);
    }
    if problem.rows.is_empty() {
        return;
    }
    let found = solved(&problem);
    let after = problem.velocities_after(&found);
    let mut lines = Ledger::default();
    lines.constraint = assembly::row_work(bodies, &problem, &found, &problem.velocities, &after, &mut lines);
    ledger.add(&lines);
    assembly::write_back(bodies, &after);
    for (k, wrench) in numbers.iter().zip(wrenches(&some, &problem, &found)) {
        impulses[*k].impacts.add_scaled(&wrench, 1.0);
    }
}
