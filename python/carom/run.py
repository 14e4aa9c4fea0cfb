"""Runs a world for a duration and holds what came of it.

The engine advances many steps per call without the interpreter lock; the loop here chooses how many so that
a call lasts about 0.1 s, records what comes back, tells the progress and looks for Ctrl-C between calls. A
run that is stopped, or that ends in an error, keeps every step that was computed. Knows no physics.
"""

from __future__ import annotations

import json
import math
import signal
import threading
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from carom.errors import BuildError, CaromError
from carom.ragged import RaggedContacts
from carom.recorded import Ledger, Run, Worst
from carom.recording import KINDS, Floats, Header, Progress, Recorder, record, solver_of

__all__ = ["Ledger", "Moment", "RaggedContacts", "Run", "Worst", "run_world"]

#: Aim for the duration of one call into the engine [s].
CALL_SECONDS = 0.1
#: A call that has lasted longer than this ends in the middle of its solve after Ctrl-C [s].
PATIENCE = 1.0


@dataclass(frozen=True)
class Moment:
    """What a progress callback is told.

    Attributes
    ----------
    time, duration : simulated since the run began, and asked for [s]
    steps : taken so far [1]
    wall_time : since the run began [s]
    last : record of the last step, or None before the first
    solve : while a step's solve is long: what the solver is doing, iterations so far [1], residual so far
        in its own measure; None between steps
    """

    time: float
    duration: float
    steps: int
    wall_time: float
    last: Any
    solve: tuple[str, int, float] | None = None


ProgressLike = bool | Callable[[Moment], None] | None


def run_world(
    world: Any,
    duration: float,
    *,
    dt: float | None = None,
    solver: str | None = None,
    iterations: int | None = None,
    tolerance: float | None = None,
    on_inaccurate: str | None = None,
    every: int = 1,
    record_events: bool | None = None,
    out: str | Path | None = None,
    progress: ProgressLike = None,
    scene: str = "",
    scene_name: str = "",
) -> Run:
    """Advances a world and records it.

    Parameters
    ----------
    duration : simulated time [s]; a last step is shortened to end there
    dt, solver, iterations, tolerance, on_inaccurate : settings for this run alone
    every : record each so-manieth step as a frame; steps are always all recorded
    record_events : whether to record what each contact did within a frame's last step, which the check of a
        run of the scheme "events" needs; when absent, where that is the scheme and every step is a frame
    out : HDF5 file to write to; in memory when absent
    progress : True for a bar on stderr, or a function that takes a `Moment`
    scene, scene_name : text and name to keep with the run

    Raises
    ------
    BuildError
        When an argument is refused.
    StepError, SolverError, InaccurateError
        When a step fails; the steps before it are in ``world.last_run``.
    KeyboardInterrupt
        After Ctrl-C, within a second also in the middle of a long solve, whose step is then not taken; what
        was done is in ``world.last_run``.

    Warns
    -----
    InaccurateWarning
        At the first step above the tolerance, when the world's `on_inaccurate` asks for it.
    """
    step = _checked(duration, every, dt if dt is not None else world.settings["dt"])
    wanted = {
        "solver": solver, "iterations": iterations, "tolerance": tolerance, "on_inaccurate": on_inaccurate
    }  # fmt: skip
    with _settings(world, wanted):
        world._warned = world._warned_of_gain = False
        header = _header(world, step, every, scene, scene_name)
        recorder = record(out, header)
        wants_events = every == 1 if record_events is None else bool(record_events)
        wants_events = wants_events and world.settings.get("scheme") == "events"
        with _bar(progress) as tell:
            return _Loop(world, recorder, duration, step, every, wants_events, tell).go()


