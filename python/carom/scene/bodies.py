"""Bodies, materials, mesh references and repetition as a scene file states them.

Rules between fields live here, each refused with the key to look at and what to do; single values are
bounded by their types. Units: m, kg, s, rad; densities per volume in space [kg/m^3] and per area in the
plane [kg/m^2]. Knows no files and no worlds.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from carom.scene.fields import (
    Bits,
    Count,
    Fraction,
    Name,
    NotNegative,
    Number,
    PlanarRotation,
    Positive,
    SpatialRotation,
    Strict,
    Switch,
    Vector2,
    Vector3,
    refuse,
)
from carom.scene.shapes import MASSLESS, PlanarShape, SpatialShape

#: Most bodies that one scene may hold after repetition [1].
MOST_BODIES = 200_000

Kind = Literal["dynamic", "static", "kinematic"]
Counts = Annotated[
    list[Annotated[int, Field(strict=True, ge=1, le=MOST_BODIES)]], Field(min_length=1, max_length=3)
]

#: Constants of contact that bodies, materials and pairs of materials have.
COEFFICIENTS = (
    "friction",
    "restitution",
    "tangential_restitution",
    "rolling_friction",
    "spinning_friction",
)
_TURNED = "Share of the slip that a bounce turns round, as far as friction reaches, 0 to 1 [1]."


class Material(Strict):
    """Contact and mass constants that several bodies share."""

    friction: NotNegative | None = Field(default=None, description="Friction coefficient (Coulomb) [1].")
    rolling_friction: NotNegative | None = Field(
        default=None, description="Largest moment against rolling per normal force [m]."
    )
    spinning_friction: NotNegative | None = Field(
        default=None, description="Largest moment about a contact's normal per normal force [m]."
    )
    restitution: Fraction | None = Field(default=None, description="Coefficient of restitution, 0 to 1 [1].")
    tangential_restitution: Fraction | None = Field(default=None, description=_TURNED)
    density: Positive | None = Field(
        default=None, description="Mass per volume [kg/m^3] in space, per area [kg/m^2] in the plane."
    )


class MaterialPair(Strict):
    """Contact constants of two materials; what is absent is mixed from the bodies' own."""

    materials: Annotated[
        list[Annotated[str, Field(min_length=1, max_length=200)]], Field(min_length=2, max_length=2)
    ] = Field(description="Names of two entries of [materials], in either order.")
    friction: NotNegative | None = Field(default=None, description="Friction coefficient (Coulomb) [1].")
    restitution: Fraction | None = Field(default=None, description="Coefficient of restitution, 0 to 1 [1].")
    tangential_restitution: Fraction | None = Field(default=None, description=_TURNED)
    rolling_friction: NotNegative | None = Field(
        default=None, description="Largest moment against rolling per normal force [m]."
    )
    spinning_friction: NotNegative | None = Field(
        default=None, description="Largest moment about a contact's normal per normal force [m]."
    )

    def coefficients(self) -> dict[str, float]:
        """What is said of the pair."""
        return {key: getattr(self, key) for key in COEFFICIENTS if getattr(self, key) is not None}


class _JointCommon(Strict):
    """What joints of the plane and of space have in common."""

    name: Name = Field(description="Name of the joint, unlike that of any other.")
    kind: Literal["point", "distance", "fixed"] = Field(
        description="point: a point stays at a point (hinge, ball joint); distance: two points keep their "
        "distance (massless rod); fixed: the relative pose stays (weld)."
    )
    a: Name = Field(description="Name of a body.")
    b: Name | None = Field(default=None, description="Name of another body; the world itself when absent.")
    length: Positive | None = Field(
        default=None, description="Length of a distance joint [m]; the present distance when absent."
    )
    collide: Switch = Field(default=False, description="Whether the two bodies collide with each other.")

    def _check_places(self, point: Any, anchors: tuple[Any, Any]) -> None:
        if point is not None and any(anchor is not None for anchor in anchors):
            raise refuse("point", "point must not be given beside anchors", "give point or anchors")
        if point is not None and self.kind == "distance":
            raise refuse("point", "point has no meaning for a distance joint", "give anchor_a and anchor_b")
        if self.length is not None and self.kind != "distance":
            raise refuse("length", f"length has no meaning for a {self.kind} joint", "leave it out")


