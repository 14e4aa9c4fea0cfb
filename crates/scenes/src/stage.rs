//! Shapes and places that mean the same in the plane and in space, so that a scene is written once: x runs
//! along, the last axis points up, and what the plane lacks is `deep` (y). Knows no bodies.

use carom::{
    Geometry, Planar, PlanarShape, Quaternion, Settings, Spatial, SpatialShape, Turn, Vec1, Vec2, Vec3, vec1,
    vec2, vec3,
};

/// What scenes ask of a space beyond its geometry.
pub trait Stage: Geometry {
    /// Disc | ball \[m\].
    fn ball(radius: f64) -> Self::Shape;
    /// Box of full side lengths \[m\].
    fn block(along: f64, up: f64, deep: f64) -> Self::Shape;
    /// Convex polygon of (along, up) | the prism over it, centred in depth \[m\].
    fn prism(points: &[(f64, f64)], deep: f64) -> Self::Shape;
    /// Everything below a line | plane through the origin that rises along x by `angle` \[rad\].
    fn ground(angle: f64) -> Self::Shape;
    /// The half-plane | half-space behind a vertical wall that faces along x when `facing` is 1, against it when -1.
    fn wall(facing: f64) -> Self::Shape;
    /// A point \[m\], or a velocity \[m/s\].
    fn place(along: f64, up: f64) -> Self::Vector;
    /// The rotation that turns x toward up by `angle` \[rad\].
    fn lean(angle: f64) -> Self::Rotation;
    /// The angular velocity that turns x toward up at `rate` \[rad/s\].
    fn spin(rate: f64) -> Self::Spin;
}

impl Stage for Planar {
    fn ball(radius: f64) -> PlanarShape {
        PlanarShape::Circle { radius }
    }
    fn block(along: f64, up: f64, _: f64) -> PlanarShape {
        PlanarShape::Box { size: [along, up] }
    }
    fn prism(points: &[(f64, f64)], _: f64) -> PlanarShape {
        PlanarShape::ConvexPolygon { points: points.iter().map(|&(x, y)| vec2(x, y)).collect() }
    }
    fn ground(angle: f64) -> PlanarShape {
        PlanarShape::HalfPlane { normal: direction::<Planar>(angle) }
    }
    fn wall(facing: f64) -> PlanarShape {
        PlanarShape::HalfPlane { normal: vec2(facing, 0.0) }
    }
    fn place(along: f64, up: f64) -> Vec2 {
        vec2(along, up)
    }
    fn lean(angle: f64) -> Turn {
        Turn::from_angle(angle)
    }
    fn spin(rate: f64) -> Vec1 {
        vec1(rate)
    }
}

impl Stage for Spatial {
    fn ball(radius: f64) -> SpatialShape {
        SpatialShape::Sphere { radius }
    }
    fn block(along: f64, up: f64, deep: f64) -> SpatialShape {
        SpatialShape::Box { size: [along, deep, up] }
    }
    fn prism(points: &[(f64, f64)], deep: f64) -> SpatialShape {
        let half = 0.5 * deep;
        let points = points.iter().flat_map(|&(x, z)| [vec3(x, -half, z), vec3(x, half, z)]).collect();
        SpatialShape::ConvexHull { points }
    }
    fn ground(angle: f64) -> SpatialShape {
        SpatialShape::HalfSpace { normal: direction::<Spatial>(angle) }
    }
    fn wall(facing: f64) -> SpatialShape {
        SpatialShape::HalfSpace { normal: vec3(facing, 0.0, 0.0) }
    }
    fn place(along: f64, up: f64) -> Vec3 {
        vec3(along, 0.0, up)
    }
    fn lean(angle: f64) -> Quaternion {
        Quaternion::from_axis_angle(vec3(0.0, -1.0, 0.0), angle)
    }
    fn spin(rate: f64) -> Vec3 {
        vec3(0.0, -rate, 0.0)
    }
}

/// Unit normal of ground that rises along x by an angle: exactly up for 0.
fn direction<S: Stage>(angle: f64) -> S::Vector {
    let [c, s] = Turn::from_angle(angle).0;
    S::place(-s, c)
}

/// Default settings with another step length \[s\].
pub fn settings<S: Stage>(dt: f64) -> Settings<S> {
    Settings { dt, ..Settings::default() }
}

/// Settings of a world without weight.
pub fn weightless<S: Stage>(dt: f64) -> Settings<S> {
    Settings { gravity: S::place(0.0, 0.0), ..settings(dt) }
}
