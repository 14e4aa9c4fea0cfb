"""The contract from Python: warn once, raise, escalate, explain, certify, and stop when asked."""

from __future__ import annotations

import copy
import pickle
import signal
import subprocess
import sys
import textwrap
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spaces import Face, both

import carom
from carom import Certificate, InaccurateError, InaccurateWarning, StepReport, planar


def tower(face: Face, top: float = 1e4, **settings: Any) -> Any:
    """Two light boxes under a heavy one, frictionless, asked for 1e-9 m/s; a free ball beside them."""
    w = face.world(**{"tolerance": 1e-9, "dt": 1 / 60, **settings})
    w.add_static("floor", face.ground(), friction=0.0)
    for i, mass in enumerate((1.0, 1.0, top)):
        w.add_body(f"box{i}", face.box(1.0), mass=mass, position=face.at(0.0, 0.5 + i), friction=0.0)
    w.add_body("ball", face.ball(0.1), mass=1.0, position=face.at(5.0, 50.0))
    return w


@both
def test_the_first_inaccurate_step_warns_and_the_others_do_not(face: Face) -> None:
    w = tower(face)
    with pytest.warns(InaccurateWarning) as caught:
        w.step()
    assert len(caught) == 1
    assert caught[0].filename == __file__
    told = caught[0].message
    assert isinstance(told, InaccurateWarning)
    assert "'box2'" in str(told)
    assert "escalate" in str(told)
    assert {finding.topic for finding in told.findings} >= {"residual", "mass_ratio", "iterations"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        w.step()
        assert not w.step().accurate
    w.iterations = 50
    with pytest.warns(InaccurateWarning):
        w.step()


@both
def test_a_run_warns_once_and_goes_on(face: Face) -> None:
    w = tower(face)
    with pytest.warns(InaccurateWarning, match="step 1 ") as caught:
        run = w.run(5 / 60)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert len(run.steps) == 5
    with pytest.warns(InaccurateWarning, match="step 6 "):
        w.run(1 / 60)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        w.run(0.1, on_inaccurate="ignore")
        w.run(0.1, solver="auto")
    assert w.on_inaccurate == "warn"


@both
def test_a_step_that_must_raise_is_not_taken(face: Face) -> None:
    w = tower(face, on_inaccurate="raise")
    before = w.snapshot()
    with pytest.raises(InaccurateError, match=r"residual of .* m/s in the contact problem") as caught:
        w.step()
    assert bytes(w.snapshot()) == bytes(before)
    error = caught.value
    assert error.field == "tolerance"
    assert error.findings[0].topic == "residual"
    assert "'box2' is 1.000e4 times as heavy as 'box1'" in str(error)
    with pytest.raises(InaccurateError):
        w.run(0.1)
    w.on_inaccurate = "escalate"
    assert w.step().accurate


@both
def test_auto_says_how_far_each_island_went_and_why(face: Face) -> None:
    w = tower(face, solver="auto")
    w.add_body("alone", face.ball(0.5), mass=1.0, position=face.at(9.0, 0.5), friction=0.0)
    report = w.step()
    assert report.accurate
    assert report.residual <= report.tolerance == 1e-9
    assert report.solver == "auto"
    column, alone = report.islands
    assert (column.first_body, column.bodies) == ("box0", 3)
    assert (alone.first_body, alone.bodies, alone.contacts) == ("alone", 1, 1)
    assert alone.solvers == ("pgs",)
    assert alone.why_further == ""
    assert column.solvers[0] == "pgs"
    assert len(column.solvers) > 1
    assert column.why_further.startswith("pgs left")
    assert column.stages[-1].stop_reason == "converged"
    assert "accurate" in str(report.explain())


@both
def test_a_report_explains_itself_before_and_after_the_world_goes_on(face: Face) -> None:
    w = tower(face, on_inaccurate="ignore")
    report = w.step()
    told = report.explain()
    assert not told.accurate
    assert told["mass_ratio"].bodies == ("box2", "box1")
    assert told["mass_ratio"].value == pytest.approx(1e4)
    assert told["conditioning"].value > 1e4
    assert told["iterations"].value == 100
    assert "set solver" in told["mass_ratio"].remedy
    assert str(told).startswith("inaccurate: ")
    w.step()
    later = report.explain()
    assert "mass_ratio" in later
    assert "conditioning" not in later
    with pytest.raises(KeyError):
        _ = later["conditioning"]
    again = pickle.loads(pickle.dumps(report))
    assert isinstance(again, StepReport)
    assert again == report
    assert again.explain().findings == report.findings
    assert copy.copy(report) == report


@both
def test_a_certificate_agrees_with_the_report_and_survives_files(face: Face, tmp_path: Path) -> None:
    w = tower(face, on_inaccurate="ignore")
    report = w.step()
    certificate = w.certificate()
    assert certificate.residual == report.residual
    assert certificate.relative_residual == report.relative_residual
    assert certificate.worst_names == report.worst_contact
    assert certificate["cone_violation"] == 0.0
    # impulses of 1.6e3 N s times velocities that are formed to rounding, over a turnover of 2 J
    assert abs(certificate.energy_identity) <= 1e-13 * certificate.energy_turned_over
    assert set(certificate) >= {"residual", "complementarity", "slip_angle_error", "energy_identity"}
    assert len(certificate) == len(dict(certificate))
    for name in ("one.json", "one.h5"):
        certificate.save(tmp_path / name)
        assert Certificate.load(tmp_path / name) == certificate
    with pytest.raises(carom.RunFileError, match=r"use \.json or \.h5"):
        certificate.save(tmp_path / "one.txt")
    with pytest.raises(carom.RunFileError, match=r"Certificate\.save wrote"):
        Certificate.load(tmp_path / "none.json")
    with pytest.raises(KeyError):
        _ = certificate["nothing"]


@both
def test_the_problem_of_the_last_step_re_certifies_it(face: Face) -> None:
    w = tower(face, on_inaccurate="ignore")
    w.step()
    problem, impulses = w.last_problem()
    assert impulses.shape == (problem.n_contacts, face.dimension)
    assert problem.certificate(impulses) == w.certificate()
    assert problem.certificate(impulses, island="box1") == w.certificate(island="box1")
    assert problem.certificate(impulses, island=1).contacts == problem.n_contacts
    # the equation itself, from the matrices: what the impulses leave of it at the worst contact
    velocity = problem.A @ impulses.ravel() - problem.b
    normal = velocity.reshape(-1, face.dimension)[:, 0]
    inverse_mass = problem.A.diagonal().reshape(-1, face.dimension)[:, 0]
    residual = np.minimum(impulses[:, 0] * inverse_mass, normal)
    assert np.abs(residual).max() == pytest.approx(w.certificate().residual, rel=1e-6)
    wrong = problem.certificate(impulses * np.array([-1.0] + [0.0] * (face.dimension - 1)))
    assert wrong.cone_violation == pytest.approx(impulses[:, 0].max())
    assert wrong.residual > 1e-3
    with pytest.raises(carom.BuildError, match="island must be"):
        w.certificate(island="ball")
    with pytest.raises(carom.BuildError):
        problem.certificate(impulses, island="nobody")
    none, empty = w.last_problem("impact")
    assert (none.n_contacts, len(empty)) == (0, 0)


@pytest.mark.parametrize(("solver", "named"), [(None, "conjugate gradients"), ("pgs", "sweeps")])
@both
def test_long_solves_tell_their_progress_and_can_be_stopped(
    face: Face, solver: str | None, named: str
) -> None:
    endless: dict[str, Any] = {"tolerance": 1e-15, "iterations": 50_000_000, "on_inaccurate": "ignore"}
    w = tower(face, top=1e6, solver=solver, **endless)
    before = bytes(w.snapshot())
    told: list[tuple[str, int, float]] = []

    def progress(stage: str, iterations: int, residual: float) -> None:
        told.append((stage, iterations, residual))
        if len(told) == 3:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        w.step(progress=progress)
    assert [stage for stage, _, _ in told] == [named] * 3
    assert told[0][1] < told[1][1] < told[2][1]
    assert bytes(w.snapshot()) == before


STOPPED = """
    import sys, time
    from carom import spatial
    w = spatial.World(tolerance=1e-15, iterations=100_000_000, on_inaccurate="ignore")
    w.add_static("floor", spatial.HalfSpace(), friction=0.0)
    for i, mass in enumerate((1.0, 1.0, 1e6)):
        w.add_body(f"box{i}", spatial.Box(1, 1, 1), mass=mass, position=(0, 0, 0.5 + i), friction=0.0)
    before = bytes(w.snapshot())
    print("ready", flush=True)
    try:
        %s
    except KeyboardInterrupt:
        print("stopped", bytes(w.snapshot()) == before, w.last_run, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("call", ["w.step()", "w.run(10.0)"])
def test_ctrl_c_ends_a_long_solve_and_the_world_is_as_before(call: str) -> None:
    script = textwrap.dedent(STOPPED) % call
    child = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert child.stdout.readline().strip() == "ready"
    time.sleep(0.5)
    child.send_signal(signal.SIGINT)
    begun = time.monotonic()
    out, err = child.communicate(timeout=60)
    assert out.startswith("stopped True"), out + err
    assert time.monotonic() - begun < 30


@both
def test_asking_for_accuracy_of_an_unknown_kind_is_refused(face: Face) -> None:
    with pytest.raises(carom.BuildError, match="on_inaccurate must be one of 'ignore', 'warn'"):
        face.world(on_inaccurate="shout")
    assert carom.ON_INACCURATE == ("ignore", "warn", "raise", "escalate")


def test_the_last_problem_of_a_step_with_moments_has_its_impulses_in_scalar_order() -> None:
    w = planar.World(dt=1 / 100, solver="exact", tolerance=1e-10)
    w.add_static("floor", planar.HalfPlane(), friction=0.5)
    rough: dict[str, Any] = {"density": 1.0, "friction": 0.5}
    w.add_body("disc", planar.Circle(0.5), position=(0, 0.5), rolling_friction=0.01, **rough)
    w.add_body("above", planar.Circle(0.5), position=(0, 2.5), **rough)
    w.step()
    problem, impulses = w.last_problem()
    assert impulses.shape == (3,)
    assert problem.residual(impulses).absolute <= 1e-10
    assert problem.residuals(impulses) == pytest.approx([0.0], abs=1e-10)
    assert problem.residuals(np.zeros(3)) == pytest.approx([problem.residual(np.zeros(3)).absolute])
