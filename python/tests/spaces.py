"""What tests of both spaces share: the plane and space with the same words."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from carom import planar, spatial

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Face:
    """One of the two modules with shapes that both have, under one name."""

    module: ModuleType
    dimension: int

    def world(self, **settings: Any) -> Any:
        return self.module.World(**settings)

    def ball(self, radius: float) -> Any:
        return planar.Circle(radius) if self.dimension == 2 else spatial.Sphere(radius)

    def box(self, side: float) -> Any:
        return self.module.Box(*[side] * self.dimension)

    def ground(self) -> Any:
        return planar.HalfPlane() if self.dimension == 2 else spatial.HalfSpace()

    def at(self, x: float, height: float) -> tuple[float, ...]:
        """A point at x along the ground, at a height."""
        return (x, height) if self.dimension == 2 else (x, 0.0, height)

    def spin(self, z: float) -> Any:
        """An angular velocity or torque about the axis out of the plane."""
        return z if self.dimension == 2 else (0.0, z, 0.0)

    def stack(self, count: int, **settings: Any) -> Any:
        """Boxes of 1 m on a floor."""
        w = self.world(**settings)
        w.add_static("floor", self.ground(), friction=0.5)
        for i in range(count):
            w.add_body(f"box{i}", self.box(1.0), density=2.0, position=self.at(0.0, 0.5 + i))
        return w

    def pile(self, count: int, seed: int = 5, **settings: Any) -> Any:
        """Bodies that tumble into each other above a floor, some of them bouncing."""
        w = self.world(**settings)
        w.add_static("floor", self.ground(), friction=0.6, restitution=0.3)
        draw = np.random.default_rng(seed)
        for i in range(count):
            shape = self.box(0.5) if i % 2 else self.ball(0.3)
            place = np.array(self.at(0.15 * i, 0.6 + 0.55 * i)) + draw.uniform(-0.1, 0.1, self.dimension)
            velocity = draw.uniform(-1, 1, self.dimension)
            w.add_body(f"b{i}", shape, density=100.0, position=place, velocity=velocity, restitution=0.3)
        return w


PLANE, SPACE = Face(planar, 2), Face(spatial, 3)
both = pytest.mark.parametrize("face", [PLANE, SPACE], ids=["planar", "spatial"])
