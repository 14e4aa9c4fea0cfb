"""Tables on stdout: the closing table of a run, the comparison of solvers, the list of scenes."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from carom.comparison import Comparison
from carom.recorded import Run
from carom.scene import Scene


def closing_table(run: Run) -> None:
    """Steps, wall time, worst residual and where, energy closure, deepest penetration and where."""
    progress = run.summary()
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_column()
    steps, frames = progress["steps"], progress["frames"]
    table.add_row("scene", run.header.scene_name, f"{run.space}, {len(run.names)} bodies")
    table.add_row("status", run.status, f"t = {progress['time']:.6g} s")
    table.add_row("steps", str(steps), f"of {run.header.dt:.6g} s, {frames} frames recorded")
    table.add_row(
        "wall time", f"{run.wall_time:.2f} s", f"{run.ms_per_step:.3f} ms per step" if steps else ""
    )
    table.add_row("solver", str(progress["solver"]), f"{progress['mean_iterations']:.1f} iterations per step")
    table.add_row("worst residual", f"{run.worst.value:.2e} m/s", run.worst.where())
    table.add_row("energy closure", f"{run.energy_closure:.1e} J", "largest failure of the ledger to add up")
    table.add_row("deepest penetration", f"{run.deepest.value:.2e} m", run.deepest.where())
    if run.path is not None:
        table.add_row("recorded in", "", str(run.path))
    stdout_console().print(table)


def comparison_table(comparison: Comparison) -> None:
    """One row per solver."""
    headings, rows = comparison.cells()
    table = Table(*headings)
    for row in rows:
        table.add_row(*row)
    console = stdout_console()
    console.print(table)
    for note in comparison.notes():
        console.print(note)


def scenes_table(scenes: list[Scene]) -> None:
    """Name, space, duration and description of scenes."""
    table = Table("scene", "space", "duration [s]", "kind", "what it shows")
    for scene in scenes:
        table.add_row(scene.name, scene.space, f"{scene.duration:g}", scene.kind, scene.description)
    stdout_console().print(table)


def stdout_console() -> Console:
    """Stdout; wide enough for whole lines when it is no terminal."""
    console = Console(highlight=False, markup=False, emoji=False)
    return console if console.is_terminal else Console(highlight=False, markup=False, emoji=False, width=200)


def plain(value: Any) -> Any:
    """Values that JSON knows; tuples as lists."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value.tolist() if hasattr(value, "tolist") else value
