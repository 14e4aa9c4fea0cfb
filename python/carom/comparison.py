"""The same scene with several solvers, side by side: residual, iterations, time, energy, trajectory error.

Each solver starts from the same world. The trajectory error of a solver is the largest distance over all
recorded frames and bodies between its positions and those of the most accurate run, which is the one with
the smallest worst residual. Scenes with many impacts are chaotic: there the error says how far apart two
rightful futures are, not which one is wrong. Knows no physics.
"""

from __future__ import annotations

import copy
import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom import SOLVERS
from carom.errors import BuildError, CaromError, InaccurateWarning
from carom.run import Run, run_world
from carom.scene.suggest import did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Row:
    """What one solver did.

    Attributes
    ----------
    solver : str
    status : "complete", or why the run ended early
    steps : taken [1]
    worst_residual, mean_residual : over the steps [m/s]
    iterations : mean per step [1]
    ms_per_step : wall time [ms]
    energy_closure : largest failure of the energy ledger to add up [J]
    deepest_penetration : [m]
    trajectory_error : largest distance from the most accurate run [m]; nan when they share no frame
    """

    solver: str
    status: str
    steps: int
    worst_residual: float
    mean_residual: float
    iterations: float
    ms_per_step: float
    energy_closure: float
    deepest_penetration: float
    trajectory_error: float


_COLUMNS = (
    ("solver", "solver", "{}"),
    ("worst_residual", "worst residual [m/s]", "{:.2e}"),
    ("mean_residual", "mean residual [m/s]", "{:.2e}"),
    ("iterations", "iterations [1]", "{:.1f}"),
    ("ms_per_step", "time per step [ms]", "{:.3f}"),
    ("energy_closure", "energy closure [J]", "{:.1e}"),
    ("deepest_penetration", "deepest penetration [m]", "{:.1e}"),
    ("trajectory_error", "trajectory error [m]", "{:.2e}"),
)


class Comparison:
    """Rows by solver, the runs themselves, and which one served as the reference; why solvers failed."""

    def __init__(
        self, rows: Sequence[Row], runs: dict[str, Run], reference: str | None, make: Callable[[], Any]
    ) -> None:
        """Rows in order, runs by solver, the reference and the way to make the world again."""
        self.rows = tuple(rows)
        self.runs = runs
        self.reference = reference
        self._make = make

    def notes(self) -> list[str]:
        """What the table cannot hold: the reference, and why solvers failed."""
        told = [f"{row.solver}: {row.status}" for row in self.rows if row.status != "complete"]
        if self.reference is not None:
            told.append(f"trajectory error: against {self.reference}, the smallest worst residual")
        return told

    def __getitem__(self, solver: str) -> Row:
        """The row of a solver."""
        return next(row for row in self.rows if row.solver == solver)

    def cells(self) -> tuple[list[str], list[list[str]]]:
        """Headings and rows of the table as text."""
        body = [[form.format(getattr(row, name)) for name, _, form in _COLUMNS] for row in self.rows]
        for cells, row in zip(body, self.rows, strict=True):
            cells.append("complete" if row.status == "complete" else f"failed after {row.steps} steps")
        return [*(heading for _, heading, _ in _COLUMNS), "status"], body

    def table(self) -> str:
        """The table as aligned text; the reference is named below it."""
        headings, body = self.cells()
        widths = [max(len(row[i]) for row in [headings, *body]) for i in range(len(headings))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
                 for row in [headings, ["-" * width for width in widths], *body]]  # fmt: skip
        return "\n".join([*lines, *self.notes()])

    def plot(self) -> Figure:
        """A figure: residual and iterations by step, distance from the reference, accuracy against cost."""
        from carom._plot_comparison import plot_comparison

        return plot_comparison(self)

    def to_html(
        self,
        path: str | Path,
        solvers: tuple[str, str] | None = None,
        *,
        max_bytes: int | None = None,
    ) -> Path:
        """Writes a page that replays two of the runs, as ghosts or side by side, with their distance plotted.

        Parameters
        ----------
        solvers : the two; when absent the reference and the run that is farthest from it
        max_bytes : about the size of the page at most, 2e7 when absent [bytes]

        Returns
        -------
        The path.

        Raises
        ------
        CaromError
            When a solver is not among the runs, fewer than two have a frame, or the page cannot be made or
            written.
        """
        first, second = self._pair() if solvers is None else solvers
        for name in (first, second):
            if name not in self.runs:
                remedy = f"choose two of {', '.join(self.runs)}"
                raise CaromError(
                    f"no run with solver {name!r}; {remedy}", field="solvers", value=name, remedy=remedy
                )
        return self.runs[first].to_html(path, other=self.runs[second], max_bytes=max_bytes)

    def _pair(self) -> tuple[str, str]:
        """The reference, and the run that is farthest from it."""
        others = [row for row in self.rows if row.solver in self.runs and row.solver != self.reference]
        if self.reference is None or not others:
            remedy = "compare two solvers that can run the scene"
            raise CaromError(f"there are no two runs to show; {remedy}", field="solvers", remedy=remedy)
        apart = {row.solver: row.trajectory_error for row in others}
        known = {name: error for name, error in apart.items() if not math.isnan(error)} or apart
        return self.reference, max(known, key=lambda name: known[name])

    def to_dict(self) -> dict[str, Any]:
        """Plain values for programs; what is not finite becomes None."""
        rows = [
            {
                key: None if isinstance(value, float) and not math.isfinite(value) else value
                for key, value in entry
            }
            for entry in (asdict(row).items() for row in self.rows)
        ]
        return {"reference": self.reference, "rows": rows}

    def problem(self, step: int, *, solver: str | None = None) -> Any:
        """The contact problem that step `step` (from 0) solves, reached with a solver (else the reference).

        Raises
        ------
        CaromError
            When no solver came that far.
        """
        chosen = solver if solver is not None else self.reference
        if chosen is None or chosen not in self.runs or not 0 <= step < len(self.runs[chosen].steps):
            raise CaromError(
                f"no run of this comparison has a step {step}; choose a step that was taken", field="step",
                value=step, remedy="choose a step that was taken",
            )  # fmt: skip
        world = self._make()
        world.solver = chosen
        if step:
            world._advance(step, self.runs[chosen].header.dt, 0)
        return world.problem()

    def __repr__(self) -> str:
        """The table."""
        return self.table()


