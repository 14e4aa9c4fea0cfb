"""A bar on stderr that shows how far a run has come, how fast, and how well."""

from __future__ import annotations

from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from carom.run import Moment


class Bar:
    """Draws moments of a run; use as a context. Silent when stderr is no terminal."""

    def __init__(self) -> None:
        """A bar that waits for its first moment."""
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.fields[state]}"),
            BarColumn(),
            TextColumn("{task.percentage:3.0f} %"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._progress.add_task("", total=1.0, state="starting")

    def __enter__(self) -> Self:
        """Shows the bar."""
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        """Takes the bar away."""
        self._progress.stop()

    def __call__(self, moment: Moment) -> None:
        """Shows a moment."""
        state = f"t = {moment.time:.3g} s, {moment.steps} steps"
        if moment.last is not None:
            contacts, residual = int(moment.last["contacts"]), float(moment.last["residual"])
            state += f", {contacts} contacts, residual {residual:.1e} m/s"
        self._progress.update(self._task, completed=moment.time / moment.duration, state=state)
