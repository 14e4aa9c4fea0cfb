"""Every shape: as a value, as a plain table, in a world, with its closed-form mass."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from spaces import Face, both

from carom import BuildError, planar, spatial
from carom._shapes import SHAPES

SQUARE = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
CUBE = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
PYRAMID = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
PI = math.pi

#: Shape, area [m^2].
PLANAR: list[tuple[Any, float | None]] = [
    (planar.Circle(2.0), 4 * PI),
    (planar.Capsule(3.0, 0.5), 3 + PI / 4),
    (planar.Box(2.0, 3.0), 6.0),
    (planar.RoundBox(2.0, 3.0, radius=0.5), 6 + 5 + PI / 4),
    (planar.ConvexPolygon(SQUARE), 4.0),
    (planar.RoundPolygon(SQUARE, 1.0), 4 + 8 + PI),
    (planar.Segment((0, 0), (1, 1)), None),
    (planar.Polyline(SQUARE, closed=True), None),
    (planar.HalfPlane((0, 2)), None),
    (planar.Cavity(2.0), None),
    (planar.HeightField([0, 1, 0], 4.0), None),
    (planar.Compound([(planar.Box(1, 1), (0, 0)), (planar.Circle(1), (5, 0), 0.3)]), 1 + PI),
]
#: Shape, volume [m^3].
SPATIAL: list[tuple[Any, float | None]] = [
    (spatial.Sphere(2.0), 32 * PI / 3),
    (spatial.Capsule(3.0, 0.5), 3 * PI / 4 + PI / 6),
    (spatial.Box(1.0, 2.0, 3.0), 6.0),
    (spatial.Cylinder(2.0, 0.5), PI / 2),
    (spatial.Cone(3.0, 1.0), PI),
    (spatial.ConvexHull(CUBE), 8.0),
    (spatial.RoundBox(1.0, 1.0, 1.0, radius=1.0), 1 + 6 + 3 * PI + 4 * PI / 3),
    (spatial.RoundCylinder(2.0, 1.0, rounding=0.5), None),
    (spatial.RoundCone(2.0, 1.0, rounding=0.1), None),
    (spatial.RoundConvexHull(CUBE, 1.0), 8 + 24 + 6 * PI + 4 * PI / 3),
    (spatial.TriMesh(PYRAMID, FACES), 1 / 6),
    (spatial.HalfSpace((0, 0, 3)), None),
    (spatial.Cavity(3.0), None),
    (spatial.HeightField(np.zeros((3, 4)), (2.0, 3.0)), None),
    (
        spatial.Compound([(spatial.Sphere(1), (0, 0, 0)), (spatial.Box(1, 1, 1), (4, 0, 0), (1, 0, 0, 1))]),
        1 + 4 * PI / 3,
    ),
]
CASES = [pytest.param(planar, *case, id=f"planar-{case[0].type}") for case in PLANAR] + [
    pytest.param(spatial, *case, id=f"spatial-{case[0].type}") for case in SPATIAL
]


def test_no_shape_is_left_out() -> None:
    assert {shape.type for shape, _ in PLANAR} == set(SHAPES["planar"])
    assert {shape.type for shape, _ in SPATIAL} == set(SHAPES["spatial"])


@pytest.mark.parametrize(("module", "shape", "measure"), CASES)
def test_every_shape_in_a_world(module: Any, shape: Any, measure: float | None) -> None:
    w = module.World()
    body = w.add_static("wall", shape)
    again = w.add_static("again", shape.to_dict())
    assert body.shape == again.shape
    assert body.shape.type == shape.type
    assert type(body.shape) is type(shape)
    assert body.shape.to_dict().keys() == shape.to_dict().keys()
    if measure is not None:
        heavy = w.add_body("heavy", shape, density=3.0)
        assert heavy.mass == pytest.approx(3 * measure, rel=1e-9)
        assert w.add_body("given", shape, mass=2.5).mass == 2.5
    assert repr(shape).startswith(type(shape).label or type(shape).__name__)


@pytest.mark.parametrize(("module", "shape", "measure"), [case for case in CASES if case.values[2] is None])
def test_shapes_without_volume_need_mass_from_elsewhere(
    module: Any, shape: Any, measure: float | None
) -> None:
    if shape.type.startswith("round_"):
        assert module.mass_properties(shape, density=1.0).mass > 0
        return
    with pytest.raises(BuildError, match="so no density gives it a mass"):
        module.mass_properties(shape, density=1.0)


@both
def test_shapes_are_values(face: Face) -> None:
    assert face.box(1.0) == face.box(1.0)
    assert face.box(1.0) != face.box(2.0)
    assert face.box(1.0) != face.ball(1.0)
    assert face.module.Box([1.0] * face.dimension) == face.box(1.0)
    with pytest.raises(AttributeError):
        face.ball(1.0).radius = 3.0


def test_arrays_and_numpy_scalars_are_taken() -> None:
    w = planar.World()
    draw = np.random.default_rng(1).normal(size=(20, 2))
    body = w.add_body("b", planar.ConvexPolygon(draw), density=np.float64(2.0), position=np.array([1, 2]))
    assert body.mass > 0
    w.add_static("t", {"type": "circle", "radius": np.float32(0.5)})


ANYTHING: Any = spatial


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (spatial.TriMesh(PYRAMID, [(0, 1)]), r"shape.triangles must be \(t, 3\) vertex indices"),
        (spatial.TriMesh(PYRAMID, [(0, 1, -2)]), "give whole numbers counted from 0"),
        (spatial.TriMesh(PYRAMID, [(0, 1, 9)]), "index 9 is out of range, there are 4 vertices"),
        (spatial.TriMesh(PYRAMID, [(0.0, 1.0, 2.0)]), "give whole numbers counted from 0"),
        (spatial.HeightField([[0, 1], [2]], (1, 1)), "shape.heights"),
        (ANYTHING.HeightField(np.zeros((2, 2)), (1, 1, 1)), "shape.size must be 2 numbers"),
        (spatial.HalfSpace((0, 0, 0)), "shape.normal must be finite and not zero"),
        (spatial.ConvexHull(np.zeros((3, 3))), "shape.points"),
        (ANYTHING.Compound("ab"), "must be a list of parts"),
    ],
)
def test_wrong_shapes_of_space(shape: Any, message: str) -> None:
    w = spatial.World()
    with pytest.raises(BuildError, match=message):
        w.add_static("s", shape)
    assert len(w) == 0
