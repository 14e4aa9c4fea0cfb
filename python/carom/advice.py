"""What to run a scene with: `advise` tries schemes, solvers and steps and says what an accuracy costs.

The error of a trial is the largest distance, over frames and bodies, between its positions and those of the
reference, the trial with the finest step of the scheme that finds events. How far the reference itself still
moves when its step is halved is told as its own uncertainty: where that exceeds the accuracy asked for,
places cannot be had to it (scenes with many impacts are chaotic), and overlap and residual decide instead.
Knows no physics.
"""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from carom.comparison import _factory
from carom.errors import BuildError, CaromError

#: Time between the frames at which trials are compared [s]; every step of `STEPS` divides it.
FRAME = 1 / 30
#: Steps that are tried, from coarse to fine [s].
STEPS = tuple(FRAME / n for n in (1, 2, 4, 8, 16, 32))
#: Schemes, solvers and plastic arrivals (of events) that are tried, the one that makes the reference last.
WAYS = (
    ("fixed_step", "nncg", None),
    ("fixed_step", "exact", None),
    ("events", "exact", "within_the_step"),
    ("events", "exact", "at_their_moment"),
)
#: Share of the seconds that each way may take.
SHARES = (0.15, 0.2, 0.3, 0.35)
#: Longest simulated time of a trial [s].
LONGEST = 1.0


@dataclass(frozen=True)
class Trial:
    """One short run.

    Attributes
    ----------
    scheme, solver, dt : what it ran with; dt [s]
    plastic_arrivals : "at_their_moment" or "within_the_step", of the scheme events; None of others
    time : simulated [s]
    cost : seconds of computing per simulated second [1]
    error : largest distance from the reference [m]; nan for a trial that did not reach the common end
    residual : worst of its steps [m/s]
    deepest : deepest overlap [m]
    gain : largest gain of energy in a step that no load explains, over the largest energy met [1]
    capped : sets of bodies whose events did not end in a step [1]
    status : "complete", "out of time", or why it failed
    """

    scheme: str
    solver: str
    dt: float
    time: float
    cost: float
    error: float
    residual: float
    deepest: float
    gain: float
    capped: int
    status: str
    plastic_arrivals: str | None = None


@dataclass(frozen=True)
class Advice:
    """What to run a scene with.

    Attributes
    ----------
    scheme, solver, dt : the advice; dt [s]
    plastic_arrivals : the same of the scheme events, "at_their_moment" or "within_the_step"; None of others
    cost : seconds of computing per simulated second that it took in the trial [1]
    error : its estimated error of position at the end of the trial [m]
    accuracy : what was asked for [m]
    is_reached : whether positions are within the accuracy, the reference's uncertainty included
    uncertainty : how far the reference moves when its step is halved [m]; nan when it was taken once only
    reason : why this and nothing else, in words
    trials : all `Trial`s in the order they were run
    """

    scheme: str
    solver: str
    dt: float
    cost: float
    error: float
    accuracy: float
    is_reached: bool
    uncertainty: float
    reason: str
    trials: tuple[Trial, ...]
    plastic_arrivals: str | None = None

    def settings(self) -> dict[str, Any]:
        """The advice as settings of a world: `World(**advice.settings())`."""
        settings: dict[str, Any] = {"scheme": self.scheme, "solver": self.solver, "dt": self.dt}
        if self.plastic_arrivals is not None:
            settings["events"] = {"plastic_arrivals": self.plastic_arrivals}
        return settings

    def to_dict(self) -> dict[str, Any]:
        """Plain values for programs; what is not finite becomes None."""

        def plain(value: Any) -> Any:
            if isinstance(value, dict):
                return {key: plain(entry) for key, entry in value.items()}
            if isinstance(value, (list, tuple)):
                return [plain(entry) for entry in value]
            return None if isinstance(value, float) and not math.isfinite(value) else value

        return {key: plain(value) for key, value in asdict(self).items()}

    def __str__(self) -> str:
        """The advice, the reason, and the trials as a table."""
        form = "{:<10}  {:<6}  {:<15}  {:>9}  {:>10}  {:>9}  {:>9}  {:>9}  {}"
        head = form.format(
            "scheme", "solver", "plastic arrive", "dt [s]", "cost [s/s]", "error [m]", "res [m/s]",
            "deep [m]", "status",
        )  # fmt: skip
        rows = [
            form.format(
                t.scheme, t.solver, t.plastic_arrivals or "-", f"{t.dt:.3g}", f"{t.cost:.2g}",
                f"{t.error:.1e}", f"{t.residual:.1e}", f"{t.deepest:.1e}", t.status,
            )
            for t in self.trials
        ]  # fmt: skip
        arrivals = f", plastic arrivals {self.plastic_arrivals!r}" if self.plastic_arrivals else ""
        first = f"scheme {self.scheme!r}, solver {self.solver!r}{arrivals}, dt {self.dt:.6g} s"
        return "\n".join([f"{first}: {self.reason}", "", head, *rows])


