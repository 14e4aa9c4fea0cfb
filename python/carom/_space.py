"""What differs between the plane and space, and how users' numbers become the engine's.

Every conversion names the field and what to give instead; numbers that the engine itself judges (sizes,
masses, coefficients) are passed on as they are. Knows no worlds.
"""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom.errors import refused

Floats = npt.NDArray[np.float64]
Records = npt.NDArray[np.void]


@dataclass(frozen=True)
class Space:
    """The plane or space.

    Attributes
    ----------
    name : "planar" or "spatial"
    dimension : numbers in a position, 2 | 3
    spins : numbers in an angular velocity, 1 | 3
    turns : numbers that store a rotation, 2 | 4
    axes : for messages, "(x, y)" | "(x, y, z)"
    """

    name: str
    dimension: int
    spins: int
    turns: int
    axes: str
    world: type[_carom.PlanarWorld] | type[_carom.SpatialWorld]
    problem: type[_carom.PlanarProblem] | type[_carom.SpatialProblem]
    pieces: type[_carom.PlanarPieces] | type[_carom.SpatialPieces]

    @property
    def is_planar(self) -> bool:
        """Whether this is the plane."""
        return self.dimension == 2

    def vector(self, value: Any, field: str, unit: str, body: str | None = None) -> list[float]:
        """As many finite numbers as the space has dimensions."""
        remedy = f"give {self.axes} in {unit}"
        return _numbers(value, self.dimension, field, remedy, body)

    def spin(self, value: Any, field: str, unit: str, body: str | None = None) -> list[float]:
        """A number in the plane, three in space."""
        if self.is_planar and np.ndim(value) == 0:
            value = [value]
        remedy = f"give a number in {unit}" if self.is_planar else f"give {self.axes} in {unit}"
        return _numbers(value, self.spins, field, remedy, body)

    def rotation(self, value: Any, field: str = "rotation", body: str | None = None) -> list[float]:
        """An angle or [cos, sin] in the plane, a quaternion [w, x, y, z] in space."""
        if self.is_planar:
            remedy = "give an angle in rad, or (cos, sin)"
            found = _numbers([value], 1, field, remedy, body) if np.ndim(value) == 0 else []
            found = found or _numbers(value, 2, field, remedy, body)
        else:
            remedy = "give a quaternion (w, x, y, z), e.g. (cos(a/2), 0, 0, sin(a/2)) for a turn by a about z"
            found = _numbers(value, 4, field, remedy, body)
        if len(found) > 1 and not 1e-150 < math.hypot(*found) < 1e150:  # beyond, its square is 0 or infinite
            raise refused(body, field, "must have a length that is not 0", value, remedy)
        return found

    def stored_rotation(self, value: Any, field: str = "rotation", body: str | None = None) -> list[float]:
        """The same as the engine stores it: unit [cos, sin] or quaternion."""
        return self.pieces.rotation(self.rotation(value, field, body))

    def inertia(self, value: Any, field: str = "inertia", body: str | None = None) -> list[float]:
        """Independent entries: [I] from a number, [xx, yy, zz, xy, xz, yz] from a symmetric (3, 3) array."""
        if self.is_planar:
            return [number(value, field, "kg m^2", body)]
        remedy = "give a symmetric (3, 3) array in kg m^2"
        full = np.array(_numbers(value, 9, field, remedy, body, shape=(3, 3))).reshape(3, 3)
        if not np.allclose(full, full.T, rtol=1e-9, atol=1e-12 * np.abs(full).max()):
            raise refused(body, field, "must be symmetric", value, remedy)
        middle = full / 2 + full.T / 2
        return [float(middle[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]

    def full_inertia(self, entries: list[float]) -> Any:
        """A float in the plane, a (3, 3) array in space, from independent entries [kg m^2]."""
        if self.is_planar:
            return entries[0]
        xx, yy, zz, xy, xz, yz = entries
        return frozen(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    def plain_spin(self, values: Any) -> Any:
        """A float in the plane, a (3,) array in space."""
        return float(values[0]) if self.is_planar else frozen(np.asarray(values, dtype=np.float64))

    @cached_property
    def contact_type(self) -> np.dtype[np.void]:
        """Type of a contact's record."""
        return record_type(self.world.contact_fields())

    @cached_property
    def action_type(self) -> np.dtype[np.void]:
        """Type of an action's record: a body's loads and position correction in a step."""
        return record_type(self.world.action_fields())

    @cached_property
    def event_type(self) -> np.dtype[np.void]:
        """Type of the record of what a contact did in a flow or a round of impacts."""
        return record_type(self.world.event_fields())

    @cached_property
    def piece_type(self) -> np.dtype[np.void]:
        """Type of the record of a piece of a body's way through a step."""
        return record_type(self.world.piece_fields())

    @cached_property
    def step_type(self) -> np.dtype[np.void]:
        """Type of a step's record."""
        return record_type(self.world.step_fields())


def record_type(fields: list[tuple[str, str, int]]) -> np.dtype[np.void]:
    """The packed type of the engine's records; a length of 0 means a plain number."""
    columns = [(name, code) if count == 0 else (name, code, (count,)) for name, code, count in fields]
    return np.dtype(columns)


def number(value: Any, field: str, unit: str, body: str | None = None) -> float:
    """A plain number, which the engine judges; nan and inf pass."""
    plain = value.item() if isinstance(value, (np.ndarray, np.generic)) and np.size(value) == 1 else value
    if isinstance(plain, bool) or not isinstance(plain, numbers.Real):
        raise refused(body, field, "must be a number", value, f"give {field} in {unit}")
    return float(plain)


def whole(value: Any, field: str, remedy: str, body: str | None = None) -> int:
    """A whole number."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise refused(body, field, "must be a whole number", value, remedy)
    return int(value)


def _numbers(
    value: Any, count: int, field: str, remedy: str, body: str | None, shape: tuple[int, ...] | None = None
) -> list[float]:
    """Finite numbers of a given count, as a flat list."""
    shape = shape or (count,)
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise refused(body, field, "must be numbers", value, remedy) from None
    if array.shape != shape:
        wanted = f"{count} numbers" if len(shape) == 1 else f"a {shape} array"
        raise refused(body, field, f"must be {wanted}", value, remedy)
    if not np.isfinite(array).all():
        raise refused(body, field, "must be finite", value, remedy)
    flat: list[float] = array.ravel().tolist()
    return flat


def frozen(array: Floats) -> Floats:
    """The array made read-only, so that writing into a copy is noticed."""
    array.flags.writeable = False
    return array


PLANAR = Space(
    "planar", 2, 1, 2, "(x, y)", _carom.PlanarWorld, _carom.PlanarProblem, _carom.PlanarPieces
)  # fmt: skip
SPATIAL = Space(
    "spatial", 3, 3, 4, "(x, y, z)", _carom.SpatialWorld, _carom.SpatialProblem, _carom.SpatialPieces
)  # fmt: skip


def space_of_vector(value: Any, field: str) -> Space:
    """The space whose vectors have this many numbers.

    Raises
    ------
    BuildError
        When it is neither two nor three.
    """
    length = np.shape(value)[-1] if np.ndim(value) else 0
    if length not in (2, 3):
        raise refused(None, field, "must be 2 or 3 numbers", value, "give (x, y) or (x, y, z)")
    return PLANAR if length == 2 else SPATIAL
