//! Piles that carom itself has poured and settled: the contact problem of the next step, of any size.

use carom::{Column, ContactProblem, Phase, Settings, Spatial, StepError};
use carom_scenes::pouring::pile;

/// Steps in which a pile may settle: 5 s.
const SETTLING: usize = 1200;
/// Bodies slower than this count as quiet \[m/s\].
const QUIET: f64 = 0.05;

/// Pours `bodies` convex bodies into a box, lets them settle by sweeps for at most 5 s, and takes the contact problem of
/// the step that would follow.
///
/// # Errors
/// What the world says, in words.
pub fn settled(bodies: usize) -> Result<ContactProblem<Spatial>, String> {
    let mut world = pile(bodies).map_err(|e| e.to_string())?;
    let settings = Settings { iterations: 20, ..world.settings().clone() };
    let dt = settings.dt;
    world.set_settings(settings).map_err(|e| e.to_string())?;
    let told = |e: StepError| e.to_string();
    for step in 0..SETTLING {
        world.step(dt).map_err(told)?;
        let speeds = world.bodies().motion.velocity.iter().map(|v| v.norm());
        // falling bodies are slow at first: the first second counts as pouring
        if step as f64 * dt > 1.0 && speeds.fold(0.0, f64::max) < QUIET {
            break;
        }
    }
    world.problem(dt, Phase::Contact).map_err(told)
}
