"""The threads of a world."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any

from carom._adding import attributed
from carom.errors import refused


class Threaded:
    """The part of a world that says who works."""

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
