"""``carom check``: a recorded run, verified from its file alone."""

from __future__ import annotations

import json
from pathlib import Path
from types import TracebackType
from typing import Annotated, Self

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from carom.check_run import check_run
from carom.check_run_file import UnreadableRunError
from carom.cli.failure import BAD_INPUT, FAILED, say


class _Bar:
    """Shows how much of a file is checked; silent when stderr is no terminal."""

    def __init__(self) -> None:
        console = Console(stderr=True)
        columns = (
            TextColumn("checking"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} %"),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._progress.add_task("", total=1.0)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self._progress.stop()

    def __call__(self, share: float) -> None:
        self._progress.update(self._task, completed=share)


def check_command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A file that `carom run` wrote.")],
    closure: Annotated[
        float, typer.Option(help="Largest closure of the energy ledger in a step, relative [1].")
    ] = 1e-12,
    penetration: Annotated[
        float | None,
        typer.Option(
            help="Deepest overlap that passes [m]; a tenth of the smallest moving body when absent."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print everything as JSON.")] = False,
) -> None:
    """Check a recorded run from its file alone; exit code 0 it holds, 1 it does not, 2 it cannot be read."""
    try:
        with _Bar() as bar:
            found = check_run(run, closure=closure, penetration=penetration, progress=bar)
    except (UnreadableRunError, ValueError) as error:
        say(f"error: {error}")
        raise typer.Exit(BAD_INPUT) from None
    typer.echo(json.dumps(found.to_dict(), indent=2) if as_json else found.text())
    if not found.ok:
        raise typer.Exit(FAILED)
