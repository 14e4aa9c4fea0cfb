"""The shapes of a recorded run, for drawing.

Recorded with the run; for older files the scene is built again from its text, and where that cannot be done
each body is drawn as a ball of its recorded extent, which the page then says. Knows no page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from carom.errors import CaromError
from carom.recording import Floats

if TYPE_CHECKING:
    from carom.recorded import Run

#: Size of bodies of which nothing at all is known, as a share of the scene's [1].
UNKNOWN_SIZE = 0.02


@dataclass(frozen=True)
class Shapes:
    """Shapes of a run's bodies.

    Attributes
    ----------
    tables : the distinct shapes, as scene files have them
    index : (n,) int32 array, row of `tables`, -1 for a particle
    center : (n, d) float64 array, centre of mass in the shape's axes [m]
    note : what the reader of the page should know about them; empty when they are as recorded
    """

    tables: tuple[Mapping[str, Any], ...]
    index: npt.NDArray[np.int32]
    center: Floats
    note: str = ""


def shapes_of_run(run: Run) -> Shapes:
    """See the file's head."""
    header = run.header
    if header.shape is not None and header.center is not None:
        return Shapes(header.shapes, header.shape, header.center)
    return _from_scene(run) or _balls(run)


def _from_scene(run: Run) -> Shapes | None:
    from carom._friction_problem_of_run import _world
    from carom.run import shapes_of

    try:
        world = _world(run, None)
    except CaromError:
        return None
    tables, index, center = shapes_of([world[name] for name in run.names], run.space)
    return None if index is None or center is None else Shapes(tables, index, center)


def _balls(run: Run) -> Shapes:
    position = run.position
    size = float(np.ptp(position.reshape(-1, position.shape[2]), axis=0).max()) if position.size else 1.0
    extent = run.header.extent
    sizes = np.full(len(run.names), UNKNOWN_SIZE * size or 1.0)
    if extent is not None:
        known = np.isfinite(extent) & (extent > 0)
        sizes = np.where(known, extent, sizes)
    kind = "circle" if run.space == "planar" else "sphere"
    distinct, index = np.unique(sizes, return_inverse=True)
    tables = tuple({"type": kind, "radius": float(each) / 2} for each in distinct)
    note = "This file holds no shapes and its scene cannot be built here: bodies are drawn as balls."
    return Shapes(tables, index.astype(np.int32), np.zeros((len(run.names), position.shape[2])), note)
