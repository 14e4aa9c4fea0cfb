"""One joint of a world, by name, and what users say of a new one.

A joint holds no state: everything is read from the world when asked for. Anchors, lengths and combinations
are checked by the engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carom._space import Floats, Space, frozen, number
from carom.errors import refused

if TYPE_CHECKING:
    from carom._world import World


class Reaction(NamedTuple):
    """What body a of a joint got from b in a step; b got the opposite. World axes, torques about the anchor.

    Attributes
    ----------
    force, torque : (d,) [N], float | (3,) [N m]; means over the step without its impacts
    impact, impact_moment : (d,) [N s], float | (3,) [N m s]; impulses of the step's impacts
    """

    force: Floats
    torque: Any
    impact: Floats
    impact_moment: Any

    @classmethod
    def _of(cls, plain: tuple[Any, ...], space: Space) -> Reaction:
        _, force, torque, impact, moment = plain
        vector = [frozen(np.array(part)) for part in (force, impact)]
        return cls(vector[0], space.plain_spin(torque), vector[1], space.plain_spin(moment))


def reactions_of(told: list[tuple[Any, ...]], space: Space) -> dict[str, Reaction]:
    """Reactions by the joints' names."""
    return {plain[0]: Reaction._of(plain, space) for plain in told}


class Joint:
    """A joint of a world. ``w.joints["hinge"]`` makes one."""

    __slots__ = ("_name", "_world")

    def __init__(self, world: World, name: str) -> None:
        self._world = world
        self._name = name

    def _read(self) -> dict[str, Any]:
        found: dict[str, Any] = self._world._native.joint(self._name)
        return found

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    @property
    def kind(self) -> str:
        """ "point", "distance" or "fixed"."""
        return str(self._read()["kind"])

    @property
    def bodies(self) -> tuple[str, str | None]:
        """Names of its bodies a and b; None for the world itself."""
        read = self._read()
        return read["a"], read["b"]

    @property
    def length(self) -> float | None:
        """Length of a distance joint [m], None for others."""
        read = self._read()
        return float(read["length"]) if read["kind"] == "distance" else None

    @property
    def collide(self) -> bool:
        """Whether its bodies collide with each other."""
        return bool(self._read()["collide"])

    @property
    def places(self) -> tuple[Floats, Floats]:
        """(d,) float64 arrays, where its anchors on a and on b are now [m]."""
        read = self._read()
        return frozen(np.array(read["place_a"])), frozen(np.array(read["place_b"]))

    @property
    def error(self) -> float:
        """Largest number of its constraint function now [m]; angles times about the radius of gyration."""
        return float(self._read()["error"])

    @property
    def reaction(self) -> Reaction:
        """What a got from b in the last step; zeros before the first."""
        return Reaction._of(self._read()["reaction"], self._world._space)

    def __repr__(self) -> str:
        a, b = self.bodies
        return f"<{self.kind} joint {self._name!r} of {a!r} and {'the world' if b is None else repr(b)}>"


def joint_arguments(given: Mapping[str, Any], space: Space) -> dict[str, Any]:
    """The engine's arguments of a new joint.

    Raises
    ------
    BuildError
        For what is no text, no point or no number.
    """
    for field in ("name", "a", "b"):
        value = given[field]
        if not isinstance(value, str) and not (field == "b" and value is None):
            raise refused(None, field, "must be a name", value, "give the name of a joint or of a body")
    arguments = {key: given[key] for key in ("kind", "a", "b")} | {"collide": bool(given["collide"])}
    point = given.get("point")
    for side in ("anchor_a", "anchor_b"):
        value = given[side]
        if point is not None and value is not None:
            raise refused(None, side, "must not be given beside point", value, "give point or anchors")
        if point is not None:
            arguments[side] = ("world", space.vector(point, "point", "m"))
        elif value is not None:
            form = "world" if side == "anchor_b" and given["b"] is None else "body"
            arguments[side] = (form, space.vector(value, side, "m"))
        else:
            arguments[side] = None
    length = given.get("length")
    arguments["length"] = None if length is None else number(length, "length", "m")
    return arguments
