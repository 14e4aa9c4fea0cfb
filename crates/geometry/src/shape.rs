//! Shapes as users state them: plain values, in SI units, that can be written to a file and read back.
//! Rounded shapes are a core swept by a disc or ball of `radius`: the outer size is size + 2 radius.
//! Axes: capsules lie along x in the plane and z in space; cylinders and cones stand along z, centred on
//! half their height.

use carom_math::{Planar, Pose, Spatial, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A shape of the plane. All lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "a variant's line describes its fields")]
pub enum PlanarShape {
    /// Disc about the origin.
    Circle { radius: f64 },
    /// Segment of `length` along x, swept by a disc.
    Capsule { length: f64, radius: f64 },
    /// Rectangle of full side lengths `size` about the origin.
    Box { size: [f64; 2] },
    /// Rectangle swept by a disc.
    RoundBox { size: [f64; 2], radius: f64 },
    /// Convex hull of the points.
    ConvexPolygon { points: Vec<Vec2> },
    /// Convex hull of the points, swept by a disc.
    RoundPolygon { points: Vec<Vec2>, radius: f64 },
    /// Straight wall between two points; no mass.
    Segment { a: Vec2, b: Vec2 },
    /// Chain of straight walls; no mass.
    Polyline {
        points: Vec<Vec2>,
        #[serde(default)]
        closed: bool,
    },
    /// Everything on the side of the origin's line that the outward normal points away from; no mass.
    HalfPlane { normal: Vec2 },
    /// Everything farther from the origin than `radius`: the inside of a bowl or a drum; no mass.
    Cavity { radius: f64 },
    /// Heights over equally spaced abscissae that span `width` about the origin; no mass.
    HeightField { heights: Vec<f64>, width: f64 },
    /// Several shapes in one body.
    Compound { parts: Vec<PlanarPart> },
}

/// A shape at a pose inside a compound of the plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanarPart {
    /// Pose of the part in the compound's frame.
    pub pose: Pose<Planar>,
    /// The part itself; not a compound, not an unbounded or massless shape when mass is asked for.
    pub shape: PlanarShape,
}

/// A shape of space. All lengths in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "a variant's line describes its fields")]
pub enum SpatialShape {
    /// Ball about the origin.
    Sphere { radius: f64 },
    /// Segment of `length` along z, swept by a ball.
    Capsule { length: f64, radius: f64 },
    /// Cuboid of full side lengths `size` about the origin.
    Box { size: [f64; 3] },
    /// Solid cylinder along z.
    Cylinder { height: f64, radius: f64 },
    /// Solid cone along z, base at -height/2, apex at +height/2.
    Cone { height: f64, radius: f64 },
    /// Convex hull of the points.
    ConvexHull { points: Vec<Vec3> },
    /// Cuboid swept by a ball.
    RoundBox { size: [f64; 3], radius: f64 },
    /// Cylinder of core `height` and `radius` swept by a ball of `rounding`.
    RoundCylinder { height: f64, radius: f64, rounding: f64 },
    /// Cone of core `height` and `radius` swept by a ball of `rounding`.
    RoundCone { height: f64, radius: f64, rounding: f64 },
    /// Convex hull of the points, swept by a ball.
    RoundConvexHull { points: Vec<Vec3>, radius: f64 },
    /// Triangles over shared vertices. As an obstacle it is a surface; mass is that of the enclosed volume
    /// and needs a closed, outward-oriented surface.
    TriMesh { vertices: Vec<Vec3>, triangles: Vec<[u32; 3]> },
    /// Everything on the side of the origin's plane that the outward normal points away from; no mass.
    HalfSpace { normal: Vec3 },
    /// Everything farther from the origin than `radius`: the inside of a bowl or a ball; no mass.
    Cavity { radius: f64 },
    /// `rows x columns` heights (row = y, column = x) over a rectangle `size` about the origin; no mass.
    HeightField { heights: Vec<Vec<f64>>, size: [f64; 2] },
    /// Several shapes in one body.
    Compound { parts: Vec<SpatialPart> },
}

/// A shape at a pose inside a compound of space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpatialPart {
    /// Pose of the part in the compound's frame.
    pub pose: Pose<Spatial>,
    /// The part itself.
    pub shape: SpatialShape,
}
