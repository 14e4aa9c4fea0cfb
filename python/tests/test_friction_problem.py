"""Contact problems in matrix form: arrays, measures, solves, from worlds and from runs."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from friction_files import ARCH, ROCKS, STACK, block, problem_of
from spaces import PLANE, SPACE, Face, both

import carom
from carom import BuildError, FrictionProblem, RunFileError
from carom.recorded import Run
from carom.scene import load_scene


def test_arrays_are_copied_and_read_only() -> None:
    q = np.array([-1.0, 2.0, 0.0])
    p = block(q, 0.5)
    q[0] = 7
    assert p.q.tolist() == [-1, 2, 0]
    with pytest.raises(ValueError, match="read-only"):
        p.data[0] = 2
    with pytest.raises(AttributeError):
        p.q = q  # type: ignore[misc]
    assert len(p) == 1
    assert p.kind == "friction"
    assert "1 contacts of 3 rows" in repr(p)
    back = pickle.loads(pickle.dumps(p))
    assert back.solve().impulse.tolist() == p.solve().impulse.tolist()


def test_unsorted_rows_and_repeated_places_are_put_in_order() -> None:
    data, columns, starts = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1, 0, 1, 1]), np.array([0, 2, 4])
    p = FrictionProblem(1, data, columns, starts, np.array([-1.0, -1.0]), np.zeros(2))
    assert p.matrix.toarray().tolist() == [[2, 1], [0, 7]]
    assert p.indices.tolist() == [0, 1, 1]


GOOD: dict[str, Any] = {
    "dimension": 2,
    "data": [1.0, 1.0],
    "indices": [0, 1],
    "indptr": [0, 1, 2],
    "q": [-1.0, 0.5],
    "mu": [0.3],
}


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ({"dimension": 4}, "dimension", "must be 1, 2 or 3, got 4"),
        ({"dimension": 2.0}, "dimension", "whole number"),
        ({"dimension": True}, "dimension", "whole number"),
        ({"data": [1.0, np.nan]}, "W.data[1]", "must be finite, got nan"),
        ({"data": [1.0]}, "W.indices", "as many entries as data, 1"),
        ({"data": ["a", "b"]}, "W.data", "list of numbers"),
        ({"data": [[1.0, 1.0]]}, "W.data", "list of numbers"),
        ({"indices": [0, 2]}, "W.indices[1]", "must be in 0 .. 1, got 2"),
        ({"indices": [-1, 0]}, "W.indices[0]", "got -1"),
        ({"indices": [0.0, 1.0]}, "W.indices", "whole numbers"),
        ({"indptr": [0, 2]}, "W.indptr", "must have 3 entries"),
        ({"indptr": [0, 3, 2]}, "W.indptr", "must ascend"),
        ({"indptr": [1, 1, 2]}, "W.indptr", "must ascend"),
        ({"q": [-1.0, 0.5, 0.1]}, "q", "must have 2 x 1 entries"),
        ({"q": [-1.0, np.inf]}, "q[1]", "finite"),
        ({"mu": [-0.3]}, "mu[0]", "must be >= 0, got -0.3"),
        ({"mu": 0.3}, "mu", "list of numbers"),
        ({"target": [0.0]}, "target", "must have 2 entries"),
    ],
)
def test_wrong_arrays_are_named(change: dict[str, Any], field: str, words: str) -> None:
    assert FrictionProblem(**GOOD).solve().solved
    with pytest.raises(BuildError) as caught:
        FrictionProblem(**{**GOOD, **change})
    assert caught.value.field == field
    assert words in str(caught.value)
    assert caught.value.remedy


CLOSED_FORMS = [
    ([1.0, 0.3, 0.0], 0.5, [0, 0, 0], "take_off"),
    ([-1.0, 0.1, 0.0], 0.5, [1, -0.1, 0], "stick"),
    ([-1.0, 2.0, 0.0], 0.5, [1, -0.5, 0], "slip"),
    ([-1.0, 3.0, 4.0], 0.5, [1, -0.3, -0.4], "slip"),
    ([-1.0, 3.0, 4.0], 0.0, [1, 0, 0], "stick"),
    ([-1.0, -2.0], 0.3, [1, 0.3], "slip"),
    ([-1.0, 0.2], 0.3, [1, -0.2], "stick"),
    ([-2.0], 0.0, [2], "stick"),
    ([2.0], 0.0, [0], "take_off"),
    ([1.0, 0.0, 0.0], 0.0, [0, 0, 0], "take_off"),
]


@pytest.mark.parametrize("solver", carom.FRICTION_SOLVERS)
@pytest.mark.parametrize(("q", "mu", "impulse", "status"), CLOSED_FORMS)
def test_one_contact_has_a_closed_form(
    q: list[float], mu: float, impulse: list[float], status: str, solver: str
) -> None:
    p = block(q, mu)
    found = p.solve(solver, 1e-10)
    if not found.solved:  # a method may say that it does not take such a problem, but must say why
        assert found.reason
        return
    assert found.impulse.ravel() == pytest.approx(impulse, abs=1e-8)
    measure = p.measure(impulse)
    assert measure.solves(1e-14)
    assert getattr(measure, status) == 1
    assert p.velocity(impulse) == pytest.approx(np.array(q) + impulse)


def test_measures_of_known_size() -> None:
    """With r = 0, q = (-1, 0, 0) the natural map is (-1, 0, 0), whatever the unit of impulse."""
    assert block([-1.0, 0.0, 0.0], 0.5).measure(np.zeros(3)).err_nat == 1
    p = problem_of(4 * np.eye(3), [-1.0, 0.0, 0.0], [0.5], 3)
    assert p.measure(np.zeros(3)).err_scaled == 1
    assert p.measure(np.zeros((1, 3))).penetration == 1
    assert p.measure([1.0, 1.0, 0.0]).cone == pytest.approx(0.5 / np.sqrt(2))


@pytest.mark.parametrize("path", [ARCH, ROCKS, STACK], ids=lambda path: str(path.stem))
def test_exact_solves_hard_problems_and_says_what_it_did(path: Path) -> None:
    p = FrictionProblem.load(path)
    found = p.solve("exact", 1e-8)
    assert found.solved
    assert found.reason == ""
    assert p.measure(found.impulse) == found.measure
    assert found.measure.solves(1e-8)
    assert found.iterations == sum(count for _, count in found.stages) > 0
    assert found.seconds > 0
    again = p.solve("exact", 1e-8, start=found.impulse)
    assert again.solved
    assert again.iterations <= found.iterations


def test_a_budget_that_runs_out_says_so() -> None:
    p = FrictionProblem.load(ARCH)
    found = p.solve("exact", 1e-8, iterations=1, factorisations=0)
    assert not found.solved
    assert found.reason
    assert p.measure(found.impulse) == found.measure
    assert "not solved" in repr(found)


def test_watching_a_solve_can_stop_it() -> None:
    p = FrictionProblem.load(ARCH)
    told: list[tuple[str, int, float]] = []

    def stop(stage: str, iterations: int, residual: float) -> bool:
        told.append((stage, iterations, residual))
        return False

    found = p.solve("pgs", 0.0, iterations=50_000_000, tell=stop)
    assert found.stopped
    assert not found.solved
    assert len(told) == 1
    assert p.measure(found.impulse) == found.measure

    def fail(stage: str, iterations: int, residual: float) -> bool:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        p.solve("pgs", 0.0, iterations=50_000_000, tell=fail)
    best = caught.value.best  # type: ignore[attr-defined]
    assert best.stopped
    assert best.impulse.shape == (len(p), 3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"solver": "exakt"}, "did you mean 'exact'"),
        ({"tolerance": np.nan}, "tolerance must be finite"),
        ({"tolerance": -1e-8}, "tolerance must be finite and >= 0"),
        ({"iterations": -1}, "iterations must be >= 0"),
        ({"iterations": 1.5}, "iterations must be a whole number"),
        ({"start": [1.0]}, "start must be 3 finite numbers"),
        ({"start": [np.nan, 0, 0]}, "start must be 3 finite numbers"),
    ],
)
def test_wrong_requests_are_named(arguments: dict[str, Any], words: str) -> None:
    with pytest.raises(BuildError, match=words.replace("(", "[(]")):
        block([-1.0, 0.0, 0.0], 0.5).solve(**arguments)
    with pytest.raises(BuildError, match="impulse must be 3 finite numbers"):
        block([-1.0, 0.0, 0.0], 0.5).measure([1.0, 2.0])


# --- from worlds and runs ---


@both
def test_matrix_form_of_a_worlds_problem(face: Face) -> None:
    w = face.pile(6)
    for _ in range(60):
        w.step()
    contacts = w.problem()
    assert len(contacts) > 1
    p = FrictionProblem.from_problem(contacts, name="pile")
    assert p.dimension == face.dimension
    assert (p.matrix - contacts.A).nnz == 0
    assert p.q.tolist() == (-contacts.b).tolist()
    assert p.mu.tolist() == contacts.friction.tolist()
    body = p.body_form
    assert body is not None
    reduced, q = body.reduced()
    assert np.abs((reduced.matrix - p.matrix).toarray()).max() < 1e-12 * np.abs(p.data).max()
    assert q == pytest.approx(p.q, abs=1e-12)
    found = p.solve("exact", 1e-10)
    assert found.solved
    assert contacts.residual(found.impulse).absolute < 1e-8


@both
def test_energy_of_the_impulses_is_that_of_the_bodies(face: Face) -> None:
    """r . (u+ + u-) / 2 is the change of kinetic energy, restitution's targets included."""
    w = face.world(gravity=face.at(0.0, -10.0))
    w.add_static("floor", face.ground(), restitution=0.5, friction=0.4)
    w.add_body("box", face.box(1.0), density=2.0, position=face.at(0, 0.5), velocity=face.at(1.0, -3.0))
    contacts = w.problem(phase="impact")
    p = FrictionProblem.from_problem(contacts)
    assert p.target is not None
    assert np.abs(p.target).max() > 1
    found = p.solve("exact", 1e-12)
    certificate = p.certificate(found.impulse)
    assert certificate.energy_closure is not None
    assert certificate.energy_closure < 1e-12 * abs(certificate.energy_change)
    velocity = contacts.solve("pgs", start=found.impulse, iterations=1, tolerance=1.0).velocity
    masses = 1 / np.array([m["linear"] or np.inf for m in contacts.to_dict()["inverse_masses"]])
    before = np.array([v["linear"] for v in contacts.to_dict()["velocities"]])
    dim = face.dimension
    lost = 0.5 * (masses[1] * ((velocity[1, :dim] ** 2).sum() - (before[1] ** 2).sum()))
    spin = velocity[1, dim:]
    inertia = np.atleast_2d(w["box"].inertia)
    lost += 0.5 * spin @ inertia @ spin
    assert certificate.energy_change == pytest.approx(lost, rel=1e-9)
    assert certificate.energy_change < 0


