"""``carom view`` and ``carom film``: a recorded run as a page that replays it, and as a film."""

from __future__ import annotations

import math
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from carom.cli.failure import say
from carom.errors import refused
from carom.recorded import Run

RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="A file that `carom run` wrote.")]


def view_command(
    run: RunArgument,
    html: Annotated[
        Path | None, typer.Option("--html", help="HTML file to write; RUN.html when absent.")
    ] = None,
    other: Annotated[
        Path | None, typer.Option("--with", metavar="OTHER", help="A run of the same scene to compare with.")
    ] = None,
    megabytes: Annotated[float, typer.Option(help="About the page's size at most [MB].")] = 20.0,
    explain: Annotated[
        float, typer.Option(help="Longest time to run up to the worst step again, to explain it [s].")
    ] = 5.0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Write the page and open nothing.")
    ] = False,
) -> None:
    """Write a page that replays a run, and open it in a browser when there is one."""
    if not 0 < megabytes < math.inf:
        raise refused(None, "--megabytes", "must be finite and > 0", megabytes, "20 is the default [MB]")
    recorded = Run.load(run)
    path = recorded.to_html(
        html if html is not None else run.with_suffix(".html"),
        other=None if other is None else Run.load(other),
        max_bytes=max(1, int(megabytes * 1e6)),
        explain_seconds=explain,
    )
    typer.echo(str(path))
    if not no_browser and not _opened(path):
        say("no browser here; open the file in one")


def film_command(
    run: RunArgument,
    out: Annotated[Path | None, typer.Option(help="MP4 file to write; RUN.mp4 when absent.")] = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second of film.")] = 1.0,
    fps: Annotated[int, typer.Option(help="Pictures per second.")] = 30,
    width: Annotated[int, typer.Option(help="Width [pixels].")] = 1280,
    height: Annotated[int, typer.Option(help="Height [pixels].")] = 720,
    dark: Annotated[bool, typer.Option("--dark", help="Dark background.")] = False,
) -> None:
    """Make a film of a run with a headless Chromium."""
    path = Run.load(run).to_mp4(
        out if out is not None else run.with_suffix(".mp4"),
        speed=speed,
        fps=fps,
        size=(width, height),
        theme="dark" if dark else "light",
    )
    typer.echo(str(path))


def _opened(path: Path) -> bool:
    """Whether a browser took the page; browsers that cannot be found or fail are none."""
    try:
        browser = webbrowser.get()
    except webbrowser.Error:
        return False
    if isinstance(browser, webbrowser.GenericBrowser) and not isinstance(
        browser, webbrowser.BackgroundBrowser
    ):
        return False  # a browser of the terminal would take the terminal away
    try:
        return bool(browser.open(path.resolve().as_uri()))
    except (OSError, webbrowser.Error):
        return False
