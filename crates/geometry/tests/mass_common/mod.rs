//! Shapes and comparisons that the mass tests share.
#![allow(dead_code, reason = "every test binary uses its own part")]

use carom_geometry::{
    MassProperties, PlanarPart, PlanarShape, SpatialPart, SpatialShape, mass_planar, mass_spatial,
};
use carom_math::{
    Column, Inertia, Planar, Pose, Quaternion, Rotation, Space, Spatial, Turn, Vec2, Vec3, vec2, vec3,
};

/// Largest relative difference: of mass, of centre over the radius of gyration, of inertia over m k^2.
pub fn difference<S: Space>(a: &MassProperties<S>, b: &MassProperties<S>) -> f64 {
    let largest = b.inertia.entries().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let gyration = (largest / b.mass).sqrt();
    let inertia =
        a.inertia.entries().iter().zip(b.inertia.entries()).fold(0.0, |m: f64, (x, y)| m.max((x - y).abs()));
    (a.mass / b.mass - 1.0).abs().max((a.center - b.center).norm() / gyration).max(inertia / largest)
}

/// Fails with both values when two bodies differ by more than `tolerance`.
pub fn assert_same<S: Space>(a: &MassProperties<S>, b: &MassProperties<S>, tolerance: f64, what: &str) {
    let d = difference(a, b);
    assert!(d <= tolerance, "{what}: difference {d:.2e} > {tolerance:.0e}\n{a:?}\n{b:?}");
}

/// Numbers in [0, 1) from a fixed seed (a linear congruential generator, Knuth's MMIX constants).
pub struct Numbers(pub u64);

impl Numbers {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
    pub fn planar(&mut self, size: f64) -> Vec2 {
        Vec2::from_fn(|_| self.between(-size, size))
    }
    pub fn spatial(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_| self.between(-size, size))
    }
}

/// Points that are no symmetric figure.
pub fn planar_cloud(count: usize, seed: u64) -> Vec<Vec2> {
    let mut numbers = Numbers(seed);
    (0..count).map(|_| numbers.planar(0.7) + vec2(0.3, -0.2)).collect()
}

/// Points that are no symmetric figure.
pub fn spatial_cloud(count: usize, seed: u64) -> Vec<Vec3> {
    let mut numbers = Numbers(seed);
    (0..count).map(|_| numbers.spatial(0.7) + vec3(0.3, -0.2, 0.1)).collect()
}

/// One of every kind of planar shape with an area.
pub fn planar_shapes() -> Vec<PlanarShape> {
    let part = |x: f64, y: f64, angle: f64, shape| PlanarPart {
        pose: Pose::new(vec2(x, y), Turn::from_angle(angle)),
        shape,
    };
    vec![
        PlanarShape::Circle { radius: 0.7 },
        PlanarShape::Capsule { length: 1.3, radius: 0.4 },
        PlanarShape::Box { size: [1.2, 0.5] },
        PlanarShape::RoundBox { size: [1.2, 0.5], radius: 0.3 },
        PlanarShape::ConvexPolygon { points: planar_cloud(12, 1) },
        PlanarShape::RoundPolygon { points: planar_cloud(9, 2), radius: 0.25 },
        PlanarShape::Compound {
            parts: vec![
                part(0.4, 0.1, 0.3, PlanarShape::Box { size: [1.0, 0.2] }),
                part(-0.4, 0.6, -1.3, PlanarShape::Capsule { length: 0.5, radius: 0.2 }),
                part(0.0, -1.0, 2.0, PlanarShape::RoundPolygon { points: planar_cloud(6, 3), radius: 0.1 }),
            ],
        },
    ]
}

