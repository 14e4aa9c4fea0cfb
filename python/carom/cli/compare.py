"""``carom compare``: one scene, several solvers, one table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from carom.cli.failure import say
from carom.cli.run import SceneArgument
from carom.cli.tables import comparison_table, plain
from carom.comparison import compare


def compare_command(
    scene: SceneArgument,
    solvers: Annotated[str, typer.Option(help="Names with commas, e.g. pgs,sequential,lemke.")],
    time: Annotated[
        float | None, typer.Option(help="Simulated time [s]; the scene's own when absent.")
    ] = None,
    dt: Annotated[float | None, typer.Option(help="Time step [s].")] = None,
    iterations: Annotated[int | None, typer.Option(help="Most iterations per step.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Residual at which solvers stop [m/s].")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the table as JSON.")] = False,
    html: Annotated[
        Path | None,
        typer.Option(help="Write a page that replays the reference and the run farthest from it."),
    ] = None,
) -> None:
    """Run a scene with several solvers and tabulate residual, iterations, time and energy closure."""
    names = [name.strip() for name in solvers.split(",") if name.strip()]
    found = compare(
        scene,
        names,
        time,
        dt=dt,
        iterations=iterations,
        tolerance=tolerance,
        progress=None if as_json else lambda name: say(f"running with {name} ..."),
    )
    if as_json:
        typer.echo(json.dumps(plain(found.to_dict()), indent=2))
    else:
        comparison_table(found)
    if html is not None:
        say(f"written: {found.to_html(html)}")
