"""The timed programs: carom, Siconos, Pinocchio; a process per problem and solver, with its own limit."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy

from bench_contact.measure import Measure, Problem, measured


@dataclass(frozen=True)
class Engine:
    """A program that answers to `--list` and to the words of a run."""

    name: str
    command: tuple[str, ...]

    def solvers(self, rows_per_contact: int) -> list[str]:
        """Its solvers for this many rows per contact; none when the program does not run here."""
        try:
            told = subprocess.run([*self.command, "--list"], capture_output=True, text=True, timeout=60)
        except OSError:
            return []
        lines = [line.split() for line in told.stdout.splitlines() if told.returncode == 0]
        return [name for rows, name in lines if int(rows) == rows_per_contact]


@dataclass(frozen=True)
class Rules:
    """How runs are timed: best of `repeats` within `budget` seconds, no call longer than `limit` seconds."""

    tolerances: tuple[str, ...]
    first: float = 1.0
    repeats: int = 100
    budget: float = 0.5
    limit: float = 3.0


@dataclass(frozen=True)
class Run:
    """One solver at one tolerance: seconds of the call, iterations, the judge's measures.

    `inside` is what carom's solver says of the solve alone: wall-clock seconds without its own change of the
    matrix's format, which the references are given theirs in; 0 where nothing is said.
    """

    engine: str
    solver: str
    tolerance: str
    seconds: float
    iterations: int
    own_tolerance: float
    measure: Measure
    inside: float = 0.0


# one thread each: what is timed is the CPU time of one thread
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "RAYON")}


def runs(engine: Engine, solver: str, problem: Problem, flat: Path, rules: Rules, scratch: Path) -> list[Run]:
    """What the solver reached, judged from its impulses; tolerances that it did not reach are missing."""
    out = scratch / f"{problem.name}.{solver}"
    lines = out.with_name(out.name + ".jsonl")
    lines.unlink(missing_ok=True)
    words = [str(flat), solver, ",".join(rules.tolerances), str(rules.first), str(rules.repeats)]
    words += [str(rules.budget), str(rules.limit), str(out)]
    # a ladder of tolerances and the repeats, each within its own limit; the clock on the wall may run faster
    patience = 60.0 + 20.0 * rules.limit * len(rules.tolerances)
    environment = {**os.environ, **ONE_THREAD}
    with contextlib.suppress(subprocess.TimeoutExpired):
        subprocess.run(
            [*engine.command, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=patience,
            env=environment,
        )
    if not lines.exists():
        return []
    found = []
    for line in lines.read_text().splitlines():
        told = json.loads(line)
        asked = next(t for t in rules.tolerances if float(t) == float(told["tolerance"]))
        saved = Path(told["impulses"])
        measure = measured(problem, numpy.fromfile(saved, "<f8"))
        saved.unlink()
        if measure.solves(float(asked)):
            figures = (told["seconds"], told["iterations"], told["own_tolerance"])
            found.append(Run(engine.name, solver, asked, *figures, measure, told.get("inside", 0.0)))
    lines.unlink()
    return found


def best_of(found: list[Run], more: list[Run]) -> list[Run]:
    """The runs of `found`, each the faster of itself and its like in `more`."""
    again = {(run.engine, run.solver, run.tolerance): run for run in more}

    def best(run: Run) -> Run:
        other = again.get((run.engine, run.solver, run.tolerance), run)
        return other if other.seconds < run.seconds else run

    return [best(run) for run in found]
