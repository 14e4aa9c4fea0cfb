"""The interpreter's lock is free while the engine steps and solves."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import pytest
from spaces import PLANE, SPACE


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


@pytest.mark.parametrize("face", [PLANE, SPACE], ids=["planar", "spatial"])
def test_a_long_call_leaves_other_threads_alone(face: Any) -> None:
    w = face.pile(20)
    begun = time.perf_counter()
    w._advance(20, w.dt, 0)
    steps = max(100, int(0.6 / (time.perf_counter() - begun) * 20))
    longest, turns, duration = pace_beside(lambda: w._advance(steps, w.dt, 0))
    assert duration > 0.1
    assert turns > 20
    assert longest < duration / 2


def test_a_run_leaves_other_threads_alone() -> None:
    w = PLANE.pile(20)
    longest, turns, duration = pace_beside(lambda: w.run(4.0))
    assert turns > 20
    assert longest < max(0.1, duration / 2)


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
