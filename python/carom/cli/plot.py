"""``carom plot``: pictures of a recorded run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from carom.recorded import Run


def plot_command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A file that `carom run` wrote.")],
    kind: Annotated[
        Literal["energy", "momentum", "residual", "contacts", "matrix", "all"],
        typer.Option(help="Picture to draw."),
    ] = "all",
    step: Annotated[
        int | None, typer.Option(help="Step whose matrix is drawn; that of most contacts when absent.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="PNG, SVG or PDF file; RUN-KIND.png when absent.")] = None,
) -> None:
    """Plot the energy ledger, momentum, residual, contacts, or the matrix at a step."""
    from carom.plotting import plot, save_figure

    recorded = Run.load(run)
    path = out if out is not None else run.with_name(f"{run.stem}-{kind}.png")
    save_figure(plot(recorded, kind, step=step), path)
    typer.echo(str(path))
