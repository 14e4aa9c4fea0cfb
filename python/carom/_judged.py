"""How good a world's solves are: its contact problems as values, certificates, one warning per run."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from carom._certificate import Certificate
from carom._explanation import Finding
from carom._problem import ContactProblem
from carom._space import Floats, Space, frozen, number
from carom.errors import EnergyGainWarning, InaccurateWarning, refused

#: Told of long solves: stage, iterations so far [1], residual so far in the solver's own measure.
SolveProgress = Callable[[str, int, float], None]


class Judged:
    """The part of a world that looks at its solves."""

    __slots__ = ("_warned", "_warned_of_gain")
    _space: ClassVar[Space]
    _warned: bool
    _warned_of_gain: bool
    if TYPE_CHECKING:
        _native: Any

        @property
        def names(self) -> tuple[str, ...]:
            """Names of the bodies."""

    def problem(self, dt: float | None = None, *, phase: str = "contact") -> ContactProblem:
        """The contact problem that the next step would solve; the world does not change.

        Parameters
        ----------
        dt : length of that step [s]; the setting when absent
        phase : "contact" for the persistent contacts, "impact" for the impacts before them

        Raises
        ------
        StepError
            As for `step`, save that a solver's refusal of this very problem is none.
        """
        length = None if dt is None else number(dt, "dt", "s")
        return ContactProblem._of(self._space, self._native.problem(length, _phase(phase)), self.names)

    def last_problem(self, phase: str = "contact") -> tuple[ContactProblem, Floats]:
        """The contact problem that the last step solved, and the impulses that it found.

        Parameters
        ----------
        phase : "contact" for the persistent contacts, "impact" for the first round of the impacts before them

        Returns
        -------
        The problem, and a (k, d) float64 array: normal, then tangential impulses, contact frames [N s]. Where
        the problem has rows of joints, rolling or spinning friction, one float64 array in scalar order: those
        of the contacts, the rows', the moments [N s], [N m s].
        """
        native, flat = self._native.last_problem(_phase(phase))
        _, _, rows, moments = native.counts()
        impulses: Floats = frozen(flat if rows or moments else flat.reshape(-1, self._space.dimension))
        return ContactProblem._of(self._space, native, self.names), impulses

    def certificate(self, phase: str = "contact", *, island: str | None = None) -> Certificate:
        """The certificate of the last step's solve, measured from the problem and the impulses alone.

        Parameters
        ----------
        phase : "contact" for the persistent contacts, "impact" for the first round of the impacts before
            them; impulses of "moreau", "poisson", "sequential" and of the energy guard obey other conditions
            than Newton's at the end: there the residual tells that
        island : name of a body whose island alone is meant; contacts keep their numbers

        Raises
        ------
        BuildError
            When there is no such body, or nothing touches it.
        """
        found = self._native.certificate(_phase(phase), island)
        if found is None:
            remedy = "name a body that has contacts, see w.contacts"
            raise refused(None, "island", "must be the name of a touching body", island, remedy)
        return Certificate.from_json(found)

    def _warn(self, step: int, time: float, findings: tuple[Finding, ...]) -> None:
        """Warns once until the next run or change of a setting."""
        if self._warned:
            return
        self._warned = True
        reasons = "\n".join(f"  - {finding}" for finding in findings)
        text = (
            f"step {step} (t = {time:.6g} s) is less accurate than asked; further ones of this run are "
            f"not told (on_inaccurate):\n{reasons}"
        )
        warnings.warn(InaccurateWarning(text, findings), stacklevel=_levels_to_the_caller())

    def _warn_of_gain(self, step: int, time: float, findings: tuple[Finding, ...]) -> None:
        """Warns of impacts that gained energy, once until the next run or change of a setting."""
        if self._warned_of_gain:
            return
        self._warned_of_gain = True
        gains = tuple(finding for finding in findings if finding.topic == "energy_gain")
        reasons = "\n".join(f"  - {finding}" for finding in gains)
        text = (
            f"impacts of step {step} (t = {time:.6g} s) gained energy; further ones of this run are not told "
            f"(energy_guard):\n{reasons}"
        )
        warnings.warn(EnergyGainWarning(text, gains), stacklevel=_levels_to_the_caller())

    def _forget_warnings(self) -> None:
        """What was warned of is told again."""
        self._warned = self._warned_of_gain = False


def _phase(name: str) -> str:
    """One of the two problems of a step."""
    if name not in ("contact", "impact"):
        raise refused(None, "phase", 'must be "contact" or "impact"', name, 'choose "contact" or "impact"')
    return name


def _levels_to_the_caller() -> int:
    """Stack levels from whoever calls this up to the first frame outside the package, for `warnings.warn`."""
    own = str(Path(__file__).parent)
    frame, levels = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith(own):
        frame, levels = frame.f_back, levels + 1
    return levels
