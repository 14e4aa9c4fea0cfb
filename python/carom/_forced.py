"""The force fields of a world."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from carom._force import Force, loads
from carom._space import Space
from carom.errors import refused, unknown


class Forced:
    """The part of a world that forces act on."""

    __slots__ = ()
    _space: ClassVar[Space]
    if TYPE_CHECKING:
        _native: Any
        _forces: dict[str, Force]

    def add_force(self, name: str, function: Force) -> None:
        """Adds a force field, or replaces the one of this name.

        Parameters
        ----------
        function : called at least once per step with the time [s] and copies of positions (n, d) [m] and
            velocities (n, d) [m/s]; returns forces (n, d) [N] at the centres of mass, or a dictionary with
            "force" and "torque" ((n,) | (n, 3) [N m]). Rows of static and kinematic bodies are ignored. An
            exception that it raises comes out of `step`, and the step is not taken. It should depend on its
            arguments alone: an integrator may ask several times in a step, and a step in which it pushes a
            body far is taken once more.

        Raises
        ------
        BuildError
            When `function` cannot be called.
        """
        if not callable(function):
            raise refused(None, "function", "must be callable", function, "give f(time, position, velocity)")
        self._native.add_force(name, loads(name, function, self._space))
        self._forces[name] = function

    def remove_force(self, name: str) -> None:
        """Removes a force field.

        Raises
        ------
        BuildError
            When there is none of this name.
        """
        if not self._native.remove_force(name):
            raise unknown("force field", name, list(self._forces))
        self._forces.pop(name, None)

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the force fields, in the order they act."""
        return tuple(self._native.force_fields())
