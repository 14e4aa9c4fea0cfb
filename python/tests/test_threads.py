"""The interpreter's lock is free while the engine steps and solves; threads of a step change no bit of it."""

from __future__ import annotations

import copy
import hashlib
import os
import pickle
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from spaces import PLANE, SPACE, both

from carom import BuildError


def pace_beside(job: Callable[[], Any]) -> tuple[float, int, float]:
    """What this thread got while another one did the job: longest pause [s], turns, duration [s]."""
    done = threading.Event()

    def work() -> None:
        job()
        done.set()

    thread = threading.Thread(target=work)
    begun = last = time.perf_counter()
    thread.start()
    turns, longest = 0, 0.0
    while not done.is_set():
        now = time.perf_counter()
        longest = max(longest, now - last)
        last = now
        turns += 1
        time.sleep(0.0005)
    thread.join()
    return longest, turns, time.perf_counter() - begun


def leaves_others_alone(job: Callable[[int], Any]) -> list[tuple[float, int, float]]:
    """Paces beside the job, ever larger, until one lets this thread work; a machine may stand still at times.

    A job that holds the interpreter's lock gives this thread a turn or two however long it is.
    """
    paces: list[tuple[float, int, float]] = []
    for doubled in range(7):
        longest, turns, duration = pace_beside(lambda size=2**doubled: job(size))  # type: ignore[misc]
        paces.append((longest, turns, duration))
        if turns > 20 and longest < duration / 2:
            return []
    return paces


@pytest.mark.parametrize("face", [PLANE, SPACE], ids=["planar", "spatial"])
def test_a_long_call_leaves_other_threads_alone(face: Any) -> None:
    w = face.pile(20)
    assert leaves_others_alone(lambda size: w._advance(50 * size, w.dt, 0)) == []


def test_a_run_leaves_other_threads_alone() -> None:
    w = PLANE.pile(20)
    assert leaves_others_alone(lambda size: w.run(float(size))) == []


def test_worlds_step_side_by_side() -> None:
    worlds = [PLANE.pile(6, seed=seed) for seed in range(4)]
    alone = [PLANE.pile(6, seed=seed) for seed in range(4)]
    threads = [threading.Thread(target=lambda w=w: [w.step() for _ in range(100)]) for w in worlds]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for w, reference in zip(worlds, alone, strict=True):
        for _ in range(100):
            reference.step()
        assert w.snapshot() == reference.snapshot()


def wall(face: Any, **settings: Any) -> Any:
    """Blocks in a wall large enough to be shared."""
    w = face.world(dt=1 / 60, on_inaccurate="ignore", **settings)
    w.add_static("floor", face.ground(), friction=0.5)
    for i in range(600):
        row, column = divmod(i, 30)
        place = face.at(1.01 * column, 0.49 + row)
        w.add_body(f"b{i}", face.box(1.0), density=2.0, position=place, friction=0.5)
    return w


@both
@pytest.mark.parametrize("scheme", ["soft_step", "fixed_step"])
def test_any_number_of_threads_gives_the_same_snapshot(face: Any, scheme: str) -> None:
    worlds = [wall(face, scheme=scheme, iterations=8, threads=n) for n in (1, 2, 8)]
    for w in worlds:
        for _ in range(4):
            w.step()
    assert [w.threads for w in worlds] == [1, 2, 8]
    assert worlds[0].snapshot() == worlds[1].snapshot() == worlds[2].snapshot()


@both
def test_threads_stay_with_a_world_and_not_with_its_snapshots(face: Any) -> None:
    w = face.stack(2)
    assert w.threads == 1
    assert "threads" not in w.settings
    kept = w.snapshot()
    w.threads = np.int64(3)
    assert w.snapshot() == kept
    w.restore(kept)
    assert w.threads == 3
    assert copy.deepcopy(w).threads == 3
    assert pickle.loads(pickle.dumps(w)).threads == 1


@both
@pytest.mark.parametrize("bad", [0, -1, 257, 2**70, 1.5, "2", None, True])
def test_a_number_of_threads_that_cannot_be_is_refused(face: Any, bad: Any) -> None:
    w = face.world(threads=2)
    with pytest.raises(BuildError, match=r"threads must be .*1 to 256, got") as told:
        w.threads = bad
    assert told.value.field == "threads"
    assert told.value.value == bad
    assert "cores" in str(told.value.remedy)
    assert w.threads == 2
    with pytest.raises(BuildError, match="threads"):
        face.world(threads=bad)


@both
@pytest.mark.parametrize("scheme", ["soft_step", "fixed_step", "events"])
def test_a_step_tells_where_its_time_went(face: Any, scheme: str) -> None:
    w = wall(face, scheme=scheme)
    assert w.step_times == (0.0, 0.0, 0.0, 0.0)
    begun = time.perf_counter()
    w.step()
    told, taken = w.step_times, time.perf_counter() - begun
    assert min(told) >= 0.0
    assert told.solve > 0.0
    assert told.whole == told.pairs + told.contacts + told.solve + told.rest
    assert told.whole <= taken
    assert scheme == "events" or min(told.pairs, told.contacts) > 0.0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_forked_process_steps_without_the_threads_it_has_not() -> None:
    w = wall(PLANE, scheme="soft_step", threads=2)
    w.step()
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        w.step()
        os.write(write, hashlib.sha256(bytes(w.snapshot())).digest())
        os._exit(0)
    w.step()
    os.waitpid(child, 0)
    assert os.read(read, 32) == hashlib.sha256(bytes(w.snapshot())).digest()
    os.close(read)
    os.close(write)
