"""``carom problem``: solve, check, certify, convert, show and extract contact problems in matrix form."""

from __future__ import annotations

import json
import math
import statistics
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from carom._friction_problem import FrictionMeasure, FrictionProblem, FrictionSolution
from carom._friction_problem_file import read_impulse_file, refused_file, write_impulse_file
from carom.cli.failure import FAILED
from carom.cli.problem_progress import SolveLine
from carom.cli.problem_tables import (
    facts_of,
    measure_table,
    problem_table,
    solution_table,
)
from carom.cli.tables import plain

problem_app = typer.Typer(
    name="problem",
    help="Contact problems in matrix form: solve, check, certify, convert, show, extract from a run.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="A problem: .npz, or FCLIB's .hdf5.")]
ImpulseArgument = Annotated[
    Path, typer.Argument(metavar="R", help="Impulses: .npy, or .hdf5 with a solution [N s].")
]
ToleranceOption = Annotated[
    float, typer.Option(help="Solved: err_nat <= this, err_scaled <= 10 times this, cone <= 1e-12.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print plain JSON.")]


def solve_command(
    file: FileArgument,
    solver: Annotated[str, typer.Option(help="Solver; `carom problem solvers` lists them.")] = "exact",
    tolerance: ToleranceOption = 1e-8,
    repeat: Annotated[int, typer.Option(min=1, help="Solve this often; best and median time are told.")] = 1,
    iterations: Annotated[int, typer.Option(min=0, help="Most sweeps to spend.")] = 100_000,
    factorisations: Annotated[int, typer.Option(min=0, help="Most factorisations to spend.")] = 2000,
    start: Annotated[
        Path | None, typer.Option(help="Impulses to start from: .npy, or .hdf5 with a solution [N s].")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Where to write the impulses: .npy, or FCLIB's .hdf5 with the problem."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Solve a problem. Exit code 0 when solved, 1 when not. Ctrl-C keeps the best impulses so far."""
    problem = FrictionProblem.load(file)
    first = None if start is None else read_impulse_file(start)
    solutions: list[FrictionSolution] = []
    try:
        with SolveLine(sys.stderr) as tell:
            for _ in range(repeat):
                found = problem.solve(
                    solver,
                    tolerance,
                    iterations=iterations,
                    factorisations=factorisations,
                    start=first,
                    tell=tell,
                )
                solutions.append(found)
    except KeyboardInterrupt as interrupt:
        best = getattr(interrupt, "best", None)
        if best is not None and not solutions:
            _close(problem, [best], tolerance, out, as_json)
        raise
    _close(problem, solutions, tolerance, out, as_json)
    if not solutions[0].solved:
        raise typer.Exit(FAILED)


def _close(
    problem: FrictionProblem,
    solutions: list[FrictionSolution],
    tolerance: float,
    out: Path | None,
    as_json: bool,
) -> None:
    solution = solutions[0]
    if out is not None:
        write_impulse_file(out, problem, solution.impulse)
    seconds = [each.seconds for each in solutions]
    table = {
        "problem": problem.name, "contacts": len(problem), "dimension": problem.dimension,
        "solver": solution.solver, "tolerance": tolerance, "solved": solution.solved,
        "seconds": min(seconds), "seconds_median": statistics.median(seconds), "repeat": len(seconds),
        "iterations": solution.iterations,
        "stages": [{"name": name, "iterations": count} for name, count in solution.stages],
        "factorisations": solution.factorisations, **_errors(solution.measure), "reason": solution.reason,
        "strict_feasibility": solution.strict_feasibility, "out": None if out is None else str(out),
    }  # fmt: skip
    if as_json:
        _print_json(table)
    else:
        solution_table(table)


def check_command(
    file: FileArgument,
    impulses: ImpulseArgument,
    tolerance: ToleranceOption = 1e-8,
    as_json: JsonOption = False,
) -> None:
    """Measure impulses against a problem. Exit code 0 when they solve it, 1 when not."""
    problem = FrictionProblem.load(file)
    measure = problem.measure(_impulses(impulses, problem))
    table = {
        "problem": problem.name, "contacts": len(problem), "tolerance": tolerance,
        "solved": measure.solves(tolerance), **_errors(measure),
    }  # fmt: skip
    if as_json:
        _print_json(table)
    else:
        measure_table(table)
    if not measure.solves(tolerance):
        raise typer.Exit(FAILED)


def certify_command(
    file: FileArgument,
    impulses: ImpulseArgument,
    out: Annotated[Path, typer.Option(help="Where to write the certificate: .json or .h5.")],
    tolerance: ToleranceOption = 1e-8,
    islands: Annotated[bool, typer.Option("--islands", help="Errors of each island as well.")] = False,
) -> None:
    """Write a certificate of impulses, for `python -m carom.check_certificate FILE R OUT`."""
    problem = FrictionProblem.load(file)
    certificate = problem.certificate(_impulses(impulses, problem), tolerance, islands=islands)
    certificate.save(out)
    typer.echo(str(certificate))


def convert_command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A problem: .npz, FCLIB's .hdf5, .json.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="Where to write it: .npz or .hdf5.")],
    whole: Annotated[
        bool, typer.Option("--global", help="FCLIB's global form, with masses and contact directions.")
    ] = False,
) -> None:
    """Write a problem in another form."""
    from carom._friction_problem_file import write_friction_problem

    problem = FrictionProblem.load(source)
    if whole and target.suffix.lower() == ".npz":
        raise refused_file(target, "has no global form", "end it in .hdf5")
    write_friction_problem(target, problem, None, whole=whole)
    typer.echo(f"{target}: {problem!r}")


def show_command(
    file: FileArgument,
    rank: Annotated[bool, typer.Option("--rank", help="Find the rank of a large W as well.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Tell what a problem is: contacts, islands, rank, asymmetry, how far its blocks differ in size."""
    facts = facts_of(FrictionProblem.load(file), rank)
    if as_json:
        _print_json(facts)
    else:
        problem_table(facts)


def extract_command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A file that `carom run` wrote.")],
    step: Annotated[int, typer.Option(min=0, help="Number of the step, from 0.")],
    out: Annotated[Path, typer.Option(help="Where to write the problem: .npz or .hdf5.")],
    phase: Annotated[
        str, typer.Option(help='"contact" for the persistent contacts, "impact" for the impacts.')
    ] = "contact",
) -> None:
    """Write the contact problem that a step of a run solved, by running its scene again up to there."""
    from carom.recorded import Run

    problem = Run.load(run).save_problem(out, step, phase=phase)
    typer.echo(f"{out}: {problem!r}")


def solvers_command() -> None:
    """List the solvers."""
    from carom import FRICTION_SOLVERS

    for name in FRICTION_SOLVERS:
        typer.echo(name)


def _impulses(path: Path, problem: FrictionProblem) -> Any:
    """Impulses of a file; one row per contact or flat."""
    return problem.flat(read_impulse_file(path), str(path))


def _errors(measure: FrictionMeasure) -> dict[str, Any]:
    return asdict(measure)


def _print_json(table: dict[str, Any]) -> None:
    """Plain JSON, in which no number can be infinite."""
    typer.echo(json.dumps(_finite(plain(table)), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


problem_app.command("solve")(solve_command)
problem_app.command("check")(check_command)
problem_app.command("certify")(certify_command)
problem_app.command("convert")(convert_command)
problem_app.command("show")(show_command)
problem_app.command("extract")(extract_command)
problem_app.command("solvers")(solvers_command)
