"""The impact laws by name: what simultaneous collisions do to the velocities (theory chapter 4).

>>> from carom import impact, planar
>>> w = planar.World(impact=impact.Sequential())
>>> w.impact
'sequential'
"""

from __future__ import annotations

from typing import Self


class _Law(str):
    """The name of a law, as settings and files have it."""

    __slots__ = ()
    _name = ""

    def __new__(cls) -> Self:
        """The law; it has no parameters."""
        return super().__new__(cls, cls._name)

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"

    def __reduce__(self) -> tuple[type[Self], tuple[()]]:
        return type(self), ()


class Newton(_Law):
    """Newton's restitution at all contacts at once: symmetric; a blow is shared among all touching bodies."""

    __slots__ = ()
    _name = "newton"


class Sequential(_Law):
    """One collision after another in a fixed order: passes a blow on, as in a cradle; not symmetric."""

    __slots__ = ()
    _name = "sequential"


#: All laws by name.
LAWS: dict[str, type[_Law]] = {"newton": Newton, "sequential": Sequential}
