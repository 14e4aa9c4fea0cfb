"""Gradients of rollouts: derivatives of any function of the states by all that the rollout was given.

>>> import numpy as np
>>> from carom import gradient, planar
>>> w = planar.World(dt=0.1, scheme="events", friction_mixing="min")
>>> floor = w.add_static("floor", planar.HalfPlane(), friction=1.0)
>>> block = w.add_body("block", planar.Box(0.4, 0.2), density=20.0, friction=0.4,
...                    position=(0, 0.1), velocity=(2, 0))
>>> rollout = gradient.record(w, steps=8)
>>> seed = np.zeros((2, 2))
>>> seed[1, 0] = 1.0                      # the block's x at the end
>>> found = rollout.pullback({"position": seed}, at=-1)
>>> bool(abs(found["friction"][1] + 2.0**2 / (2 * 0.4**2 * 9.81)) < 1e-9)   # -v^2 / (2 mu^2 g)
True

Reverse mode through the scheme ``events`` (theory chapter 10): each flow and impact is differentiated on the
contacts that were found to act, each moment of an impact or of a stop by the equation that makes it. Arrays
in, arrays out, so that any framework can call it. Knows no framework.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from carom._space import Floats, Space, frozen, number, whole
from carom.errors import refused, unknown

if TYPE_CHECKING:
    from carom._world import World

__all__ = ["Flag", "Rollout", "record"]

#: Fields of a state.
_STATE = ("position", "rotation", "velocity", "angular_velocity")


@dataclass(frozen=True)
class Flag:
    """A step whose contact set is on an edge, where a derivative is that of one side or of a choice.

    Attributes
    ----------
    step : counted from 0
    bodies : names of the bodies concerned
    reason : "weightless", "on_cone", "indeterminate", "simultaneous", "grazing", "rest_cut", "projected",
        "cut_short" or "law"
    text : what it means, in words
    """

    step: int
    bodies: tuple[str, ...]
    reason: str
    text: str

    def __str__(self) -> str:
        """The flag in words."""
        names = ", ".join(repr(name) for name in self.bodies)
        return f"step {self.step}: {names}: {self.text}"


class Rollout:
    """Recorded steps of a world, ready to be differentiated; made by `record`.

    Attributes
    ----------
    names : of the bodies, in the order of all arrays
    steps : steps taken [1]
    stretch : steps between snapshots [1]; on the way back each stretch is taken again, bit for bit the same
    position : (steps + 1, n, d) centres of mass [m], the state before the first step included
    rotation : (steps + 1, n, 2 | 4) [cos, sin] | [w, x, y, z]
    velocity : (steps + 1, n, d) [m/s]
    angular_velocity : (steps + 1, n, 1 | 3) [rad/s], world axes
    flags : steps whose contact set is on an edge; empty where there is none
    """

    def __init__(self, native: Any, space: Space, names: tuple[str, ...], steps: int) -> None:
        """What the engine recorded; `record` calls this."""
        self._native = native
        self._space = space
        self.names = names
        self.steps = steps
        self.stretch: int = native.stretch()
        states = native.states()
        for field in _STATE:
            shape = (steps + 1, len(names), self._width(field))
            setattr(self, field, frozen(np.reshape(states[field], shape)))
        self.flags = tuple(
            Flag(step, tuple(bodies), reason, text) for step, bodies, reason, text in native.flags()
        )

    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats

    def _width(self, field: str) -> int:
        space = self._space
        widths = {"rotation": space.turns, "rotation_vector": space.spins, "angular_velocity": space.spins}
        return widths.get(field, space.dimension)

    def __repr__(self) -> str:
        """Steps, bodies and how many steps are flagged."""
        flagged = f", {len(self.flags)} flagged" if self.flags else ""
        return f"<Rollout {self.steps} steps of {len(self.names)} bodies{flagged}>"

    def pullback(self, cotangents: Mapping[str, npt.ArrayLike], at: int | None = None) -> dict[str, Any]:
        """The vector-Jacobian product: derivatives of the number sum(cotangents * states) by all inputs.

        Parameters
        ----------
        cotangents : arrays by field: "position", "rotation" (by the stored numbers), "rotation_vector" (by
            small rotation vectors in world axes [1/rad]), "velocity", "angular_velocity", each in the shape
            of the states' field, (steps + 1, n, ...); fields left out are zero
        at : index of one state; arrays are then (n, ...). -1 is the last, 0 the one before the first step

        Returns
        -------
        dict of float64 arrays: "position" (n, d), "rotation_vector" (n, 1 | 3), "velocity" (n, d) and
        "angular_velocity" (n, 1 | 3) of the initial state; "mass" (n,), the inertia in proportion, which is
        by the density; "inertia" (n,), by a factor on the inertia alone; "friction" (n,) and "restitution"
        (n,) of the bodies, through the mixing rule; "gravity" (d,); "forces" (steps, n, d); "torques"
        (steps, n, 1 | 3); and "pairs", by entries of the materials' table:
        {(material, material): (by friction, by restitution)}.

        Raises
        ------
        BuildError
            For a field that there is not, a shape that does not fit, or numbers that are not finite.

        Notes
        -----
        Implicit function theorem on the active set of contacts, reverse mode from snapshots (theory eqs. 10.2
        to 10.7). Where `flags` is not empty a derivative there is that of one side or of a choice.
        """
        known = ["position", "rotation", "rotation_vector", "velocity", "angular_velocity"]
        for field in cotangents:
            if field not in known:
                raise unknown("cotangent", str(field), known)
        lead = (self.steps + 1,) if at is None else ()
        arrays = {f: self._cotangent(f, cotangents.get(f), lead) for f in known}
        if at is None:
            states = [k for k in range(self.steps + 1) if any(a[k].any() for a in arrays.values())]
            given = [(k, [arrays[f][k].ravel() for f in known]) for k in states]
        else:
            state = whole(at, "at", f"give a state from {-self.steps - 1} to {self.steps}")
            if not -self.steps - 1 <= state <= self.steps:
                remedy = f"give a state from {-self.steps - 1} to {self.steps}"
                raise refused(None, "at", "must be a state of the rollout", at, remedy)
            given = [(state % (self.steps + 1), [arrays[f].ravel() for f in known])]
        return self._shaped(self._native.pullback(given))

    def _cotangent(self, field: str, value: Any, lead: tuple[int, ...]) -> Floats:
        shape = (*lead, len(self.names), self._width(field))
        if value is None:
            return np.zeros(shape)
        return _array(value, f"cotangents[{field!r}]", shape)

    def _shaped(self, plain: dict[str, Any]) -> dict[str, Any]:
        count, spins, dimension = len(self.names), self._space.spins, self._space.dimension
        shapes: dict[str, tuple[int, ...]] = {
            "position": (count, dimension),
            "rotation": (count, spins),
            "velocity": (count, dimension),
            "angular_velocity": (count, spins),
            "forces": (self.steps, count, dimension),
            "torques": (self.steps, count, spins),
        }
        out: dict[str, Any] = {}
        for name, values in plain.items():
            if name == "pairs":
                out[name] = {(one, other): (mu, e) for one, other, mu, e in values}
            else:
                out["rotation_vector" if name == "rotation" else name] = np.reshape(
                    values, shapes.get(name, np.shape(values))
                )
        return out


def record(
    world: World,
    steps: int,
    dt: float | None = None,
    *,
    forces: npt.ArrayLike | None = None,
    torques: npt.ArrayLike | None = None,
    initial: Mapping[str, npt.ArrayLike] | None = None,
    stretch: int | None = None,
) -> Rollout:
    """Takes steps from a world's present state and records them; the world itself stays as it is.

    Parameters
    ----------
    world : with ``scheme="events"``
    steps : [1]
    dt : length of a step [s]; the world's when absent
    forces : (steps, n, d) on the centres of mass [N], constant through each step
    torques : (steps, n, 1 | 3) | (steps, n) in the plane [N m], world axes
    initial : arrays in place of the world's state: any of "position" (n, d), "rotation" (n, 2 | 4),
        "velocity" (n, d), "angular_velocity" (n, 1 | 3)
    stretch : steps between snapshots; the square root of the steps, which needs least memory, when absent

    Raises
    ------
    BuildError
        For another scheme, force fields, rolling or spinning friction, box friction in space, forces waiting
        for the next step, and arrays that do not fit.
    StepError
        When a step fails.
    """
    space: Space = world._space
    count = whole(steps, "steps", "give how many steps to record")
    if count < 0:
        raise refused(None, "steps", "must be >= 0", steps, "give how many steps to record")
    if stretch is not None and whole(stretch, "stretch", "give steps between snapshots") < 1:
        raise refused(None, "stretch", "must be >= 1", stretch, "give steps between snapshots")
    length = None if dt is None else number(dt, "dt", "s")
    names = world.names
    loads = np.zeros(0)
    if forces is not None or torques is not None:
        pushes = np.zeros((count, len(names), space.dimension))
        turns = np.zeros((count, len(names), space.spins))
        if forces is not None:
            pushes = _array(forces, "forces", pushes.shape)
        if torques is not None:
            given = np.asarray(torques, dtype=np.float64)
            turns = _array(
                given[..., None] if space.is_planar and given.ndim == 2 else given, "torques", turns.shape
            )
        loads = np.concatenate([pushes, turns], axis=2).ravel()
    native = (world if initial is None else _started(world, initial))._native
    return Rollout(native.record(count, length, loads, stretch), space, names, count)


def _started(world: World, initial: Mapping[str, npt.ArrayLike]) -> World:
    """A copy of a world with another state."""
    for field in initial:
        if field not in _STATE:
            raise unknown("field of a state", str(field), list(_STATE))
    other = copy.deepcopy(world)
    for field, value in initial.items():
        setattr(other, field, _array(value, f"initial[{field!r}]", getattr(other, field).shape))
    return other


def _array(value: Any, field: str, shape: tuple[int, ...]) -> Floats:
    """A finite array of a given shape."""
    remedy = f"give an array of shape {shape}"
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise refused(None, field, "must be numbers", value, remedy) from None
    if array.shape != shape:
        raise refused(None, field, f"must have shape {shape}", array.shape, remedy)
    if not np.isfinite(array).all():
        raise refused(None, field, "must be finite", value, remedy)
    return np.ascontiguousarray(array)
