"""Single collisions, piece by piece (theory chapter 3, items 16-19), and questions to pairs of shapes.

The five steps: `detect` the contact, `offset` of its point from each centre of mass, `effective_mass` along
the normal, `normal_impulse`, and the `linear_response` and `angular_response` to it. Each takes vectors of
the plane or of space: the number of components tells which. Normals point from b to a; `None` in the place of
b is an obstacle.

>>> from carom import collision
>>> ball = collision.Side(velocity=(0, -2), inverse_mass=1.0)
>>> m = collision.effective_mass((0, 1), ball, None)
>>> collision.normal_impulse(collision.normal_velocity((0, 1), ball, None), 0.5, m)
3.0
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from carom import _carom
from carom._adding import attributed
from carom._shapes import ShapeLike, shape_table
from carom._space import Floats, Space, frozen, number, space_of_vector
from carom.errors import refused

if TYPE_CHECKING:
    from carom._body import Body


class ContactPoint(NamedTuple):
    """One point of contact.

    Attributes
    ----------
    point : (d,) float64 array, midway between the surfaces [m]
    normal : (d,) float64 array, unit, from b to a
    gap : distance of the surfaces along the normal [m]; negative for overlap
    feature : names the point within its pair
    """

    point: Floats
    normal: Floats
    gap: float
    feature: int


class Nearest(NamedTuple):
    """Closest points of two shapes: on a and on b (d,) [m], unit normal from b to a (d,), gap [m]."""

    point_a: Floats
    point_b: Floats
    normal: Floats
    gap: float


@dataclass(frozen=True)
class Side:
    """One body of a collision.

    Attributes
    ----------
    arm : (d,) contact point from the centre of mass [m]
    velocity : (d,) of the centre of mass [m/s]
    angular_velocity : float | (3,), world axes [rad/s]
    inverse_mass : [1/kg]; 0 for an obstacle
    inverse_inertia : float | (3, 3), world axes [1/(kg m^2)]; 0 for an obstacle and for a particle

    What is left out is zero.
    """

    arm: Any = None
    velocity: Any = None
    angular_velocity: Any = None
    inverse_mass: float = 0.0
    inverse_inertia: Any = None

    @classmethod
    def of(cls, body: Body, point: Any) -> Self:
        """The side that a body of a world takes in a contact at a world point [m]."""
        arm = np.asarray(point, dtype=np.float64) - body.position
        velocity, spin = body.velocity, body.angular_velocity
        if body.kind != "dynamic":
            return cls(arm, velocity, spin)
        inertia = body.inertia
        if body._space.is_planar:
            return cls(arm, velocity, spin, 1.0 / body.mass, 1.0 / inertia if inertia else 0.0)
        if not np.any(inertia):
            return cls(arm, velocity, spin, 1.0 / body.mass)
        centre = body.position
        turn = np.array([body.to_world(axis) - centre for axis in np.eye(3)]).T
        return cls(arm, velocity, spin, 1.0 / body.mass, turn @ np.linalg.inv(inertia) @ turn.T)

    def _plain(
        self, space: Space, name: str
    ) -> tuple[list[float], list[float], list[float], float, list[float]]:
        still, no_spin = [0.0] * space.dimension, [0.0] * space.spins
        inverse = number(self.inverse_mass, f"{name}.inverse_mass", "1/kg")
        if not (inverse >= 0 and math.isfinite(inverse)):
            raise refused(
                None, f"{name}.inverse_mass", "must be finite and >= 0", inverse, "give 1/mass in 1/kg"
            )
        zero = [0.0] if space.is_planar else [0.0] * 6
        inertia = self.inverse_inertia
        return (
            still if self.arm is None else space.vector(self.arm, f"{name}.arm", "m"),
            still if self.velocity is None else space.vector(self.velocity, f"{name}.velocity", "m/s"),
            no_spin
            if self.angular_velocity is None
            else space.spin(self.angular_velocity, f"{name}.angular_velocity", "rad/s"),
            inverse,
            zero if inertia is None else space.inertia(inertia, f"{name}.inverse_inertia"),
        )


#: A position (d,), or a pair (position, rotation).
Pose = Any
PlainPose = tuple[list[float], list[float]]


def _space_of(pose: Pose, field: str) -> tuple[Space, PlainPose]:
    """Space and plain form of a pose: (x, y), ((x, y), angle), (x, y, z), ((x, y, z), quaternion)."""
    has_rotation = isinstance(pose, (tuple, list)) and len(pose) == 2 and np.ndim(pose[0]) == 1
    position, rotation = pose if has_rotation else (pose, None)
    space = space_of_vector(position, field)
    place = space.vector(position, field, "m")
    still = [1.0] + [0.0] * (space.turns - 1)
    return space, (place, still if rotation is None else space.rotation(rotation, f"{field}.rotation"))


def _pair(
    shape_a: ShapeLike, pose_a: Pose, shape_b: ShapeLike, pose_b: Pose
) -> tuple[Space, tuple[str, PlainPose, str, PlainPose]]:
    (space, plain_a), (other, plain_b) = _space_of(pose_a, "pose_a"), _space_of(pose_b, "pose_b")
    if space is not other:
        raise refused(
            None,
            "pose_b",
            "must be of the same space as pose_a",
            pose_b,
            "give both in 2 or both in 3 numbers",
        )
    shapes = ((shape_a, "shape_a"), (shape_b, "shape_b"))
    texts = [json.dumps(shape_table(shape, space, path=path)) for shape, path in shapes]
    return space, (texts[0], plain_a, texts[1], plain_b)


def detect(
    shape_a: ShapeLike, pose_a: Pose, shape_b: ShapeLike, pose_b: Pose, margin: float = 0.0
) -> list[ContactPoint]:
    """Contact points of two posed shapes whose gap is at most `margin` [m] (item 19).

    Parameters
    ----------
    shape_a, shape_b : shapes, or plain tables of them
    pose_a, pose_b : position (d,) [m], or (position, rotation) with an angle [rad] | quaternion [w, x, y, z]

    Raises
    ------
    BuildError
        Naming the field of a shape or pose.
    """
    space, arguments = _pair(shape_a, pose_a, shape_b, pose_b)
    reach = number(margin, "margin", "m")
    features, points, normals, gaps = space.pieces.contacts(*arguments, reach)
    rows = zip(
        points.reshape(-1, space.dimension), normals.reshape(-1, space.dimension), gaps, features, strict=True
    )
    return [
        ContactPoint(frozen(point), frozen(normal), float(gap), feature)
        for point, normal, gap, feature in rows
    ]


def nearest(
    shape_a: ShapeLike, pose_a: Pose, shape_b: ShapeLike, pose_b: Pose, reach: float = math.inf
) -> Nearest | None:
    """Closest points of two posed shapes, None when they are further apart than `reach` [m].

    Arguments and errors as for `detect`.
    """
    space, arguments = _pair(shape_a, pose_a, shape_b, pose_b)
    found = space.pieces.closest(*arguments, number(reach, "reach", "m"))
    if found is None:
        return None
    point_a, point_b, normal, gap = found
    return Nearest(frozen(np.array(point_a)), frozen(np.array(point_b)), frozen(np.array(normal)), gap)


def raycast(
    shape: ShapeLike, pose: Pose, origins: Any, directions: Any, reach: float = math.inf
) -> tuple[Floats, Floats]:
    """First hits of rays with a posed shape.

    Parameters
    ----------
    origins, directions : (m, d) or (d,); directions of any length [m]
    reach : longest distance to look for [m]

    Returns
    -------
    distances (m,) float64 array [m], inf without a hit; outward normals (m, d) float64 array, 0 without a hit

    Raises
    ------
    BuildError
        Naming the field; a direction must not have length 0.
    """
    space, plain = _space_of(pose, "pose")
    table = shape_table(shape, space)
    start = np.atleast_2d(np.asarray(origins, dtype=np.float64))
    way = np.atleast_2d(np.asarray(directions, dtype=np.float64))
    for field, array in (("origins", start), ("directions", way)):
        if array.ndim != 2 or array.shape[1] != space.dimension or not np.isfinite(array).all():
            raise refused(
                None, field, f"must be finite (m, {space.dimension}) numbers", array, "give a row per ray"
            )
    start, way = np.broadcast_arrays(start, way)
    length = np.linalg.norm(way, axis=1, keepdims=True)
    if not (length > 0).all():
        raise refused(
            None, "directions", "must not have length 0", directions, "give a direction for each ray"
        )
    with attributed({"shape": table}):
        distances, normals = space.pieces.raycast(
            json.dumps(table),
            plain,
            start.ravel(),
            (way / length).ravel(),
            number(reach, "reach", "m"),
        )
    return distances, normals.reshape(-1, space.dimension)


def offset(point: Any, center: Any) -> Floats:
    """Step 2: offset r = x - x_c of a contact point from a centre of mass, (d,) float64 array [m]."""
    space = space_of_vector(point, "point")
    return frozen(
        np.array(space.pieces.offset(space.vector(point, "point", "m"), space.vector(center, "center", "m")))
    )


def normal_velocity(normal: Any, a: Side, b: Side | None) -> float:
    """Velocity of a's point relative to b's along the unit normal [m/s]; < 0 when they approach."""
    space, along = _direction(normal, "normal")
    return space.pieces.normal_velocity(along, a._plain(space, "a"), (b or Side())._plain(space, "b"))


def effective_mass(direction: Any, a: Side, b: Side | None) -> float:
    """Step 3: effective mass along a unit direction [kg]; inf when neither side can move.

    1/m = 1/m_a + 1/m_b + (r_a x n)^T I_a^-1 (r_a x n) + (r_b x n)^T I_b^-1 (r_b x n)
    """
    space, along = _direction(direction, "direction")
    return space.pieces.effective_mass(along, a._plain(space, "a"), (b or Side())._plain(space, "b"))


def normal_impulse(normal_velocity: float, restitution: float, effective_mass: float) -> float:
    """Step 3: gamma = -(1 + e) m u_n [N s], and 0 when nothing approaches."""
    return _carom.normal_impulse(
        number(normal_velocity, "normal_velocity", "m/s"),
        _coefficient(restitution),
        number(effective_mass, "effective_mass", "kg"),
    )


def linear_response(side: Side, impulse: Any) -> Floats:
    """Step 4: velocity after an impulse [N s], v + m^-1 j: (d,) float64 array [m/s]."""
    return apply_impulse(side, impulse)[0]


def angular_response(side: Side, impulse: Any) -> Any:
    """Step 5: angular velocity after an impulse [N s], w + I^-1 (r x j): float | (3,) array [rad/s]."""
    return apply_impulse(side, impulse)[1]


def apply_impulse(side: Side, impulse: Any) -> tuple[Floats, Any]:
    """Steps 4 and 5 (item 16): velocity (d,) [m/s] and angular velocity float | (3,) [rad/s]."""
    space = space_of_vector(impulse, "impulse")
    velocity, spin = space.pieces.respond(side._plain(space, "side"), space.vector(impulse, "impulse", "N s"))
    return frozen(np.array(velocity)), space.plain_spin(spin)


class Collided(NamedTuple):
    """What a collision did: velocities of a and of b after it [m/s], [rad/s], impulse [N s] on a."""

    velocity_a: Floats
    angular_velocity_a: Any
    velocity_b: Floats
    angular_velocity_b: Any
    impulse: float


def collide(a: Side, b: Side | None, normal: Any, restitution: float) -> Collided:
    """Steps 2 to 5 for one frictionless collision along a unit normal from b to a."""
    space, along = _direction(normal, "normal")
    sides = a._plain(space, "a"), (b or Side())._plain(space, "b")
    (va, wa), (vb, wb), gamma = space.pieces.collide(*sides, along, _coefficient(restitution))
    return Collided(
        frozen(np.array(va)), space.plain_spin(wa), frozen(np.array(vb)), space.plain_spin(wb), gamma
    )  # fmt: skip


def energy_lost(normal_velocity: float, restitution: float, effective_mass: float) -> float:
    """Kinetic energy that a frictionless collision takes, 1/2 m (1 - e^2) u_n^2 [J]."""
    return _carom.energy_lost(
        number(normal_velocity, "normal_velocity", "m/s"),
        _coefficient(restitution),
        number(effective_mass, "effective_mass", "kg"),
    )


def _coefficient(restitution: float) -> float:
    found = number(restitution, "restitution", "[0, 1]")
    if not 0 <= found <= 1:
        raise refused(None, "restitution", "must be in [0, 1]", found, "give a coefficient in [0, 1]")
    return found


def _direction(value: Any, field: str) -> tuple[Space, list[float]]:
    """A unit vector; a direction of another length would scale the masses, so it is refused."""
    space = space_of_vector(value, field)
    along = space.vector(value, field, "length 1")
    if abs(math.hypot(*along) - 1.0) > 1e-9:
        raise refused(None, field, "must have length 1", value, "divide it by its length")
    return space, along
