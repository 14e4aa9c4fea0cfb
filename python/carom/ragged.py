"""What frames of a run hold in different numbers: contacts, and what they did. Knows no worlds."""

from __future__ import annotations

import operator
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from carom.errors import refused
from carom.recording import Records, RunData


class RaggedContacts:
    """Contacts of each frame: structured arrays with fields a, b, point [m], normal (b -> a), gap [m], ..."""

    _offsets = "contact_offsets"

    def __init__(self, data: RunData) -> None:
        """Contacts of recorded data."""
        self._data = data

    def _rows(self, begin: int, end: int) -> Records:
        return self._data.contacts(begin, end)

    @property
    def offsets(self) -> npt.NDArray[np.int64]:
        """(f + 1,) int64 array; contacts of frame i are rows offsets[i]:offsets[i + 1]."""
        return self._data.frames(self._offsets)

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.offsets) - 1

    def __getitem__(self, frame: int) -> Records:
        """Contacts of a frame; negative numbers count from the end.

        Raises
        ------
        IndexError
            When there is no such frame.
        TypeError
            For anything but a whole number.
        """
        try:
            number = range(len(self))[operator.index(frame)]
        except IndexError:
            raise IndexError(f"no frame {frame}: the run has {len(self)}") from None
        except TypeError:
            raise TypeError(f"a frame's number is whole, got {frame!r}; ask for one after another") from None
        return self._rows(int(self.offsets[number]), int(self.offsets[number + 1]))

    def __iter__(self) -> Iterator[Records]:
        """Contacts of one frame after another."""
        return (self[frame] for frame in range(len(self)))

    def at(self, t: float) -> Records:
        """Contacts of the recorded frame nearest to time `t` [s].

        Raises
        ------
        BuildError
            When `t` is not finite.
        """
        if not np.isfinite(t):
            raise refused(None, "t", "must be finite", t, "give a moment of the run [s]")
        return self[int(np.argmin(np.abs(self._data.frames("time") - t)))]

    def all(self) -> Records:
        """Contacts of all frames, one after another."""
        return self._rows(0, int(self.offsets[-1]))

    def __repr__(self) -> str:
        """Counts of frames and contacts."""
        return f"<contacts of {len(self)} frames, {int(self.offsets[-1])} in all>"


class RaggedEvents(RaggedContacts):
    """What the contacts did in each frame's last step: structured arrays as of ``world.event_log``."""

    _offsets = "event_offsets"

    def __init__(self, data: RunData, records: Records) -> None:
        """Events of recorded data."""
        super().__init__(data)
        self._records = records

    def _rows(self, begin: int, end: int) -> Records:
        return self._records[begin:end]

    def __repr__(self) -> str:
        """Counts of frames and records."""
        return f"<events of {len(self)} frames, {int(self.offsets[-1])} records in all>"
