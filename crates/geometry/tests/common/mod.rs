//! What the geometry tests share: a small generator with fixed seeds, poses and one-line queries.
#![allow(dead_code, reason = "every test file uses its own part of this")]

use carom_geometry::{Closest, ContactPoint, Geometry, PlanarShape, SpatialShape};
use carom_math::{Column, Planar, Pose, Quaternion, Rotation, Spatial, Turn, Vec2, Vec3, vec2, vec3};

/// Marsaglia's xorshift, 64 bits.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
    pub fn vec2(&mut self) -> Vec2 {
        vec2(self.signed(), self.signed())
    }
    pub fn vec3(&mut self) -> Vec3 {
        vec3(self.signed(), self.signed(), self.signed())
    }
    pub fn direction2(&mut self) -> Vec2 {
        Turn::from_angle(self.unit() * std::f64::consts::TAU).rotate(vec2(1.0, 0.0))
    }
    pub fn direction3(&mut self) -> Vec3 {
        loop {
            let v = self.vec3();
            if v.norm() > 0.1 && v.norm() < 1.0 {
                return v * (1.0 / v.norm());
            }
        }
    }
    pub fn turn(&mut self) -> Turn {
        Turn::from_angle(self.unit() * std::f64::consts::TAU)
    }
    pub fn rotation(&mut self) -> Quaternion {
        Quaternion::from_axis_angle(self.direction3(), std::f64::consts::TAU * self.unit())
    }
    pub fn pose2(&mut self, far: f64) -> Pose<Planar> {
        Pose::new(self.vec2() * far, self.turn())
    }
    pub fn pose3(&mut self, far: f64) -> Pose<Spatial> {
        Pose::new(self.vec3() * far, self.rotation())
    }
}

/// Contact points of two shapes at poses.
pub fn contacts<S: Geometry>(
    a: &S::Shape,
    pose_a: &Pose<S>,
    b: &S::Shape,
    pose_b: &Pose<S>,
    margin: f64,
) -> Vec<ContactPoint<S>> {
    let (a, b) = (collider::<S>(a), collider::<S>(b));
    let mut out = Vec::new();
    S::contacts(&a, pose_a, &b, pose_b, margin, &mut out);
    out
}

pub fn collider<S: Geometry>(shape: &S::Shape) -> S::Collider {
    S::collider(shape).unwrap_or_else(|e| panic!("{shape:?}: {e}"))
}

pub fn closest<S: Geometry>(
    a: &S::Shape,
    pose_a: &Pose<S>,
    b: &S::Shape,
    pose_b: &Pose<S>,
    reach: f64,
) -> Option<Closest<S>> {
    S::closest(&collider::<S>(a), pose_a, &collider::<S>(b), pose_b, reach)
}

pub fn deepest<S: Geometry>(points: &[ContactPoint<S>]) -> f64 {
    points.iter().fold(f64::INFINITY, |m, p| m.min(p.gap))
}

pub fn at2(x: f64, y: f64) -> Pose<Planar> {
    Pose::new(vec2(x, y), Turn::IDENTITY)
}

pub fn at3(x: f64, y: f64, z: f64) -> Pose<Spatial> {
    Pose::new(vec3(x, y, z), Quaternion::IDENTITY)
}

pub fn about(axis: Vec3, angle: f64) -> Quaternion {
    Quaternion::from_axis_angle(axis * (1.0 / axis.norm()), angle)
}

pub const X: Vec3 = vec3(1.0, 0.0, 0.0);
pub const Y: Vec3 = vec3(0.0, 1.0, 0.0);
pub const Z: Vec3 = vec3(0.0, 0.0, 1.0);

pub fn assert_close(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance, "{what}: {a:.17e} is not {b:.17e} within {tolerance:e}");
}

/// Bounded convex shapes of the plane.
pub fn convex_planar() -> Vec<PlanarShape> {
    let ring = |n: usize, r: f64| {
        (0..n).map(move |k| Turn::from_angle(k as f64 * 6.3 / n as f64).rotate(vec2(r, 0.0)))
    };
    vec![
        PlanarShape::Circle { radius: 0.4 },
        PlanarShape::Capsule { length: 0.7, radius: 0.2 },
        PlanarShape::Box { size: [0.9, 0.5] },
        PlanarShape::RoundBox { size: [0.6, 0.4], radius: 0.1 },
        PlanarShape::ConvexPolygon { points: ring(5, 0.5).collect() },
        PlanarShape::RoundPolygon { points: ring(7, 0.4).collect(), radius: 0.05 },
        PlanarShape::Segment { a: vec2(-0.5, 0.1), b: vec2(0.4, -0.2) },
    ]
}

/// Points of a hull with `n` points on a sphere.
pub fn hull_points(n: usize, radius: f64, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(seed);
    (0..n).map(|_| random.direction3() * radius).collect()
}

/// Bounded convex shapes of space whose cores are flat-faced.
pub fn flat_spatial() -> Vec<SpatialShape> {
    vec![
        SpatialShape::Sphere { radius: 0.4 },
        SpatialShape::Capsule { length: 0.7, radius: 0.2 },
        SpatialShape::Box { size: [0.9, 0.5, 0.7] },
        SpatialShape::RoundBox { size: [0.6, 0.4, 0.5], radius: 0.1 },
        SpatialShape::ConvexHull { points: hull_points(14, 0.5, 3) },
        SpatialShape::RoundConvexHull { points: hull_points(8, 0.4, 4), radius: 0.05 },
    ]
}

/// Bounded convex shapes of space with curved cores.
pub fn curved_spatial() -> Vec<SpatialShape> {
    vec![
        SpatialShape::Cylinder { height: 0.8, radius: 0.3 },
        SpatialShape::Cone { height: 0.9, radius: 0.4 },
        SpatialShape::RoundCylinder { height: 0.5, radius: 0.3, rounding: 0.1 },
        SpatialShape::RoundCone { height: 0.6, radius: 0.3, rounding: 0.05 },
    ]
}

pub fn convex_spatial() -> Vec<SpatialShape> {
    let mut all = flat_spatial();
    all.extend(curved_spatial());
    all
}

/// A flat square floor of `2 cells x cells` triangles at z = 0.
pub fn flat_mesh(cells: usize, size: f64) -> SpatialShape {
    let n = cells + 1;
    let place = |k: usize| size * (k as f64 / cells as f64 - 0.5);
    let vertices = (0..n * n).map(|i| vec3(place(i % n), place(i / n), 0.0)).collect();
    let corner = |r: usize, c: usize| (r * n + c) as u32;
    let triangles = (0..cells * cells)
        .flat_map(|i| {
            let (r, c) = (i / cells, i % cells);
            // both diagonals occur, so that no direction of rolling is special
            let [p, q, s, t] = [corner(r, c), corner(r, c + 1), corner(r + 1, c + 1), corner(r + 1, c)];
            if (r + c) % 2 == 0 { [[p, q, s], [p, s, t]] } else { [[p, q, t], [q, s, t]] }
        })
        .collect();
    SpatialShape::TriMesh { vertices, triangles }
}
