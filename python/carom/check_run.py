"""Checks a recorded run from its file alone: numpy and h5py, not a line of the engine.

    carom check RUN.h5        (or: python -m carom.check_run RUN.h5, or: python check_run.py RUN.h5)

Every number that a run records twice, or that follows from others by a law, is computed again and compared
within a bound that rounding alone explains; where the solver's error enters, the bound is the recorded
residual. A file whose numbers were changed, or whose motion does not obey its own impulses, does not pass.
What it does not see: whether the contacts it lists are all there were (that takes the shapes), and a file
that was computed by other means as a whole.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

if __package__:
    from carom.check_run_events import EVENT_CHECKS
    from carom.check_run_file import RunFile, UnreadableRunError
    from carom.check_run_frames import EPS, FRAME_CHECKS, Frames, bodies_of, check_frames
    from carom.check_run_steps import STEP_CHECKS, check_pairs
else:  # as a script beside its parts, without the package
    from check_run_events import EVENT_CHECKS  # type: ignore[import-not-found,no-redef]
    from check_run_file import RunFile, UnreadableRunError  # type: ignore[import-not-found,no-redef]
    from check_run_frames import (  # type: ignore[import-not-found,no-redef]
        EPS,
        FRAME_CHECKS,
        Frames,
        bodies_of,
        check_frames,
    )
    from check_run_steps import STEP_CHECKS, check_pairs  # type: ignore[import-not-found,no-redef]

#: Bodies times frames that are looked at together: about 4 kB each.
AT_ONCE = 16_384

#: Checks by name, in the order they are told: what must hold, and the unit of value and bound.
#: Closure of a soft step over the energy that went through it [1]: some twenty roundings of f32.
SOFT_CLOSURE = 2e-6

CHECKS = {
    "finite": ("every number is finite", "1"),
    "times": ("times increase by the steps' lengths, and frames lie on steps", "s"),
    "step_length": ("steps have the run's length; the last may be shorter", "s"),
    "contact_table": ("contacts of a frame are those that its step counted; normals are units", "1"),
    "ledger": ("the ledger's lines and its closure add up to the energy change", "J"),
    "closure": ("what the ledger's lines leave over is rounding", "J"),
    "impact_dissipation": ("impacts give no energy", "J"),
    "friction_dissipation": ("friction gives no energy", "J"),
    "residual": ("solves are as accurate as was asked", "m/s"),
    "penetration": ("bodies do not overlap by much", "m"),
    **FRAME_CHECKS,
    **STEP_CHECKS,
}


@dataclass
class Check:
    """One thing that must hold, and where it holds least.

    Attributes
    ----------
    name, meaning, unit : as in `CHECKS`
    verdict : "ok", "warning", "failed" or "not checked"
    value, bound : at the worst place, [unit]
    step : number of the step from 0, -1 for the initial state; None when nothing was looked at
    time : at the end of that step [s]
    where : body or contact, by the bodies' names
    count : numbers compared [1]
    note : what could not be looked at and why
    """

    name: str
    meaning: str
    unit: str
    verdict: str = "not checked"
    value: float | None = None
    bound: float | None = None
    step: int | None = None
    time: float | None = None
    where: str = ""
    count: int = 0
    note: str = ""
    _ratio: float = field(default=-1.0, repr=False)

    def see(
        self,
        value: Any,
        bound: Any,
        step: Any,
        where: Callable[[int], str] | None = None,
        is_lenient: bool = False,
    ) -> None:
        """Compares |value| with a bound; `step` is the step of each entry, `where` names its flat index."""
        value, bound, step = np.broadcast_arrays(np.abs(value), bound, step)
        if value.size == 0:
            return
        self.count += value.size
        self.verdict = "ok" if self.verdict == "not checked" else self.verdict
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            ratio = np.where(value == 0, 0.0, np.where(bound > 0, value / bound, np.inf))
        ratio = np.where(np.isnan(ratio), np.inf, ratio).ravel()
        at = int(ratio.argmax())
        if ratio[at] > self._ratio:
            self._ratio = float(ratio[at])
            self.value, self.bound = float(value.ravel()[at]), float(bound.ravel()[at])
            self.step = int(step.ravel()[at])
            self.where = where(at) if where is not None else ""
        if self._ratio > 1:
            self.verdict = "warning" if is_lenient and self.verdict != "failed" else "failed"

    def to_dict(self) -> dict[str, Any]:
        """Plain values; numbers that JSON lacks as None."""
        names = (
            "name",
            "meaning",
            "unit",
            "verdict",
            "value",
            "bound",
            "step",
            "time",
            "where",
            "count",
            "note",
        )
        found = {name: getattr(self, name) for name in names}
        return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in found.items()}


@dataclass(frozen=True)
class Verdict:
    """What came of checking a run.

    Attributes
    ----------
    path, scene, space, status, version : of the file
    steps, frames, bodies : counts [1]
    checks : one `Check` each, in the order of `CHECKS`; those of `EVENT_CHECKS` after them where they concern
        the run
    """

    path: str
    scene: str
    space: str
    status: str
    version: int
    steps: int
    frames: int
    bodies: int
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """True when nothing failed; warnings do not fail."""
        return all(check.verdict != "failed" for check in self.checks)

    @property
    def worst(self) -> Check | None:
        """The failed check of the earliest step."""
        failed = [check for check in self.checks if check.verdict == "failed"]
        return min(failed, key=lambda check: -1 if check.step is None else check.step, default=None)

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain values."""
        names = ("path", "scene", "space", "status", "version", "steps", "frames", "bodies", "ok")
        return {**{name: getattr(self, name) for name in names}, "checks": [c.to_dict() for c in self.checks]}

    def text(self) -> str:
        """A table, and a line with the verdict."""
        lines = [f"{'check':22}{'verdict':13}{'worst':>10}{'bound':>10}  unit     where"]
        for c in self.checks:
            value, bound = (f"{x:10.2g}" if x is not None else f"{'-':>10}" for x in (c.value, c.bound))
            place = "" if c.step is None or not c.value else f"step {c.step}, t = {c.time:.6g} s"
            where = "; ".join(part for part in (place, c.where if place else "", c.note) if part)
            lines.append(f"{c.name:22}{c.verdict:13}{value}{bound}  {c.unit:9}{where}".rstrip())
        worst = self.worst
        head = f"{self.steps} steps, {self.frames} frames, {self.bodies} bodies ({self.status})"
        if worst is None:
            told = {word: sum(c.verdict == word for c in self.checks) for word in ("warning", "not checked")}
            rest = "".join(f"; {word}: {count}" for word, count in told.items() if count)
            return "\n".join([*lines, f"OK: {head}{rest}"])
        place = "" if worst.step is None else f" at step {worst.step}"
        where = f", {worst.where}" if worst.where else ""
        return "\n".join(
            [*lines, f"FAILED: {worst.name}{place}{where}: {worst.meaning} does not hold; {head}"]
        )


