"""Results as a table and as CSV, and what they come to: ratios to the best reference per problem."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from bench_contact.engines import Run
from bench_contact.measure import Measure, Problem

OURS = "carom"
COLUMNS = [
    *("problem", "rows_per_contact", "contacts", "tolerance", "engine", "solver", "seconds", "iterations"),
    *("own_tolerance", "err_nat", "err_scaled", "cone", "ratio_to_best_reference", "seconds_inside"),
]
# the settings that published comparisons on these problems tried; the rest are ours
USUAL = frozenset(
    (
        *("nsgs_hyb", "nsgs_ac", "nsgs_gp", "nsgs_pli", "nsgs_em", "nsgs_ac_freq", "vi_eg", "pin_admm"),
        *("nsn_ac", "nsn_fb", "nsn_nm", "prox_nsn", "admm", "admm_br"),
        *("fc2d_nsgs", "fc2d_cpg", "fc2d_lemke", "lcp_lemke", "lcp_newton_fb", "lcp_pgs"),
    )
)


@dataclass
class Row:
    """One problem with all that solved it."""

    problem: str
    rows_per_contact: int
    contacts: int
    runs: list[Run] = field(default_factory=list)

    @staticmethod
    def of(problem: Problem) -> Row:
        """An empty row."""
        return Row(problem.name, problem.rows_per_contact, problem.contacts)

    def best_reference(self, tolerance: str) -> Run | None:
        """The fastest reference solver at a tolerance, or None when none solved it."""
        reached = [run for run in self.runs if run.engine != OURS and run.tolerance == tolerance]
        return min(reached, key=lambda run: run.seconds, default=None)

    def usual(self) -> Row:
        """The same with only those settings of the references that published comparisons tried."""
        kept = [run for run in self.runs if run.engine == OURS or run.solver in USUAL]
        return Row(self.problem, self.rows_per_contact, self.contacts, kept)

    def ours(self, solver: str, tolerance: str) -> Run | None:
        """Our solver at a tolerance, or None when it did not solve it."""
        reached = (run for run in self.runs if run.engine == OURS and run.tolerance == tolerance)
        return next((run for run in reached if run.solver == solver), None)

    def ratio(self, run: Run) -> float | None:
        """Time over that of the fastest reference solver."""
        best = self.best_reference(run.tolerance)
        return run.seconds / best.seconds if best else None


def milliseconds(run: Run | None) -> str:
    """A time for people."""
    return f"{1e3 * run.seconds:.4g}" if run else "-"


def heading(tolerances: Iterable[str], solvers: Iterable[str]) -> str:
    """Names over the table."""
    text = f"{'problem':<38}{'contacts':>9}"
    for tolerance in tolerances:
        for solver in solvers:
            text += f" {solver + ' ' + tolerance:>13} {'ratio':>7}"
        text += f" {'best reference':>15} {'ms':>9}"
    return text


def line(row: Row, tolerances: Iterable[str], solvers: Iterable[str]) -> str:
    """A row for people; times in ms."""
    text = f"{row.problem[:37]:<38}{row.contacts:>9}"
    for tolerance in tolerances:
        best = row.best_reference(tolerance)
        for solver in solvers:
            run = row.ours(solver, tolerance)
            ratio = row.ratio(run) if run else None
            text += f" {milliseconds(run):>13} {f'{ratio:.3f}' if ratio else '-':>7}"
        text += f" {best.solver if best else 'none':>15} {milliseconds(best):>9}"
    return text


def summary(rows: list[Row], tolerances: Iterable[str], solvers: Iterable[str]) -> str:
    """Per solver and tolerance: solved, geometric mean and worst of the ratios to the best reference."""
    lines = []
    for tolerance in tolerances:
        reference = sum(row.best_reference(tolerance) is not None for row in rows)
        lines.append(f"{tolerance}: {reference} of {len(rows)} problems solved by a reference solver")
        for solver in solvers:
            solved = [(row, run) for row in rows if (run := row.ours(solver, tolerance))]
            ratios = [(ratio, row) for row, run in solved if (ratio := row.ratio(run))]
            text = f"{tolerance}: {solver:<10} solved {len(solved):>3} of {len(rows)}"
            if ratios:
                mean = math.exp(sum(math.log(ratio) for ratio, _ in ratios) / len(ratios))
                many = [math.log(ratio) for ratio, row in ratios if row.contacts >= 20]
                worst, where = max(ratios, key=lambda pair: pair[0])
                text += f", time over the best reference: geometric mean {mean:.4f}"
                if many:
                    text += f" ({math.exp(sum(many) / len(many)):.4f} from 20 contacts on)"
                text += f", worst {worst:.3f} ({where.problem})"
            missed = [row.problem for row in rows if row.ours(solver, tolerance) is None]
            lines.append(text + (f"; not solved: {', '.join(missed[:8])}" if 0 < len(missed) <= 8 else ""))
    return "\n".join(lines)


def save(path: Path, rows: Iterable[Row]) -> None:
    """Writes all runs of all rows as CSV."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        for row in rows:
            for run in row.runs:
                ratio, m = row.ratio(run), run.measure
                out.writerow(
                    [
                        *(row.problem, row.rows_per_contact, row.contacts, run.tolerance),
                        *(run.engine, run.solver, f"{run.seconds:.4e}", run.iterations),
                        *(f"{run.own_tolerance:.3g}", f"{m.natural:.2e}", f"{m.scaled:.2e}", f"{m.cone:.2e}"),
                        f"{ratio:.4f}" if ratio else "",
                        f"{run.inside:.4e}" if run.inside else "",
                    ]
                )


def references(path: Path) -> dict[str, list[Run]]:
    """The reference runs of an earlier CSV, by problem."""
    found: dict[str, list[Run]] = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["engine"] != OURS:
                measure = Measure(float(row["err_nat"]), float(row["err_scaled"]), float(row["cone"]))
                run = Run(
                    row["engine"],
                    row["solver"],
                    row["tolerance"],
                    float(row["seconds"]),
                    int(row["iterations"]),
                    float(row["own_tolerance"]),
                    measure,
                )
                found.setdefault(row["problem"], []).append(run)
    return found
