"""Bowls and drums from Python: worlds, scene files, recordings and their check, gradients."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checked import failed
from spaces import Face, both

import carom
from carom import BuildError, gradient, load_scene
from carom.check_run import check_run
from carom.errors import SceneError


def bowl(face: Face, **settings: Any) -> Any:
    """A ball of .1 m in a bowl of 1 m, let go .2 rad from its lowest point."""
    w = face.world(**{"dt": 0.01, "scheme": "events", **settings})
    w.add_static("bowl", face.module.Cavity(1.0), friction=0.8)
    place = face.at(0.9 * np.sin(0.2), -0.9 * np.cos(0.2))
    w.add_body("ball", face.ball(0.1), mass=1.0, position=place, friction=0.8)
    return w


@both
def test_a_ball_rolls_to_and_fro_and_keeps_its_energy_and_its_gap(face: Face) -> None:
    w = bowl(face)
    start = w.energy["total"]
    lowest = -np.inf
    swing = 9.81 * 0.9 * (1 - np.cos(0.2))
    for _ in range(300):
        w.step()
        lowest = max(lowest, abs(float(np.linalg.norm(w["ball"].position)) - 0.9))
    # where friction turns round, the roll is taken for slips that stop (docs/guide/limits.md)
    assert w.energy["total"] == pytest.approx(start, abs=1e-6 * swing)
    assert lowest < 1e-9


@both
def test_a_recording_of_a_bowl_passes_its_check(face: Face, tmp_path: Path) -> None:
    bowl(face, on_inaccurate="ignore").run(1.0, out=tmp_path / "run.h5")
    assert failed(check_run(tmp_path / "run.h5")) == {}


def test_a_bowl_of_a_scene_file_and_one_that_cannot_be(tmp_path: Path) -> None:
    text = """
schema_version = 1
space = "planar"
[[body]]
name = "drum"
kind = "static"
shape = { type = "cavity", radius = RADIUS }
[[body]]
name = "box"
shape = { type = "box", size = [0.2, 0.2] }
mass = 1.0
position = [0.1, 0.0]
"""
    path = tmp_path / "drum.toml"
    path.write_text(text.replace("RADIUS", "0.5"))
    w = load_scene(path).build()
    w.scheme = "events"
    for _ in range(200):
        w.step()
    assert np.linalg.norm(w["box"].position) < 0.5
    path.write_text(text.replace("RADIUS", "-0.5"))
    with pytest.raises(SceneError, match="radius"):
        load_scene(path)
    with pytest.raises(BuildError, match="mass"):
        carom.planar.World().add_body("drum", carom.planar.Cavity(1.0), mass=1.0)


@both
def test_a_gradient_through_a_bowl_is_that_of_differences(face: Face) -> None:
    steps, change = 20, 1e-5

    def end(push: float) -> float:
        w = bowl(face)
        w["ball"].velocity = face.at(push, 0.0)
        for _ in range(steps):
            w.step()
        return float(w["ball"].position[0])

    rollout = gradient.record(bowl(face), steps=steps)
    seed = np.zeros((2, face.dimension))
    seed[1, 0] = 1.0
    found = rollout.pullback({"position": seed}, at=-1)["velocity"][1, 0]
    assert found == pytest.approx((end(change) - end(-change)) / (2 * change), rel=1e-6)
