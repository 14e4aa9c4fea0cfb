"""The state of a world as arrays over its bodies; they show the engine's own memory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from carom._body import ANGULAR_VELOCITY, POSITION, ROTATION, VELOCITY
from carom._space import Floats, Space, frozen
from carom.errors import refused


class Arrayed:
    """The part of a world that is arrays, a row for each body."""

    __slots__ = ()
    _space: ClassVar[Space]
    if TYPE_CHECKING:
        _native: Any

    @property
    def position(self) -> Floats:
        """(n, d) float64 view, centres of mass [m]; valid and writable until dropped."""
        array: Floats = self._native.view(POSITION)
        return array

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self._fill(self.position, "position", value)

    @property
    def rotation(self) -> Floats:
        """(n, 2) [cos, sin] | (n, 4) [w, x, y, z] float64 view; length 1 is restored by the next step."""
        array: Floats = self._native.view(ROTATION)
        return array

    @rotation.setter
    def rotation(self, value: npt.ArrayLike) -> None:
        self._fill(self.rotation, "rotation", value)

    @property
    def velocity(self) -> Floats:
        """(n, d) float64 view, velocities of the centres of mass [m/s]; static bodies must keep 0."""
        array: Floats = self._native.view(VELOCITY)
        return array

    @velocity.setter
    def velocity(self, value: npt.ArrayLike) -> None:
        self._fill(self.velocity, "velocity", value)

    @property
    def angular_velocity(self) -> Floats:
        """(n,) | (n, 3) float64 view, world axes [rad/s]; static bodies must keep 0."""
        array: Floats = self._native.view(ANGULAR_VELOCITY)
        return array[:, 0] if self._space.is_planar else array

    @angular_velocity.setter
    def angular_velocity(self, value: npt.ArrayLike) -> None:
        self._fill(self.angular_velocity, "angular_velocity", value)

    @staticmethod
    def _fill(view: Floats, field: str, value: npt.ArrayLike) -> None:
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.zeros(0)
        if array.shape != view.shape:
            raise refused(None, field, f"must be a {view.shape} array", value, "give a row for each body")
        view[...] = array

    @property
    def mass(self) -> Floats:
        """(n,) float64 array [kg]; inf for bodies that forces do not move."""
        return frozen(self._native.masses())
