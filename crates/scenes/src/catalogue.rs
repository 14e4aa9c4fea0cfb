//! The scenes by name, with the parameters that their names stand for.

use crate::{constrained, dominoes, falling, jointed, pouring, seven, sliding, spinning, stacking, striking};
use carom::{BuildError, Planar, Spatial, World2, World3};

/// What is known of a scene before it is built.
#[derive(Clone, Copy, Debug)]
pub struct SceneInfo {
    /// Name; ends in `_planar` or `_spatial` where both exist.
    pub name: &'static str,
    /// "planar" or "spatial".
    pub space: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// Simulated time of a run when none is asked for \[s\].
    pub duration: f64,
    build: Build,
}

#[derive(Clone, Copy, Debug)]
enum Build {
    Planar(fn() -> Result<World2, BuildError>),
    Spatial(fn() -> Result<World3, BuildError>),
}

const fn planar_scene(
    name: &'static str,
    duration: f64,
    description: &'static str,
    build: fn() -> Result<World2, BuildError>,
) -> SceneInfo {
    SceneInfo { name, space: "planar", description, duration, build: Build::Planar(build) }
}

const fn spatial_scene(
    name: &'static str,
    duration: f64,
    description: &'static str,
    build: fn() -> Result<World3, BuildError>,
) -> SceneInfo {
    SceneInfo { name, space: "spatial", description, duration, build: Build::Spatial(build) }
}

/// Thirty degrees \[rad\].
const SLOPE: f64 = std::f64::consts::FRAC_PI_6;