class PlanarJoint(_JointCommon):
    """A joint of the plane."""

    point: Vector2 | None = Field(default=None, description="Place of the world where both are held [m].")
    anchor_a: Vector2 | None = Field(
        default=None, description="Point of a in its shape's axes [m]; derived when absent."
    )
    anchor_b: Vector2 | None = Field(
        default=None, description="Point of b in its shape's axes, or place of the world [m]."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_places(self.point, (self.anchor_a, self.anchor_b))
        return self


class SpatialJoint(_JointCommon):
    """A joint of space."""

    point: Vector3 | None = Field(default=None, description="Place of the world where both are held [m].")
    anchor_a: Vector3 | None = Field(
        default=None, description="Point of a in its shape's axes [m]; derived when absent."
    )
    anchor_b: Vector3 | None = Field(
        default=None, description="Point of b in its shape's axes, or place of the world [m]."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_places(self.point, (self.anchor_a, self.anchor_b))
        return self


class MeshFile(Strict):
    """A triangle mesh in a file beside the scene."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] = Field(
        description="Path of an OBJ, STL, PLY or GLB file, relative to the scene file's folder and inside it."
    )
    as_: Literal["hull", "decomposition", "static"] = Field(
        alias="as",
        description="hull: convex hull; decomposition: several convex parts; static: the triangles "
        "themselves (obstacles only).",
    )
    scale: Positive = Field(default=1.0, description="Metres per unit of length in the file [m].")
    max_parts: Annotated[int, Field(strict=True, ge=1, le=1000)] | None = Field(
        default=None, description="Most convex parts of a decomposition [1]; 16 when absent."
    )

    @model_validator(mode="after")
    def _parts_only_for_decomposition(self) -> Self:
        if self.max_parts is not None and self.as_ != "decomposition":
            raise refuse(
                "max_parts", f"max_parts has no meaning with as = {self.as_!r}", 'use as = "decomposition"'
            )
        return self


class _Repeat(Strict):
    """Copies of a body on a grid or in a pyramid."""

    count: Counts = Field(description="Copies along each of the steps, e.g. [10] or [4, 3] [1].")
    arrangement: Literal["grid", "pyramid"] = Field(
        default="grid",
        description="grid: all copies; pyramid: the last step counts the layers, and layer l holds l fewer "
        "copies along every other step.",
    )

    def _check_steps(self, steps: int) -> None:
        if steps != len(self.count):
            raise refuse(
                "step",
                f"repeat needs one step for each count, got {steps} for {len(self.count)}",
                "write e.g. count = [4, 3], step = [[1, 0], [0, 1]]",
            )
        if math.prod(self.count) > MOST_BODIES:
            raise refuse(
                "count",
                f"repeat makes {math.prod(self.count)} bodies",
                f"keep the product at or below {MOST_BODIES}",
            )
        if self.arrangement == "pyramid" and len(self.count) < 2:
            raise refuse(
                "count", "a pyramid needs at least two counts", "write count = [10, 10]: bottom row, layers"
            )


class PlanarRepeat(_Repeat):
    """Copies of a body on a grid or in a pyramid."""

    step: Annotated[list[Vector2], Field(min_length=1, max_length=3)] = Field(
        description="Displacement from one copy to the next, one vector for each count [m]."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_steps(len(self.step))
        return self


class SpatialRepeat(_Repeat):
    """Copies of a body on a grid or in a pyramid."""

    step: Annotated[list[Vector3], Field(min_length=1, max_length=3)] = Field(
        description="Displacement from one copy to the next, one vector for each count [m]."
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_steps(len(self.step))
        return self


class _Scatter(Strict):
    """Disorder from a fixed seed: the same file always gives the same scene."""

    rotation: NotNegative = Field(
        default=0.0,
        description="Largest turn [rad], drawn evenly from -rotation to rotation; in space about an axis "
        "drawn evenly from the sphere.",
    )
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = Field(
        default=0, description="Seed of the generator (numpy PCG64) [1]."
    )


class PlanarScatter(_Scatter):
    """Disorder from a fixed seed: the same file always gives the same scene."""

    position: tuple[NotNegative, NotNegative] = Field(
        default=(0.0, 0.0), description="Largest displacement along x and y, drawn evenly from -d to d [m]."
    )


class SpatialScatter(_Scatter):
    """Disorder from a fixed seed: the same file always gives the same scene."""

    position: tuple[NotNegative, NotNegative, NotNegative] = Field(
        default=(0.0, 0.0, 0.0),
        description="Largest displacement along x, y and z, drawn evenly from -d to d [m].",
    )


class BodyCommon(Strict):
    """What bodies of the plane and of space have in common."""

    name: Name = Field(
        description="Name, unique in the scene. With repeat: {i}, {j}, {k} stand for the copy's numbers, {n} "
        "for its running number, all from 0; without one of them the numbers are appended."
    )
    kind: Kind = Field(
        default="dynamic",
        description="dynamic: moved by forces; static: never moves; kinematic: keeps its given velocity.",
    )
    material: Annotated[str, Field(min_length=1, max_length=200)] | None = Field(
        default=None, description="Name of an entry of [materials]."
    )
    density: Positive | None = Field(
        default=None, description="Mass per volume [kg/m^3] in space, per area [kg/m^2] in the plane."
    )
    mass: Positive | None = Field(default=None, description="Mass [kg]; instead of density.")
    friction: NotNegative | None = Field(
        default=None, description="Friction coefficient (Coulomb) [1]; the material's, else 0.5."
    )
    rolling_friction: NotNegative | None = Field(
        default=None,
        description="Largest moment against rolling per normal force [m]; the material's, else 0.",
    )
    spinning_friction: NotNegative | None = Field(
        default=None,
        description="Largest moment about a contact's normal per normal force [m]; the material's, else 0.",
    )
    restitution: Fraction | None = Field(
        default=None, description="Coefficient of restitution, 0 to 1 [1]; the material's, else 0."
    )
    tangential_restitution: Fraction | None = Field(
        default=None, description=_TURNED.replace(" [1].", " [1]; the material's, else 0.")
    )
    linear_damping: NotNegative | None = Field(
        default=None, description="Damping of the velocity [1/s]; else 0."
    )
    angular_damping: NotNegative | None = Field(
        default=None, description="Damping of the angular velocity [1/s]; else 0."
    )
    collision_groups: Bits | None = Field(
        default=None, description="Groups that the body is in, as bits [1]; else all."
    )
    collision_mask: Bits | None = Field(
        default=None, description="Groups that the body collides with, as bits [1]; else all."
    )

    def _check_common(self, parts: dict[str, Any]) -> None:
        """Rules shared by both spaces; `parts` holds the fields whose types differ."""
        shape, mesh = parts["shape"], parts["mesh"]
        given = {key for key, value in {**parts, **_common_values(self)}.items() if value is not None}
        if shape is not None and mesh is not None:
            raise refuse("mesh", "shape and mesh are both given", "keep one of them")
        if parts["position"] is not None and parts["origin"] is not None:
            raise refuse(
                "origin",
                "position and origin are both given",
                "keep position (of the centre of mass) or origin (of the shape's own frame)",
            )
        if self.mass is not None and self.density is not None:
            raise refuse("density", "mass and density are both given", "keep one of them")
        if self.kind == "dynamic":
            self._check_dynamic(shape, mesh, parts)
        else:
            self._check_obstacle(shape, mesh, given)

    def _check_dynamic(self, shape: Any, mesh: Any, parts: dict[str, Any]) -> None:
        if shape is None and mesh is None:
            if self.mass is None:
                raise refuse(
                    "mass",
                    "a body without shape is a particle and needs its mass",
                    "give mass [kg] or a shape",
                )
            for key in ("inertia", "center_of_mass", "rotation", "angular_velocity"):
                if parts[key] is not None:
                    raise refuse(key, f"a particle (no shape) has no {key}", "remove it or give a shape")
        if mesh is not None and mesh.as_ == "static":
            raise refuse(
                "mesh.as",
                'mesh as = "static" cannot belong to a dynamic body',
                'use as = "hull" or "decomposition", or set kind = "static"',
            )
        if shape is not None and shape.type in MASSLESS:
            raise refuse(
                "shape.type",
                f"shape {shape.type!r} has no volume and so no mass",
                'set kind = "static" or choose a solid shape',
            )
        if parts["inertia"] is not None and self.mass is None:
            raise refuse("inertia", "inertia is given without mass", "give mass [kg] too")
        if parts["center_of_mass"] is not None and self.mass is None:
            raise refuse("center_of_mass", "center_of_mass is given without mass", "give mass [kg] too")

    def _check_obstacle(self, shape: Any, mesh: Any, given: set[str]) -> None:
        if shape is None and mesh is None:
            raise refuse("kind", f"a {self.kind} body needs a shape", "give shape or mesh")
        meaningless = ["mass", "density", "inertia", "center_of_mass", "linear_damping", "angular_damping"]
        if self.kind == "static":
            meaningless += ["velocity", "angular_velocity"]
        for key in meaningless:
            if key in given:
                remedy = 'remove it or set kind = "dynamic"'
                if key in ("velocity", "angular_velocity"):
                    remedy = 'remove it or set kind = "kinematic"'
                raise refuse(key, f"{key} has no meaning for a {self.kind} body", remedy)


def _common_values(body: BodyCommon) -> dict[str, Any]:
    return {key: getattr(body, key) for key in BodyCommon.model_fields}


_VARYING = ("shape", "mesh", "position", "origin", "rotation", "velocity", "angular_velocity", "inertia",
            "center_of_mass")  # fmt: skip

_ORIGIN = "Position of the shape's own origin [m]; instead of position."
_POSITION = "Position of the centre of mass [m]; the shape's origin is at the world's when both are absent."
_MESH = "A triangle mesh in a file; instead of shape. In space only."
_SHAPE = "Shape; a dynamic body without shape and mesh is a particle."


class PlanarBody(BodyCommon):
    """A body of the plane."""

    shape: PlanarShape | None = Field(default=None, description=_SHAPE)
    position: Vector2 | None = Field(default=None, description=_POSITION)
    origin: Vector2 | None = Field(default=None, description=_ORIGIN)
    rotation: PlanarRotation | None = Field(
        default=None, description="Angle, counter-clockwise [rad], or { degrees = .. }."
    )
    velocity: Vector2 | None = Field(default=None, description="Velocity of the centre of mass [m/s].")
    angular_velocity: Number | None = Field(
        default=None, description="Angular velocity, counter-clockwise [rad/s]."
    )
    inertia: Positive | None = Field(
        default=None, description="Inertia about the centre of mass [kg m^2]; with mass."
    )
    center_of_mass: Vector2 | None = Field(
        default=None, description="Centre of mass in the shape's axes [m]; with mass."
    )
    repeat: PlanarRepeat | None = Field(default=None, description="Copies on a grid or in a pyramid.")
    scatter: PlanarScatter | None = Field(default=None, description="Disorder of pose from a fixed seed.")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_common({key: getattr(self, key, None) for key in _VARYING})
        return self


class SpatialBody(BodyCommon):
    """A body of space."""

    shape: SpatialShape | None = Field(default=None, description=_SHAPE)
    mesh: MeshFile | None = Field(default=None, description=_MESH)
    position: Vector3 | None = Field(default=None, description=_POSITION)
    origin: Vector3 | None = Field(default=None, description=_ORIGIN)
    rotation: SpatialRotation | None = Field(
        default=None,
        description="Rotation to world axes: [w, x, y, z], { axis = [..], angle | degrees = .. } or "
        "{ euler_xyz_degrees = [..] }.",
    )
    velocity: Vector3 | None = Field(default=None, description="Velocity of the centre of mass [m/s].")
    angular_velocity: Vector3 | None = Field(
        default=None, description="Angular velocity, world axes [rad/s]."
    )
    inertia: tuple[Vector3, Vector3, Vector3] | None = Field(
        default=None,
        description="Inertia about the centre of mass in the shape's axes, 3 x 3 [kg m^2]; with mass.",
    )
    center_of_mass: Vector3 | None = Field(
        default=None, description="Centre of mass in the shape's axes [m]; with mass."
    )
    repeat: SpatialRepeat | None = Field(default=None, description="Copies on a grid or in a pyramid.")
    scatter: SpatialScatter | None = Field(default=None, description="Disorder of pose from a fixed seed.")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        self._check_common({key: getattr(self, key, None) for key in _VARYING})
        return self


__all__ = [
    "MOST_BODIES",
    "BodyCommon",
    "Count",
    "Kind",
    "Material",
    "MeshFile",
    "PlanarBody",
    "PlanarRepeat",
    "SpatialBody",
    "SpatialRepeat",
]
