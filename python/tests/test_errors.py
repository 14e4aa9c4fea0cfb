"""Wrong calls: each is refused with the body, the field, the value and what to do, and changes nothing."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from spaces import SPACE, Face, both

import carom
from carom import BuildError, CaromError, SolverError, StepError, planar, spatial

NAN = math.nan
ANYTHING: Any = planar
BOX, BALL = planar.Box(1, 1), spatial.Sphere(1)

#: Arguments of add_body in the plane; what must be in the message, the field, the value.
PLANAR: dict[str, tuple[dict[str, Any], str, str, Any]] = {
    "mass of nan": ({"mass": NAN}, "body 'crate3': mass must be > 0, got nan; give mass in kg", "mass", NAN),
    "negative density": (
        {"density": -1.0},
        "density must be > 0, got -1; give density in kg/m",
        "density",
        -1.0,
    ),
    "no mass": ({}, "mass is missing; give density in kg/m^2 or mass in kg", "mass", None),
    "text as mass": ({"mass": "1"}, "mass must be a number, got '1'; give mass in kg", "mass", "1"),
    "mass and density": ({"mass": 1, "density": 1}, "density must not be given beside mass", "density", 1),
    "inertia alone": ({"density": 1, "inertia": 2}, "inertia needs mass beside it, got 2", "inertia", 2),
    "impossible inertia": (
        {"mass": 1, "inertia": -2.0},
        "a moment of inertia must be finite and > 0",
        "inertia",
        -2.0,
    ),
    "three numbers": (
        {"mass": 1, "position": (1, 2, 3)},
        "position must be 2 numbers, got (1, 2, 3); give (x, y) in m",
        "position",
        (1, 2, 3),
    ),
    "text in a position": (
        {"mass": 1, "position": ("a", 1)},
        "position must be numbers",
        "position",
        ("a", 1),
    ),
    "infinite velocity": (
        {"mass": 1, "velocity": (0, math.inf)},
        "velocity must be finite",
        "velocity",
        (0, math.inf),
    ),
    "quaternion in the plane": (
        {"mass": 1, "rotation": (1, 0, 0, 0)},
        "give an angle in rad, or (cos, sin)",
        "rotation",
        (1, 0, 0, 0),
    ),
    "rotation of length 0": (
        {"mass": 1, "rotation": (0, 0)},
        "must have a length that is not 0",
        "rotation",
        (0, 0),
    ),
    "position and origin": (
        {"mass": 1, "position": (0, 0), "origin": (1, 1)},
        "origin must not be given beside position",
        "origin",
        (1, 1),
    ),
    "negative friction": (
        {"mass": 1, "friction": -1},
        "friction must be finite and >= 0, got -1",
        "friction",
        -1,
    ),
    "restitution above 1": (
        {"mass": 1, "restitution": 2},
        "restitution must be in [0, 1], got 2",
        "restitution",
        2,
    ),
    "mistyped argument": (
        {"mass": 1, "fricton": 0.1},
        "unknown argument 'fricton'; did you mean 'friction'?",
        "fricton",
        "fricton",
    ),
    "unknown kind": (
        {"mass": 1, "kind": "ghost"},
        "choose one of dynamic, static, kinematic",
        "kind",
        "ghost",
    ),
    "static in motion": (
        {"kind": "static", "velocity": (1, 0)},
        "given for a static body; make it kinematic",
        "velocity",
        (1, 0),
    ),
    "static with mass": ({"kind": "static", "mass": 1}, "mass has no meaning for a static body", "mass", 1),
    "groups of 33 bits": (
        {"mass": 1, "collision_groups": 2**32},
        "at most 32 bits",
        "collision_groups",
        2**32,
    ),
}


@pytest.mark.parametrize("case", PLANAR)
def test_wrong_arguments_of_a_body(case: str) -> None:
    arguments, message, field, value = PLANAR[case]
    w = planar.World()
    with pytest.raises(BuildError) as caught:
        w.add_body("crate3", BOX, **arguments)
    error = caught.value
    assert message in str(error)
    assert str(error).startswith("body 'crate3': ")
    assert (error.body, error.field) == ("crate3", field)
    assert error.value == value or (value is NAN and math.isnan(error.value))
    assert error.remedy
    assert error.remedy in str(error)
    assert len(w) == 0


#: Shapes; what must be in the message, the field, the value.
SHAPES: dict[str, tuple[Any, str, str, Any]] = {
    "negative side": (
        planar.Box(1, -1),
        "shape.size[1] must be finite and > 0, got -1",
        "shape.size[1]",
        -1.0,
    ),
    "side of nan": (planar.Box(1, NAN), "shape.size[1] must be finite, got nan", "shape.size[1]", NAN),
    "cuboid in the plane": (
        planar.Box(1, 1, 1),
        "shape.size must be 2 numbers, got (1, 1, 1)",
        "shape.size",
        (1, 1, 1),
    ),
    "ball in the plane": (
        BALL,
        "must be a shape of the planar world, got 'sphere'; choose one of",
        "shape.type",
        "sphere",
    ),
    "unknown type": (
        {"type": "boxx"},
        "got 'boxx'; choose one of circle, capsule, box",
        "shape.type",
        "boxx",
    ),
    "mistyped field": (
        {"type": "box", "sise": (1, 1)},
        "unknown field of box 'sise'; did you mean 'size'?",
        "sise",
        "sise",
    ),
    "missing field": (
        {"type": "circle"},
        "shape.radius is missing; give radius of the circle",
        "shape.radius",
        None,
    ),
    "no shape": (3.5, "shape must be a shape, got 3.5; give one of carom.planar: Circle", "shape", 3.5),
    "points on a line": (
        planar.ConvexPolygon([(0, 0), (1, 1), (2, 2)]),
        "all 3 points lie on one line",
        "shape.points",
        [[0, 0], [1, 1], [2, 2]],
    ),
    "points in space": (
        planar.ConvexPolygon(np.zeros((4, 3))),
        "shape.points must be (k, 2) numbers",
        "shape.points",
        ...,
    ),
    "point of nan": (
        planar.ConvexPolygon([(0, 0), (1, NAN), (2, 2)]),
        "shape.points[1][1] must be finite, got nan",
        "shape.points[1][1]",
        NAN,
    ),
    "part of a compound": (
        planar.Compound([(planar.Circle(1), (0, 0)), (planar.Circle(-2), (1, 0))]),
        "shape.parts[1].shape.radius must be finite and > 0, got -2",
        "shape.parts[1].shape.radius",
        -2.0,
    ),
    "part without a place": (
        ANYTHING.Compound([planar.Circle(1)]),
        "give (shape, position) or (shape, position, rotation)",
        "shape.parts[0]",
        ...,
    ),
    "no volume": (planar.HalfPlane(), "so no density gives it a mass", "shape", ...),
}


@pytest.mark.parametrize("case", SHAPES)
def test_wrong_shapes(case: str) -> None:
    shape, message, field, value = SHAPES[case]
    w = planar.World()
    with pytest.raises(BuildError) as caught:
        w.add_body("crate3", shape, density=1.0)
    error = caught.value
    assert message in str(error)
    assert (error.body, error.field) == ("crate3", field)
    if value is not ...:
        assert error.value == value or (value is NAN and math.isnan(error.value))
    assert error.remedy
    assert len(w) == 0


#: Settings; what must be in the message.
SETTINGS: dict[str, tuple[dict[str, Any], str]] = {
    "mistyped": ({"itterations": 3}, "unknown setting 'itterations'; did you mean 'iterations'?"),
    "solver": (
        {"solver": "pgss"},
        f"solver must be one of {', '.join(map(repr, carom.SOLVERS))}, got 'pgss'",
    ),
    "half an iteration": ({"iterations": 2.5}, "iterations must be a whole number >= 0, got 2.5"),
    "no iteration": ({"iterations": 0}, "iterations must be in 1 to 100,000,000, got 0"),
    "no time": ({"dt": 0}, "dt must be > 0, got 0; give a step length in s"),
    "time of nan": ({"dt": NAN}, "dt must be finite, got nan; see World.dt: Length of a step [s]."),
    "gravity": ({"gravity": 9.81}, "gravity must be 2 numbers, got 9.81; give (x, y) in m/s^2"),
    "switch": ({"warm_start": "yes"}, "warm_start must be True or False, got 'yes'"),
    "share": ({"correction_fraction": 2}, "correction_fraction must be between 0 and 1, got 2"),
    "mixing": ({"friction_mixing": "median"}, "friction_mixing must be one of 'min', 'max', 'mean'"),
    "object": ({"solver": object()}, "solver must be a plain value"),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_wrong_settings(case: str) -> None:
    given, message = SETTINGS[case]
    (name,) = given
    with pytest.raises(BuildError) as caught:
        planar.World(**given)
    assert message in str(caught.value)
    assert caught.value.field == name
    if case == "mistyped":
        return
    w = planar.World()
    before = w.settings
    with pytest.raises(BuildError) as caught:
        setattr(w, name, given[name])
    assert message in str(caught.value)
    assert w.settings == before


@both
@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda w, f: w["box7"], BuildError, "body 'box7': name is not in this world; did you mean 'box0'?"),
        (lambda w, f: w[1], BuildError, "name must be a body's name, got 1; see w.names"),
        (lambda w, f: w.remove("flor"), BuildError, "did you mean 'floor'?"),
        (
            lambda w, f: w.add_body("box0", mass=1.0),
            BuildError,
            "body 'box0': name is taken; give each body a name",
        ),
        (lambda w, f: w.add_body("", mass=1.0), BuildError, "name is empty"),
        (
            lambda w, f: w.add_static("s", f.ball(1), velocity=f.at(1, 0)),
            BuildError,
            "velocity has no meaning for a static",
        ),
        (
            lambda w, f: w.add_static("s", f.ball(1), positon=f.at(1, 0)),
            BuildError,
            "did you mean 'position'?",
        ),
        (lambda w, f: w.add_static("s", None), BuildError, "shape must be given for a static body"),
        (
            lambda w, f: w["floor"].apply_force(f.at(1, 0)),
            BuildError,
            "body 'floor': force has no effect on a static body",
        ),
        (
            lambda w, f: w["floor"].apply_impulse(f.at(1, 0)),
            BuildError,
            "impulse has no effect on a static body",
        ),
        (lambda w, f: w["box0"].apply_force(f.at(1, NAN)), BuildError, "body 'box0': force must be finite"),
        (lambda w, f: w["box0"].apply_force(5), BuildError, "force must be"),
        (
            lambda w, f: w["box0"].inertia_about(0.0 * np.ones(f.dimension * 2 - 3)),
            BuildError,
            "axis must not have length 0",
        ),
        (lambda w, f: setattr(w["floor"], "velocity", f.at(1, 0)), BuildError, "add it with add_kinematic"),
        (lambda w, f: w.step(-1), StepError, "step: dt must be > 0, got -1; give a step length in s"),
        (lambda w, f: w.step("long"), BuildError, "dt must be a number, got 'long'"),
        (lambda w, f: w.remove_force("wind"), BuildError, "unknown force field 'wind'"),
        (
            lambda w, f: w.add_force("wind", 3),
            BuildError,
            "function must be callable, got 3; give f(time, position",
        ),
        (lambda w, f: w.problem(phase="all"), BuildError, 'choose "contact" or "impact"'),
        (lambda w, f: w.problem().solve("pg"), BuildError, "unknown solver 'pg'; did you mean 'pgs'?"),
        (lambda w, f: w.problem().solve("pgs", iterations=0), BuildError, "iterations must be >= 1, got 0"),
        (
            lambda w, f: w.problem().solve("pgs", friction_law="cone"),
            BuildError,
            "friction_law must be 'disc' or 'box'",
        ),
        (lambda w, f: w.problem().residual([1.0]), BuildError, "impulse must be"),
    ],
)
def test_wrong_calls(
    face: Face, call: Callable[[Any, Face], Any], kind: type[CaromError], message: str
) -> None:
    w = face.stack(1)
    before = w.snapshot()
    with pytest.raises(kind) as caught:
        call(w, face)
    assert message in str(caught.value)
    assert type(caught.value) is kind
    assert caught.value.remedy
    assert w.snapshot() == before


def test_mistyped_attributes_are_refused() -> None:
    w = planar.World()
    with pytest.raises(AttributeError, match="unknown setting 'slover'; did you mean 'solver'"):
        w.slover = "pgs"
    with pytest.raises(AttributeError, match="no setter"):
        w.time = 3.0  # type: ignore[misc]


def test_rotations_and_inertias_of_space() -> None:
    w = spatial.World()
    with pytest.raises(
        BuildError, match=r"rotation must be 4 numbers, got 0.5; give a quaternion \(w, x, y, z\)"
    ):
        w.add_body("b", BALL, mass=1, rotation=0.5)
    with pytest.raises(BuildError, match="the largest exceeds the sum of the other two; check its entries"):
        w.add_body("b", BALL, mass=1, inertia=np.diag([1.0, 1.0, 5.0]))
    with pytest.raises(BuildError, match=r"inertia must be a \(3, 3\) array, got 2.0"):
        w.add_body("b", BALL, mass=1, inertia=2.0)
    with pytest.raises(BuildError, match="inertia must be symmetric"):
        w.add_body("b", BALL, mass=1, inertia=[[1, 1, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(BuildError, match="center_of_mass needs inertia beside it"):
        w.add_body("b", BALL, mass=1, center_of_mass=(0, 0, 0.1))
    assert len(w) == 0


def test_a_failed_step_leaves_the_world_as_it_was() -> None:
    w = SPACE.pile(5)
    for _ in range(100):
        w.step()
    before = w.snapshot()
    w["b2"].apply_force((1e300, 0, 0))
    waiting = w.snapshot()
    with pytest.raises(StepError, match=r"body 'b2': .* is not finite .* after the step") as caught:
        w.step()
    assert caught.value.body == "b2"
    assert w.snapshot() == waiting
    assert waiting != before
    w.restore(before)
    w.step()


def test_errors_are_values() -> None:
    error = SolverError("it said no", body="b", field="f", value=3, remedy="ask again")
    back = pickle.loads(pickle.dumps(error))
    assert (str(back), back.body, back.field, back.value, back.remedy) == (
        "it said no",
        "b",
        "f",
        3,
        "ask again",
    )
    assert issubclass(SolverError, StepError)
    scene = carom.SceneError("x", path="a.toml", line=3, key="k")
    assert (scene.path, scene.line, scene.key) == ("a.toml", 3, "k")
    assert all(
        issubclass(getattr(carom, name), CaromError) for name in carom.__all__ if name.endswith("Error")
    )
