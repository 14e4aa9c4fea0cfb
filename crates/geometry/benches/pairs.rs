//! What the contact points of two boxes and two hulls cost, pair by pair and where pairs go side by side, beside the library's
//! manifolds made anew, in one run: the same poses, rounds in turn, processor time, medians. The library's answers differ (ADR 8); what they are worth is not told.

use carom_geometry::{ABREAST, Geometry, Look, SpatialShape};
use carom_math::{Pose, Quaternion, Spatial, Vec3, vec3};
use parry3d_f64::glamx::DQuat;
use parry3d_f64::math::{Pose as Place, Vector};
use parry3d_f64::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d_f64::shape::SharedShape;
use std::time::Instant;

#[path = "../tests/common/mod.rs"]
mod common;
use common::Random;

/// Poses per kind, rounds of each, and passes over the poses in a round.
const POSES: usize = 2000;
const ROUNDS: usize = 7;
const PASSES: usize = 25;
/// Gap up to which contact points are asked for \[m\].
const MARGIN: f64 = 1e-3;

/// Two poses as ours and as one relative to the other.
struct Posed {
    ours: [Pose<Spatial>; 2],
    theirs: Place,
}

fn main() {
    println!("{:36}{:>12}{:>12}{:>12}{:>8}", "ns per pair", "alone", "abreast", "library", "ratio");
    let unit = SpatialShape::Box { size: [1.0, 1.0, 1.0] };
    let library_unit = SharedShape::cuboid(0.5, 0.5, 0.5);
    for (name, tilt) in [("boxes of a wall", 0.0), ("boxes of a wall, tilted by 1e-3", 1e-3)] {
        compare(name, &unit, &library_unit, &wall(tilt));
    }
    compare("boxes turned at random", &unit, &library_unit, &at_random(0.9, 1.2));
    for corners in [12, 24, 32] {
        let points = common::hull_points(corners, 0.5, 3);
        let theirs: Vec<Vector> = points.iter().map(|p| Vector::new(p[0], p[1], p[2])).collect();
        let hull = SharedShape::convex_hull(&theirs).expect("corners on a ball have a hull");
        let name = format!("hulls of {corners} corners");
        compare(&name, &SpatialShape::ConvexHull { points }, &hull, &at_random(0.85, 1.05));
    }
}

/// Boxes of side 1 m half on each other and beside each other, turned and moved by up to `tilt`.
fn wall(tilt: f64) -> Vec<Posed> {
    let mut random = Random::new(3);
    let beside = [vec3(0.5, 0.0, 1.0), vec3(-0.5, 0.0, 1.0), vec3(1.0, 0.0, 0.0)];
    (0..POSES)
        .map(|k| {
            let at = vec3((k % 50) as f64, 0.0, (k / 50) as f64);
            let other = at + beside[k % 3] + random.vec3() * (0.1 * tilt);
            posed(&mut random, [at, other], tilt)
        })
        .collect()
}

/// Poses turned at random with centres between two distances \[m\].
fn at_random(near: f64, far: f64) -> Vec<Posed> {
    let mut random = Random::new(5);
    (0..POSES)
        .map(|_| {
            let at = random.vec3() * 5.0;
            let other = at + random.direction3() * (near + (far - near) * random.unit());
            posed(&mut random, [at, other], std::f64::consts::PI)
        })
        .collect()
}

fn posed(random: &mut Random, places: [Vec3; 2], tilt: f64) -> Posed {
    let ours: [Pose<Spatial>; 2] = places.map(|at| {
        let turn = Quaternion::from_axis_angle(random.direction3(), tilt * random.signed());
        Pose::new(at, turn)
    });
    let [a, b] = ours.map(|pose| {
        let ([x, y, z], [w, i, j, k]) = (pose.position.0, pose.rotation.0);
        Place::from_parts(Vector::new(x, y, z), DQuat::from_xyzw(i, j, k, w))
    });
    Posed { ours, theirs: a.inv_mul(&b) }
}

fn compare(name: &str, shape: &SpatialShape, theirs: &SharedShape, poses: &[Posed]) {
    let (collider, mut points) = (common::collider::<Spatial>(shape), Vec::new());
    let ours = || {
        for p in poses {
            points.clear();
            Spatial::contacts(&collider, &p.ours[0], &collider, &p.ours[1], MARGIN, &mut points);
            std::hint::black_box(&points);
        }
    };
    let mut found = Vec::new();
    let abreast = || {
        for some in poses.chunks_exact(ABREAST) {
            let looks: [Look<'_, Spatial>; ABREAST] = std::array::from_fn(|k| {
                let [a, b] = &some[k].ours;
                Look { colliders: [&collider; 2], poses: [a, b], margin: MARGIN }
            });
            found.clear();
            Spatial::contacts_abreast(&looks, &mut found);
            std::hint::black_box(&found);
        }
    };
    let library = || {
        for p in poses {
            let (mut manifolds, mut workspace) = (Vec::<ContactManifold<(), ()>>::new(), None);
            let asked = DefaultQueryDispatcher.contact_manifolds(
                &p.theirs,
                &**theirs,
                &**theirs,
                MARGIN,
                &mut manifolds,
                &mut workspace,
            );
            asked.expect("the library knows these shapes");
            std::hint::black_box(&manifolds);
        }
    };
    let [ours, abreast, library] = in_turn([&mut { ours }, &mut { abreast }, &mut { library }]);
    // in a step they go as is quicker for them
    let own = if Spatial::go_abreast(&collider, &collider) { abreast } else { ours };
    println!("{name:36}{ours:12.0}{abreast:12.0}{library:12.0}{:8.2}", own / library);
}

/// Medians of the time of some calls \[ns per pose\].
fn in_turn<const N: usize>(mut calls: [&mut dyn FnMut(); N]) -> [f64; N] {
    let clock = Instant::now();
    let mut times = [const { Vec::new() }; N];
    let time = |call: &mut dyn FnMut()| {
        let begun = processor_seconds().unwrap_or_else(|| clock.elapsed().as_secs_f64());
        (0..PASSES).for_each(|_| call());
        let end = processor_seconds().unwrap_or_else(|| clock.elapsed().as_secs_f64());
        1e9 * (end - begun) / (PASSES * POSES) as f64
    };
    for _ in 0..ROUNDS {
        for (times, call) in times.iter_mut().zip(calls.iter_mut()) {
            times.push(time(call));
        }
    }
    times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[ROUNDS / 2]
    })
}

/// Processor time of this thread so far \[s\], of systems that tell it.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(1e-9 * text.split_whitespace().next()?.parse::<f64>().ok()?)
}
