"""What can go wrong, each saying which body and field, the value and the remedy.

Messages have the form ``body 'crate3': mass must be > 0, got nan; give mass in kg``. Programs read the parts
from the attributes. Knows nothing else of carom.
"""

from __future__ import annotations

from typing import Any


class CaromError(Exception):
    """Base of all errors of carom.

    Attributes
    ----------
    body : name of the body meant, or None
    joint : name of the joint meant, or None
    field : its field, a setting of the world or an argument, or None
    value : what was given, or None
    remedy : what to do about it, or None
    """

    def __init__(
        self,
        message: str,
        *,
        body: str | None = None,
        field: str | None = None,
        value: Any = None,
        remedy: str | None = None,
    ) -> None:
        """The whole sentence, and its parts for programs."""
        super().__init__(message)
        self.body = body
        self.joint: str | None = None
        self.field = field
        self.value = value
        self.remedy = remedy


class BuildError(CaromError):
    """Wrong input: an argument, a body, a shape, a setting. Nothing has changed."""


class StepError(CaromError):
    """A step that could not be taken. The world is exactly as it was before it.

    Attributes
    ----------
    findings : `carom.Finding` of the solve that failed the step, if one did; empty otherwise
    """

    findings: tuple[Any, ...] = ()

    def _tell(self, findings: list[Any]) -> None:
        from carom._explanation import findings_of

        self.findings = findings_of(findings)


class SolverError(StepError):
    """A step whose contact problem the chosen solver refused. The world is exactly as it was before it."""


class InaccurateError(StepError):
    """A step that is less accurate than asked, with ``on_inaccurate = "raise"``. The world is as before."""


class EnergyGainError(StepError):
    """A step whose impacts would gain energy, with ``energy_guard = "raise"``. The world is as before."""


class EnergyGainWarning(UserWarning):
    """Impacts gained energy, with ``energy_guard = "warn"``; once per run, with bodies and energy.

    Attributes
    ----------
    findings : `carom.Finding` of the step
    """

    def __init__(self, message: str, findings: tuple[Any, ...] = ()) -> None:
        """The whole text, and its parts for programs."""
        super().__init__(message)
        self.findings = findings


class InaccurateWarning(UserWarning):
    """A step that is less accurate than asked, with "warn" or "escalate"; once per run, with the reasons.

    Attributes
    ----------
    findings : `carom.Finding` of the step
    """

    def __init__(self, message: str, findings: tuple[Any, ...] = ()) -> None:
        """The whole text, and its parts for programs."""
        super().__init__(message)
        self.findings = findings


class ViewError(CaromError):
    """A change of the bodies while arrays still look at the world's memory. Nothing has changed."""


class BusyError(CaromError):
    """A call on a world that is in the middle of a step, in another thread or above a force field."""


class RunFileError(CaromError):
    """A run file that cannot be read or written."""


class SceneError(CaromError):
    """A scene that was refused.

    Attributes
    ----------
    path : file or name of the scene, or None
    line : line of the file, from 1, or None
    key : key in the file, e.g. ``body.2.mass``, or None
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | None = None,
        line: int | None = None,
        key: str | None = None,
        body: str | None = None,
        field: str | None = None,
        value: Any = None,
        remedy: str | None = None,
    ) -> None:
        """The whole sentence, and its parts for programs."""
        super().__init__(message, body=body, field=field, value=value, remedy=remedy)
        self.path = path
        self.line = line
        self.key = key


def refused(body: str | None, field: str, problem: str, value: Any, remedy: str) -> BuildError:
    """A refused input in the form of all messages: ``body 'a': field problem, got value; remedy``."""
    place = f"body {body!r}: " if body is not None else ""
    return BuildError(
        f"{place}{field} {problem}, got {shown(value)}; {remedy}",
        body=body,
        field=field,
        value=value,
        remedy=remedy,
    )


def shown(value: Any) -> str:
    """A value for a message: numpy scalars as plain numbers, long ones cut."""
    text = repr(value.tolist() if hasattr(value, "tolist") else value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def unknown(what: str, word: str, known: list[str], body: str | None = None) -> BuildError:
    """A name that is none of those known, with the nearest of them."""
    from carom.scene.suggest import did_you_mean

    remedy = did_you_mean(word, known) or f"known: {', '.join(known)}"
    place = f"body {body!r}: " if body is not None else ""
    return BuildError(
        f"{place}unknown {what} {word!r}; {remedy}", body=body, field=word, value=word, remedy=remedy
    )
