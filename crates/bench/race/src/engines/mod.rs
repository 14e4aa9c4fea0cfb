//! The engines by name, each with what it offers. A new scheme of carom is an entry of `ours::RACING`; a new engine is a file
//! here and an entry of the lists below.

pub mod box2d;
pub mod box3d;
pub mod foreign;
#[cfg(feature = "jolt")]
pub mod jolt;
pub mod ours;
pub mod rapier;

use crate::engine::{Choice, Engine};
use crate::scene::{Arena, Scene};
use carom::{Planar, Spatial};
use std::path::Path;

/// Bodies up to which engines that live in Python take part.
const SMALL: usize = 500;

/// Makes a world of a scene.
type Build<S> = Box<dyn Fn(&Scene<S>, Choice) -> Result<Box<dyn Engine<S>>, String>>;

/// An engine with one way of stepping.
pub struct Entrant<S: Arena> {
    /// The engine.
    pub engine: &'static str,
    /// Its scheme and solver, in a few words.
    pub solver: String,
    /// Whether it can use more threads than one.
    pub threads: bool,
    /// Whether its bodies can fall asleep.
    pub sleeping: bool,
    /// Most bodies, fixed ones included, that it is asked to take.
    pub most: usize,
    /// Makes a world.
    pub build: Build<S>,
}

impl<S: Arena> Entrant<S> {
    fn new(
        engine: &'static str,
        solver: &str,
        build: impl Fn(&Scene<S>, Choice) -> Result<Box<dyn Engine<S>>, String> + 'static,
    ) -> Self {
        let solver = solver.into();
        Entrant { engine, solver, threads: true, sleeping: true, most: usize::MAX, build: Box::new(build) }
    }
    /// carom by a way of stepping; only soft steps let bodies sleep.
    fn ours(way: &str) -> Self {
        let asked = way.to_string();
        let build = move |scene: &Scene<S>, choice: Choice| ours::build(scene, &asked, choice);
        Entrant { sleeping: way == "soft_step", ..Entrant::new("carom", way, build) }
    }
    /// An engine in Python: one thread, no sleeping, small scenes.
    fn foreign(engine: &'static str, solver: &str, python: &Path) -> Self {
        let python = python.to_path_buf();
        let build = move |scene: &Scene<S>, _: Choice| foreign::build(scene, engine, &python);
        Entrant { threads: false, sleeping: false, most: SMALL, ..Entrant::new(engine, solver, build) }
    }
    /// Whether it can run so, on a scene with so many bodies.
    pub fn takes(&self, choice: Choice, bodies: usize) -> bool {
        (self.threads || choice.threads == 1) && (self.sleeping || !choice.sleeping) && bodies <= self.most
    }
}

/// A space with the engines that know it.
pub trait Field: Arena {
    /// Its peers; `python` runs those that live in Python.
    fn peers(python: &Path) -> Vec<Entrant<Self>>;
}

impl Field for Planar {
    fn peers(python: &Path) -> Vec<Entrant<Planar>> {
        vec![
            Entrant::new("box2d", "default:avx2", box2d::build),
            Entrant::new("rapier", "default:simd8", rapier::planar::build),
            Entrant::foreign("pymunk", "default", python),
        ]
    }
}

impl Field for Spatial {
    fn peers(python: &Path) -> Vec<Entrant<Spatial>> {
        vec![
            Entrant::new("box3d", "default", box3d::build),
            Entrant::new("rapier", "default:simd8", rapier::spatial::build),
            #[cfg(feature = "jolt")]
            Entrant::new("jolt", "default:5.0", jolt::build),
            Entrant::foreign("mujoco", "newton", python),
        ]
    }
}

/// The engines that words ask for: `ENGINE`, or `carom/SCHEME:SOLVER`; all for no words. Engines in Python that cannot be had
/// are left out, and `tell` hears of it.
///
/// # Errors
/// A word that names no engine of any space, or no way of carom's.
pub fn entrants<S: Field>(
    words: &[String],
    python: &Path,
    tell: &dyn Fn(&str),
) -> Result<Vec<Entrant<S>>, String> {
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    let mut found: Vec<Entrant<S>> = Vec::new();
    if wanted("carom") {
        found.extend(ours::RACING.iter().map(|way| Entrant::ours(way)));
    }
    for way in words.iter().filter_map(|w| w.strip_prefix("carom/")) {
        ours::settings::<S>(way)?;
        found.push(Entrant::ours(way));
    }
    for peer in S::peers(python).into_iter().filter(|p| wanted(p.engine)) {
        if peer.most == SMALL && !foreign::is_there(peer.engine, python) {
            tell(&format!("SKIPPED {}: {} cannot import it", peer.engine, python.display()));
            continue;
        }
        found.push(peer);
    }
    if cfg!(not(feature = "jolt")) && S::DIM == 3 && wanted("jolt") {
        tell("SKIPPED jolt: built without the feature `jolt`; race/setup.sh says what it lacks");
    }
    Ok(found)
}

/// Names of all engines, for checking words.
pub const NAMES: [&str; 7] = ["carom", "box2d", "box3d", "rapier", "jolt", "mujoco", "pymunk"];

/// The shapes made last, so that bodies of equal shape share one, as users of the engines would have it.
struct Shared<S: Arena, T> {
    kept: Vec<(S::Shape, f64, T)>,
}

impl<S: Arena, T: Clone> Shared<S, T> {
    /// Kinds that are kept.
    const MOST: usize = 16;

    fn new() -> Self {
        Shared { kept: Vec::new() }
    }
    /// The shape of a density that was made before, or a new one.
    fn get(
        &mut self,
        shape: &S::Shape,
        density: f64,
        make: impl FnOnce() -> Result<T, String>,
    ) -> Result<T, String> {
        if let Some((_, _, made)) = self.kept.iter().find(|(s, d, _)| *d == density && s == shape) {
            return Ok(made.clone());
        }
        let made = make()?;
        if self.kept.len() == Self::MOST {
            self.kept.remove(0);
        }
        self.kept.push((shape.clone(), density, made.clone()));
        Ok(made)
    }
}

/// The kind of a shape, for messages: the first word of what it says of itself.
fn kind_of(shape: &impl std::fmt::Debug) -> String {
    let all = format!("{shape:?}");
    all.split([' ', '{']).next().unwrap_or_default().to_string()
}