class _Run:
    """A trial in the making: its frames and its worst figures."""

    def __init__(self, world: Any, way: tuple[str, str, str | None], dt: float) -> None:
        self.way, self.dt = way, dt
        world.scheme, world.solver, arrivals = way
        if arrivals is not None:
            world.events = {**world.events, "plastic_arrivals": arrivals}
        self.world, self.frames = world, [np.array(world.position)]
        self.residual, self.deepest, self.gain, self.capped = 0.0, 0.0, 0.0, 0
        self.wall, self.simulated, self.status = 0.0, 0.0, "complete"

    def go(self, frames: int, seconds: float) -> None:
        """Runs so many frames, or for so many seconds of computing."""
        dt = self.dt
        energy = largest = sum(self.world.energy.values())
        for _ in range(frames):
            for _ in range(round(FRAME / dt)):
                begun = time.perf_counter()
                try:
                    report = self.world.step(dt)
                except CaromError as error:
                    self.status = str(error)
                    return
                self.wall += time.perf_counter() - begun
                self.simulated += dt
                now = report.kinetic + report.potential
                work = report.ledger["applied"] + report.ledger["driven"]
                largest = max(largest, abs(now), report.kinetic)
                self.gain = max(self.gain, (now - energy - work) / max(largest, 1e-300))
                energy = now
                self.residual = max(self.residual, report.residual)
                self.deepest = max(self.deepest, -(report.deepest_gap or 0.0))
                self.capped += report.events.capped
                if self.wall > seconds:
                    self.status = "out of time"
                    return
            self.frames.append(np.array(self.world.position))

    def trial(self, reference: _Run | None) -> Trial:
        """What it came to, beside the reference."""
        scheme, solver, arrivals = self.way
        cost = self.wall / self.simulated if self.simulated else math.inf
        error = math.nan if reference is None else _apart(self.frames, reference.frames)
        if self.status != "complete":
            error = math.nan
        return Trial(
            scheme, solver, self.dt, self.simulated, cost, error, self.residual, self.deepest, self.gain,
            self.capped, self.status, arrivals,
        )  # fmt: skip


def _apart(one: list[npt.NDArray[np.float64]], other: list[npt.NDArray[np.float64]]) -> float:
    pairs = list(zip(one, other, strict=False))[1:]
    return max((float(np.linalg.norm(a - b, axis=-1).max(initial=0.0)) for a, b in pairs), default=math.nan)


