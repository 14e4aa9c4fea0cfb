"""Runs: how often frames come, what survives failures and Ctrl-C, what a run says of itself."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest
from scripted import ScriptedWorld

from carom.errors import BuildError, StepError
from carom.run import Moment, Run, run_world


def test_frame_zero_is_the_initial_state_and_every_step_is_a_record(world: ScriptedWorld) -> None:
    start = world.position.copy()
    run = run_world(world, 0.5)
    assert len(run.steps) == 50
    assert len(run.time) == 51
    assert np.array_equal(run.position[0], start)
    assert np.array_equal(run.position[-1], world.position)
    assert run.steps["time"] == pytest.approx(np.arange(1, 51) * 0.01)


@pytest.mark.parametrize("every", [2, 7, 50, 1000])
def test_frames_come_after_every_so_manieth_step_and_at_the_end(every: int) -> None:
    run = run_world(ScriptedWorld(), 0.5, every=every)
    wanted = sorted({0, *range(every, 51, every), 50})
    assert len(run.steps) == 50
    assert run.time == pytest.approx(np.array(wanted) * 0.01)


def test_slow_steps_are_frames_too_although_calls_are_shorter_than_a_frame() -> None:
    world = ScriptedWorld(delay=0.03)
    run = run_world(world, 0.2, every=10)
    assert run.time == pytest.approx([0.0, 0.1, 0.2])
    assert max(steps for steps, _, _ in world.calls) < 10


def test_fast_steps_go_many_to_a_call() -> None:
    world = ScriptedWorld()
    run_world(world, 20.0, every=3)
    assert len(world.calls) < 200


def test_last_step_is_shortened_to_end_at_the_duration(world: ScriptedWorld) -> None:
    run = run_world(world, 0.105)
    assert len(run.steps) == 11
    assert run.time[-1] == pytest.approx(0.105, abs=1e-15)
    assert world.calls[-1][1] == pytest.approx(0.005)


def test_settings_of_a_run_do_not_outlive_it(world: ScriptedWorld) -> None:
    run = run_world(world, 0.1, solver="lemke", iterations=3, tolerance=0.0)
    assert run.settings["solver"] == "lemke"
    assert run.settings["iterations"] == 3
    assert world.settings["solver"] == "pgs"
    assert world.settings["iterations"] == 10


def test_failed_step_raises_and_keeps_every_step_before_it() -> None:
    world = ScriptedWorld(fails_at=37)
    with pytest.raises(StepError, match="ball0"):
        run_world(world, 1.0, every=10)
    assert world.last_run.status == "failed"
    assert len(world.last_run.steps) == 37
    assert world.last_run.time == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.37])


def test_interrupt_keeps_what_is_done_and_is_raised() -> None:
    world = ScriptedWorld(delay=0.005)
    timer = threading.Timer(0.4, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    begun = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        run_world(world, 100.0)
    assert time.perf_counter() - begun < 25.0
    run = world.last_run
    assert run.status == "interrupted"
    assert 0 < len(run.steps) < 10_000
    assert len(run.time) == len(run.steps) + 1
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_run_from_another_thread_leaves_signals_alone() -> None:
    runs: list[Run] = []
    thread = threading.Thread(target=lambda: runs.append(run_world(ScriptedWorld(), 0.1)))
    thread.start()
    thread.join()
    assert runs[0].status == "complete"


def test_progress_tells_time_steps_and_the_last_record(world: ScriptedWorld) -> None:
    moments: list[Moment] = []
    run_world(world, 0.5, progress=moments.append)
    assert moments[-1].time == pytest.approx(0.5)
    assert moments[-1].steps == 50
    assert [moment.steps for moment in moments] == sorted(moment.steps for moment in moments)
    assert moments[-1].last["residual"] > 0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": float("nan")}, "duration"),
        ({"duration": "5"}, "duration"),
        ({"duration": 1.0, "dt": -0.1}, "dt"),
        ({"duration": 1.0, "every": 0}, "every"),
        ({"duration": 1.0, "every": 1.5}, "every"),
        ({"duration": 1e12}, "duration"),
    ],
)
def test_impossible_arguments_are_refused_with_field_value_and_remedy(
    world: ScriptedWorld, arguments: dict[str, object], field: str
) -> None:
    with pytest.raises(BuildError) as caught:
        run_world(world, **arguments)  # type: ignore[arg-type]
    assert caught.value.field == field
    assert caught.value.remedy
    assert field in str(caught.value)


def test_worst_residual_and_deepest_penetration_name_step_and_bodies(world: ScriptedWorld) -> None:
    run = run_world(world, 2.0)
    step = int(np.argmax(run.steps["residual"]))
    assert run.worst.step == step
    assert run.worst.value == run.steps["residual"].max() == run.worst_residual
    assert run.worst.between == ("ball0", "floor")
    assert "ball0 / floor" in run.worst.where()
    assert run.deepest_penetration == pytest.approx(-run.steps["deepest_gap"].min())
    assert run.deepest_penetration > 0


def test_nothing_overlapping_is_no_penetration(world: ScriptedWorld) -> None:
    run = run_world(world, 0.1)
    assert run.deepest_penetration == 0.0
    assert run.deepest.between is None


def test_ledger_cumulates_the_work_of_steps(world: ScriptedWorld) -> None:
    run = run_world(world, 0.3)
    assert run.ledger["gravity"][-1] == pytest.approx(run.ledger.kinetic[-1])
    assert run.energy_closure == pytest.approx(np.abs(np.cumsum(run.steps["closure"])).max())
    assert run.energy_closure < 1e-12


def test_contacts_of_a_time_are_those_of_the_nearest_frame(world: ScriptedWorld) -> None:
    run = run_world(world, 1.0)
    first = next(i for i, rows in enumerate(run.contacts) if len(rows))
    assert len(run.contacts.at(run.time[first] + 0.004)) == len(run.contacts[first]) > 0
    assert run.contacts[first]["a"][0] == 1
    assert len(run.contacts.all()) == run.contacts.offsets[-1] == sum(len(rows) for rows in run.contacts)


def test_repr_states_steps_residual_and_closure(world: ScriptedWorld) -> None:
    text = repr(run_world(world, 0.5))
    assert text.startswith("<Run 50 steps, worst residual 7.0e-06 m/s, energy closure ")
