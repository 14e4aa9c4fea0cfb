"""Shapes as a scene file states them; the same names and fields as the engine's own shapes.

Lengths are in metres. Rounded shapes are a core swept by a disc or ball of `radius`. Capsules lie along x
in the plane and along z in space; cylinders and cones stand along z, centred on half their height. Knows no
worlds; checks sizes and counts only, while the engine checks hulls.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from carom.scene.fields import (
    MOST_POINTS,
    Index,
    Number,
    PlanarRotation,
    Positive,
    Sizes2,
    Sizes3,
    SpatialRotation,
    Strict,
    Switch,
    Vector2,
    Vector3,
)

Points2 = Annotated[list[Vector2], Field(min_length=3, max_length=MOST_POINTS)]
Points3 = Annotated[list[Vector3], Field(min_length=4, max_length=MOST_POINTS)]

_RADIUS = Field(description="Radius [m].")
_ROUNDING = Field(description="Radius of the disc or ball that sweeps the core [m].")
_LENGTH = Field(description="Length of the core segment, without the caps [m].")


class Circle(Strict):
    """Disc about the origin."""

    type: Literal["circle"]
    radius: Positive = _RADIUS


class PlanarCapsule(Strict):
    """Segment along x, swept by a disc."""

    type: Literal["capsule"]
    length: Positive = _LENGTH
    radius: Positive = _RADIUS


class PlanarBox(Strict):
    """Rectangle about the origin."""

    type: Literal["box"]
    size: Sizes2 = Field(description="Full side lengths along x and y [m].")


class PlanarRoundBox(Strict):
    """Rectangle swept by a disc."""

    type: Literal["round_box"]
    size: Sizes2 = Field(description="Full side lengths of the core along x and y [m].")
    radius: Positive = _ROUNDING


class ConvexPolygon(Strict):
    """Convex hull of the points."""

    type: Literal["convex_polygon"]
    points: Points2 = Field(description="Points, at least three [m].")


class RoundPolygon(Strict):
    """Convex hull of the points, swept by a disc."""

    type: Literal["round_polygon"]
    points: Points2 = Field(description="Points of the core, at least three [m].")
    radius: Positive = _ROUNDING


class Segment(Strict):
    """Straight wall between two points; no mass."""

    type: Literal["segment"]
    a: Vector2 = Field(description="First end [m].")
    b: Vector2 = Field(description="Second end [m].")


class Polyline(Strict):
    """Chain of straight walls; no mass."""

    type: Literal["polyline"]
    points: Annotated[list[Vector2], Field(min_length=2, max_length=MOST_POINTS)] = Field(
        description="Points in order, at least two [m]."
    )
    closed: Switch = Field(default=False, description="Whether the last point joins the first.")


class HalfPlane(Strict):
    """Everything behind a line through the origin; no mass."""

    type: Literal["half_plane"]
    normal: Vector2 = Field(description="Outward normal, any length [1].")


class Cavity(Strict):
    """Everything farther from the origin than the radius: the inside of a bowl or a drum; no mass."""

    type: Literal["cavity"]
    radius: Positive = _RADIUS


class PlanarHeightField(Strict):
    """Heights over equally spaced abscissae; no mass."""

    type: Literal["height_field"]
    heights: Annotated[list[Number], Field(min_length=2, max_length=MOST_POINTS)] = Field(
        description="Heights from left to right, at least two [m]."
    )
    width: Positive = Field(description="Width that the heights span about the origin [m].")


class PlanarPose(Strict):
    """Where a part of a compound sits."""

    position: Vector2 = Field(default=(0.0, 0.0), description="Position of the part's origin [m].")
    rotation: PlanarRotation | None = Field(
        default=None, description="Turn of the part, counter-clockwise [rad], or { degrees = .. }."
    )


class PlanarPart(Strict):
    """A shape at a pose inside a compound of the plane."""

    pose: PlanarPose = Field(default=PlanarPose(), description="Pose in the compound's frame [m, rad].")
    shape: PlanarPartShape = Field(description="The part's shape; not a compound.")


class PlanarCompound(Strict):
    """Several shapes in one body."""

    type: Literal["compound"]
    parts: Annotated[list[PlanarPart], Field(min_length=1, max_length=10_000)] = Field(
        description="The parts."
    )


PlanarPartShape = Annotated[
    Circle | PlanarCapsule | PlanarBox | PlanarRoundBox | ConvexPolygon | RoundPolygon | Segment | Polyline,
    Field(discriminator="type"),
]
PlanarShape = Annotated[
    Circle
    | PlanarCapsule
    | PlanarBox
    | PlanarRoundBox
    | ConvexPolygon
    | RoundPolygon
    | Segment
    | Polyline
    | HalfPlane
    | Cavity
    | PlanarHeightField
    | PlanarCompound,
    Field(discriminator="type"),
]


class Sphere(Strict):
    """Ball about the origin."""

    type: Literal["sphere"]
    radius: Positive = _RADIUS


class SpatialCapsule(Strict):
    """Segment along z, swept by a ball."""

    type: Literal["capsule"]
    length: Positive = _LENGTH
    radius: Positive = _RADIUS


class SpatialBox(Strict):
    """Cuboid about the origin."""

    type: Literal["box"]
    size: Sizes3 = Field(description="Full side lengths along x, y and z [m].")


class SpatialRoundBox(Strict):
    """Cuboid swept by a ball."""

    type: Literal["round_box"]
    size: Sizes3 = Field(description="Full side lengths of the core along x, y and z [m].")
    radius: Positive = _ROUNDING


class Cylinder(Strict):
    """Solid cylinder along z."""

    type: Literal["cylinder"]
    height: Positive = Field(description="Height along z [m].")
    radius: Positive = _RADIUS


class Cone(Strict):
    """Solid cone along z, base at -height/2, apex at +height/2."""

    type: Literal["cone"]
    height: Positive = Field(description="Height along z [m].")
    radius: Positive = Field(description="Radius of the base [m].")


class RoundCylinder(Strict):
    """Cylinder swept by a ball."""

    type: Literal["round_cylinder"]
    height: Positive = Field(description="Height of the core along z [m].")
    radius: Positive = Field(description="Radius of the core [m].")
    rounding: Positive = _ROUNDING


class RoundCone(Strict):
    """Cone swept by a ball."""

    type: Literal["round_cone"]
    height: Positive = Field(description="Height of the core along z [m].")
    radius: Positive = Field(description="Radius of the core's base [m].")
    rounding: Positive = _ROUNDING


class ConvexHull(Strict):
    """Convex hull of the points."""

    type: Literal["convex_hull"]
    points: Points3 = Field(description="Points, at least four, not all in one plane [m].")


class RoundConvexHull(Strict):
    """Convex hull of the points, swept by a ball."""

    type: Literal["round_convex_hull"]
    points: Points3 = Field(description="Points of the core, at least four, not all in one plane [m].")
    radius: Positive = _ROUNDING


class TriMesh(Strict):
    """Triangles over shared vertices; a surface as an obstacle, a volume (if closed) for its mass."""

    type: Literal["tri_mesh"]
    vertices: Annotated[list[Vector3], Field(min_length=3, max_length=MOST_POINTS)] = Field(
        description="Vertices [m]."
    )
    triangles: Annotated[
        list[tuple[Index, Index, Index]], Field(min_length=1, max_length=2 * MOST_POINTS)
    ] = Field(description="Vertex indices of each triangle, counter-clockwise from outside.")


class HalfSpace(Strict):
    """Everything behind a plane through the origin; no mass."""

    type: Literal["half_space"]
    normal: Vector3 = Field(description="Outward normal, any length [1].")


class SpatialHeightField(Strict):
    """Heights over a rectangle; no mass."""

    type: Literal["height_field"]
    heights: Annotated[
        list[Annotated[list[Number], Field(min_length=2, max_length=MOST_POINTS)]],
        Field(min_length=2, max_length=MOST_POINTS),
    ] = Field(description="Rows (y) of columns (x) of heights, at least 2 x 2 [m].")
    size: Sizes2 = Field(description="Extent along x and y about the origin [m].")


class SpatialPose(Strict):
    """Where a part of a compound sits."""

    position: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Position of the part's origin [m].")
    rotation: SpatialRotation | None = Field(
        default=None, description="Rotation of the part: [w, x, y, z], or { axis = [..], degrees = .. }."
    )


class SpatialPart(Strict):
    """A shape at a pose inside a compound of space."""

    pose: SpatialPose = Field(default=SpatialPose(), description="Pose in the compound's frame [m].")
    shape: SpatialPartShape = Field(description="The part's shape; not a compound.")


class SpatialCompound(Strict):
    """Several shapes in one body."""

    type: Literal["compound"]
    parts: Annotated[list[SpatialPart], Field(min_length=1, max_length=10_000)] = Field(
        description="The parts."
    )


SpatialPartShape = Annotated[
    Sphere
    | SpatialCapsule
    | SpatialBox
    | SpatialRoundBox
    | Cylinder
    | Cone
    | RoundCylinder
    | RoundCone
    | ConvexHull
    | RoundConvexHull
    | TriMesh,
    Field(discriminator="type"),
]
SpatialShape = Annotated[
    Sphere
    | SpatialCapsule
    | SpatialBox
    | SpatialRoundBox
    | Cylinder
    | Cone
    | RoundCylinder
    | RoundCone
    | ConvexHull
    | RoundConvexHull
    | TriMesh
    | HalfSpace
    | Cavity
    | SpatialHeightField
    | SpatialCompound,
    Field(discriminator="type"),
]

#: Shapes that have no volume and so can only belong to static or kinematic bodies.
MASSLESS = frozenset({"segment", "polyline", "half_plane", "half_space", "cavity", "height_field"})

PlanarPart.model_rebuild()
PlanarCompound.model_rebuild()
SpatialPart.model_rebuild()
SpatialCompound.model_rebuild()


def as_plain(shape: Strict) -> dict[str, Any]:
    """The shape as the plain table that the engine reads: rotations become [c, s] or [w, x, y, z]."""
    table: dict[str, Any] = {}
    for key in type(shape).model_fields:
        value = getattr(shape, key)
        if isinstance(value, (PlanarRotation, SpatialRotation)):
            table[key] = value.stored()
        elif isinstance(value, PlanarPose | SpatialPose):
            table[key] = as_plain(value)
            if table[key].get("rotation") is None:
                table[key]["rotation"] = [1.0, 0.0] if isinstance(value, PlanarPose) else [1.0, 0.0, 0.0, 0.0]
        elif isinstance(value, Strict):
            table[key] = as_plain(value)
        elif isinstance(value, list) and value and isinstance(value[0], Strict):
            table[key] = [as_plain(item) for item in value]
        else:
            table[key] = value
    return table
