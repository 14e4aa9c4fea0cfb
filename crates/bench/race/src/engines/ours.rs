//! carom, by any of its schemes and solvers: settings are carom's own but for gravity, the step's length, sleep and threads.

use crate::engine::{Choice, Engine, Phases, Spent, timed};
use crate::scene::{DT, FRICTION, Kind, Scene};
use carom::{BodySpec, Geometry, Pose, Scheme, Settings, SolverKind, World};

/// What races when `carom` is asked for without a scheme: `SCHEME` or `SCHEME:SOLVER`, as [`build`] reads them.
pub const RACING: [&str; 2] = ["soft_step", "fixed_step:pgs"];

/// A world of carom.
struct Ours<S: Geometry> {
    world: World<S>,
}

/// A scene in carom by `SCHEME`, `SCHEME:SOLVER` or `SCHEME:SOLVER:ITERATIONS[:SUBSTEPS]`, by the names that scene files use.
///
/// # Errors
/// An unknown scheme or solver, or what carom refuses in the scene or of the choice.
pub fn build<S: Geometry>(scene: &Scene<S>, way: &str, choice: Choice) -> Result<Box<dyn Engine<S>>, String> {
    let mut settings = settings::<S>(way)?;
    settings.soft.sleeping = choice.sleeping;
    let mut world = World::new(settings).map_err(|e| e.to_string())?;
    world.set_threads(choice.threads).map_err(|e| e.to_string())?;
    for (k, body) in scene.bodies.iter().enumerate() {
        let spec = match body.kind {
            Kind::Dynamic => BodySpec::dense(body.shape.clone(), body.density),
            Kind::Fixed => BodySpec::fixed(body.shape.clone()),
            Kind::Kinematic => BodySpec::kinematic(body.shape.clone()),
        };
        let spec = spec.with_origin_at(body.pose.position).turned(body.pose.rotation);
        let spec = spec.moving(body.velocity).spinning(body.spin).friction(FRICTION);
        world.add(&format!("b{k}"), spec).map_err(|e| e.to_string())?;
    }
    // what stands is arranged before the clock runs, as other engines do while bodies are added or when they are asked to
    world.prepare(DT).map_err(|e| e.to_string())?;
    Ok(Box::new(Ours { world }))
}

/// The settings of a way of stepping.
///
/// # Errors
/// An unknown scheme or solver, and what is no number.
pub fn settings<S: Geometry>(way: &str) -> Result<Settings<S>, String> {
    let mut parts = way.split(':');
    let scheme = parts.next().unwrap_or_default();
    let scheme: Scheme = serde_json::from_value(scheme.into()).map_err(|e| format!("carom: {e}"))?;
    let solver = parts.next().map(str::parse::<SolverKind>).transpose()?;
    let gravity = Scene::<S>::gravity();
    let mut settings = Settings { dt: DT, gravity, scheme, solver, ..Settings::default() };
    for (number, part) in [&mut settings.iterations, &mut settings.soft.substeps].into_iter().zip(&mut parts)
    {
        *number = part.parse().map_err(|_| format!("carom: {part:?} in {way:?} is no number"))?;
    }
    parts.next().map_or(Ok(settings), |more| Err(format!("carom: nothing is named {more:?} in {way:?}")))
}

impl<S: Geometry> Engine<S> for Ours<S> {
    fn step(&mut self) -> Result<Spent, String> {
        let (report, spent) = timed(|| self.world.step(DT));
        report.map_err(|e| e.to_string())?;
        Ok(spent)
    }
    fn poses(&mut self) -> Result<Vec<Pose<S>>, String> {
        let bodies = self.world.bodies();
        Ok((0..bodies.len()).map(|i| bodies.shape_pose(i)).collect())
    }
    fn contacts(&mut self) -> Option<usize> {
        Some(self.world.touches().len())
    }
    fn phases(&self) -> Option<Phases> {
        let times = self.world.step_times();
        let [step, pairs, contacts, solve] =
            [times.whole(), times.pairs, times.contacts, times.solve].map(|seconds| 1e3 * seconds);
        Some(Phases::of(step, pairs, contacts, solve))
    }
}
