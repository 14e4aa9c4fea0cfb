"""Plots of ledgers, comparisons and problems: the data are the run's, axes have units, files are vector."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import carom
from carom import ContactProblem, planar
from carom._convergence import budgets
from carom.errors import BuildError, CaromError
from carom.plotting import PALETTE, save_figure


def _stack() -> planar.World:
    w = planar.World(dt=1 / 60, tolerance=1e-9, iterations=30, on_inaccurate="ignore")
    w.add_static("floor", planar.HalfPlane(), friction=0.5)
    for k in range(4):
        w.add_body(f"box{k}", planar.Box(1, 1), mass=1.0 + 9.0 * k, position=(0, 0.5 + k), friction=0.5)
    return w


@pytest.fixture(scope="module")
def problem() -> ContactProblem:
    w = _stack()
    w.step()
    return w.problem()


def _panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]


def _have_units(figure: Figure) -> bool:
    labels = [axes.get_ylabel() for axes in _panels(figure)]
    labels += [axes.get_xlabel() for axes in _panels(figure) if axes.get_xlabel()]
    return all("[" in label and "]" in label for label in labels)


def test_the_ledger_s_figure_holds_its_lines_and_its_closure() -> None:
    run = carom.build_scene("bouncing_ball_planar").run(1.0)
    figure = run.ledger.plot()
    upper, lower = figure.axes
    drawn = {str(line.get_label()): np.asarray(line.get_ydata()) for line in upper.get_lines()}
    assert np.array_equal(drawn["kinetic"], run.ledger.kinetic)
    assert np.array_equal(drawn["work: impact normal"], run.ledger["impact_normal"])
    assert "work: damping" not in drawn
    assert np.array_equal(np.asarray(lower.get_lines()[0].get_ydata()), run.ledger.closure)
    assert _have_units(figure)
    asked = run.ledger.plot(lines=["damping"]).axes[0].get_lines()
    assert [str(line.get_label()) for line in asked][2:] == ["work: damping"]


def test_an_unknown_line_of_the_ledger_is_refused_with_the_known_ones() -> None:
    run = carom.build_scene("bouncing_ball_planar").run(0.1)
    with pytest.raises(CaromError, match=r"unknown line 'heat' of the ledger; choose from gravity"):
        run.ledger.plot(lines=["heat"])


def test_a_comparison_s_figure_holds_each_solver_s_residuals_and_cost(tmp_path: Path) -> None:
    found = carom.compare(_stack, ["pgs", "apgd", "exact"], t=0.2)
    figure = found.plot()
    residual, work, distance, cost = figure.axes
    assert [str(line.get_label()) for line in residual.get_lines()] == ["pgs", "apgd", "exact"]
    told = np.nan_to_num(np.asarray(residual.get_lines()[0].get_ydata(), dtype=float))
    assert np.array_equal(told, found.runs["pgs"].steps["residual"])
    iterations = np.asarray(work.get_lines()[2].get_ydata())
    assert np.array_equal(iterations, found.runs["exact"].steps["iterations"])
    assert found.reference == "exact"
    assert [str(line.get_label()) for line in distance.get_lines()] == ["pgs", "apgd"]
    assert len(cost.get_lines()) == 3
    assert _have_units(figure)
    save_figure(figure, tmp_path / "solvers.svg")
    save_figure(found.plot(), tmp_path / "again.svg")
    assert (tmp_path / "solvers.svg").read_bytes() == (tmp_path / "again.svg").read_bytes()


def test_convergence_is_measured_solve_by_solve(problem: ContactProblem) -> None:
    sweeps, exact = problem.convergence(["pgs", "exact"], iterations=64)
    assert sweeps.counts == "iterations"
    assert exact.counts == "factorisations"
    for budget, residual in zip(sweeps.budget, sweeps.residual, strict=True):
        assert residual == problem.solve("pgs", iterations=int(budget), tolerance=1e-12).residual
    assert sweeps.residual[-1] < sweeps.residual[0]
    assert np.all(np.diff(sweeps.spent) > 0)
    assert np.all(sweeps.seconds > 0)
    assert exact.residual[-1] <= 1e-9
    assert "64" not in repr(exact)


def test_a_solver_that_refuses_has_no_points_and_says_why() -> None:
    w = carom.build_scene("stack_spatial")
    w.step()
    (refused,) = w.problem().convergence(["lemke"], iterations=10)
    assert refused.status == "refused"
    assert len(refused.residual) == 0
    assert refused.reason
    assert "lemke" in repr(refused)
    figure = w.problem().plot(["lemke"], iterations=10)
    assert any("lemke" in text.get_text() for text in figure.axes[1].texts)


def test_convergence_refuses_what_is_no_budget(problem: ContactProblem) -> None:
    with pytest.raises(BuildError, match="iterations"):
        problem.convergence(["pgs"], iterations=0)
    with pytest.raises(BuildError, match="repeats"):
        problem.convergence(["pgs"], repeats=0)
    with pytest.raises(BuildError, match="solver"):
        problem.convergence(["magic"])


@pytest.mark.parametrize("most", [1, 2, 7, 1000])
def test_budgets_grow_and_end_with_the_largest(most: int) -> None:
    ladder = budgets(most)
    assert ladder[0] == 1
    assert ladder[-1] == most
    assert ladder == sorted(set(ladder))
    assert all(b / a <= 2.01 for a, b in pairwise(ladder))


@pytest.mark.parametrize("suffix", [".pdf", ".svg"])
def test_a_problem_s_figure_is_vector_with_units(
    problem: ContactProblem, suffix: str, tmp_path: Path
) -> None:
    figure = problem.plot(["pgs", "nncg", "exact"], iterations=40)
    assert _have_units(figure)
    against_time = figure.axes[2]
    assert against_time.get_xlabel().endswith("[ms]")
    save_figure(figure, tmp_path / f"problem{suffix}")
    assert (tmp_path / f"problem{suffix}").stat().st_size > 4000


def test_spy_draws_every_entry_of_a(problem: ContactProblem) -> None:
    shown = problem.spy().get_images()[0].get_array()
    size = np.abs(problem.A.toarray())
    assert shown is not None
    assert np.ma.count(shown) == np.count_nonzero(size > 1e-12 * size.max())


def test_the_figure_of_spy_s_axes_is_saved(problem: ContactProblem, tmp_path: Path) -> None:
    save_figure(problem.spy(), tmp_path / "pattern.svg")
    assert (tmp_path / "pattern.svg").read_bytes().startswith(b"<?xml")


def test_labels_of_a_short_time_axis_do_not_stand_on_each_other(problem: ContactProblem) -> None:
    figure = problem.plot(("pgs",))
    figure.canvas.draw()
    for axes in figure.axes[1:3]:
        labels = [t for t in axes.get_xticklabels(which="both") if t.get_text() and t.get_visible()]
        low, high = axes.get_xlim()
        shown = [t.get_window_extent() for t in labels if low <= t.get_position()[0] <= high]
        shown.sort(key=lambda box: float(box.x0))
        assert len(shown) >= 1
        assert all(left.x1 < right.x0 for left, right in pairwise(shown))


def test_neighbouring_colours_differ_in_grey_too() -> None:
    def grey(color: str) -> float:
        parts = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        return math.sqrt(0.299 * parts[0] ** 2 + 0.587 * parts[1] ** 2 + 0.114 * parts[2] ** 2)

    assert all(abs(grey(a) - grey(b)) > 0.02 for a, b in pairwise(PALETTE))
