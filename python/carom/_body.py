"""One body of a world, by name.

A body holds no state: everything is read from the world when asked for, as copies that cannot be written
into. Arrays over all bodies at once (``w.position``) are faster where many bodies are wanted. Items are those
of theory chapter 1.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from carom._report import KineticEnergy, MassProperties
from carom._shapes import Shape, shape_from_json
from carom._space import Floats, Space, frozen
from carom.errors import BuildError

if TYPE_CHECKING:
    from carom._world import World

POSITION, ROTATION, VELOCITY, ANGULAR_VELOCITY = range(4)


class Body:
    """A body of a world. ``w["egg"]`` makes one; it serves as an index too: ``run.position[:, w["egg"]]``."""

    __slots__ = ("_name", "_world")

    def __init__(self, world: World, name: str) -> None:
        self._world = world
        self._name = name

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    @property
    def world(self) -> World:
        """The world it belongs to."""
        return self._world

    @property
    def _native(self) -> Any:
        return self._world._native

    @property
    def _space(self) -> Space:
        return self._world._space

    @property
    def index(self) -> int:
        """Its row in arrays over all bodies; falls when a body before it is removed."""
        return int(self._native.index(self._name))

    def __index__(self) -> int:
        return self.index

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Body) and other._world is self._world and other._name == self._name

    def __hash__(self) -> int:
        return hash((id(self._world), self._name))

    def _constant(self, key: str) -> Any:
        return self._native.constants(self._name)[key]

    @property
    def kind(self) -> str:
        """ "dynamic", "static" or "kinematic"."""
        return str(self._constant("kind"))

    @property
    def asleep(self) -> bool:
        """Whether it sleeps: see the setting `soft`. `World.wake` wakes its island."""
        return bool(self._native.asleep()[self.index])

    @property
    def shape(self) -> Shape | None:
        """Its shape, None for a particle that touches nothing."""
        text = self._constant("shape")
        return None if text is None else shape_from_json(text, self._space)

    @property
    def shape_text(self) -> str | None:
        """Its shape as JSON text, as run files keep it; None for a particle."""
        text: str | None = self._constant("shape")
        return text

    @property
    def friction(self) -> float:
        """Coefficient of friction [1]."""
        return float(self._constant("friction"))

    @property
    def rolling_friction(self) -> float:
        """Largest moment against rolling per normal force [m]."""
        return float(self._constant("rolling_friction"))

    @property
    def spinning_friction(self) -> float:
        """Largest moment about a contact's normal per normal force [m]; without effect in the plane."""
        return float(self._constant("spinning_friction"))

    @property
    def restitution(self) -> float:
        """Coefficient of restitution [1]."""
        return float(self._constant("restitution"))

    @property
    def tangential_restitution(self) -> float:
        """Share of the slip that a bounce turns round, as far as friction reaches [1]."""
        return float(self._constant("tangential_restitution"))

    @property
    def extent(self) -> float:
        """Largest extent of the shape [m]; 0 without a shape, inf for half-planes and half-spaces."""
        return float(self._constant("extent"))

    @property
    def material(self) -> str | None:
        """Name of its material, by which `World.set_pair` tells pairs apart."""
        found: str | None = self._constant("material")
        return found

    @property
    def linear_damping(self) -> float:
        """Rate at which the velocity decays [1/s]."""
        return float(self._constant("linear_damping"))

    @property
    def angular_damping(self) -> float:
        """Rate at which the angular velocity decays [1/s]."""
        return float(self._constant("angular_damping"))

    @property
    def collision_groups(self) -> int:
        """Groups it belongs to, as bits."""
        return int(self._constant("collision_groups"))

    @property
    def collision_mask(self) -> int:
        """Groups it collides with, as bits."""
        return int(self._constant("collision_mask"))

    @property
    def position(self) -> Floats:
        """(d,) float64 array, centre of mass [m]; assign to move the body."""
        return frozen(self._native.read(self._name, POSITION))

    @position.setter
    def position(self, value: Any) -> None:
        numbers = self._space.vector(value, "position", "m", self._name)
        self._native.write(self._name, POSITION, numbers)

    @property
    def rotation(self) -> Floats:
        """[cos, sin] | quaternion [w, x, y, z], body axes to world axes; an angle [rad] can be assigned."""
        return frozen(self._native.read(self._name, ROTATION))

    @rotation.setter
    def rotation(self, value: Any) -> None:
        numbers = self._space.rotation(value, "rotation", self._name)
        self._native.write(self._name, ROTATION, numbers)

    @property
    def angle(self) -> float:
        """Angle in (-pi, pi] [rad]; in the plane only."""
        if not self._space.is_planar:
            raise AttributeError(
                f"body {self._name!r}: space has no single angle; use rotation, a quaternion"
            )
        cosine, sine = self.rotation
        return math.atan2(sine, cosine)

    @property
    def velocity(self) -> Floats:
        """(d,) float64 array, velocity of the centre of mass [m/s]; can be assigned."""
        return frozen(self._native.read(self._name, VELOCITY))

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self._refuse_if_static("velocity", value)
        self._native.write(self._name, VELOCITY, self._space.vector(value, "velocity", "m/s", self._name))

    @property
    def angular_velocity(self) -> Any:
        """A float | (3,) float64 array, world axes [rad/s]; can be assigned."""
        return self._space.plain_spin(self._native.read(self._name, ANGULAR_VELOCITY))

    @angular_velocity.setter
    def angular_velocity(self, value: Any) -> None:
        self._refuse_if_static("angular_velocity", value)
        numbers = self._space.spin(value, "angular_velocity", "rad/s", self._name)
        self._native.write(self._name, ANGULAR_VELOCITY, numbers)

    def _refuse_if_static(self, field: str, value: Any) -> None:
        if self.kind == "static":
            remedy = "add it with add_kinematic to let it move"
            raise BuildError(
                f"body {self._name!r}: {field} of a static body cannot be set; {remedy}",
                body=self._name, field=field, value=value, remedy=remedy,
            )  # fmt: skip

    @property
    def mass(self) -> float:
        """Mass [kg]; inf for bodies that forces do not move."""
        return self.mass_properties.mass

    @property
    def inertia(self) -> Any:
        """A float | (3, 3) float64 array about the centre of mass, shape axes [kg m^2]; as for mass, 0 for
        particles.
        """
        return self.mass_properties.inertia

    @property
    def mass_properties(self) -> MassProperties:
        """Mass, centre of mass, inertia, and the error of a density function's quadrature."""
        constants = self._native.constants(self._name)
        mass, center, entries, error = constants["mass_properties"]
        if constants["kind"] != "dynamic":
            mass = math.inf
            entries = [math.inf] * self._space.spins + [0.0] * (len(entries) - self._space.spins)
        return MassProperties(mass, frozen(np.array(center)), self._space.full_inertia(entries), error)

    @property
    def kinetic_energy(self) -> KineticEnergy:
        """Translational and rotational part, and total [J] (item 9); 0 for bodies that forces do not move."""
        return KineticEnergy(*self._native.carried(self._name)[:2])

    @property
    def momentum(self) -> Floats:
        """(d,) float64 array, m v [kg m/s]."""
        return frozen(np.array(self._native.carried(self._name)[2]))

    @property
    def spin_momentum(self) -> Any:
        """Angular momentum about the centre of mass, I w, a float | (3,) float64 array [kg m^2/s]."""
        return self._space.plain_spin(self._native.carried(self._name)[3])

    @property
    def angular_momentum(self) -> Any:
        """Angular momentum about the world's origin, x x p + I w, a float | (3,) float64 array [kg m^2/s]."""
        return self._space.plain_spin(self._native.carried(self._name)[4])

    def set_momenta(self, momentum: Any, spin_momentum: Any) -> None:
        """Sets the velocities from the state's other form (item 8): v = p/m, w = I^-1 L.

        Parameters
        ----------
        momentum : (d,) [kg m/s]
        spin_momentum : float | (3,), about the centre of mass [kg m^2/s]

        Raises
        ------
        BuildError
            For wrong counts, and for bodies that forces do not move.
        """
        linear = self._space.vector(momentum, "momentum", "kg m/s", self._name)
        angular = self._space.spin(spin_momentum, "spin_momentum", "kg m^2/s", self._name)
        self._native.set_momenta(self._name, linear, angular)

    def inertia_about(self, axis: Any = 1.0, point: Any = None) -> float:
        """Inertia about a world axis through a world point, by Steiner's rule (item 13) [kg m^2].

        Parameters
        ----------
        axis : (3,), any length; in the plane there is only one, and it can be left out
        point : (d,) on the axis [m]; the centre of mass when absent
        """
        numbers = self._space.spin(axis, "axis", "any unit", self._name)
        if not any(numbers):
            raise BuildError(
                f"body {self._name!r}: axis must not have length 0, got {numbers}; give a direction",
                body=self._name, field="axis", value=axis, remedy="give a direction",
            )  # fmt: skip
        return float(self._native.inertia_about(self._name, numbers, self._point(point, "point")))

    def velocity_at(self, point: Any) -> Floats:
        """Velocity of the body's point at a world point [m], v + w x r: (d,) float64 array [m/s] (item 4)."""
        numbers = self._space.vector(point, "point", "m", self._name)
        return frozen(self._native.velocity_at(self._name, numbers))

    def to_world(self, point: Any) -> Floats:
        """World coordinates of a point in body axes from the centre of mass, x + R r: (d,) array [m]."""
        return frozen(self._native.to_world(self._name, self._space.vector(point, "point", "m", self._name)))

    def to_body(self, point: Any) -> Floats:
        """The inverse of `to_world`, R^T (r - x): (d,) float64 array [m]."""
        return frozen(self._native.to_body(self._name, self._space.vector(point, "point", "m", self._name)))

    def apply_force(self, force: Any, at: Any = None) -> None:
        """Applies a force during the next step alone (items 14-15).

        Parameters
        ----------
        force : (d,) world axes [N]
        at : (d,) world point where it acts [m]; the centre of mass when absent

        Raises
        ------
        BuildError
            For wrong counts, numbers that are not finite, and bodies that forces do not move.
        """
        numbers = self._space.vector(force, "force", "N", self._name)
        torque = [0.0] * self._space.spins
        self._native.apply_wrench(self._name, numbers, torque, self._point(at, "at"))

    def apply_torque(self, torque: Any) -> None:
        """Applies a torque, a float | (3,) [N m], during the next step alone; raises as `apply_force`."""
        numbers = self._space.spin(torque, "torque", "N m", self._name)
        self._native.apply_wrench(self._name, [0.0] * self._space.dimension, numbers, None)

    def apply_impulse(self, impulse: Any, at: Any = None) -> None:
        """Changes the velocities at once (item 16): v + j/m, w + I^-1 (r x j); raises as `apply_force`.

        Parameters
        ----------
        impulse : (d,) world axes [N s]
        at : (d,) world point where it acts [m]; the centre of mass when absent
        """
        numbers = self._space.vector(impulse, "impulse", "N s", self._name)
        self._native.apply_impulse(self._name, numbers, self._point(at, "at"))

    def _point(self, value: Any, field: str) -> list[float] | None:
        return None if value is None else self._space.vector(value, field, "m", self._name)

    def __repr__(self) -> str:
        kind = self.kind
        mass = f", mass {self.mass:.6g} kg" if kind == "dynamic" else ""
        shape = self.shape
        label = "particle" if shape is None else shape.type
        at, moving = self.position.tolist(), self.velocity.tolist()
        return (
            f"<{kind} body {self._name!r}: {label}{mass}, position {_row(at)} m, velocity {_row(moving)} m/s>"
        )


def _row(values: list[float]) -> str:
    return f"({', '.join(f'{value:.6g}' for value in values)})"