class _Loop:
    """The loop of a run: how many steps per call, what is recorded, when it ends."""

    def __init__(
        self,
        world: Any,
        recorder: Recorder,
        duration: float,
        dt: float,
        every: int,
        wants_events: bool,
        tell: Callable[[Moment], None] | None,
    ) -> None:
        self.world = world
        self.recorder = recorder
        self.duration = duration
        self.dt = dt
        self.every = every
        self.wants_events = wants_events
        self.tell = tell
        whole = round(duration / dt)
        self.remainder = duration - whole * dt
        if abs(self.remainder) <= 1e-9 * duration:
            self.remainder = 0.0
        elif self.remainder < 0:
            whole -= 1
            self.remainder = duration - whole * dt
        self.whole = whole
        self.taken = 0
        self.since_frame = 0
        self.step_time = 0.0
        self.last: Any = None

    def go(self) -> Run:
        """Runs to the end, to Ctrl-C or to an error; the recording is closed in each case."""
        self.begun = clock.perf_counter()
        status = "failed"
        with _Interrupt() as interrupt:
            self.interrupt = interrupt
            self.world._progress = self._solving
            try:
                self._record(self.world._frame())
                status = "complete" if self._steps(interrupt) else "interrupted"
            except KeyboardInterrupt:  # the second Ctrl-C, or one that a caller's own handler raised
                status = "interrupted"
                raise
            finally:
                self.world._progress = None
                run = self._close(status)
        if interrupt.asked:
            raise KeyboardInterrupt
        return run

    def _steps(self, interrupt: _Interrupt) -> bool:
        """Takes all steps; whether it came to the end."""
        while self.taken < self.whole and not interrupt.asked:
            self._call(min(self._affordable(), self.whole - self.taken), self.dt)
        if self.remainder > 0 and self.taken == self.whole and not interrupt.asked:
            self._call(1, self.remainder)
            self.remainder = 0.0
        return self.taken >= self.whole and self.remainder == 0

    def _affordable(self) -> int:
        """Steps that take about `CALL_SECONDS`, growing at most fourfold from what has been taken."""
        if self.taken == 0 or self.step_time <= 0:
            return 1
        return max(1, min(int(CALL_SECONDS * self.taken / self.step_time), 4 * self.taken))

    def _call(self, steps: int, dt: float) -> None:
        """One call into the engine, ending on a frame when it reaches one."""
        to_frame = self.every - self.since_frame
        if steps < to_frame:
            frames_every = 0
        elif self.since_frame > 0:
            steps = frames_every = to_frame
        else:
            steps -= steps % self.every
            frames_every = self.every
        self.call_begun = clock.perf_counter()
        chunk = self.world._advance(steps, dt, frames_every)
        self.step_time += clock.perf_counter() - self.call_begun
        records = np.asarray(chunk.steps)
        self.taken += len(records)
        self.since_frame += len(records) - len(chunk.time) * self.every
        self._record(chunk)
        self.last = records[-1] if len(records) else self.last
        self.recorder.tell(self._progress("running"))
        if self.tell is not None:
            time = min(self.taken * self.dt, self.duration)
            self.tell(Moment(time, self.duration, self.taken, clock.perf_counter() - self.begun, self.last))

    def _record(self, chunk: Any) -> None:
        """Hands a chunk on, without the events where they are not wanted."""
        if not self.wants_events and getattr(chunk, "events", None) is not None:
            chunk = replace(chunk, events=None, pieces=None)
        self.recorder.append(chunk)

    def _solving(self, stage: str, iterations: int, residual: float) -> None:
        """Told by the engine while a solve is long: passes it on, and ends the step after Ctrl-C."""
        if self.interrupt.asked and clock.perf_counter() - self.call_begun > PATIENCE:
            raise KeyboardInterrupt
        if self.tell is not None:
            time, wall = min(self.taken * self.dt, self.duration), clock.perf_counter() - self.begun
            self.tell(Moment(time, self.duration, self.taken, wall, self.last, (stage, iterations, residual)))

    def _progress(self, status: str) -> Progress:
        time = float(self.last["time"]) if self.last is not None else float(self.world.time)
        return Progress(status, self.taken, time, clock.perf_counter() - self.begun, self.step_time)

    def _close(self, status: str) -> Run:
        if isinstance(getattr(self.world, "_late_error", None), KeyboardInterrupt):
            self.world._late_error = None  # told by this run's end, and not once more by the next call
        if self.since_frame > 0:
            self._record(self.world._frame())
        self.recorder.tell(self._progress(status))
        run = Run(self.recorder.close())
        self.world.last_run = run
        return run


class _Interrupt:
    """Turns the first Ctrl-C into a wish to stop after the present call; the second one acts at once."""

    def __init__(self) -> None:
        self.asked = False
        self._before: Any = None

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._before = signal.getsignal(signal.SIGINT)
            if self._before is signal.default_int_handler:  # a caller's own handler stays in charge
                signal.signal(signal.SIGINT, self._note)
        return self

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            signal.default_int_handler(number, frame)
        self.asked = True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._before is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._before)


