//! The scenes by name and size, as `pyramid:100`: how each is built, how many steps it takes, what it is judged by.

use crate::scene::{Arena, Asks, Body, Scene};
use crate::scenes::{pouring, sliding, stacking, striking, turning};
use carom::{Planar, Spatial};

/// What is known of a scene before it is built.
pub struct Entry<S: Arena> {
    /// Name.
    pub name: &'static str,
    /// Size when none is asked for.
    size: usize,
    /// Steps of a run.
    steps: usize,
    asks: Asks,
    build: fn(usize) -> Vec<Body<S>>,
}

const STANDING: Asks = Asks { rests: true, closed: true, slides: false };
const LOOSE: Asks = Asks { rests: false, closed: true, slides: false };
const DRIVEN: Asks = Asks { rests: false, closed: false, slides: false };
const SLIDING: Asks = Asks { rests: false, closed: true, slides: true };

static PLANE: [Entry<Planar>; 8] = [
    Entry { name: "pyramid", size: 100, steps: 200, asks: STANDING, build: stacking::pyramid },
    Entry { name: "pyramids", size: 20, steps: 60, asks: STANDING, build: stacking::pyramids },
    Entry { name: "tumbler", size: 45, steps: 200, asks: DRIVEN, build: turning::tumbler },
    Entry { name: "rain", size: 50, steps: 300, asks: LOOSE, build: pouring::rain },
    Entry { name: "smash", size: 60, steps: 200, asks: LOOSE, build: striking::smash },
    Entry { name: "washer", size: 90, steps: 200, asks: DRIVEN, build: turning::washer },
    Entry { name: "stacks", size: 100, steps: 300, asks: STANDING, build: stacking::stacks },
    Entry { name: "bricks", size: 50, steps: 300, asks: STANDING, build: stacking::bricks },
];

static SPACE: [Entry<Spatial>; 11] = [
    Entry { name: "pyramid", size: 100, steps: 200, asks: STANDING, build: stacking::pyramid },
    Entry { name: "pyramids", size: 14, steps: 60, asks: STANDING, build: stacking::pyramids },
    Entry { name: "hulls", size: 12, steps: 300, asks: LOOSE, build: pouring::hulls },
    Entry { name: "bricks", size: 15, steps: 300, asks: STANDING, build: stacking::bricks },
    Entry { name: "rocks", size: 10, steps: 300, asks: LOOSE, build: pouring::rocks },
    Entry { name: "washer", size: 20, steps: 200, asks: DRIVEN, build: turning::washer },
    Entry { name: "stacks", size: 10, steps: 300, asks: STANDING, build: stacking::stacks },
    Entry { name: "statics", size: 1000, steps: 100, asks: LOOSE, build: stacking::statics },
    Entry { name: "slide", size: 8, steps: 60, asks: SLIDING, build: sliding::slide },
    Entry { name: "smash", size: 20, steps: 200, asks: LOOSE, build: striking::smash },
    Entry { name: "tumbler", size: 12, steps: 200, asks: DRIVEN, build: turning::tumbler },
];

/// Scenes of a run that names none: those of the issue of speed, small pyramids, and the sliding bricks.
pub const USUAL: [&str; 22] = [
    "planar/pyramid:10",
    "planar/pyramid:20",
    "planar/pyramid:30",
    "spatial/pyramid:10",
    "spatial/pyramid:20",
    "spatial/slide",
    "planar/pyramid",
    "planar/pyramids",
    "planar/tumbler",
    "planar/rain",
    "planar/smash",
    "planar/washer",
    "spatial/pyramid",
    "spatial/pyramids",
    "spatial/hulls",
    "spatial/bricks",
    "spatial/rocks",
    "spatial/washer",
    "spatial/stacks",
    "spatial/pyramid:30",
    "planar/stacks",
    "spatial/statics",
];

/// A space that has a catalogue.
pub trait Catalogue: Arena {
    /// Its scenes.
    fn entries() -> &'static [Entry<Self>];
}

impl Catalogue for Planar {
    fn entries() -> &'static [Entry<Planar>] {
        &PLANE
    }
}

impl Catalogue for Spatial {
    fn entries() -> &'static [Entry<Spatial>] {
        &SPACE
    }
}

/// The scene that a word names in this space: `NAME`, `NAME:SIZE`, either behind `planar/` or `spatial/`; `None` when it names
/// none here.
///
/// # Errors
/// A size that is no positive number.
pub fn scene<S: Catalogue>(word: &str) -> Result<Option<Scene<S>>, String> {
    let Some((name, size)) = split::<S>(word)? else { return Ok(None) };
    let Some(entry) = S::entries().iter().find(|e| e.name == name) else { return Ok(None) };
    let size = size.unwrap_or(entry.size);
    Ok(Some(Scene {
        name: format!("{name}:{size}"),
        steps: entry.steps,
        bodies: (entry.build)(size),
        asks: entry.asks,
    }))
}

/// Whether a word names a scene of this space.
///
/// # Errors
/// A size that is no positive number.
pub fn knows<S: Catalogue>(word: &str) -> Result<bool, String> {
    Ok(split::<S>(word)?.is_some_and(|(name, _)| S::entries().iter().any(|e| e.name == name)))
}

fn split<S: Catalogue>(word: &str) -> Result<Option<(&str, Option<usize>)>, String> {
    let rest = match word.split_once('/') {
        Some((space, rest)) if space == S::NAME => rest,
        Some(_) => return Ok(None),
        None => word,
    };
    let Some((name, size)) = rest.split_once(':') else { return Ok(Some((rest, None))) };
    match size.parse() {
        Ok(size) if size > 0 => Ok(Some((name, Some(size)))),
        _ => Err(format!("{word}: a size is a positive number, as in pyramid:20, not {size:?}")),
    }
}
