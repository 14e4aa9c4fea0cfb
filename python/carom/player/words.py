"""The certificate of a run's worst step and its explanation, in words.

A run file keeps a record of every step, not its problems; the scene is run again up to the worst step, bit by
bit, when that takes no longer than a few seconds. Otherwise the page tells what the records hold, and how to
ask for more. Knows no page.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from carom._friction_problem_of_run import _same, _world
from carom.errors import CaromError

if TYPE_CHECKING:
    from carom.recorded import Run

#: Longest time that running a scene again may take when nothing else is asked for [s].
EXPLAIN_SECONDS = 5.0
#: Steps per call on the way to the worst one.
_STEPS_AT_ONCE = 256


def worst_step_in_words(run: Run, seconds: float = EXPLAIN_SECONDS) -> dict[str, Any]:
    """What is known of the step with the largest residual.

    Returns
    -------
    A table: "step" [1], "time" [s]; "findings" as lists of topic, text, remedy and bodies; "certificate" as
    lists of words, value and unit; "note", why these are missing, empty when they are not.
    """
    worst = run.worst
    told: dict[str, Any] = {"step": worst.step, "time": None, "findings": [], "certificate": [], "note": ""}
    if worst.step < 0 or not worst.value > 0:
        return told | {"note": "No step has a residual: nothing needed to be solved."}
    told["time"] = worst.time
    needed = (worst.step + 1) * run.ms_per_step / 1e3
    if not run.header.scene:
        return told | {"note": "The run does not hold its scene; carom run records it, and the worst step can"
                       " then be explained here."}  # fmt: skip
    if not needed <= seconds:
        return told | {"note": f"Running up to the worst step again takes about {needed:.0f} s; ask for it "
                       f"with explain_seconds={needed * 2:.0f}."}  # fmt: skip
    try:
        return told | _again(run, worst.step)
    except CaromError as error:
        return told | {"note": f"The worst step cannot be run again here: {error}"}


def _again(run: Run, step: int) -> dict[str, Any]:
    import warnings

    world = _world(run, None)
    taken = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        while taken < step:
            chunk = world._advance(min(_STEPS_AT_ONCE, step - taken), run.header.dt, 0)
            taken += _same(run, taken, chunk.steps, run.steps)
        report = world.step(float(run.steps["dt"][step]) if step == len(run.steps) - 1 else run.header.dt)
    findings = [
        [each.topic, each.text, each.remedy, [str(name) for name in each.bodies]]
        for each in report.explain().findings
    ]
    return {"findings": findings, "certificate": _lines(world), "accurate": bool(report.accurate)}


def _lines(world: Any) -> list[list[Any]]:
    """The certificate of the persistent contacts' solve: words, value, unit."""
    found = world.certificate()
    rows = f" and {found.rows} rows of joints" if found.rows else ""
    return [
        [f"residual of the natural map ({found.contacts} contacts{rows})", found.residual, "m/s"],
        ["the same, over that of no impulses at all", found.relative_residual, "1"],
        ["largest pull, or friction beyond its limit", found.cone_violation, "N s"],
        ["largest |impulse × velocity left along the normal|", found.complementarity, "J"],
        [f"friction against the slip, off by ({found.sliding} slide)", found.slip_angle_error, "rad"],
        ["energy change − work of the impulses", found.energy_identity, "J"],
        ["energy turned over", found.energy_turned_over, "J"],
    ]
