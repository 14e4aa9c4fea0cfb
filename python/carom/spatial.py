"""Space: positions (x, y, z), rotations as quaternions (w, x, y, z), forces in N, densities in kg/m^3.

>>> from carom import spatial
>>> w = spatial.World()
>>> floor = w.add_static("floor", spatial.HalfSpace(normal=(0, 0, 1)))
>>> ball = w.add_body("ball", spatial.Sphere(0.5), density=1000.0, position=(0, 0, 2))
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
    Compound,
    Cone,
    ConvexHull,
    Cylinder,
    HalfSpace,
    HeightField,
    RoundBox,
    RoundCone,
    RoundConvexHull,
    RoundCylinder,
    Shape,
    ShapeLike,
    Sphere,
    TriMesh,
)
from carom._space import SPATIAL


class World(_world.World):  # noqa: D101 (the docstring is that of the common text)
    __doc__ = _world.World.__doc__
    __slots__ = ()
    _space = SPATIAL


def mass_properties(
    shape: ShapeLike, *, density: Any = None, mass: float | None = None, tolerance: float = 1e-6
) -> MassProperties:
    """Mass properties of a shape in its own axes.

    Parameters
    ----------
    density : [kg/m^3], or a function of (n, 3) points [m] that returns (n,) densities
    mass : [kg], instead of a density
    tolerance : relative error asked of a density function's quadrature [1]

    Raises
    ------
    BuildError
        For shapes without volume, and where the quadrature cannot reach the tolerance.
    """
    return _mass_properties(SPATIAL, shape, density, mass, tolerance)


__all__ = [
    "Body",
    "Box",
    "Capsule",
    "Cavity",
    "Compound",
    "Cone",
    "ContactProblem",
    "ConvexHull",
    "Cylinder",
    "HalfSpace",
    "HeightField",
    "MassProperties",
    "RoundBox",
    "RoundCone",
    "RoundConvexHull",
    "RoundCylinder",
    "Shape",
    "Sphere",
    "TriMesh",
    "World",
    "collision",
    "mass_properties",
]
