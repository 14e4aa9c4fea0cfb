"""What the command line says and returns when something goes wrong: one message on stderr, an exit code."""

from __future__ import annotations

import sys
import traceback

from carom.errors import CaromError, SolverError, StepError

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def exit_code(error: BaseException, is_debug: bool) -> int:
    """Tells an error and returns the exit code that belongs to it."""
    if isinstance(error, SystemExit):
        return error.code if isinstance(error.code, int) else FAILED
    if type(error).__name__ == "Exit" and hasattr(error, "exit_code"):  # typer's way to leave early
        return int(error.exit_code)
    if is_debug:
        traceback.print_exception(error)
    if isinstance(error, KeyboardInterrupt) or type(error).__name__ == "Abort":
        say("interrupted")
        return INTERRUPTED
    if type(error).__name__ == "NoArgsIsHelpError" and hasattr(error, "format_message"):
        say(error.format_message())
        return BAD_INPUT
    if hasattr(error, "format_message"):  # a usage error of the command line
        context = getattr(error, "ctx", None)
        hint = f" (see `{context.command_path} --help`)" if context is not None else ""
        say(f"error: {error.format_message()}{hint}")
        return BAD_INPUT
    if isinstance(error, (StepError, SolverError)):
        say(f"error: {error}")
        return FAILED
    if isinstance(error, CaromError):
        say(f"error: {error}")
        return BAD_INPUT
    if isinstance(error, BrokenPipeError):
        return FAILED
    say(f"internal error: {type(error).__name__}: {error}; run again with --debug and report it")
    return FAILED


def say(message: str) -> None:
    """One message to stderr."""
    print(message, file=sys.stderr)