def advise(
    scene: Any,
    accuracy: float,
    t: float | None = None,
    *,
    seconds: float = 60.0,
    progress: Callable[[str], None] | None = None,
) -> Advice:
    """Which scheme, solver and step give positions to an accuracy, and what that costs.

    Parameters
    ----------
    scene : a World (left as it is), a function that makes one, the name of a scene, or the path of a scene
        file
    accuracy : wanted error of positions after the trial [m]
    t : simulated time of the trials [s]; the scene's own when absent, at most 1
    seconds : of computing for all trials together [s]; each gets a fair share of what is left
    progress : told each trial before it runs

    Raises
    ------
    BuildError
        When the accuracy, the time or the seconds are not positive numbers, or nothing could be run.
    SceneError
        When the scene is refused.
    """
    for name, value in (("accuracy", accuracy), ("t", 1.0 if t is None else t), ("seconds", seconds)):
        if not (math.isfinite(value) and value > 0):
            raise BuildError(
                f"advise: {name} must be > 0, got {value!r}; give a positive number",
                field=name, value=value, remedy="give a positive number",
            )  # fmt: skip
    make, own = _factory(scene)
    length = min(LONGEST, own or LONGEST) if t is None else t
    frames = max(1, round(length / FRAME))
    runs = _runs(make, frames, seconds, progress)
    return _chosen(runs, accuracy)


def _runs(
    make: Callable[[], Any], frames: int, seconds: float, progress: Callable[[str], None] | None
) -> list[_Run]:
    """All trials, the reference's scheme first; each way goes on to finer steps until its time is spent."""
    runs: list[_Run] = []
    for way, share in reversed(tuple(zip(WAYS, SHARES, strict=True))):
        left = seconds * share
        for dt in STEPS:
            if progress is not None:
                progress(f"{', '.join(name for name in way if name)}, dt {dt:.3g} s")
            run = _Run(make(), way, dt)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # the table tells
                run.go(frames, left)
            runs.append(run)
            left -= run.wall
            # half the step takes about twice the time
            if run.status != "complete" or left < 2 * run.wall:
                break
    return runs


def _chosen(runs: list[_Run], accuracy: float) -> Advice:
    whole = [run for run in runs if run.status == "complete"]
    if not whole:
        raise BuildError(
            f"advise: no trial came to its end: {runs[0].status}; give more seconds, or a shorter t",
            field="seconds", remedy="give more seconds, or a shorter t",
        )  # fmt: skip
    reference_way = next((way for way in reversed(WAYS) if any(run.way == way for run in whole)), WAYS[-1])
    same = [run for run in whole if run.way == reference_way]
    reference = same[-1]
    uncertainty = _apart(same[-2].frames, reference.frames) if len(same) > 1 else math.nan
    trials = tuple(run.trial(reference) for run in runs)
    good = [trial for trial in trials if trial.status == "complete" and trial.capped == 0]
    if uncertainty <= accuracy:
        enough = [trial for trial in good if max(trial.error, uncertainty) <= accuracy]
        if enough:
            best = min(enough, key=lambda trial: trial.cost)
            reason = (
                f"the cheapest trial whose positions are within {accuracy:.1e} m of the reference, "
                f"which moves by {uncertainty:.1e} m when its step is halved"
            )
            return _advice(best, accuracy, True, uncertainty, reason, trials)
    moves = "was taken at one step only" if math.isnan(uncertainty) else f"still moves by {uncertainty:.1e} m"
    shallow = [trial for trial in good if trial.deepest <= accuracy]
    if shallow:
        best = min(shallow, key=lambda trial: (max(trial.residual, 1e-9), trial.cost))
        chosen = f"this one has the least residual of those that overlap by at most {accuracy:.1e} m"
    else:
        best = min(good or list(trials), key=lambda trial: (trial.deepest, trial.cost))
        chosen = "this one overlaps least"
    reason = (
        f"positions cannot be told to {accuracy:.1e} m: the reference {moves} when its step is halved, so "
        f"futures part (many impacts), or the time for trials was too short; {chosen}"
    )
    return _advice(best, accuracy, False, uncertainty, reason, trials)


def _advice(
    best: Trial, accuracy: float, is_reached: bool, uncertainty: float, reason: str, trials: tuple[Trial, ...]
) -> Advice:
    return Advice(
        best.scheme, best.solver, best.dt, best.cost, best.error, accuracy, is_reached, uncertainty, reason,
        trials, best.plastic_arrivals,
    )  # fmt: skip
