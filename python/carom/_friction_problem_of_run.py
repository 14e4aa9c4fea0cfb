"""The contact problem of any step of a recorded run.

A run keeps its scene's text, its settings and a record of every step, not the problems: the scene is run
again up to the step, which the engine does to the last bit, and every step on the way must be the recorded
one. Knows no physics.
"""

from __future__ import annotations

import time as clock
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carom.errors import CaromError, RunFileError, SceneError

if TYPE_CHECKING:
    from carom._problem import ContactProblem
    from carom.recorded import Run
    from carom.recording import Records

#: Aim for the duration of one call into the engine [s], so that Ctrl-C is seen.
CALL_SECONDS = 0.1


def problem_of_run(run: Run, step: int, phase: str, folder: Path | None) -> ContactProblem:
    """See `Run.problem`."""
    steps = run.steps
    if not 0 <= step < len(steps):
        raise _refused(run, f"has no step {step}", f"choose a step from 0 to {len(steps) - 1}", "step", step)
    world = _world(run, folder)
    taken, calls = 0, 1
    while taken < step:
        begun = clock.perf_counter()
        chunk = world._advance(min(calls, step - taken), run.header.dt, 0)
        taken += _same(run, taken, chunk.steps, steps)
        is_quick = clock.perf_counter() - begun < CALL_SECONDS / 4
        calls = 4 * calls if is_quick else calls
    problem: ContactProblem = world.problem(float(steps["dt"][step]), phase=phase)
    return problem


def _world(run: Run, folder: Path | None) -> Any:
    """The world that the run began with."""
    header = run.header
    if not header.scene:
        remedy = "record a scene with `carom run`, or ask the world itself: world.problem()"
        raise _refused(run, "does not say how its world is made", remedy, "scene", "")
    try:
        world = _scene(run, folder).build()
    except SceneError as error:
        raise _refused(
            run, f"has a scene that cannot be built: {error}", "give its folder", "scene", None
        ) from error
    for name, value in header.settings.items():
        if name not in world.settings:
            remedy = "use the carom that wrote it"
            raise _refused(run, f"has a setting {name!r} that this carom lacks", remedy, name, value)
        if world.settings[name] != value:
            setattr(world, name, value)
    first = world._frame()
    for name in ("position", "rotation", "velocity", "angular_velocity"):
        recorded = getattr(run, name)[:1]
        if getattr(first, name).tobytes() != np.ascontiguousarray(recorded).tobytes():
            remedy = "only runs from a scene's own start can be run again"
            raise _refused(run, f"began with another {name} than its scene", remedy, name, None)
    return world


def _scene(run: Run, folder: Path | None) -> Any:
    """The scene of the run: by name when that still has the same text, else from its text."""
    from carom.scene import load_scene, scene_from_text

    text, name = run.header.scene, run.header.scene_name
    try:
        known = load_scene(name)
        if known.kind in ("built-in", "packaged") and known.text == text:
            return known
    except CaromError:
        pass  # a scene of the user's
    beside = folder if folder is not None else (run.path.parent if run.path is not None else Path.cwd())
    form = "json" if text.lstrip().startswith("{") else "toml"
    return scene_from_text(text, form=form, folder=beside, source=name)  # type: ignore[arg-type]


def _same(run: Run, taken: int, again: Records, recorded: Records) -> int:
    """How many steps were taken; refuses when one of them is not the recorded one, bit by bit."""
    names = [name for name in again.dtype.names or () if name in (recorded.dtype.names or ())]
    for name in names:
        ours = np.ascontiguousarray(again[name])
        theirs = np.ascontiguousarray(recorded[name][taken : taken + len(again)])
        if ours.tobytes() != theirs.tobytes():
            remedy = f"use carom {run.header.version} on the same kind of machine"
            raise _refused(
                run, f"runs differently here: {name} before step {taken + len(again)}", remedy, name, None
            )
    return len(again)


def _refused(run: Run, problem: str, remedy: str, field: str, value: Any) -> RunFileError:
    name = repr(str(run.path)) if run.path is not None else "in memory"
    return RunFileError(f"run {name}: {problem}; {remedy}", field=field, value=value, remedy=remedy)
