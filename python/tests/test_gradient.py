"""Gradients in Python: shapes, closed forms, refusals, and the examples for jax and torch.

The frameworks are not among carom's dependencies: the examples themselves run where they are installed and
say that they need them where not; their core, numbers in and numbers out, is tested here in any case.
"""

from __future__ import annotations

import importlib.util
import runpy
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from spaces import Face, Floats

from carom import BuildError, gradient, planar, spatial

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
FACES = (Face(planar, 2), Face(spatial, 3))


@pytest.fixture(params=FACES, ids=["plane", "space"])
def face(request: pytest.FixtureRequest) -> Face:
    found: Face = request.param
    return found


def thrown(face: Face, **settings: Any) -> Any:
    """A ball that bounces once and flies on."""
    w = face.world(dt=0.1, scheme="events", **settings)
    w.add_static("floor", face.ground(), friction=0.2)
    w.add_body("ball", face.ball(0.1), density=50.0, friction=0.4, restitution=0.8, position=face.at(0, 1.1))
    return w


def test_the_apex_changes_with_restitution_by_the_closed_form(face: Face) -> None:
    rollout = gradient.record(thrown(face), 7)
    height, rise = rollout.position[-1, 1, -1], rollout.velocity[-1, 1, -1]
    assert height + rise**2 / (2 * 9.81) == pytest.approx(0.8**2 * 1.0 + 0.1, abs=1e-12)
    seed = {"position": np.zeros((2, face.dimension)), "velocity": np.zeros((2, face.dimension))}
    seed["position"][1, -1], seed["velocity"][1, -1] = 1.0, rise / 9.81
    found = rollout.pullback(seed, at=-1)
    # the larger restitution counts, the ball's
    assert found["restitution"] == pytest.approx([0.0, 2 * 0.8 * 1.0], abs=1e-9)
    assert rollout.flags == ()


def test_arrays_have_the_shapes_that_are_told(face: Face) -> None:
    rollout = gradient.record(thrown(face), 5)
    d, spins, turns = face.dimension, 1 if face.dimension == 2 else 3, 2 if face.dimension == 2 else 4
    assert rollout.position.shape == rollout.velocity.shape == (6, 2, d)
    assert rollout.rotation.shape == (6, 2, turns)
    assert rollout.angular_velocity.shape == (6, 2, spins)
    found = rollout.pullback({"position": np.ones((6, 2, d))})
    shapes = {name: np.shape(value) for name, value in found.items() if name != "pairs"}
    assert shapes == {
        "position": (2, d),
        "rotation_vector": (2, spins),
        "velocity": (2, d),
        "angular_velocity": (2, spins),
        "mass": (2,),
        "inertia": (2,),
        "friction": (2,),
        "restitution": (2,),
        "gravity": (d,),
        "forces": (5, 2, d),
        "torques": (5, 2, spins),
    }


def test_the_world_stays_and_snapshots_change_nothing(face: Face) -> None:
    w = thrown(face)
    before = w.snapshot()
    seed = np.arange(12.0 * face.dimension).reshape(6, 2, face.dimension)
    whole = gradient.record(w, 5, stretch=5).pullback({"velocity": seed})
    parts = gradient.record(w, 5, stretch=1).pullback({"velocity": seed})
    assert w.snapshot() == before
    for name in (n for n in whole if n != "pairs"):
        assert np.array_equal(whole[name], parts[name]), name


def difference(number: Callable[[float], float]) -> float:
    h = 1e-4
    return (8 * (number(h) - number(-h)) - (number(2 * h) - number(-2 * h))) / (12 * h)


def test_forces_torques_and_rotations_agree_with_differences(face: Face) -> None:
    w = thrown(face)
    d, spins = face.dimension, 1 if face.dimension == 2 else 3
    seed = np.cos(np.arange(2 * (2 if d == 2 else 4))).reshape(2, -1)
    forces, torques = np.zeros((7, 2, d)), np.zeros((7, 2, spins))
    torques[0, 1] = 0.05
    forces[1, 1, 0] = 0.7

    def number(rollout: gradient.Rollout) -> float:
        return float((seed * rollout.rotation[-1]).sum() + rollout.position[-1, 1].sum())

    ends = {"rotation": seed, "position": np.array([np.zeros(d), np.ones(d)])}
    found = gradient.record(w, 7, forces=forces, torques=torques).pullback(ends, at=-1)
    for k in range(spins):

        def turned(h: float, k: int = k) -> float:
            other = torques.copy()
            other[0, 1, k] += h
            return number(gradient.record(w, 7, forces=forces, torques=other))

        assert found["torques"][0, 1, k] == pytest.approx(difference(turned), rel=1e-6, abs=1e-8)

    def pushed(h: float) -> float:
        other = forces.copy()
        other[1, 1, 0] += h
        return number(gradient.record(w, 7, forces=other, torques=torques))

    assert found["forces"][1, 1, 0] == pytest.approx(difference(pushed), rel=1e-6, abs=1e-8)


