"""`advise`: events are the reference, the cheapest sufficient trial wins, chaos is called so."""

from __future__ import annotations

import json
import math

import pytest

from carom import BuildError, advise, planar
from carom.cli import main


def bouncing() -> planar.World:
    """A ball that bounces: fixed steps err by the step, events by nothing."""
    w = planar.World()
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.0)
    w.add_body("ball", planar.Circle(0.1), density=1000.0, position=(0, 0.5), restitution=0.8, friction=0.0)
    return w


def free() -> planar.World:
    """A stone in the air: every way is exact."""
    w = planar.World()
    w.add_body("stone", planar.Circle(0.1), density=1000.0, position=(0, 9), velocity=(1, 2))
    return w


def heap() -> planar.World:
    """Boxes that drop on the floor and on each other, and stay there."""
    w = planar.World()
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)))
    for k in range(3):
        w.add_body(f"box{k}", planar.Box((0.4, 0.2)), density=1000.0, position=(0.01 * k, 0.15 + 0.3 * k))
    return w


def test_where_bounces_must_be_in_time_events_are_advised_at_a_coarse_step() -> None:
    told = advise(bouncing, 1e-6, seconds=20)
    assert told.is_reached
    assert (told.scheme, told.solver) == ("events", "exact")
    assert told.dt > 1 / 200
    assert told.error <= 1e-6
    assert told.uncertainty <= 1e-6
    fixed = [trial for trial in told.trials if trial.scheme == "fixed_step" and trial.status == "complete"]
    assert min(trial.error for trial in fixed) > 1e-6
    w = bouncing()
    for name, value in told.settings().items():
        setattr(w, name, value)
    w.step()


def test_where_everything_is_exact_the_cheapest_is_advised() -> None:
    told = advise(free, 1e-6, t=0.2, seconds=20)
    complete = [trial for trial in told.trials if trial.status == "complete"]
    assert told.is_reached
    assert told.cost == min(trial.cost for trial in complete)
    assert "cheapest" in str(told)


def test_arrivals_within_the_step_are_tried_beside_those_at_their_moment() -> None:
    told = advise(heap, 1e-3, t=0.4, seconds=20)
    of_events = {trial.plastic_arrivals for trial in told.trials if trial.scheme == "events"}
    assert of_events == {"at_their_moment", "within_the_step"}
    assert all(trial.plastic_arrivals is None for trial in told.trials if trial.scheme == "fixed_step")
    within = [trial for trial in told.trials if trial.plastic_arrivals == "within_the_step"]
    # they err by up to a step's way, and never by nothing
    assert 0 < within[0].error < 5 * within[0].dt
    assert "within_the_step" in str(told)
    w = heap()
    for name, value in told.settings().items():
        setattr(w, name, value)
    assert told.scheme != "events" or w.events["plastic_arrivals"] == told.plastic_arrivals
    w.step()


def test_an_accuracy_beyond_rounding_is_not_promised() -> None:
    told = advise(bouncing, 1e-30, seconds=10)
    assert not told.is_reached
    assert "cannot be told" in told.reason


def test_too_little_time_is_said() -> None:
    with pytest.raises(BuildError, match="no trial came to its end"):
        advise(bouncing, 1e-3, seconds=1e-9)


@pytest.mark.parametrize(("name", "value"), [("accuracy", -1.0), ("t", 0.0), ("seconds", math.nan)])
def test_impossible_arguments_are_refused_by_name(name: str, value: float) -> None:
    given = {"accuracy": 1e-3, "t": 0.1, "seconds": 1.0, name: value}
    with pytest.raises(BuildError, match=name):
        advise(bouncing, given["accuracy"], given["t"], seconds=given["seconds"])


def test_the_command_prints_the_advice_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["advise", "sliding_block_planar", "--time", "0.1", "--seconds", "10", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["scheme"] in ("fixed_step", "events")
    assert len(told["trials"]) >= 3
