"""The scheme "soft_step" as users of the package meet it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spaces import Face, both

from carom import BuildError
from carom.check_run import check_run

QUIET: dict[str, Any] = {"dt": 1 / 60, "scheme": "soft_step", "on_inaccurate": "ignore"}


@both
def test_contact_forces_of_a_soft_step_bear_the_weight(face: Face) -> None:
    world = face.stack(3, **QUIET)
    for _ in range(240):
        report = world.step()
    contacts = world.contacts
    floor = contacts["normal_impulse"][np.asarray(contacts["a"]) == 0].sum() / world.dt
    assert floor == pytest.approx(6 * 9.81, rel=1e-3)
    assert abs(report.ledger["closure"]) < 1e-5
    assert "soft_step" in repr(world)


@both
def test_a_snapshot_of_a_soft_step_restores_the_trajectory(face: Face) -> None:
    world = face.pile(12, **QUIET)
    for _ in range(40):
        world.step()
    kept = world.snapshot()
    for _ in range(40):
        world.step()
    there = world.position.copy()
    world.restore(kept)
    for _ in range(40):
        world.step()
    assert np.array_equal(world.position, there)


@both
def test_choices_of_the_scheme_are_checked_by_name(face: Face) -> None:
    world = face.world(scheme="soft_step", soft={"substeps": 8})
    assert world.soft["substeps"] == 8
    assert world.soft["hertz"] == 38.0
    with pytest.raises(BuildError, match="substeps"):
        world.soft = {"substeps": 0}
    with pytest.raises(BuildError, match="solver"):
        world.solver = "exact"


@both
@pytest.mark.parametrize("solver", ["pgs", "nncg"])
def test_rigid_contacts_are_swept_in_lanes(face: Face, solver: str, tmp_path: Path) -> None:
    world = face.stack(3, **QUIET, solver=solver, iterations=12, soft={"substeps": 1})
    for _ in range(240):
        report = world.step()
    contacts = world.contacts
    floor = contacts["normal_impulse"][np.asarray(contacts["a"]) == 0].sum() / world.dt
    assert floor == pytest.approx(6 * 9.81, rel=1e-4)
    assert report.iterations == 24
    assert solver in repr(world)
    world.run(0.2, out=tmp_path / "run.h5", every=1)
    verdict = check_run(tmp_path / "run.h5", penetration=0.1)
    failed = [check.name for check in verdict.checks if check.verdict == "failed"]
    assert not failed, failed
    with pytest.raises(BuildError, match="iterations"):
        world.iterations = 1001


@both
def test_the_books_of_a_recorded_run_of_soft_steps_hold(face: Face, tmp_path: Path) -> None:
    world = face.pile(12, **{**QUIET, "dt": 1 / 240})
    world.run(1.0, out=tmp_path / "run.h5", every=1)
    # the pile begins with overlaps
    verdict = check_run(tmp_path / "run.h5", penetration=0.3)
    failed = [check.name for check in verdict.checks if check.verdict == "failed"]
    assert not failed, failed
