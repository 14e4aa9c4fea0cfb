"""How the residual of a contact problem falls while a solver works: against iterations and against time.

A solver keeps no history. Each point is a solve of its own from the same start with a larger budget of
iterations (of factorisations, for solvers that count those), timed by itself: methods are deterministic, so
the solve with budget k is the beginning of that with budget k + 1. What one solve tells is one point; nothing
is interpolated. Knows no worlds.
"""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom._space import Floats, number, whole
from carom.errors import refused

if TYPE_CHECKING:
    from carom._problem import ContactProblem

#: Solvers whose work is bounded by `factorisations`; their sweeps before are left at the default.
FACTORISING = ("exact",)


@dataclass(frozen=True)
class Convergence:
    """Residuals of one solver by budget.

    Attributes
    ----------
    solver : its name
    counts : "iterations" or "factorisations", what the budget bounds
    budget : (k,) float64 array, most of them that a solve could spend [1]
    spent : (k,) float64 array, iterations that it did spend, factorisations among them [1]
    residual : (k,) float64 array, of what it found [m/s]
    seconds : (k,) float64 array, wall time of the solve, the best of the repeats [s]
    status : of the last solve, as `Solution.status`
    reason : why the method refused, or None
    """

    solver: str
    counts: str
    budget: Floats
    spent: Floats
    residual: Floats
    seconds: Floats
    status: str
    reason: str | None

    def __repr__(self) -> str:
        if not len(self.residual):
            return f"<Convergence of {self.solver}: {self.status} ({self.reason})>"
        return (
            f"<Convergence of {self.solver}: {len(self.budget)} budgets, residual {self.residual[0]:.1e} to "
            f"{self.residual[-1]:.1e} m/s, {self.status}>"
        )


def budgets(most: int) -> list[int]:
    """1, 2, 3, 4, 6, 8, 11, .. about the square root of two apart, ending with `most`."""
    ladder = {min(most, round(2 ** (k / 2))) for k in range(2 * int(np.log2(max(most, 1))) + 2)}
    return sorted({*ladder, most})


def converge(
    problem: ContactProblem,
    solvers: Sequence[str],
    *,
    iterations: int = 1000,
    tolerance: float = 1e-12,
    repeats: int = 1,
) -> tuple[Convergence, ...]:
    """Residuals of each solver for growing budgets; see `ContactProblem.convergence`."""
    most = whole(iterations, "iterations", "give the largest budget")
    if most < 1:
        raise refused(None, "iterations", "must be >= 1", most, "give the largest budget")
    tries = whole(repeats, "repeats", "give how often each solve is timed")
    if tries < 1:
        raise refused(None, "repeats", "must be >= 1", tries, "give how often each solve is timed")
    limit = number(tolerance, "tolerance", "m/s")
    return tuple(_one(problem, str(name), most, limit, tries) for name in solvers)


def _one(problem: ContactProblem, name: str, most: int, tolerance: float, repeats: int) -> Convergence:
    counts = "factorisations" if name in FACTORISING else "iterations"
    rows: list[tuple[float, float, float, float]] = []
    status, reason = "refused", None
    for budget in budgets(most):
        sweeps, factors = (100, budget) if counts == "factorisations" else (budget, 2000)
        seconds = np.inf
        for _ in range(repeats):
            begun = clock.perf_counter()
            found = problem.solve(name, tolerance=tolerance, iterations=sweeps, factorisations=factors)
            seconds = min(seconds, clock.perf_counter() - begun)
        status, reason = found.status, found.reason
        if status == "refused":
            break
        rows.append((float(budget), float(found.iterations), found.residual, seconds))
        if found.converged or (len(rows) > 1 and rows[-1][1] < budget / 4 and counts == "iterations"):
            break  # solved, or a method that ends by itself
    budget_of, spent, residual, seconds_of = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return Convergence(name, counts, budget_of, spent, residual, seconds_of, status, reason)