def test_a_moving_obstacle_is_in_the_body_form() -> None:
    w = PLANE.world(gravity=(0, -10))
    w.add_kinematic("belt", PLANE.ground(), velocity=(0.5, 0), friction=0.4)
    w.add_body("box", PLANE.box(1.0), density=2.0, position=(0, 0.5))
    p = FrictionProblem.from_problem(w.problem())
    assert p.body_form is not None
    assert p.body_form.directions.shape[0] == 3
    _, q = p.body_form.reduced()
    assert q == pytest.approx(p.q, abs=1e-14)
    certificate = p.certificate(p.solve().impulse)
    assert certificate.energy_closure == pytest.approx(0, abs=1e-12)


def with_row(face: Face, lo: Any, hi: Any) -> carom.ContactProblem:
    """A settled stack whose first box is also held by a general row."""
    w = face.stack(2)
    for _ in range(3):
        w.step()
    table = w.problem().to_dict()
    count = 3 if face.dimension == 2 else 6
    unit = [1.0] + [0.0] * (count - 1)
    side = {"linear": unit[: face.dimension], "angular": unit[face.dimension :]}
    none = {"linear": [0.0] * face.dimension, "angular": [0.0] * (count - face.dimension)}
    table["rows"] = [
        {"id": 1, "a": 1, "b": 0, "on_a": side, "on_b": none, "target": 0.25, "lo": lo, "hi": hi}
    ]
    return carom.ContactProblem.from_dict(table)