def test_the_entry_of_a_pair_of_materials_has_the_derivative(face: Face) -> None:
    w = face.world(dt=0.1, scheme="events")
    w.add_static("floor", face.ground(), material="ice")
    velocity = face.at(2.0, 0.0)
    w.add_body(
        "block", face.box(0.2), density=20.0, position=face.at(0, 0.1), velocity=velocity, material="wood"
    )
    w.set_pair("ice", "wood", friction=0.4)
    seed = np.zeros((2, face.dimension))
    seed[1, 0] = 1.0
    found = gradient.record(w, 8).pullback({"position": seed}, at=8)
    by_friction, by_restitution = found["pairs"][("ice", "wood")]
    assert by_friction == pytest.approx(-(2.0**2) / (2 * 0.4**2 * 9.81), abs=1e-9)
    assert by_restitution == 0.0
    assert not found["friction"].any()


def test_a_contact_set_on_an_edge_is_flagged(face: Face) -> None:
    w = face.world(dt=0.1, scheme="events")
    w.add_static("floor", face.ground())
    w.add_body("box", face.box(0.2), density=20.0, position=face.at(0, 0.5), restitution=0.5)
    flags = gradient.record(w, 4).flags
    assert {f.reason for f in flags} >= {"simultaneous"}
    assert flags[0].bodies == ("floor", "box")
    assert "arrive at once" in str(flags[0])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"steps": -1}, "steps must be >= 0"),
        ({"steps": 2.5}, "steps must be a whole number"),
        ({"steps": 2, "stretch": 0}, "stretch must be >= 1"),
        ({"steps": 2, "forces": np.zeros((2, 3, 2))}, r"forces must have shape \(2, 2, 2\)"),
        ({"steps": 2, "torques": np.full((2, 2), np.nan)}, "torques must be finite"),
        ({"steps": 2, "initial": {"speed": np.zeros(2)}}, "unknown field of a state 'speed'"),
        ({"steps": 2, "initial": {"velocity": np.zeros(2)}}, "must have shape"),
    ],
)
def test_wrong_input_is_refused(arguments: dict[str, Any], words: str) -> None:
    w = thrown(FACES[0])
    with pytest.raises(BuildError, match=words):
        gradient.record(w, **arguments)


def test_what_has_no_gradient_is_refused_by_name() -> None:
    w = planar.World()
    with pytest.raises(BuildError, match=r"scheme has no gradient: fixed_step; set scheme = \"events\""):
        gradient.record(w, 1)
    w = thrown(FACES[0])
    w.add_force("wind", lambda t, x, v: np.zeros_like(x))
    with pytest.raises(BuildError, match="force field has no gradient: 'wind'"):
        gradient.record(w, 1)
    w = thrown(FACES[0])
    w["ball"].apply_force((1.0, 0.0))
    with pytest.raises(BuildError, match="body 'ball': force is waiting"):
        gradient.record(w, 1)


def test_wrong_cotangents_are_refused() -> None:
    rollout = gradient.record(thrown(FACES[0]), 2)
    with pytest.raises(BuildError, match="unknown cotangent 'positon'"):
        rollout.pullback({"positon": np.zeros((3, 2, 2))})
    with pytest.raises(BuildError, match="must have shape"):
        rollout.pullback({"position": np.zeros((2, 2))})
    with pytest.raises(BuildError, match="at must be a state"):
        rollout.pullback({"position": np.zeros((2, 2))}, at=3)


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_core_of_the_example_for_jax_finds_the_push() -> None:
    core = example("gradients_jax")
    speed = 2.0
    for _ in range(60):
        velocity = np.array([speed, 0.0])
        miss = core.forward(velocity)[0] - core.MARK
        speed -= 0.3 * float(core.backward(velocity, np.array([2 * miss, 0.0]))[0])
    assert speed == pytest.approx(np.sqrt(2 * 0.4 * 9.81 * core.MARK), abs=1e-6)


def test_the_core_of_the_example_for_torch_finds_the_throw() -> None:
    core = example("gradients_torch")
    velocity: Floats = np.array([1.0, -1.0])
    for _ in range(30):
        end, rollout = core.forward(velocity)
        rows = [core.backward(rollout, unit) for unit in np.eye(2)]
        velocity = velocity - np.linalg.solve(np.array(rows), end - core.TARGET)
    assert core.forward(velocity)[0] == pytest.approx(core.TARGET, abs=1e-9)


@pytest.mark.parametrize("framework", ["jax", "torch"])
def test_the_examples_run_where_their_framework_is_installed(
    framework: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip(
        framework, reason=f"{framework} is not among carom's dependencies: pip install {framework}"
    )
    runpy.run_path(str(EXAMPLES / f"gradients_{framework}.py"), run_name="__main__")
    assert "needs" not in capsys.readouterr().out
