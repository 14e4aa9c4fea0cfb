"""The plane: positions (x, y), rotations as angles, forces in N, densities in kg/m^2.

>>> from carom import planar
>>> w = planar.World(gravity=(0, -9.81))
>>> floor = w.add_static("floor", planar.HalfPlane(normal=(0, 1)))
>>> ball = w.add_body("ball", planar.Circle(0.5), density=10.0, position=(0, 2))
>>> report = w.step()
"""

from __future__ import annotations

from typing import Any

from carom import _world, collision
from carom._adding import mass_properties as _mass_properties
from carom._body import Body
from carom._problem import ContactProblem
from carom._report import MassProperties
from carom._shapes import (
    Box,
    Capsule,
    Cavity,
    Circle,
    Compound,
    ConvexPolygon,
    HalfPlane,
    Polyline,
    RoundBox,
    RoundPolygon,
    Segment,
    Shape,
    ShapeLike,
)
from carom._shapes import HeightLine as HeightField
from carom._space import PLANAR


class World(_world.World):  # noqa: D101 (the docstring is that of the common text)
    __doc__ = _world.World.__doc__
    __slots__ = ()
    _space = PLANAR


def mass_properties(
    shape: ShapeLike, *, density: Any = None, mass: float | None = None, tolerance: float = 1e-6
) -> MassProperties:
    """Mass properties of a shape in its own axes.

    Parameters
    ----------
    density : [kg/m^2], or a function of (n, 2) points [m] that returns (n,) densities
    mass : [kg], instead of a density
    tolerance : relative error asked of a density function's quadrature [1]

    Raises
    ------
    BuildError
        For shapes without area, and where the quadrature cannot reach the tolerance.
    """
    return _mass_properties(PLANAR, shape, density, mass, tolerance)


__all__ = [
    "Body",
    "Box",
    "Capsule",
    "Cavity",
    "Circle",
    "Compound",
    "ContactProblem",
    "ConvexPolygon",
    "HalfPlane",
    "HeightField",
    "MassProperties",
    "Polyline",
    "RoundBox",
    "RoundPolygon",
    "Segment",
    "Shape",
    "World",
    "collision",
    "mass_properties",
]
