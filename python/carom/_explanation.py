"""Why a step is as accurate as it is: findings in words, and their figures for programs. Knows no world."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple, Self


class Finding(NamedTuple):
    """One thing that was found out about a step.

    Attributes
    ----------
    topic : "residual" (value in m/s), "mass_ratio" [1], "redundant_contacts" (surplus rows [1]),
        "conditioning" (a lower bound of the condition [1]), "iterations" [1], "penetration" [m],
        "rounding" (residual over velocities [1]), "strict_feasibility" [m/s] or "refusal" (contacts [1])
    value : its figure, in the unit named above
    bodies : names of the bodies meant
    text : the finding as a sentence
    remedy : what to do about it; empty when nothing need be done
    """

    topic: str
    value: float
    bodies: tuple[str, ...]
    text: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.text}; {self.remedy}" if self.remedy else self.text


@dataclass(frozen=True)
class Explanation:
    """The findings of a step; as text, a line each.

    Attributes
    ----------
    accurate : whether every solve of the step is within the tolerance
    findings : the residuals first, then what made the problem hard
    """

    accurate: bool
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, accurate: bool, plain: Iterable[Iterable[Any]]) -> Self:
        """An explanation from the engine's plain findings."""
        return cls(accurate, findings_of(plain))

    def __str__(self) -> str:
        return "\n".join(str(finding) for finding in self.findings)

    def __contains__(self, topic: object) -> bool:
        return any(finding.topic == topic for finding in self.findings)

    def __getitem__(self, topic: str) -> Finding:
        for finding in self.findings:
            if finding.topic == topic:
                return finding
        raise KeyError(topic)


def findings_of(plain: Iterable[Iterable[Any]]) -> tuple[Finding, ...]:
    """Findings from the engine's tuples."""
    made = (Finding._make(fields) for fields in plain)
    return tuple(finding._replace(bodies=tuple(finding.bodies)) for finding in made)
