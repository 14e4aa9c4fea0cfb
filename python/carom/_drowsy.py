"""Who sleeps in a world, and waking it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt


class Drowsy:
    """The part of a world that says who sleeps."""

    __slots__ = ()
    if TYPE_CHECKING:
        _native: Any

        @property
        def names(self) -> tuple[str, ...]: ...

    @property
    def asleep(self) -> npt.NDArray[np.bool_]:
        """(n,) bool array: who sleeps, held until something stirs it; see the setting `soft`."""
        array: npt.NDArray[np.bool_] = self._native.asleep()
        array.flags.writeable = False
        return array

    def wake(self, *names: str) -> None:
        """Wakes the islands of bodies that sleep; all of them when none is named.

        Forces, impulses and whatever is written to a body wake its island too, and so do bodies that come
        near.

        Raises
        ------
        BuildError
            for a name that no body has
        """
        for name in names or self.names:
            self._native.wake(name)