def check_run(
    path: str | Path,
    *,
    closure: float = 1e-12,
    penetration: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Verdict:
    """Checks a recorded run from its file alone.

    Parameters
    ----------
    closure : largest closure of the ledger in a step, relative to the energies of the step [1]
    penetration : deepest overlap that passes [m]; a tenth of the smallest moving body's extent when absent
    progress : told now and then how much is done, from 0 to 1

    Raises
    ------
    UnreadableRunError
        When the file is missing, no run, damaged or unsafe to read.
    ValueError
        For bounds that are not finite or are negative.
    """
    for name, bound in (("closure", closure), ("penetration", penetration)):
        if bound is not None and not (np.isfinite(bound) and bound >= 0):
            raise ValueError(f"{name} must be finite and >= 0, got {bound}; leave it out for the default")
    file = RunFile(Path(path))
    try:
        return _Looking(file, closure, penetration, progress or (lambda share: None)).verdict(str(path))
    except (OSError, ValueError, LookupError, TypeError, ArithmeticError, RuntimeError, MemoryError) as error:
        raise UnreadableRunError(f"{path}: {str(error)[:300]}") from error
    finally:
        file.close()


class _Looking:
    """One pass over the steps, one over the frames."""

    def __init__(
        self, file: RunFile, closure: float, penetration: float | None, progress: Callable[[float], None]
    ) -> None:
        self.file, self.closure, self.depth, self.progress = file, closure, penetration, progress
        told = {**CHECKS, **EVENT_CHECKS} if file.settings.get("scheme") == "events" else CHECKS
        self.checks = {name: Check(name, *about) for name, about in told.items()}
        self.bodies = bodies_of(file)
        self.gravity = np.zeros(3)
        self.gravity[: file.dimension] = file.settings.get("gravity", [np.nan] * file.dimension)

    def verdict(self, path: str) -> Verdict:
        """Looks at everything."""
        file = self.file
        with np.errstate(all="ignore"):
            times = self._steps()
            self._frames(times)
        for check in self.checks.values():
            if check.step is not None and len(times):
                check.time = float(times[check.step]) if 0 <= check.step < len(times) else float(self.start)
        counts = (file.step_count, file.frame_count, len(file.names))
        head = (path, file.scene_name, file.space, file.status, file.version)
        return Verdict(*head, *counts, tuple(self.checks.values()))

    # --- steps ---

    def _steps(self) -> Any:
        """Times of all steps [s]; checks what the steps tell by themselves."""
        file = self.file
        columns = file.columns("steps")
        # the ledger stands between these two, whatever lines it has by now
        self.lines = columns[columns.index("gravity") : columns.index("closure")]
        first = Frames.read(file, 0, min(1, file.frame_count))
        is_there = len(first.time) > 0
        self.start = float(first.time[0]) if is_there else math.nan
        before = math.nan
        floor = 0.0
        if is_there:
            kinetic, potential, size = first.energies(self.bodies, self.gravity)
            before, floor = float((kinetic + potential)[0]), float(size[0])
            self._first = (before, 64 * EPS * (1 + len(file.names)) * floor)
        times = np.empty(file.step_count)
        last = self.start
        for begin, end in file.ranges("steps"):
            rows = file.rows("steps", begin, end)
            number = np.arange(begin, end)
            times[begin:end] = rows["time"]
            self._finite("steps", rows, number)
            earlier = np.concatenate([[last], rows["time"][:-1]])
            self.checks["times"].see(
                _late(earlier, rows["time"], rows["dt"]), 4 * EPS * np.abs(rows["time"]), number
            )
            self._lengths(rows, number)
            energy = rows["kinetic"] + rows["potential"]
            self._ledger(rows, np.concatenate([[before], energy[:-1]]), floor, number)
            self._accuracy(rows, number)
            if end > begin:
                last, before = float(rows["time"][-1]), float(energy[-1])
            self.progress(0.2 * end / file.step_count)
        told = file.steps_told if file.status in ("complete", "interrupted", "failed") else file.step_count
        if told != file.step_count:
            self.checks["times"].see(
                abs(told - file.step_count), 0.0, file.step_count - 1, lambda k: "steps missing"
            )
        return times

    def _finite(self, table: str, rows: Any, number: Any) -> None:
        may_be_absent = {"deepest_gap"} if table == "steps" else set()
        for name in rows.dtype.names:
            column = rows[name]
            if column.dtype.kind == "f":
                bad = (~np.isfinite(column)).any(axis=tuple(range(1, column.ndim)))
                if name in may_be_absent:
                    bad &= rows["contacts"] != 0
                self.checks["finite"].see(bad.astype(float), 0.0, number, _named(f"{table}.{name}"))

    def _lengths(self, rows: Any, number: Any) -> None:
        is_last = number == self.file.step_count - 1
        off = rows["dt"] - self.file.dt
        # a run's last step ends where the run was asked to end
        off = np.where(is_last & (off < 0) & (rows["dt"] > 0), 0.0, off)
        self.checks["step_length"].see(off, 4 * EPS * self.file.dt, number)

    def _ledger(self, rows: Any, before: Any, floor: float, number: Any) -> None:
        lines = np.stack([rows[name] for name in self.lines if name != "gravity"], axis=-1)
        total, turned = lines.sum(axis=-1), np.abs(lines).sum(axis=-1)
        kinetic, potential = np.abs(rows["kinetic"]), np.abs(rows["potential"])
        scale = kinetic + potential + np.abs(before) + turned + np.abs(rows["closure"])
        bound = 16 * EPS * scale
        if len(number) and number[0] == 0 and self.file.frame_count:
            bound[0] += self._first[1]
        change = rows["kinetic"] + rows["potential"] - before
        self.checks["ledger"].see(change - total - rows["closure"], bound, number)
        scale = scale + np.abs(rows["gravity"]) + floor
        allowed = self.closure * scale
        if self.file.settings.get("scheme") == "soft_step":
            # velocities are f32 within the step: rounding of what went through it, which places do not raise
            allowed = SOFT_CLOSURE * (kinetic + turned + np.abs(rows["gravity"])) + floor
        self.checks["closure"].see(rows["closure"], allowed, number)
        # a solve that is off by the residual may give that times its impulses, each at most sqrt(2 m E)
        slack = 1e-9 * scale + rows["contacts"] * rows["residual"] * np.sqrt(2 * scale * self._mass())
        impacts = rows["impact_normal"] + rows["impact_friction"] + rows["rest_cut"]
        # one collision after another has no guard, and a guard that warns lets energy in
        settings = self.file.settings
        is_guarded = settings.get("impact") != "sequential" and settings.get("energy_guard") != "warn"
        check = self.checks["impact_dissipation"]
        check.see(np.maximum(impacts, 0), slack, number, is_lenient=not is_guarded)
        check = self.checks["friction_dissipation"]
        check.see(np.maximum(rows["friction"], 0), slack, number, is_lenient=True)

    def _mass(self) -> float:
        return float(self.bodies.mass[self.bodies.moves].sum())

    def _accuracy(self, rows: Any, number: Any) -> None:
        file, names = self.file, self.file.names
        tolerance = float(file.settings.get("tolerance", 0.0))
        if tolerance > 0:
            goes_on = file.settings.get("on_inaccurate") != "raise"
            self.checks["residual"].see(rows["residual"], tolerance, number, is_lenient=goes_on)
        else:
            self.checks["residual"].note = "the run asked for no tolerance"
        depth = self.depth
        if depth is None:
            extent = np.zeros(0) if file.extent is None else np.abs(file.extent[self.bodies.moves])
            sizes = extent[np.isfinite(extent) & (extent > 0)]
            depth = 0.1 * float(sizes.min()) if len(sizes) else math.inf
            self.checks["penetration"].note = (
                "" if len(sizes) else "no size of a body is recorded: give a bound"
            )

        def between(k: int) -> str:
            a, b = int(rows["deepest_a"][k]), int(rows["deepest_b"][k])
            return f"{names[a]} / {names[b]}" if min(a, b) >= 0 and max(a, b) < len(names) else ""

        overlap = np.where(rows["contacts"] == 0, 0.0, np.maximum(0, -rows["deepest_gap"]))
        self.checks["penetration"].see(overlap, depth, number, between)
        if not math.isfinite(depth):
            self.checks["penetration"].verdict = "not checked"

    # --- frames ---

    def _frames(self, times: Any) -> None:
        """Frames in blocks that share their border, each frame with the step that ends there."""
        file = self.file
        if not file.is_even and file.status != "running":
            self.checks["times"].see(1.0, 0.0, file.step_count - 1, lambda k: "frames missing")
        block = max(1, AT_ONCE // max(1, len(file.names)))
        for begin in range(0, file.frame_count, block):
            at = max(0, begin - 1)
            frames = Frames.read(file, at, min(begin + block, file.frame_count))
            frames.find_steps(times, self.start)
            fresh = slice(begin - at, None)
            self._frame_times(frames, times, fresh)
            for name, array in frames.arrays():
                bad = ~np.isfinite(array[fresh]).all(axis=tuple(range(1, array.ndim)))
                self.checks["finite"].see(
                    bad.astype(float), 0.0, frames.step[fresh], _named(f"frames.{name}")
                )
            for table, rows, place in frames.tables():
                self._finite(table, rows, frames.step[place])
            check_frames(self.checks, file, self.bodies, self.gravity, frames, fresh)
            check_pairs(self.checks, file, self.bodies, self.gravity, frames)
            self.progress(0.2 + 0.8 * min(begin + block, file.frame_count) / file.frame_count)
        for name in self.checks.keys() & {*FRAME_CHECKS, *STEP_CHECKS, *EVENT_CHECKS}:
            check = self.checks[name]
            if check.verdict == "not checked" and not check.note:
                check.note = "nothing to look at"

    def _frame_times(self, frames: Frames, times: Any, fresh: slice) -> None:
        """Each frame lies at the end of a step: every so-manieth, the last one wherever the run ended."""
        number = np.arange(frames.begin, frames.begin + len(frames.time))[fresh]
        wanted = number * self.file.every - 1
        last = self.file.frame_count - 1
        if self.file.status != "running" or self.file.step_count < last * self.file.every:
            wanted = np.where(
                (number == last) & (number > 0), np.minimum(wanted, self.file.step_count - 1), wanted
            )
        inside = np.clip(wanted, -1, max(-1, self.file.step_count - 1))
        expected = np.concatenate([[self.start], times])[inside + 1]
        off = np.where(wanted == inside, frames.time[fresh] - expected, np.inf)
        self.checks["times"].see(off, 0.0, inside, lambda k: f"frame {number[k]}")


def _named(name: str) -> Callable[[int], str]:
    """The same name at every place."""
    return lambda k: name


def _late(earlier: Any, time: Any, dt: Any) -> Any:
    """How far a time is from the one before it plus the step; infinite where time does not increase."""
    return np.where((dt > 0) & (time > earlier), time - (earlier + dt), np.inf)


def main(words: list[str]) -> int:
    """Checks a file; returns 0 when it holds, 1 when not, 2 when it cannot be read, 130 after Ctrl-C."""
    parser = argparse.ArgumentParser(
        prog="check_run", description="Check a recorded run from its file alone."
    )
    parser.add_argument("run", metavar="RUN", help="a file that `carom run` wrote")
    parser.add_argument("--closure", type=float, default=1e-12, help="largest relative closure [1]")
    parser.add_argument("--penetration", type=float, help="deepest overlap that passes [m]")
    parser.add_argument("--json", action="store_true", help="print everything as JSON")
    given = parser.parse_args(words)
    try:
        found = check_run(given.run, closure=given.closure, penetration=given.penetration)
    except UnreadableRunError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    print(json.dumps(found.to_dict(), indent=1) if given.json else found.text())
    return 0 if found.ok else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
