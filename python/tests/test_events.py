"""The scheme "events" from Python: its settings, its report, and that a textbook scene comes out exact."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from carom import EVENT_KINDS, BuildError, EventReport, planar, spatial
from carom.check_run import check_run

G = 9.81


def bouncing(dt: float, **settings: Any) -> planar.World:
    """A ball that falls from a metre and bounces with .8."""
    w = planar.World(scheme="events", dt=dt, **settings)
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.0)
    w.add_body("ball", planar.Circle(0.1), density=1000.0, position=(0, 1.1), restitution=0.8, friction=0.0)
    return w


def test_a_bounce_is_found_inside_a_step_of_a_tenth() -> None:
    w = bouncing(0.1)
    arrivals = 0
    for _ in range(10):
        report = w.step()
        assert isinstance(report.events, EventReport)
        arrivals += report.events.arrivals
    first = (2 / G) ** 0.5
    flight = w.time - first
    exact = 0.8 * G * first * flight - 0.5 * G * flight**2
    assert arrivals == 1
    assert w["ball"].position[1] - 0.1 == pytest.approx(exact, abs=1e-12)
    assert abs(w.ledger["closure"]) < 1e-10


def test_a_slide_in_space_stops_where_the_closed_form_says() -> None:
    w = spatial.World(scheme="events", dt=0.1)
    w.add_static("floor", spatial.HalfSpace(normal=(0, 0, 1)), friction=0.5)
    block = spatial.Box(0.4, 0.3, 0.2)
    w.add_body("block", block, density=1000.0, position=(0, 0, 0.1), velocity=(4, 3, 0), friction=0.5)
    run = w.run(1.5)
    x = w["block"].position
    assert float(x[0] ** 2 + x[1] ** 2) ** 0.5 == pytest.approx(25 / G, abs=1e-10)
    assert float(3 * x[0] - 4 * x[1]) == pytest.approx(0, abs=1e-10)
    assert run.ledger["friction"][-1] == pytest.approx(-300.0, abs=1e-9)


def test_choices_of_the_scheme_are_settings_and_wrong_ones_are_refused() -> None:
    w = planar.World(scheme="events", events={"touching": 1e-6})
    assert w.events["touching"] == 1e-6
    assert w.events["slip_stops"] == 16
    assert (w.solver, w.impact) == (None, None)
    with pytest.raises(BuildError, match="touching"):
        w.events = {"touching": -1.0}
    with pytest.raises(BuildError, match="half-way"):
        w.integrator = "rk4"


def test_a_recorded_run_with_events_closes_its_books(tmp_path: Path) -> None:
    w = bouncing(0.05)
    path = tmp_path / "run.h5"
    w.run(1.0, out=path, every=1)
    told = check_run(path)
    verdicts = {check.name: check.verdict for check in told.checks}
    assert verdicts["ledger"] == verdicts["closure"] == "ok"
    assert "failed" not in verdicts.values(), json.dumps(verdicts)


def test_a_heap_without_moments_is_told_and_checked(tmp_path: Path) -> None:
    w = spatial.World(scheme="events", dt=0.01, events={"plastic_arrivals": "within_the_step"})
    w.add_static("floor", spatial.HalfSpace(normal=(0, 0, 1)), friction=0.5)
    for i in range(4):
        shape = spatial.Sphere(0.1) if i % 2 else spatial.Box(0.3, 0.2, 0.2)
        place = (0.04 * i, 0.03 * i, 0.3 + 0.3 * i)
        w.add_body(f"body{i}", shape, density=1000.0, position=place, friction=0.5, restitution=0.0)
    run = w.run(0.6, out=tmp_path / "heap.h5", every=1)
    assert run.events is not None
    kinds = {EVENT_KINDS[k] for frame in run.events for k in frame["kind"]}
    assert {"slowed", "closing"} <= kinds
    assert check_run(tmp_path / "heap.h5").ok
    with pytest.raises(BuildError, match="plastic_arrivals"):
        w.events = {"plastic_arrivals": "later"}
