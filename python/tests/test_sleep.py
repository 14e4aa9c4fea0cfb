"""Sleep in soft steps, as users see it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import carom
from carom import planar, spatial
from carom.cli import main
from carom.run import Run

SPACES = pytest.mark.parametrize("space", [planar, spatial])


def drowsy(space: Any) -> Any:
    """Two boxes that fall a little, far from each other, on a floor."""
    w = space.World(scheme="soft_step", soft={"sleeping": True}, dt=1 / 60)
    d = len(w.gravity)
    up = np.eye(d)[-1]
    w.add_static("floor", planar.HalfPlane(up) if d == 2 else spatial.HalfSpace(up))
    for name, x in [("one", 0.0), ("other", 5.0)]:
        place = 0.52 * up
        place[0] = x
        w.add_body(name, space.Box((1.0,) * d), density=10.0, position=place)
    return w


@SPACES
def test_what_rests_falls_asleep_and_wakes_when_it_is_asked_to(space: Any) -> None:
    w = drowsy(space)
    reports = [w.step() for _ in range(120)]
    assert [r.asleep for r in (reports[0], reports[-1])] == [0, 2]
    assert w.asleep.tolist() == [False, True, True]
    assert w["one"].asleep
    assert not w["floor"].asleep
    assert w.ledger["sleep"] <= 0
    assert sum(r.ledger["sleep"] for r in reports) == pytest.approx(w.ledger["sleep"])
    assert np.all(w.velocity == 0)
    w.wake("one")
    assert w.asleep.tolist() == [False, False, True]
    w.wake()
    assert not w.asleep.any()
    with pytest.raises(carom.BuildError, match="thing"):
        w.wake("thing")
    with pytest.raises(ValueError, match="read-only"):
        w.asleep[0] = True


@SPACES
def test_arrays_that_are_written_wake_what_they_touch(space: Any) -> None:
    w = drowsy(space)
    for _ in range(120):
        w.step()
    velocity = w.velocity
    w.step()
    assert w.asleep.sum() == 2, "looking wakes nobody"
    velocity[1, 0] = 0.5
    w.step()
    assert w.asleep.tolist() == [False, False, True]
    w["other"].apply_impulse((1.0, *(0.0,) * (len(w.gravity) - 1)))
    w.step()
    assert not w.asleep.any()


@SPACES
def test_recording_of_what_sleeps_is_checked_and_its_books_close(space: Any, tmp_path: Any) -> None:
    w = drowsy(space)
    path = tmp_path / "run.h5"
    run = w.run(3.0, out=path)
    assert w.asleep.sum() == 2
    assert run.ledger["sleep"][-1] == pytest.approx(w.ledger["sleep"])
    assert Run.load(path).ledger.totals()["sleep"] == pytest.approx(w.ledger["sleep"])
    assert main(["check", str(path)]) == 0


@SPACES
def test_snapshot_has_who_sleeps(space: Any) -> None:
    w = drowsy(space)
    for _ in range(120):
        w.step()
    other = space.World()
    other.restore(w.snapshot())
    assert other.asleep.tolist() == w.asleep.tolist()


def test_sleeping_is_refused_where_it_makes_no_sense() -> None:
    for field, value in [("sleep_speed", -1.0), ("sleep_time", float("nan"))]:
        with pytest.raises(carom.BuildError, match=field):
            planar.World(scheme="soft_step", soft={field: value})
