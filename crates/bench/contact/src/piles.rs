//! Piles that carom itself has poured and settled: the contact problem of the next step, of any size.

use carom::{Column, ContactProblem, Phase, Scheme, Settings, SolverKind, Spatial, StepError};
use carom_scenes::pouring::pile;

/// Seconds in which a pile may fall and settle, by soft steps.
const SETTLING: f64 = 10.0;
/// Bodies slower than this count as quiet \[m/s\].
const QUIET: f64 = 0.05;
/// Fixed steps that follow: a step's problem is made of what the one before left.
const FIXED: usize = 12;
/// Most iterations of such a step, and what it is content with \[m/s\]: after steps of twenty, bodies are eight times as fast in the
/// median.
const ITERATIONS: usize = 500;
const TOLERANCE: f64 = 1e-5;

/// Pours `bodies` convex bodies into a box, lets them settle by soft steps until they are quiet, for at most 10 s, goes on
/// with a few accurate fixed steps, and takes the contact problem of the step that would follow. Two threads: no bit depends
/// on their number.
///
/// # Errors
/// What the world says, in words.
pub fn settled(bodies: usize) -> Result<ContactProblem<Spatial>, String> {
    let mut world = pile(bodies).map_err(|e| e.to_string())?;
    let usual = world.settings().clone();
    let dt = usual.dt;
    world.set_threads(2).map_err(|e| e.to_string())?;
    world.set_settings(Settings { scheme: Scheme::SoftStep, ..usual.clone() }).map_err(|e| e.to_string())?;
    let told = |e: StepError| e.to_string();
    for step in 0..(SETTLING / dt) as usize {
        world.step(dt).map_err(told)?;
        let speeds = world.bodies().motion.velocity.iter().map(|v| v.norm());
        let fastest = speeds.fold(0.0, f64::max);
        if step % 240 == 239 {
            println!(
                "pile of {bodies}: after {:.0} s the fastest moves at {fastest:.2} m/s",
                (step + 1) as f64 * dt
            );
        }
        // falling bodies are slow at first: the first second counts as pouring
        if step as f64 * dt > 1.0 && fastest < QUIET {
            break;
        }
    }
    let accurate =
        Settings { solver: Some(SolverKind::Nncg), iterations: ITERATIONS, tolerance: TOLERANCE, ..usual };
    world.set_settings(accurate).map_err(|e| e.to_string())?;
    for _ in 0..FIXED {
        world.step(dt).map_err(told)?;
    }
    world.problem(dt, Phase::Contact).map_err(told)
}
