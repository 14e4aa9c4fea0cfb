"""The command ``carom``: run, view, film, plot, check, compare, advise, problem, scenes, schema.

Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 the run failed, 2 bad input, 130
Ctrl-C.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from carom.cli.advise import advise_command
from carom.cli.check import check_command
from carom.cli.compare import compare_command
from carom.cli.failure import INTERRUPTED, exit_code, say
from carom.cli.plot import plot_command
from carom.cli.problem import problem_app
from carom.cli.run import run_command
from carom.cli.scenes import scenes_command, schema_command
from carom.cli.view import film_command, view_command

app = typer.Typer(
    name="carom",
    help="Rigid-body dynamics in the plane and in space: run scenes, plot runs, compare solvers.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(is_asked: bool) -> None:
    if is_asked:
        import carom

        typer.echo(f"carom {carom.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback when something fails.")] = False,
) -> None:
    """Options before the command; `main` has taken --debug away already, wherever it stood."""


app.command("run")(run_command)
app.command("view")(view_command)
app.command("film")(film_command)
app.command("plot")(plot_command)
app.command("check")(check_command)
app.command("compare")(compare_command)
app.command("advise")(advise_command)
app.command("scenes")(scenes_command)
app.command("schema")(schema_command)
app.add_typer(problem_app)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; returns the exit code.

    Parameters
    ----------
    arguments : words after the command's name; those of the process when absent
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    is_debug = "--debug" in words
    words = [word for word in words if word != "--debug"]
    try:
        code = app(args=words, prog_name="carom", standalone_mode=False)
    except BaseException as error:
        return exit_code(error, is_debug)
    if code == INTERRUPTED:  # what typer makes of Ctrl-C
        say("interrupted")
    return code if isinstance(code, int) else 0


__all__ = ["app", "main"]
