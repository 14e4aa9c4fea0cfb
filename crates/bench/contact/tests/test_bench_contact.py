"""The judge knows one-contact answers by hand; files and tables give back what was put in."""

from __future__ import annotations

from pathlib import Path

import numpy
import pytest

from bench_contact import problems, table
from bench_contact.engines import Run, best_of
from bench_contact.measure import Measure, Problem, measured


def one_contact(q: list[float], friction: float, scale: float = 1.0) -> Problem:
    """W = scale times the unit matrix."""
    d = len(q)
    starts, columns = numpy.arange(d + 1), numpy.arange(d)
    values = numpy.full(d, scale)
    return Problem("one", d, starts, columns, values, numpy.array(q, float), numpy.array([friction]))


@pytest.mark.parametrize(
    ("q", "friction", "r", "solved"),
    [
        ([1, 0.3, 0], 0.5, [0, 0, 0], True),
        ([-1, 0.1, 0], 0.5, [1, -0.1, 0], True),
        ([-1, 3, 4], 0.5, [1, -0.3, -0.4], True),
        ([-1, 3, 4], 0.0, [1, 0, 0], True),
        ([-1, -2], 0.3, [1, 0.3], True),
        ([-1], 0.0, [1], True),
        ([-1, 0, 0], 0.5, [0, 0, 0], False),
        ([-1, 2, 0], 0.5, [1, 0.5, 0], False),
        # what convex relaxations give: the normal impulse that opens the contact while it slides
        ([-1, 2, 0], 0.5, [1.6, -0.8, 0], False),
        ([-1], 0.0, [0], False),
    ],
)
def test_judge_knows_answers_by_hand(q: list[float], friction: float, r: list[float], solved: bool) -> None:
    measure = measured(one_contact(q, friction), numpy.array(r, float))
    assert measure.solves(1e-12) == solved
    assert solved or max(measure.natural, measure.scaled) > 1e-2


def test_scaled_error_does_not_know_the_unit_of_impulse() -> None:
    r = numpy.array([0.3, 0.2, -0.1])
    plain = measured(one_contact([-1, 2, 0], 0.5), r)
    other = measured(one_contact([-1, 2, 0], 0.5, 1e4), r / 1e4)
    assert other.scaled == pytest.approx(plain.scaled, rel=1e-12)
    assert other.natural != pytest.approx(plain.natural, rel=0.1)


def test_impulses_that_are_no_numbers_solve_nothing() -> None:
    assert not measured(one_contact([1, 0, 0], 0.5), numpy.array([numpy.nan, 0, 0])).solves(1e300)


def test_flat_files_give_back_the_problem(tmp_path: Path) -> None:
    problem = one_contact([-1, 2, 0.5], 0.5, 3.0)
    problems.to_flat(problem, tmp_path / "one.bin")
    again = problems.read(tmp_path / "one.bin")
    for field in ("starts", "columns", "values", "velocity", "friction"):
        assert numpy.array_equal(getattr(problem, field), getattr(again, field))


def test_ratio_is_to_the_fastest_reference_and_survives_the_file(tmp_path: Path) -> None:
    good = Measure(1e-9, 1e-9, 0.0)
    row = table.Row("p", 3, 50)
    row.runs = [
        Run("siconos", "nsgs_hyb", "1e-8", 4e-3, 10, 1e-8, good),
        Run("siconos", "nsgs_p", "1e-8", 2e-3, 10, 1e-8, good),
        Run(table.OURS, "exact", "1e-8", 1e-3, 5, 1e-8, good),
    ]
    ours = row.ours("exact", "1e-8")
    assert ours is not None
    assert row.ratio(ours) == pytest.approx(0.5)
    assert row.usual().ratio(ours) == pytest.approx(0.25)
    assert row.ours("exact", "1e-4") is None
    table.save(tmp_path / "t.csv", [row])
    assert [run.seconds for run in table.references(tmp_path / "t.csv")["p"]] == [4e-3, 2e-3]
    assert "geometric mean 0.5000" in table.summary([row], ["1e-8"], ["exact"])


def test_of_several_rounds_the_best_counts() -> None:
    def run(solver: str, tolerance: str, seconds: float) -> Run:
        return Run("siconos", solver, tolerance, seconds, 10, 1e-8, Measure(1e-9, 1e-9, 0.0))

    first = [run("nsgs", "1e-4", 2.0), run("nsgs", "1e-8", 4.0), run("admm", "1e-8", 3.0)]
    more = [run("nsgs", "1e-8", 1.0), run("admm", "1e-8", 5.0), run("nsn", "1e-8", 0.5)]
    assert [r.seconds for r in best_of(first, more)] == [2.0, 1.0, 3.0]
