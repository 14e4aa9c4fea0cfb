"""The certificates of a run's steps and their explanations, in words, and how far off their contacts are.

A run file keeps a record of every step, not its problems; the scene is run again, bit by bit, when that takes
no longer than a few seconds, and the steps of its frames are told on the way; up to the worst step at least.
Otherwise the page tells what the records hold, and how to ask for more. Knows no page.
"""

from __future__ import annotations

import time as clock
import warnings
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from carom._friction_problem_of_run import _same, _world
from carom.errors import CaromError

if TYPE_CHECKING:
    from carom.recorded import Run

#: Longest time that running a scene again may take when nothing else is asked for [s].
EXPLAIN_SECONDS = 5.0
#: Steps per call on the way to the next one that is told.
_STEPS_AT_ONCE = 256
#: Most frames whose steps are told.
_MOST_FRAMES = 1000


@dataclass
class Told:
    """What running a scene again told."""

    #: "step" [1] and "time" [s] of the worst step, and its "findings", "certificate" and "accurate"; "note",
    #: why these are missing, empty when they are not; "steps", the same three of other steps by number.
    table: dict[str, Any]
    #: By frame: pairs of bodies, smaller number first, and the largest residual of their contacts [m/s].
    residuals: dict[int, dict[tuple[int, int], float]] = field(default_factory=dict)

    def residuals_of(self, frame: int, a: npt.NDArray[Any], b: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
        """The residual that contacts of a frame share with their pair [m/s]; NaN where it is not known."""
        known = self.residuals.get(frame, {})
        pairs = zip(np.minimum(a, b).tolist(), np.maximum(a, b).tolist(), strict=True)
        return np.array([known.get(pair, np.nan) for pair in pairs], dtype=np.float64)


def in_words(run: Run, seconds: float = EXPLAIN_SECONDS) -> Told:
    """What is known of the steps of a run's frames and of the step with the largest residual."""
    worst = run.worst
    told: dict[str, Any] = {"step": worst.step, "time": None, "findings": [], "certificate": [], "note": "",
                            "steps": {}}  # fmt: skip
    if worst.step < 0 or not worst.value > 0:
        return Told(told | {"note": "No step has a residual: nothing needed to be solved."})
    told["time"] = worst.time
    needed = (worst.step + 1) * run.ms_per_step / 1e3
    if not run.header.scene:
        return Told(told | {"note": "The run does not hold its scene; carom run records it, and the steps can"
                            " then be explained here."})  # fmt: skip
    if not needed <= seconds:
        note = f"Running up to the worst step again takes about {needed:.0f} s; ask for it with"
        return Told(told | {"note": f"{note} explain_seconds={needed * 2:.0f}."})
    again = Told(told)
    try:
        _again(run, worst.step, seconds, again)
    except CaromError as error:
        told["note"] = f"The worst step cannot be run again here: {error}"
    return again


def _again(run: Run, worst: int, seconds: float, told: Told) -> None:
    world = _world(run, None)
    frames = _frames_of_steps(run)
    begun, taken = clock.perf_counter(), 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for step in sorted({worst, *frames}):
            if step > worst and clock.perf_counter() - begun > seconds:
                break
            while taken < step:
                chunk = world._advance(min(_STEPS_AT_ONCE, step - taken), run.header.dt, 0)
                taken += _same(run, taken, chunk.steps, run.steps)
            is_last = step == len(run.steps) - 1
            report = world.step(float(run.steps["dt"][step]) if is_last else run.header.dt)
            taken += 1
            words = _words(world, report)
            if step == worst:
                told.table |= words
            if step in frames:
                told.table["steps"][str(step)] = words
                told.residuals[frames[step]] = _residuals(world)


def _frames_of_steps(run: Run) -> dict[int, int]:
    """Frames by the step that ended at them; some of them where there are many."""
    ends = np.asarray(run.steps["time"], dtype=np.float64)
    stride = -(-len(run.time) // _MOST_FRAMES)
    found: dict[int, int] = {}
    for frame in range(0, len(run.time), max(1, stride)):
        step = int(np.searchsorted(ends, run.time[frame] - 0.5 * run.header.dt))
        if step < len(ends) and abs(ends[step] - run.time[frame]) < 1e-6 * run.header.dt:
            found[step] = frame
    return found


def _words(world: Any, report: Any) -> dict[str, Any]:
    findings = [
        [each.topic, each.text, each.remedy, [str(name) for name in each.bodies]]
        for each in report.explain().findings
    ]
    return {"findings": findings, "certificate": _lines(world), "accurate": bool(report.accurate)}


def _residuals(world: Any) -> dict[tuple[int, int], float]:
    """The largest residual of every pair of bodies, in the last step's problems of contacts and impacts."""
    found: dict[tuple[int, int], float] = {}
    for phase in ("contact", "impact"):
        problem, impulses = world._native.last_problem(phase)
        for (a, b), value in zip(problem.pairs(), problem.residuals(impulses.tolist(), None), strict=True):
            pair = (min(a, b), max(a, b))
            found[pair] = max(found.get(pair, 0.0), float(value))
    return found


def _lines(world: Any) -> list[list[Any]]:
    """The certificate of the contacts' solve, or of the impacts' if that is worse: words, value, unit."""
    solves = [(world.certificate(phase), phase) for phase in ("contact", "impact")]
    found, of = max(solves, key=lambda each: float(each[0].residual))
    rows = f" and {found.rows} rows of joints" if found.rows else ""
    solve = "the impacts' first round" if of == "impact" else "the contacts' solve"
    return [
        [f"residual of the natural map in {solve} ({found.contacts} contacts{rows})", found.residual, "m/s"],
        ["the same, over that of no impulses at all", found.relative_residual, "1"],
        ["largest pull, or friction beyond its limit", found.cone_violation, "N s"],
        ["largest |impulse × velocity left along the normal|", found.complementarity, "J"],
        [f"friction against the slip, off by ({found.sliding} slide)", found.slip_angle_error, "rad"],
        ["energy change − work of the impulses", found.energy_identity, "J"],
        ["energy turned over", found.energy_turned_over, "J"],
    ]
