"""The threads of a world, and the time that its steps take."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, NamedTuple

from carom._adding import attributed
from carom.errors import refused


class StepTimes(NamedTuple):
    """Where the time of a step went, by the machine's clock.

    Attributes
    ----------
    pairs : which bodies are near each other: boxes and the broad phase [s]
    contacts : their contacts: the narrow phase [s]
    solve : the scheme's other work: loads, solves, motion [s]; all of ``scheme="events"``, which looks for
        contacts in between
    rest : what comes before and after: checks, the ledger, sleep, the report [s]
    """

    pairs: float
    contacts: float
    solve: float
    rest: float

    @property
    def whole(self) -> float:
        """The whole step [s]."""
        return sum(self)


class Threaded:
    """The part of a world that says who works, and how long."""

    __slots__ = ()
    if TYPE_CHECKING:
        _native: Any

    @property
    def threads(self) -> int:
        """Threads that share the work of a step [1], the caller's among them; 1 unless said, at most 256.

        They change the time that steps take and no bit of what comes of them, so `threads` is no setting:
        snapshots, pickles and recorded runs do not have it, and `restore` leaves it as it is. As many as the
        machine has idle cores make sense, and small worlds use only one. ``scheme="soft_step"`` shares nearly
        all of a step, the other schemes their search for contacts, and the islands of solvers that go island
        by island (``"exact"``, ``"auto"``).

        Raises
        ------
        BuildError
            For what is no whole number from 1 to 256, or more threads than the system has; those that there
            were stay.
        """
        return int(self._native.threads())

    @threads.setter
    def threads(self, value: int) -> None:
        try:
            count = operator.index(value)
        except TypeError:
            count = None
        if count is None or isinstance(value, bool) or not 0 <= count < 2**32:
            remedy = "take as many as the machine has cores, or fewer"
            raise refused(None, "threads", "must be a whole number from 1 to 256", value, remedy)
        with attributed({"threads": value}):
            self._native.set_threads(count)

    @property
    def step_times(self) -> StepTimes:
        """Where the time of the last step went [s]; zeros before the first.

        Wall-clock time, with all threads that took part, without what Python takes to ask for the step. It is
        no part of a report, a snapshot or a run: two runs of one scene have the same bits and other times.
        """
        return StepTimes(*self._native.step_times())