@both
def test_bilateral_rows_are_eliminated(face: Face) -> None:
    contacts = with_row(face, "-inf", "inf")
    p = FrictionProblem.from_problem(contacts)
    found = p.solve("exact", 1e-11)
    assert found.solved
    whole = contacts.solve("pgs", iterations=200_000, tolerance=1e-12)
    assert p.measure(whole.impulse).err_scaled < 1e-6
    a = contacts.A.toarray()
    n = p.q.size
    row = -(a[n, :n] @ found.impulse.ravel() - contacts.b[n]) / a[n, n]
    together = np.concatenate([found.impulse.ravel(), [row]])
    assert contacts.residual(together).absolute < 1e-9
    assert p.body_form is not None
    reduced, q = p.body_form.reduced()
    assert np.abs((reduced.matrix - p.matrix).toarray()).max() < 1e-12 * np.abs(p.data).max()
    assert q == pytest.approx(p.q, abs=1e-12)


def test_what_the_matrix_form_lacks_is_refused() -> None:
    with pytest.raises(BuildError, match=r"rows\[0\] must be bilateral"):
        FrictionProblem.from_problem(with_row(PLANE, 0.0, "inf"))
    table = {**with_row(SPACE, "-inf", "inf").to_dict(), "rows": [], "friction_law": "box"}
    with pytest.raises(BuildError, match="friction_law must be the disc"):
        FrictionProblem.from_problem(carom.ContactProblem.from_dict(table))