def _checked(duration: float, every: int, dt: Any) -> float:
    for field, value in (("duration", duration), ("dt", dt)):
        if isinstance(value, bool) or not isinstance(value, (int, float, np.floating)):
            raise _refused(field, value, "must be a number", "give seconds")
        if not (math.isfinite(value) and value > 0):
            raise _refused(field, value, "must be > 0", "give seconds")
    if isinstance(every, bool) or not isinstance(every, (int, np.integer)) or every < 1:
        raise _refused(
            "every", every, "must be a whole number >= 1", "give the number of steps between frames"
        )
    if duration / float(dt) > 1e9:
        raise _refused(
            "duration", duration, f"makes {duration / float(dt):.0e} steps", "at most 1e9 steps in a run"
        )
    return float(dt)


def _refused(field: str, value: Any, problem: str, remedy: str) -> CaromError:
    return BuildError(
        f"run: {field} {problem}, got {value!r}; {remedy}", field=field, value=value, remedy=remedy
    )


@contextmanager
def _settings(world: Any, wanted: Mapping[str, Any]) -> Iterator[None]:
    """Settings for one run; the world's own come back afterwards."""
    before = {key: world.settings[key] for key, value in wanted.items() if value is not None}
    try:
        for key in before:
            setattr(world, key, wanted[key])
        yield
    finally:
        for key, value in before.items():
            setattr(world, key, value)


@contextmanager
def _bar(progress: ProgressLike) -> Iterator[Callable[[Moment], None] | None]:
    """The function that is told the progress."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        from carom.cli.progress import Bar

        with Bar() as bar:
            yield bar
    else:
        yield progress


def _header(world: Any, dt: float, every: int, scene: str, scene_name: str) -> Header:
    """What is known of the world before the run."""
    import carom

    names = tuple(str(name) for name in world.names)
    bodies = [world[name] for name in names]
    kinds = np.array([KINDS.index(str(body.kind)) for body in bodies], dtype=np.uint8)
    mass = np.array([float(body.mass) for body in bodies], dtype=np.float64)
    mass[kinds != 0] = np.inf
    space = "planar" if world._frame().position.shape[2] == 2 else "spatial"
    shape = () if space == "planar" else (3, 3)
    inertia = np.full((len(bodies), *shape), np.nan)
    for number, body in enumerate(bodies):
        if kinds[number] == 0:
            inertia[number] = np.asarray(body.inertia, dtype=np.float64).reshape(shape)
    version = str(getattr(carom, "__version__", ""))
    settings = dict(world.settings)
    more = {
        name: np.array([float(getattr(body, name, 0.0)) for body in bodies], dtype=np.float64)
        for name in ("extent", "linear_damping", "angular_damping")
    }
    known = (space, names, kinds, mass, inertia, settings, scene, scene_name, version, dt, every)
    joints = tuple(
        {"name": j.name, "kind": j.kind, "a": j.bodies[0], "b": j.bodies[1], "length": j.length}
        for j in getattr(world, "joints", {}).values()
    )
    damping = (more["linear_damping"], more["angular_damping"])
    shapes, rows, center = shapes_of(bodies, space)
    return Header(*known, more["extent"], *damping, joints, shapes, rows, center, solver_of(settings))


def shapes_of(
    bodies: Sequence[Any], space: str
) -> tuple[tuple[Mapping[str, Any], ...], npt.NDArray[np.int32] | None, Floats | None]:
    """Distinct shapes of bodies, which of them each has, and where its centre of mass lies in it [m]."""
    if not all(hasattr(body, "shape_text") for body in bodies):
        return (), None, None
    texts = [body.shape_text for body in bodies]
    rows = {text: row for row, text in enumerate(dict.fromkeys(text for text in texts if text is not None))}
    index = np.array([-1 if text is None else rows[text] for text in texts], dtype=np.int32)
    center = np.zeros((len(bodies), 2 if space == "planar" else 3))
    for row, body in enumerate(bodies):
        center[row] = body.mass_properties.center_of_mass
    return tuple(json.loads(text) for text in rows), index, center
