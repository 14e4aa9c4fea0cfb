"""``carom advise``: which scheme, solver and step give an accuracy, from short trial runs."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from carom.advice import advise
from carom.cli.failure import say
from carom.cli.run import SceneArgument


def advise_command(
    scene: SceneArgument,
    accuracy: Annotated[float, typer.Option(help="Wanted error of positions after the trial [m].")] = 1e-3,
    time: Annotated[
        float | None,
        typer.Option(help="Simulated time of the trials [s]; the scene's own, at most 1, when absent."),
    ] = None,
    seconds: Annotated[float, typer.Option(help="Computing time for all trials together [s].")] = 60.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print all as JSON.")] = False,
) -> None:
    """Try schemes, solvers and steps for a moment, and say what an accuracy costs."""
    found = advise(
        scene,
        accuracy,
        time,
        seconds=seconds,
        progress=None if as_json else lambda name: say(f"trying {name} ..."),
    )
    typer.echo(json.dumps(found.to_dict(), indent=2) if as_json else str(found))
