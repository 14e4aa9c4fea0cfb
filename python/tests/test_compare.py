"""Comparisons: who is the reference, what a failing solver leaves, what scenes may be."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scripted import ScriptedWorld

from carom.comparison import compare, trajectory_error
from carom.errors import BuildError, CaromError
from carom.run import run_world


def test_reference_is_the_solver_with_the_smallest_worst_residual() -> None:
    found = compare(ScriptedWorld, ["pgs", "lemke", "sequential"], t=0.5)
    assert found.reference == "lemke"
    assert [row.solver for row in found.rows] == ["pgs", "lemke", "sequential"]
    assert found["sequential"].worst_residual == pytest.approx(7e-3)
    assert found["lemke"].trajectory_error == 0.0


def test_table_states_units_and_names_the_reference() -> None:
    lines = compare(ScriptedWorld, ["pgs", "lemke"], t=0.2).table().splitlines()
    for words in ("worst residual [m/s]", "iterations [1]", "time per step [ms]", "energy closure [J]",
                  "trajectory error [m]"):  # fmt: skip
        assert words in lines[0]
    assert lines[2].startswith("pgs")
    assert lines[3].startswith("lemke")
    assert "against lemke" in lines[-1]


def test_world_given_as_scene_is_left_as_it_is() -> None:
    world = ScriptedWorld()
    before = world.position.copy()
    compare(world, ["pgs", "lemke"], t=0.2)
    assert np.array_equal(world.position, before)
    assert world.time == 0.0


def test_trajectory_error_is_the_largest_distance_over_frames_and_bodies() -> None:
    high, low = ScriptedWorld(), ScriptedWorld()
    low.position[2] += [0.3, 0.4]
    run, other = (run_world(world, 0.2) for world in (high, low))
    assert trajectory_error(run, other) == pytest.approx(0.5)
    assert trajectory_error(run, run) == 0.0


def test_runs_of_different_frame_rates_are_compared_where_both_have_frames() -> None:
    often, seldom = run_world(ScriptedWorld(), 0.2), run_world(ScriptedWorld(), 0.2, every=5)
    assert trajectory_error(seldom, often) == 0.0


class RefusesPgs(ScriptedWorld):
    """A world whose tenth step fails with one solver."""

    def __setattr__(self, name: str, value: object) -> None:
        super().__setattr__(name, value)
        if name == "solver":
            super().__setattr__("fails_at", 10 if value == "pgs" else None)


def test_solver_that_fails_is_a_row_that_says_why() -> None:
    found = compare(RefusesPgs, ["pgs", "lemke"], t=0.5)
    assert "remove the NaN force" in found["pgs"].status
    assert found["pgs"].steps == 10
    assert found["lemke"].status == "complete"
    assert "failed after 10 steps" in found.table()
    assert "remove the NaN force" in found.table()
    assert found.reference == "lemke"
    plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert plain["rows"][0]["solver"] == "pgs"
    assert plain["reference"] == "lemke"


def test_solver_that_fails_at_once_has_no_figures() -> None:
    class Refuses(ScriptedWorld):
        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, value)
            if name == "solver" and value == "pgs":
                super().__setattr__("fails_at", 0)

    found = compare(Refuses, ["pgs", "lemke"], t=0.2)
    assert math.isnan(found["pgs"].worst_residual)
    assert found["pgs"].steps == 0
    assert found.to_dict()["rows"][0]["worst_residual"] is None


def test_problem_of_a_step_is_reached_with_the_reference() -> None:
    class WithProblem(ScriptedWorld):
        def problem(self) -> tuple[int, str]:
            return self.taken, str(self.settings["solver"])

    found = compare(WithProblem, ["pgs", "lemke"], t=0.2)
    assert found.problem(7) == (7, "lemke")
    assert found.problem(0, solver="pgs") == (0, "pgs")
    with pytest.raises(CaromError, match="no run of this comparison has a step 20"):
        found.problem(20)


def test_what_cannot_be_compared_is_refused() -> None:
    with pytest.raises(BuildError, match="distinct names"):
        compare(ScriptedWorld, ["pgs", "pgs"], t=1.0)
    with pytest.raises(BuildError, match="distinct names"):
        compare(ScriptedWorld, [], t=1.0)
    with pytest.raises(BuildError, match="t is missing"):
        compare(ScriptedWorld, ["pgs"])
    with pytest.raises(BuildError, match="scene must be a World"):
        compare(42, ["pgs"], t=1.0)


def test_two_runs_of_a_comparison_are_replayed_together(tmp_path: Path) -> None:
    found = compare("card_house", ["pgs", "exact", "sequential"], t=0.05)
    page = found.to_html(tmp_path / "two.html").read_text(encoding="utf-8")
    assert page.count('type="application/carom-run">') == 2
    chosen = found.to_html(tmp_path / "chosen.html", ("pgs", "sequential")).read_text(encoding="utf-8")
    assert chosen != page
    with pytest.raises(CaromError, match="no run with solver 'lemke'; choose two of"):
        found.to_html(tmp_path / "none.html", ("pgs", "lemke"))
    with pytest.raises(CaromError, match="there are no two runs"):
        compare("card_house", ["pgs"], t=0.05).to_html(tmp_path / "one.html")