static SCENES: [SceneInfo; 38] = [
    planar_scene(
        "billiard_break_planar",
        6.0,
        "a cue ball breaks a rack of fifteen discs, seen from above",
        striking::billiard_break_planar,
    ),
    planar_scene("bouncing_ball_planar", 5.0, "a disc dropped from 1 m bounces with restitution .8", || {
        falling::bouncing_ball::<Planar>(1.0, 0.8)
    }),
    planar_scene("bowl_planar", 6.0, "a disc rolls to and fro in a round valley", || {
        constrained::bowl_planar(0.2)
    }),
    planar_scene("card_house", 5.0, "a house of cards of three levels stands by friction", || {
        stacking::card_house(3, 0.6)
    }),
    planar_scene("conveyor_planar", 2.0, "a block set down on a running belt", || {
        sliding::conveyor::<Planar>(2.0, 0.4)
    }),
    planar_scene(
        "cradle_planar",
        3.0,
        "Newton's cradle of five discs, between walls instead of on strings",
        || striking::cradle::<Planar>(5),
    ),
    planar_scene("double_pendulum_planar", 10.0, "two bars end to end swing from a pivot", || {
        jointed::double_pendulum::<Planar>()
    }),
    planar_scene("four_bar_linkage_planar", 5.0, "a crank drives a rocker through a coupler", || {
        jointed::four_bar_linkage::<Planar>()
    }),
    planar_scene("incline_planar", 3.0, "two blocks on a slope of 30 degrees: one holds, one slides", || {
        sliding::incline::<Planar>(SLOPE, [0.58, 0.57])
    }),
    planar_scene("pyramid_planar", 10.0, "a pyramid of 1,275 boxes", || stacking::pyramid::<Planar>(50)),
    planar_scene("pyramid_small_planar", 5.0, "a pyramid of 55 boxes", || stacking::pyramid::<Planar>(10)),
    planar_scene("rolling_ball_planar", 3.0, "a disc launched without spin slides until it rolls", || {
        sliding::rolling_ball::<Planar>(5.0, 0.2)
    }),
    planar_scene("seven_objects", 4.0, "the notes' seven objects between fixed walls", seven::seven_objects),
    planar_scene("sliding_block_planar", 2.0, "a block launched at 5 m/s slides to a stop", || {
        sliding::sliding_block::<Planar>(5.0, 0.5)
    }),
    planar_scene("stack_planar", 5.0, "ten boxes on each other", || stacking::stack::<Planar>(10, 1.0)),
    planar_scene(
        "wedge_planar",
        0.5,
        "a block slides down a wedge that slides away, without friction",
        || constrained::wedge::<Planar>(SLOPE),
    ),
    spatial_scene(
        "billiard_break_spatial",
        6.0,
        "a cue ball breaks a rack of fifteen balls on a table",
        striking::billiard_break_spatial,
    ),
    spatial_scene("bin", 10.0, "fifty tilted boxes and two hundred hulls dropped into a bin", || {
        pouring::bin(5, 50, 200)
    }),
    spatial_scene(
        "bouncing_ball_spatial",
        5.0,
        "a ball dropped from 1 m bounces with restitution .8",
        || falling::bouncing_ball::<Spatial>(1.0, 0.8),
    ),
    spatial_scene("bowl_spatial", 6.0, "a ball rolls to and fro in a bowl of triangles", || {
        constrained::bowl_spatial(0.2)
    }),
    spatial_scene("conveyor_spatial", 2.0, "a block set down on a running belt", || {
        sliding::conveyor::<Spatial>(2.0, 0.4)
    }),
    spatial_scene(
        "cradle_spatial",
        3.0,
        "Newton's cradle of five balls, between walls instead of on strings",
        || striking::cradle::<Spatial>(5),
    ),
    spatial_scene("dominoes", 2.0, "thirty dominoes fall in a winding row", || dominoes::dominoes(30)),
    spatial_scene("double_pendulum_spatial", 10.0, "two bars on ball joints swing from a pivot", || {
        jointed::double_pendulum::<Spatial>()
    }),
    spatial_scene(
        "dzhanibekov",
        20.0,
        "a handle spun about its intermediate axis flips again and again",
        spinning::dzhanibekov,
    ),
    spatial_scene("four_bar_linkage_spatial", 5.0, "a crank drives a rocker through ball joints", || {
        jointed::four_bar_linkage::<Spatial>()
    }),
    spatial_scene(
        "four_leg_table",
        2.0,
        "a load on a table whose four legs share it in many possible ways",
        || constrained::four_leg_table(8.0, 0.3, 0.1),
    ),
    spatial_scene("free_top", 10.0, "a symmetric top precesses freely", spinning::free_top),
    spatial_scene(
        "incline_spatial",
        3.0,
        "two blocks on a slope of 30 degrees: one holds, one slides",
        || sliding::incline::<Spatial>(SLOPE, [0.58, 0.57]),
    ),
    spatial_scene("pile", 10.0, "a thousand mixed convex bodies poured into a box", || pouring::pile(1000)),
    spatial_scene("pile_small", 5.0, "sixty mixed convex bodies poured into a box", || pouring::pile(60)),
    spatial_scene("pyramid_small_spatial", 5.0, "a pyramid of 55 boxes, one box deep", || {
        stacking::pyramid::<Spatial>(10)
    }),
    spatial_scene("rocks_on_height_field", 6.0, "forty rocks fall on a valley given by its heights", || {
        pouring::rocks_on_terrain(40, pouring::Terrain::HeightField)
    }),
    spatial_scene("rocks_on_terrain", 6.0, "forty rocks fall on a valley made of triangles", || {
        pouring::rocks_on_terrain(40, pouring::Terrain::Mesh)
    }),
    spatial_scene("rolling_ball_spatial", 3.0, "a ball launched without spin slides until it rolls", || {
        sliding::rolling_ball::<Spatial>(5.0, 0.2)
    }),
    spatial_scene("sliding_block_spatial", 2.0, "a block launched at 5 m/s slides to a stop", || {
        sliding::sliding_block::<Spatial>(5.0, 0.5)
    }),
    spatial_scene("stack_spatial", 5.0, "ten boxes on each other", || stacking::stack::<Spatial>(10, 1.0)),
    spatial_scene(
        "wedge_spatial",
        0.5,
        "a block slides down a wedge that slides away, without friction",
        || constrained::wedge::<Spatial>(SLOPE),
    ),
];

/// All scenes, by space and name.
pub fn catalogue() -> &'static [SceneInfo] {
    &SCENES
}

fn find(name: &str) -> Option<Build> {
    SCENES.iter().find(|s| s.name == name).map(|s| s.build)
}

/// A new world of a scene of the plane; `None` when there is no such scene there.
pub fn planar(name: &str) -> Option<Result<World2, BuildError>> {
    match find(name)? {
        Build::Planar(build) => Some(build()),
        Build::Spatial(_) => None,
    }
}

/// A new world of a scene of space; `None` when there is no such scene there.
pub fn spatial(name: &str) -> Option<Result<World3, BuildError>> {
    match find(name)? {
        Build::Spatial(build) => Some(build()),
        Build::Planar(_) => None,
    }
}