@pytest.mark.parametrize("scene", ["seven_objects", "drop.toml"])
def test_the_problem_of_a_step_of_a_run(scene: str, tmp_path: Path) -> None:
    from test_cli import SCENE

    (tmp_path / "drop.toml").write_text(SCENE)
    what = tmp_path / scene if scene.endswith("toml") else scene
    loaded = load_scene(what)
    world = loaded.build(iterations=7)
    path = tmp_path / "run.h5"
    duration = 0.3 if scene.endswith("toml") else 0.15
    from carom.run import run_world

    run_world(world, duration, out=path, scene=loaded.text, scene_name=loaded.name, every=5)
    run = Run.load(path)
    step = len(run) - 3
    twin = load_scene(what).build(iterations=7)
    for _ in range(step):
        twin.step()
    contacts = run.problem(step)
    assert contacts.to_dict() == twin.problem().to_dict()
    saved = run.save_problem(tmp_path / "step.npz", step)
    back = FrictionProblem.load(tmp_path / "step.npz")
    assert back.name == f"{loaded.name}-step{step}"
    assert back.q.tolist() == saved.q.tolist() == (-contacts.b).tolist()
    assert run.save_problem(tmp_path / "step.hdf5", step).data.tolist() == back.data.tolist()
    assert FrictionProblem.load(tmp_path / "step.hdf5").data.tolist() == back.data.tolist()
    with pytest.raises(RunFileError, match=f"has no step {len(run)}; choose a step from 0 to {len(run) - 1}"):
        run.problem(len(run))


def test_a_run_that_cannot_be_run_again_says_why(tmp_path: Path) -> None:
    w = PLANE.stack(2)
    run = w.run(0.05)
    with pytest.raises(RunFileError, match="does not say how its world is made"):
        run.problem(2)
    from carom.run import run_world

    loaded = load_scene("seven_objects")
    world = loaded.build()
    world.step()
    late = run_world(world, 0.05, scene=loaded.text, scene_name=loaded.name)
    with pytest.raises(RunFileError, match="began with another position"):
        late.problem(2)
    world = loaded.build()
    changed = run_world(world, 0.05, scene=loaded.text, scene_name=loaded.name)
    changed.steps["residual"][1] += 1e-9
    with pytest.raises(RunFileError, match="runs differently here: residual before step"):
        changed.problem(5)
