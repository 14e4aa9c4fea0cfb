"""How far two runs are apart over time, from the unrounded recordings. Knows no page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from carom.errors import CaromError
from carom.recording import Floats

if TYPE_CHECKING:
    from carom.recorded import Run


@dataclass(frozen=True)
class Difference:
    """Distances between the centres of mass of two runs at the frames that both have.

    Attributes
    ----------
    time : (k,) float64 array [s]
    largest, mean : (k,) float64 arrays over the bodies that both have [m]
    body : (k,) int32 array, the body that is farthest apart, as a row of the first run
    """

    time: Floats
    largest: Floats
    mean: Floats
    body: np.ndarray[tuple[int], np.dtype[np.int32]]


def difference(run: Run, other: Run) -> Difference:
    """See `Difference`; bodies are matched by name, frames by time to 1e-9 s.

    Raises
    ------
    CaromError
        When the runs are of different spaces, or share no body or no frame.
    """
    if run.space != other.space:
        raise _refused("one run is of the plane, the other of space")
    rows = {name: row for row, name in enumerate(other.names)}
    shared = [row for row, name in enumerate(run.names) if name in rows]
    if not shared:
        raise _refused("the runs share no body")
    theirs = [rows[run.names[row]] for row in shared]
    near = np.clip(np.searchsorted(other.time, run.time - 1e-9), 0, len(other.time) - 1)
    frames = np.flatnonzero(np.abs(other.time[near] - run.time) <= 1e-9)
    if not len(frames):
        raise _refused("the runs share no moment")
    ours = run.position[frames][:, shared]
    apart = np.linalg.norm(ours - other.position[near[frames]][:, theirs], axis=2)
    farthest = np.array(shared, dtype=np.int32)[apart.argmax(axis=1)]
    return Difference(run.time[frames], apart.max(axis=1), apart.mean(axis=1), farthest)


def _refused(problem: str) -> CaromError:
    remedy = "compare runs of the same scene"
    return CaromError(f"replay: {problem}; {remedy}", field="other", remedy=remedy)
