"""Force fields that users write, in the engine's form: flat forces and torques, checked. Knows no worlds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from carom._space import Floats, Space, frozen
from carom.errors import StepError, shown

#: A force field: (time [s], (n, d) positions [m], (n, d) velocities [m/s]) -> (n, d) forces [N], or a
#: dictionary with "force" and "torque" ((n,) | (n, 3) [N m]).
Force = Callable[[float, Floats, Floats], npt.ArrayLike | Mapping[str, npt.ArrayLike]]
_Loads = tuple[Floats | None, Floats | None]


def loads(name: str, function: Force, space: Space) -> Callable[[float, Floats, Floats], _Loads]:
    """A force field in the engine's form: flat forces and torques."""

    def act(time: float, position: Floats, velocity: Floats) -> _Loads:
        count = len(position)
        answer = function(time, frozen(position), frozen(velocity))
        table = answer if isinstance(answer, Mapping) else {"force": answer}
        for key in table:
            if key not in ("force", "torque"):
                remedy = "give 'force' and 'torque'"
                raise StepError(
                    f"force field {name!r}: unknown key {key!r}; {remedy}",
                    field=name,
                    value=key,
                    remedy=remedy,
                )
        torques = (count,) if space.is_planar else (count, 3)
        given: dict[str, Floats] = {}
        for part, shape, unit in (("force", (count, space.dimension), "N"), ("torque", torques, "N m")):
            if part in table:
                given[part] = _load(name, part, table[part], shape, unit)
        return given.get("force"), given.get("torque")

    return act


def _load(name: str, part: str, value: Any, shape: tuple[int, ...], unit: str) -> Floats:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(())
    if array.shape != shape:
        got = f"got {shown(value)}" if array.ndim == 0 else f"got shape {array.shape}"
        remedy = f"return a row for each body in {unit}"
        raise StepError(
            f"force field {name!r}: {part} must be a {shape} array, {got}; {remedy}",
            field=name, value=value, remedy=remedy,
        )  # fmt: skip
    return np.ascontiguousarray(array).reshape(-1)
