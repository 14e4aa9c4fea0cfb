"""``carom run``: runs a scene, records it and prints the closing table."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from carom.cli.failure import say
from carom.cli.progress import Bar
from carom.cli.tables import closing_table, plain
from carom.errors import InaccurateWarning, SolverError, StepError
from carom.run import Run, run_world
from carom.scene import Scene, load_scene
from carom.scene.document import ImpactLaw, Integrator, OnInaccurate, Scheme, Solver

#: Frames per simulated second when nothing else is asked for [1/s].
FRAME_RATE = 60

SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="A scene's name, or a .toml or .json file.")
]


def run_command(
    scene: SceneArgument,
    time: Annotated[
        float | None, typer.Option(help="Simulated time [s]; the scene's own when absent.")
    ] = None,
    dt: Annotated[float | None, typer.Option(help="Time step [s].")] = None,
    solver: Annotated[Solver | None, typer.Option(help="Contact solver.")] = None,
    iterations: Annotated[int | None, typer.Option(help="Most iterations per step.")] = None,
    tolerance: Annotated[float | None, typer.Option(help="Residual at which the solver stops [m/s].")] = None,
    on_inaccurate: Annotated[
        OnInaccurate | None, typer.Option(help="What happens to a solve above the tolerance.")
    ] = None,
    scheme: Annotated[Scheme | None, typer.Option(help="Time-stepping scheme.")] = None,
    impact: Annotated[ImpactLaw | None, typer.Option(help="Impact law.")] = None,
    integrator: Annotated[Integrator | None, typer.Option(help="Integrator.")] = None,
    threads: Annotated[
        int, typer.Option(help="Threads that share a step's work; the same bits for any number.")
    ] = 1,
    every: Annotated[
        int | None,
        typer.Option(help="Steps between recorded frames; 60 frames per simulated second when absent."),
    ] = None,
    record_events: Annotated[
        bool | None,
        typer.Option(
            help="Record what contacts did within steps of the scheme 'events'; when absent, if --every is 1."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="HDF5 file to record into; SCENE.h5 here when absent, 'none' for no file."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the closing table as JSON.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar and no table.")] = False,
) -> None:
    """Run a scene and record it. Ctrl-C keeps what is done."""
    wanted = load_scene(scene)
    settings = {
        "dt": dt,
        "solver": solver,
        "iterations": iterations,
        "tolerance": tolerance,
        "on_inaccurate": on_inaccurate,
        "scheme": scheme,
        "impact": impact,
        "integrator": integrator,
    }
    world = wanted.build(**{key: value for key, value in settings.items() if value is not None})
    world.threads = threads
    if not quiet:
        for note in wanted.notes:
            say(f"note: {note}")
    path = _out(wanted, out)
    frames = every if every is not None else max(1, round(1 / (FRAME_RATE * world.settings["dt"])))
    duration = time if time is not None else wanted.duration
    options: dict[str, Any] = {
        "every": frames, "record_events": record_events, "out": path,
        "scene": wanted.text, "scene_name": wanted.name,
    }  # fmt: skip
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", InaccurateWarning)
            if quiet or as_json:
                run = run_world(world, duration, **options)
            else:
                with Bar() as bar:
                    run = run_world(world, duration, progress=bar, **options)
        for warning in caught:
            say(f"warning: {warning.message}")
    except (KeyboardInterrupt, StepError, SolverError):
        partial = getattr(world, "last_run", None)
        if partial is not None:
            _close(partial, as_json, quiet)
        raise
    _close(run, as_json, quiet)


def _close(run: Run, as_json: bool, quiet: bool) -> None:
    if as_json:
        typer.echo(json.dumps(plain({**run.summary(), "settings": dict(run.settings)}), indent=2))
    elif not quiet:
        closing_table(run)


def _out(scene: Scene, out: Path | None) -> Path | None:
    """Where to record: as asked, or a file here that no earlier run has taken."""
    if out is not None:
        return None if str(out) == "none" else out
    path, number = Path(f"{scene.name}.h5"), 1
    while path.exists():
        number += 1
        path = Path(f"{scene.name}-{number}.h5")
    return path