def compare(
    scene: Any,
    solvers: Sequence[str],
    t: float | None = None,
    *,
    dt: float | None = None,
    iterations: int | None = None,
    tolerance: float | None = None,
    every: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Runs a scene with each solver.

    Parameters
    ----------
    scene : a World (left as it is), a function that makes one, the name of a scene, or the path of a scene
    file solvers : names, e.g. ["sequential", "pgs", "lemke"] t : simulated time [s]; the scene's own when
    absent dt, iterations, tolerance : settings for all of them every : steps between recorded frames; 60
    frames per simulated second when absent progress : told each solver's name before its run

    Raises
    ------
    BuildError
        When there is no solver, one is given twice, or a duration is missing.
    SceneError
        When the scene is refused.

    A solver that refuses or fails makes a row that says why.
    """
    names = list(solvers)
    if not names or len(set(names)) != len(names):
        remedy = 'give distinct names, e.g. ["pgs", "lemke"]'
        raise BuildError(f"compare: solvers must be distinct names, got {names!r}; {remedy}", field="solvers",
                         value=names, remedy=remedy)  # fmt: skip
    for name in names:
        if name not in SOLVERS:
            remedy = f"{did_you_mean(name, SOLVERS)} known: {', '.join(SOLVERS)}".strip()
            raise BuildError(
                f"compare: unknown solver {name!r}; {remedy}", field="solvers", value=name, remedy=remedy
            )
    make, own_duration = _factory(scene)
    duration = t if t is not None else own_duration
    if duration is None:
        raise BuildError(
            "compare: t is missing; give the simulated time [s]", field="t", remedy="give seconds"
        )
    runs: dict[str, Run] = {}
    failures: dict[str, str] = {}
    for name in names:
        if progress is not None:
            progress(name)
        world = make()
        step = dt if dt is not None else float(world.settings["dt"])
        frames = every if every is not None else max(1, round(1 / (60 * step)))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", InaccurateWarning)  # the table tells every residual
                runs[name] = run_world(
                    world, duration, dt=dt, solver=name, iterations=iterations, tolerance=tolerance,
                    every=frames,
                )  # fmt: skip
        except CaromError as error:
            failures[name] = str(error)
            partial = getattr(world, "last_run", None)
            if partial is not None and len(partial.steps):
                runs[name] = partial
    if not runs and failures:
        raise BuildError(
            f"compare: no solver ran: {next(iter(failures.values()))}", field="solvers", value=names
        )
    return _judged(names, runs, failures, make)


def _factory(scene: Any) -> tuple[Callable[[], Any], float | None]:
    """How to make the world again and again, and the scene's own duration [s] if it has one."""
    from carom.scene import Scene, load_scene

    if isinstance(scene, (str, Path)):
        scene = load_scene(scene)
    if isinstance(scene, Scene):
        return scene.build, scene.duration
    if hasattr(scene, "_advance") and not isinstance(scene, type):
        return lambda: copy.deepcopy(scene), None
    if callable(scene):
        return scene, None
    raise BuildError(
        f"compare: scene must be a World, a function that makes one, a name or a path, got {scene!r}; "
        "give one of these",
        field="scene", value=scene, remedy="give a World, a function, a name or a path",
    )  # fmt: skip


def _judged(
    names: Sequence[str], runs: dict[str, Run], failures: dict[str, str], make: Callable[[], Any]
) -> Comparison:
    """Rows in the order asked for, each against the most accurate run that came to its end."""
    whole = [name for name in names if name in runs and name not in failures]
    reference = min(whole, key=lambda name: runs[name].worst_residual, default=None)
    rows = []
    for name in names:
        status = failures.get(name, "complete")
        if name not in runs:
            rows.append(Row(name, status, 0, *([math.nan] * 7)))
            continue
        run = runs[name]
        error = math.nan if reference is None else trajectory_error(run, runs[reference])
        residuals, iterations = run.steps["residual"], run.steps["iterations"]
        rows.append(
            Row(
                name,
                status,
                len(run.steps),
                run.worst_residual,
                float(np.mean(residuals)) if len(residuals) else math.nan,
                float(np.mean(iterations)) if len(iterations) else math.nan,
                run.ms_per_step,
                run.energy_closure,
                run.deepest_penetration,
                error,
            )
        )
    return Comparison(rows, runs, reference, make)


def trajectory_error(run: Run, reference: Run) -> float:
    """Largest distance between the positions of two runs over the frames that both have [m]."""
    count = min(len(run.time), len(reference.time))
    if count == 0 or run.position.shape[1:] != reference.position.shape[1:]:
        return math.nan
    same = np.isclose(run.time[:count], reference.time[:count], rtol=0, atol=1e-9)
    apart = np.linalg.norm(run.position[:count] - reference.position[:count], axis=2)[same]
    return float(apart.max()) if apart.size else math.nan
