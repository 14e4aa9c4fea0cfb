"""Snapshots, pickles and copies continue the same trajectory, bit for bit, warm starts included."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spaces import PLANE, SPACE, Face, both

from carom import BuildError, Snapshot


def trajectory(w: Any, steps: int) -> bytes:
    """All numbers of a stretch of motion, as bytes."""
    chunk = w._advance(steps, w.dt, 1)
    parts = (
        chunk.position,
        chunk.rotation,
        chunk.velocity,
        chunk.angular_velocity,
        chunk.contacts,
        chunk.steps,
    )
    return b"".join(part.tobytes() for part in parts)


def in_the_middle(face: Face) -> Any:
    """A pile whose contacts are warm, with so few iterations that it matters, and a force is waiting."""
    w = face.pile(8, iterations=4)
    for _ in range(150):
        w.step()
    w["b3"].apply_force(face.at(5.0, 1.0))
    return w


@both
def test_a_restored_world_takes_the_same_way(face: Face) -> None:
    w = in_the_middle(face)
    snapshot = w.snapshot()
    assert isinstance(snapshot, Snapshot)
    assert snapshot.time == w.time
    assert snapshot.space == face.module.__name__.split(".")[-1]
    first = trajectory(w, 100)
    w.restore(snapshot)
    assert trajectory(w, 100) == first
    other = face.world()
    other.add_body("gone", mass=1.0)
    other.restore(bytes(snapshot))
    assert other.snapshot() == snapshot
    assert trajectory(other, 100) == first


@both
def test_the_warm_start_is_part_of_it(face: Face) -> None:
    """The control: without warm starts the way is another, so the test above would notice their loss."""
    w = in_the_middle(face)
    cold = copy.deepcopy(w)
    cold.warm_start = False
    assert trajectory(cold, 20) != trajectory(w, 20)


@both
@pytest.mark.parametrize("remade", [lambda w: pickle.loads(pickle.dumps(w)), copy.deepcopy, copy.copy])
def test_pickles_and_copies_take_the_same_way(face: Face, remade: Any) -> None:
    w = in_the_middle(face)
    other = remade(w)
    assert type(other) is type(w)
    assert other.names == w.names
    assert trajectory(other, 100) == trajectory(w, 100)


@both
def test_copies_are_independent(face: Face) -> None:
    w = face.stack(2)
    other = copy.deepcopy(w)
    other["box0"].velocity = face.at(9.0, 0.0)
    other.solver = "lemke"
    other.remove("box1")
    assert w["box0"].velocity[0] == 0.0
    assert w.solver is None
    assert "box1" in w


@both
def test_force_fields_and_snapshots(face: Face) -> None:
    w = face.stack(1)
    w.add_force("wind", lambda t, x, v: 0.1 * np.ones_like(x))
    snapshot = w.snapshot()
    with pytest.raises(BuildError, match=r"cannot be pickled \('wind'\); remove_force before pickling"):
        pickle.dumps(w)
    other = copy.deepcopy(w)
    assert other.forces == ("wind",)
    assert trajectory(other, 20) == trajectory(w, 20)
    bare = face.world()
    with pytest.raises(
        BuildError, match="needs the force field 'wind', which this world has not; call add_force"
    ):
        bare.restore(snapshot)
    assert len(bare) == 0
    w.add_force("later", lambda t, x, v: x)
    w.restore(snapshot)
    assert w.forces == ("wind",)


def test_what_is_no_snapshot() -> None:
    w = PLANE.stack(1)
    before = w.snapshot()
    for wrong in (
        b"",
        b"{}",
        b"\xff\xfe",
        bytes(SPACE.stack(1).snapshot()),
        bytes(before).replace(b"version", b"vision"),
    ):
        with pytest.raises(BuildError, match=r"^snapshot"):
            w.restore(wrong)
    with pytest.raises(BuildError, match="snapshot must be a snapshot, got 5"):
        w.restore(5)
    assert w.snapshot() == before


SCRIPT = """
import hashlib, sys
sys.path.insert(0, {folder!r})
from spaces import PLANE, SPACE
from test_snapshot import trajectory
print(*(hashlib.sha256(trajectory(face.pile(8, iterations=10), 300)).hexdigest() for face in (PLANE, SPACE)))
"""


def test_another_process_takes_the_same_way() -> None:
    """Two fresh interpreters with different hash seeds, and this one."""
    import hashlib

    script = SCRIPT.format(folder=str(Path(__file__).parent))
    runs = [
        subprocess.run(
            [sys.executable, "-c", script], env={"PYTHONHASHSEED": seed}, capture_output=True, text=True
        )
        for seed in ("1", "2")
    ]
    here = [
        hashlib.sha256(trajectory(face.pile(8, iterations=10), 300)).hexdigest() for face in (PLANE, SPACE)
    ]
    for run in runs:
        assert run.returncode == 0, run.stderr
        assert run.stdout.split() == here
