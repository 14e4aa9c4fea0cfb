"""Columns of the steps for the page's plots; of long runs some points that each stand for many steps.

Such a point has the largest residual, the most contacts and iterations and the deepest overlap of its steps,
and the energies, momenta and the cumulated ledger at their end. Knows no page.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from carom.recording import LEDGER_LINES, Records

#: Most points of a plot.
MOST_POINTS = 20_000
_LARGEST = ("residual", "iterations", "contacts", "stop")
_AT_THE_END = ("time", "kinetic", "potential", "momentum", "angular_momentum")
_PAIRS = {"residual": "worst", "deepest_gap": "deepest"}

Array = npt.NDArray[Any]


def columns_of(steps: Records) -> tuple[dict[str, Array], int]:
    """Columns by name, and how many steps a point stands for.

    "number" is the step's (of those a point stands for, the one with the largest residual), "worst" and
    "deepest" are (points, 2) rows of bodies, -1 for none.
    """
    names = steps.dtype.names or ()
    every = -(-len(steps) // MOST_POINTS) if len(steps) else 1
    groups = [slice(begin, begin + every) for begin in range(0, len(steps), every)]
    last = np.array([min(group.stop, len(steps)) - 1 for group in groups], dtype=np.int64)
    residual = np.nan_to_num(steps["residual"])
    worst = np.array([group.start + int(np.argmax(residual[group])) for group in groups], dtype=np.int64)
    gap = np.nan_to_num(steps["deepest_gap"], nan=np.inf)
    deepest = np.array([group.start + int(np.argmin(gap[group])) for group in groups], dtype=np.int64)
    found: dict[str, Array] = {"number": worst.astype(np.int32)}
    for name in _LARGEST:
        largest = [steps[name][group].max() for group in groups]
        found[name] = np.array(largest, dtype=np.float32 if name == "residual" else np.int32)
    found["deepest_gap"] = steps["deepest_gap"][deepest].astype(np.float32)
    for name in _AT_THE_END:
        values = steps[name][last]
        found[name] = values.astype(np.float64 if name == "time" else np.float32)
    for line in (*LEDGER_LINES, "closure"):
        if line in names:
            found[f"ledger_{line}"] = np.cumsum(steps[line])[last].astype(np.float32)
    for column, pair in _PAIRS.items():
        rows = worst if column == "residual" else deepest
        if f"{pair}_a" in names:
            both = np.stack([steps[f"{pair}_a"][rows], steps[f"{pair}_b"][rows]], axis=1)
            found[pair] = both.astype(np.int32).reshape(-1, 2)
    return found, every
