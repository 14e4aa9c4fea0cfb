"""One line on a terminal that shows what a long solve is doing; nothing where nobody looks."""

from __future__ import annotations

from types import TracebackType
from typing import Self, TextIO


class SolveLine:
    """Told the progress of a solve; use as a context."""

    def __init__(self, stream: TextIO) -> None:
        """A line that waits for its first news; silent when the stream is no terminal."""
        self._stream = stream
        self._is_seen = stream.isatty()
        self._width = 0

    def __enter__(self) -> Self:
        """Nothing is shown before a solve has lasted long enough to be told."""
        return self

    def __call__(self, stage: str, iterations: int, residual: float) -> None:
        """Shows the stage, its iterations [1] and the residual in the solver's own measure."""
        if self._is_seen:
            self._show(f"{stage}: {iterations} iterations, residual {residual:.1e}")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        """Takes the line away."""
        if self._width:
            self._show("")
            print("\r", end="", file=self._stream, flush=True)

    def _show(self, line: str) -> None:
        print(f"\r{line.ljust(self._width)}", end="", file=self._stream, flush=True)
        self._width = len(line)
