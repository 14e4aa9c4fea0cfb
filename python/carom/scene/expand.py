"""Copies of a body: grid or pyramid by `repeat`, disorder by `scatter`.

Copy (i, j, ..) is displaced by i step_0 + j step_1 + ..; in a pyramid the last number l is the layer, and
only copies with every other number below count - l exist. Scatter draws from numpy's PCG64 with the file's
seed and the body's name, so the order of bodies in the file changes nothing. Knows no worlds.
"""

from __future__ import annotations

import itertools
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from carom.scene.bodies import PlanarBody, SpatialBody
from carom.scene.fields import axis_angle, quaternion_product


@dataclass(frozen=True)
class Copy:
    """One body to be made: its name, where it is moved and how it is turned from what the file says.

    Attributes
    ----------
    displacement : (2,) or (3,) float64 array [m]
    rotation : angle [rad] in the plane, unit quaternion [w, x, y, z] in space; None when neither file nor
    scatter
        turn the body
    """

    name: str
    displacement: npt.NDArray[np.float64]
    rotation: float | list[float] | None


def copies(body: PlanarBody | SpatialBody) -> Iterator[Copy]:
    """All copies of a body, in order of their running number; the body itself when it is not repeated."""
    generator = None
    if body.scatter is not None:
        generator = np.random.default_rng([body.scatter.seed, zlib.crc32(body.name.encode())])
    for running, numbers in enumerate(_numbers(body)):
        displacement = np.zeros(2 if isinstance(body, PlanarBody) else 3)
        if body.repeat is not None:
            displacement += np.asarray(numbers, dtype=float) @ np.asarray(body.repeat.step, dtype=float)
        rotation = _rotation(body)
        if generator is not None and body.scatter is not None:
            reach = np.asarray(body.scatter.position, dtype=float)
            displacement += reach * generator.uniform(-1.0, 1.0, len(reach))
            if body.scatter.rotation > 0:
                rotation = _turned(rotation, body.scatter.rotation, generator, isinstance(body, PlanarBody))
        yield Copy(_name(body, numbers, running), displacement, rotation)


def _numbers(body: PlanarBody | SpatialBody) -> Iterator[tuple[int, ...]]:
    if body.repeat is None:
        yield ()
        return
    pyramid = body.repeat.arrangement == "pyramid"
    for numbers in itertools.product(*(range(count) for count in body.repeat.count)):
        if pyramid and any(n >= body.repeat.count[axis] - numbers[-1] for axis, n in enumerate(numbers[:-1])):
            continue
        yield numbers


def _name(body: PlanarBody | SpatialBody, numbers: tuple[int, ...], running: int) -> str:
    if body.repeat is None:
        return body.name
    filled = body.name.replace("{n}", str(running))
    for letter, number in zip("ijk", numbers, strict=False):
        filled = filled.replace("{" + letter + "}", str(number))
    if filled == body.name:
        filled += "-" + "-".join(str(number) for number in numbers)
    return filled


def _rotation(body: PlanarBody | SpatialBody) -> float | list[float] | None:
    if body.rotation is None:
        return None
    return body.rotation.radians if isinstance(body, PlanarBody) else body.rotation.stored()


def _turned(
    rotation: float | list[float] | None, most: float, generator: np.random.Generator, planar: bool
) -> float | list[float]:
    """The rotation followed by a drawn turn; in space the axis is even on the sphere."""
    angle = float(generator.uniform(-most, most))
    if planar:
        return angle + (rotation if isinstance(rotation, float) else 0.0)
    height, around = float(generator.uniform(-1.0, 1.0)), float(generator.uniform(0.0, 2 * math.pi))
    radius = math.sqrt(1 - height * height)
    drawn = axis_angle((radius * math.cos(around), radius * math.sin(around), height), angle)
    return quaternion_product(drawn, rotation) if isinstance(rotation, list) else drawn