/// A cube of side 2 as a closed, outward mesh.
pub fn cube_mesh() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let vertices = (0..8u32).map(|i| Vec3::from_fn(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (vertices, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// An L-shaped prism: not convex, and star-shaped about its centroid only in part.
pub fn angle_mesh(arm: f64, width: f64, height: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let outline = [[0.0, 0.0], [arm, 0.0], [arm, width], [width, width], [width, arm], [0.0, arm]];
    let at = |z: f64| outline.iter().map(move |[x, y]| vec3(*x, *y, z));
    let vertices: Vec<Vec3> = at(0.0).chain(at(height)).collect();
    let caps = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]];
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for [a, b, c] in caps {
        triangles.push([a, c, b]);
        triangles.push([a + 6, b + 6, c + 6]);
    }
    for i in 0..6 {
        let j = (i + 1) % 6;
        triangles.extend([[i, j, j + 6], [i, j + 6, i + 6]]);
    }
    (vertices, triangles)
}

/// One of every kind of spatial shape with a volume.
pub fn spatial_shapes() -> Vec<SpatialShape> {
    let part = |x: f64, y: f64, z: f64, spin: Vec3, shape| SpatialPart {
        pose: Pose::new(vec3(x, y, z), Quaternion::about(spin)),
        shape,
    };
    let (vertices, triangles) = angle_mesh(1.5, 0.4, 0.7);
    vec![
        SpatialShape::Sphere { radius: 0.7 },
        SpatialShape::Capsule { length: 1.3, radius: 0.4 },
        SpatialShape::Box { size: [1.2, 0.5, 0.8] },
        SpatialShape::Cylinder { height: 1.1, radius: 0.6 },
        SpatialShape::Cone { height: 1.4, radius: 0.5 },
        SpatialShape::ConvexHull { points: spatial_cloud(20, 4) },
        SpatialShape::RoundBox { size: [1.2, 0.5, 0.8], radius: 0.3 },
        SpatialShape::RoundCylinder { height: 1.1, radius: 0.6, rounding: 0.25 },
        SpatialShape::RoundCone { height: 1.4, radius: 0.5, rounding: 0.2 },
        SpatialShape::RoundConvexHull { points: spatial_cloud(10, 5), radius: 0.3 },
        SpatialShape::TriMesh { vertices, triangles },
        SpatialShape::Compound {
            parts: vec![
                part(0.4, 0.1, -0.2, vec3(0.3, 0.2, -0.7), SpatialShape::Cone { height: 1.0, radius: 0.2 }),
                part(
                    -0.4,
                    0.6,
                    0.5,
                    vec3(-1.3, 0.4, 0.0),
                    SpatialShape::Capsule { length: 0.5, radius: 0.2 },
                ),
                part(
                    0.0,
                    -1.0,
                    0.3,
                    vec3(0.1, 2.0, 0.5),
                    SpatialShape::RoundBox { size: [0.5, 0.2, 0.3], radius: 0.1 },
                ),
            ],
        },
    ]
}

/// Corners of a box about the origin.
pub fn box_corners(size: [f64; 3]) -> Vec<Vec3> {
    (0..8).map(|i| Vec3::from_fn(|k| if i >> k & 1 == 1 { 0.5 * size[k] } else { -0.5 * size[k] })).collect()
}

/// Corners of a regular polygon of this side.
pub fn regular_polygon(count: usize, side: f64) -> Vec<Vec2> {
    let step = std::f64::consts::TAU / count as f64;
    let radius = 0.5 * side / (0.5 * step).sin();
    (0..count).map(|k| vec2(radius * (k as f64 * step).cos(), radius * (k as f64 * step).sin())).collect()
}

/// Points all over a sphere about `center` (a Fibonacci spiral).
pub fn on_sphere(center: Vec3, radius: f64, count: usize) -> impl Iterator<Item = Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (s, c) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        center + vec3(r * c, r * s, z) * radius
    })
}

/// A closed shape's properties at density 1.
pub fn planar(shape: &PlanarShape) -> MassProperties<Planar> {
    mass_planar::mass_properties(shape, 1.0).unwrap_or_else(|e| panic!("{shape:?}: {e}"))
}

/// A closed shape's properties at density 1.
pub fn spatial(shape: &SpatialShape) -> MassProperties<Spatial> {
    mass_spatial::mass_properties(shape, 1.0).unwrap_or_else(|e| panic!("{shape:?}: {e}"))
}

/// Properties of a density function, one point at a time.
pub fn planar_of(
    shape: &PlanarShape,
    density: impl Fn(Vec2) -> f64,
    tolerance: f64,
) -> MassProperties<Planar> {
    let mut density = |points: &[Vec2]| points.iter().map(|p| density(*p)).collect();
    mass_planar::mass_properties_of(shape, &mut density, tolerance)
        .unwrap_or_else(|e| panic!("{shape:?}: {e}"))
}

/// Properties of a density function, one point at a time.
pub fn spatial_of(
    shape: &SpatialShape,
    density: impl Fn(Vec3) -> f64,
    tolerance: f64,
) -> MassProperties<Spatial> {
    let mut density = |points: &[Vec3]| points.iter().map(|p| density(*p)).collect();
    mass_spatial::mass_properties_of(shape, &mut density, tolerance)
        .unwrap_or_else(|e| panic!("{shape:?}: {e}"))
}
