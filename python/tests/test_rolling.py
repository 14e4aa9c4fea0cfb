"""Rolling and spinning friction from Python: bodies, scene files, and problems in both file forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spaces import Face, both

from carom import BuildError, ContactProblem, load_scene

RADIUS, SPEED, ROLLING = 0.3, 0.5, 0.01


def rolling(face: Face) -> tuple[Any, Any]:
    w = face.world(dt=1 / 240, tolerance=1e-10, iterations=2000)
    w.add_static("floor", face.ground(), friction=0.8)
    spin = -SPEED / RADIUS if face.dimension == 2 else (0.0, SPEED / RADIUS, 0.0)
    ball = w.add_body(
        "ball",
        face.ball(RADIUS),
        mass=2.0,
        position=face.at(0.0, RADIUS),
        velocity=face.at(SPEED, 0.0),
        angular_velocity=spin,
        friction=0.8,
        rolling_friction=ROLLING,
        spinning_friction=0.002,
    )
    return w, ball


@both
def test_a_rolling_ball_stops_after_its_closed_form_way(face: Face) -> None:
    w, ball = rolling(face)
    assert (ball.rolling_friction, ball.spinning_friction) == (ROLLING, 0.002)
    shape = 0.5 if face.dimension == 2 else 0.4
    slowing = ROLLING * 9.81 / (RADIUS * (1 + shape))
    w.run(1.3 * SPEED / slowing)
    assert ball.position[0] == pytest.approx(SPEED**2 / (2 * slowing), abs=slowing / 240**2)
    assert np.abs(ball.velocity).max() < 1e-9


@both
@pytest.mark.parametrize("suffix", [".json", ".h5"])
def test_files_of_problems_keep_resistances(face: Face, suffix: str, tmp_path: Path) -> None:
    w, _ = rolling(face)
    w.step()
    problem = w.problem()
    problem.save(tmp_path / f"problem{suffix}")
    again = ContactProblem.load(tmp_path / f"problem{suffix}")
    wanted = [{"contact": 0, "rolling": ROLLING, "spinning": 0.002}]
    assert problem.to_dict()["resistances"] == wanted == again.to_dict()["resistances"]
    assert np.array_equal(problem.solve("nncg").impulse, again.solve("nncg").impulse)
    answer = problem.solve("pgs", tolerance=1e-12)
    assert answer.moment.shape == ((1, 1) if face.dimension == 2 else (1, 3))
    assert np.abs(answer.moment).max() == pytest.approx(ROLLING * answer.impulse[0, 0])
    assert problem.A.shape[0] == len(answer.flat)
    assert problem.residual(answer.flat).absolute == answer.residual
    refused = problem.solve("direct")
    assert refused.status == "refused"
    assert "rolling" in str(refused.reason)


@both
def test_a_negative_coefficient_is_refused_by_name(face: Face) -> None:
    with pytest.raises(BuildError, match="rolling_friction"):
        face.world().add_static("floor", face.ground(), rolling_friction=-0.1)


def test_a_scene_file_gives_materials_rolling_friction(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'schema_version = 1\nspace = "planar"\n[materials.felt]\nfriction = 0.5\nrolling_friction = 0.02\n'
        '[[body]]\nname = "table"\nkind = "static"\nmaterial = "felt"\n[body.shape]\ntype = "half_plane"\n'
        "normal = [0, 1]\n"
        '[[body]]\nname = "ball"\nmass = 1.0\nrolling_friction = 0.03\nposition = [0, 0.1]\n'
        '[body.shape]\ntype = "circle"\nradius = 0.1\n'
    )
    world = load_scene(scene).build()
    assert (world["table"].rolling_friction, world["ball"].rolling_friction) == (0.02, 0.03)
