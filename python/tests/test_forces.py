"""Force fields and densities that users write: what they get, what they may return, what their errors do."""

from __future__ import annotations

import gc
import math
import weakref
from typing import Any

import numpy as np
import pytest
from spaces import PLANE, Face, both

from carom import BuildError, StepError, planar, spatial


@both
def test_a_spring_swings_at_its_frequency(face: Face) -> None:
    """m x'' = -k x by the trapezoid with the force at mid-step: order 2."""
    errors = []
    for dt in (0.01, 0.005):
        w = face.world(gravity=np.zeros(face.dimension), dt=dt)
        body = w.add_body("b", mass=2.0, position=face.at(1.0, 0.0))
        w.add_force("spring", lambda t, x, v: -8.0 * x)
        for _ in range(round(1.0 / dt)):
            w.step()
        errors.append(abs(body.position[0] - math.cos(2.0)))
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


@both
def test_time_forces_and_torques(face: Face) -> None:
    w = face.world(gravity=np.zeros(face.dimension), dt=0.5)
    body = w.add_body("b", face.box(1.0), mass=6.0)
    w.add_static("far", face.box(1.0), position=face.at(50, 50))
    times: list[float] = []

    def field(t: float, x: Any, v: Any) -> Any:
        times.append(t)
        assert not x.flags.writeable
        torque = np.array([face.spin(2.0)] * 2)
        return {"force": np.array([face.at(12.0, 0.0)] * 2), "torque": torque}

    w.add_force("field", field)
    assert w.forces == ("field",)
    report = w.step()
    assert times == [0.25]
    assert body.velocity == pytest.approx(face.at(1.0, 0.0))
    assert body.angular_velocity == pytest.approx(face.spin(1.0))
    assert w["far"].velocity.tolist() == [0.0] * face.dimension
    assert report.ledger["applied"] == pytest.approx(report.energy)
    w.add_force("field", lambda t, x, v: {"torque": np.array([face.spin(-2.0)] * 2)})
    w.step()
    assert body.angular_velocity == pytest.approx(face.spin(0.0), abs=1e-15)
    w.remove_force("field")
    assert w.forces == ()
    w.step()
    assert len(times) == 1


class OverheatedError(Exception):
    pass


@both
def test_an_exception_in_a_force_field_comes_out_and_nothing_has_changed(face: Face) -> None:
    w = face.pile(4)
    for _ in range(50):
        w.step()
    calls = 0

    def field(t: float, x: Any, v: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise OverheatedError("sensor 7")
        return np.zeros_like(x)

    w.add_force("field", field)
    w.step()
    w.step()
    before = w.snapshot()
    with pytest.raises(OverheatedError, match="sensor 7") as caught:
        w.step()
    assert any("field" in entry.name for entry in caught.traceback)
    assert w.snapshot() == before
    w.step()
    assert w.time == pytest.approx(53 * w.dt)


@both
@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda x: None, r"force must be a \(2, \d\) array, got None"),
        (
            lambda x: x[0],
            r"force must be a \(2, \d\) array, got shape \(\d,\); return a row for each body in N",
        ),
        (lambda x: "push", r"force must be a \(2, \d\) array, got 'push'"),
        (lambda x: {"forces": x}, "unknown key 'forces'; give 'force' and 'torque'"),
        (lambda x: {"force": x, "torque": x[0, 0]}, r"torque must be a \(2"),
        (lambda x: x + np.inf, r"gives body 'floor' force .* return finite numbers"),
    ],
)
def test_wrong_answers_of_force_fields(face: Face, answer: Any, message: str) -> None:
    w = face.stack(1)
    before = w.snapshot()
    w.add_force("wind", lambda t, x, v: answer(x))
    with pytest.raises(StepError, match=f"force field 'wind'.*{message}") as caught:
        w.step()
    assert caught.value.field == "wind"
    w.remove_force("wind")
    assert w.snapshot() == before


def test_a_world_that_its_force_field_refers_to_is_collected() -> None:
    w = PLANE.stack(1)
    w.add_force("self", lambda t, x, v, w=w: 0.0 * x)
    w.step()
    trace = weakref.ref(w)
    del w
    gc.collect()
    assert trace() is None


def test_a_density_function_in_the_plane() -> None:
    """Item 11. Density r^2 over a disc of radius R: m = pi R^4 / 2, I = pi R^6 / 3."""
    w = planar.World()
    radius = 2.0
    body = w.add_body(
        "d", planar.Circle(radius), density=lambda p: (p**2).sum(axis=1), density_tolerance=1e-9
    )
    found = body.mass_properties
    assert found.mass == pytest.approx(math.pi * radius**4 / 2, rel=1e-9)
    assert found.inertia == pytest.approx(math.pi * radius**6 / 3, rel=1e-9)
    assert found.center_of_mass == pytest.approx([0, 0], abs=1e-9)
    assert 0 <= found.error < 1e-9
    assert found.quadrature_error == found.error


def test_a_density_function_with_a_jump_in_space() -> None:
    """Item 12. The half z < 0 of a ball is heavier: m = 2 pi R^3 (a + b) / 3, z_c = pi R^4 (a - b) / 4 m."""
    above, below, radius = 900.0, 4900.0, 0.03
    found = spatial.mass_properties(
        spatial.Sphere(radius), density=lambda p: above + (below - above) * (p[:, 2] < 0), tolerance=1e-5
    )
    mass = 2 * math.pi * radius**3 / 3 * (above + below)
    height = math.pi * radius**4 * (above - below) / (4 * mass)
    assert found.mass == pytest.approx(mass, rel=1e-5)
    assert found.center_of_mass == pytest.approx([0, 0, height], abs=1e-5 * radius)
    assert abs(found.mass / mass - 1) <= found.error
    w = spatial.World()
    egg = w.add_body("egg", spatial.Sphere(radius), density=lambda p: above + (below - above) * (p[:, 2] < 0))
    assert egg.mass == pytest.approx(mass, rel=1e-6)


@both
@pytest.mark.parametrize(
    ("density", "error", "message"),
    [
        (lambda p: 1 / 0, ZeroDivisionError, "division by zero"),
        (
            lambda p: p,
            BuildError,
            r"density must return \(\d+,\) numbers, got .*; take \(n, d\) points and return",
        ),
        (lambda p: "heavy", BuildError, r"density must return \(\d+,\) numbers, got 'heavy'"),
        (
            lambda p: -np.ones(len(p)),
            BuildError,
            "density: the function is -1 at .* return finite values >= 0",
        ),
    ],
)
def test_wrong_densities(face: Face, density: Any, error: type[Exception], message: str) -> None:
    w = face.world()
    with pytest.raises(error, match=message) as caught:
        w.add_body("b", face.ball(1.0), density=density)
    if isinstance(caught.value, BuildError):
        assert (caught.value.body, caught.value.field) == ("b", "density")
    assert len(w) == 0


@both
def test_mass_properties_without_a_world(face: Face) -> None:
    found = face.module.mass_properties(face.box(2.0), density=3.0)
    assert found.mass == pytest.approx(3.0 * 2.0**face.dimension)
    assert found.error == 0.0
    heavier = face.module.mass_properties(face.box(2.0), mass=2 * found.mass)
    assert np.asarray(heavier.inertia) == pytest.approx(2 * np.asarray(found.inertia))
    with pytest.raises(BuildError, match="give one of them"):
        face.module.mass_properties(face.box(2.0))
    with pytest.raises(BuildError, match="shape: a half-"):
        face.module.mass_properties(face.ground(), density=1.0)
