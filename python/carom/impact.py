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
    """One collision after another, the fastest first: passes a blow on, as in a cradle; not symmetric."""

    __slots__ = ()
    _name = "sequential"


class GeneralizedReflections(_Law):
    """Rounds of Newton's restitution at the contacts that approach: symmetric, and passes a blow on.

    Source: Smith, Kaufman, Vouga, Tamstorf and Grinspun 2012 (theory eq. 4.24).
    """

    __slots__ = ()
    _name = "generalized_reflections"


class Moreau(_Law):
    """Coulomb's law for the mean of the velocities before and after, weighted by e: never gains energy.

    It reverses slips by its own e and refuses tangential restitution.

    Source: Moreau 1988 (theory eqs. 3.20 and 3.21).
    """

    __slots__ = ()
    _name = "moreau"


class Poisson(_Law):
    """Compression, then restitution that gives back at least e times compression's normal impulses.

    It refuses tangential restitution.

    Source: Glocker and Pfeiffer 1995 (theory eqs. 4.28 and 4.29).
    """

    __slots__ = ()
    _name = "poisson"


#: All laws by name.
LAWS: dict[str, type[_Law]] = {
    law._name: law for law in (GeneralizedReflections, Newton, Sequential, Moreau, Poisson)
}
