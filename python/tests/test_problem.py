"""Contact problems as values: matrices, solvers, residual, files, in both spaces."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy import sparse
from spaces import PLANE, SPACE, Face, both

import carom
from carom import BuildError, ContactProblem, RunFileError, SolverError, planar


def settled(face: Face, count: int = 3, **settings: Any) -> Any:
    w = face.stack(count, **settings)
    for _ in range(5):
        w.step()
    return w


@both
def test_matrices_are_those_of_the_notes(face: Face) -> None:
    p = settled(face).problem()
    d, dof = face.dimension, 3 if face.dimension == 2 else 6
    rows = d * p.n_contacts
    assert all(isinstance(m, sparse.csr_array) for m in (p.A, p.J, p.inverse_mass_matrix))
    assert p.J.shape == (rows, dof * p.n_bodies)
    assert p.A.shape == (rows, rows)
    product = p.J @ p.inverse_mass_matrix @ p.J.T
    assert np.abs((p.A - product).toarray()).max() < 1e-12 * np.abs(p.A.toarray()).max()
    velocities = np.array([[*v["linear"], *np.atleast_1d(v["angular"])] for v in p.to_dict()["velocities"]])
    assert p.b == pytest.approx(p.target - p.J @ velocities.ravel(), abs=1e-14)
    for k, contact in enumerate(p.to_dict()["contacts"]):
        row = p.J[[k * d]].toarray().reshape(p.n_bodies, dof)
        assert row[contact["a"], :d] == pytest.approx(contact["normal"])
        assert row[contact["b"], :d] == pytest.approx([-x for x in contact["normal"]])
        arm, normal = np.array(contact["arm_a"]), np.array(contact["normal"])
        turn = np.cross(arm, normal) if d == 3 else [arm[0] * normal[1] - arm[1] * normal[0]]
        assert row[contact["a"], d:] == pytest.approx(turn)
    assert len(p.friction) == len(p.restitution) == len(p.gap) == len(p) == p.n_contacts
    assert p.friction == pytest.approx(0.5)
    assert p.pairs.shape == (p.n_contacts, 2)


@both
def test_the_problem_is_that_of_the_next_step_and_asking_changes_nothing(face: Face) -> None:
    w = face.pile(6)
    for _ in range(120):
        w.step()
    w["b1"].apply_force(face.at(3.0, 0.0))
    before, contacts = w.snapshot(), w.contacts
    p = w.problem()
    impacts = w.problem(phase="impact")
    assert w.snapshot() == before
    assert w.contacts.tobytes() == contacts.tobytes()
    assert p.n_bodies == impacts.n_bodies == len(w)
    twin = carom.planar.World() if face.dimension == 2 else carom.spatial.World()
    twin.restore(before)
    w.problem()
    assert w.step() == twin.step()


@both
def test_all_solvers_on_one_problem(face: Face) -> None:
    """Matrix form and iterative form agree (item 45); every answer has the residual that it claims."""
    p = settled(face, 3 if face.dimension == 2 else 1, solver="pgs").problem()
    answers = {
        name: p.solve(name, iterations=20_000, tolerance=1e-13)
        for name in ("pgs", "pgs_matrix", "sequential")
    }
    if face.dimension == 2:
        answers["lemke"] = p.solve("lemke", tolerance=1e-12)
    for name, answer in answers.items():
        assert answer.solver == name
        assert answer.impulse.shape == (p.n_contacts, face.dimension)
        judged = p.residual(answer.impulse)
        assert judged.absolute == answer.residual
        assert judged.relative == answer.relative_residual
        if name != "sequential":
            # four corners with friction in space are redundant: sweeps lose their linear rate near the end
            assert answer.residual < (1e-12 if face.dimension == 2 else 1e-8)
            assert answer.converged == (answer.residual <= 1e-13)
    assert np.abs(answers["pgs"].impulse - answers["pgs_matrix"].impulse).max() < 1e-12
    velocity = answers["pgs"].velocity.ravel()
    assert p.J @ velocity == pytest.approx(p.A @ answers["pgs"].impulse.ravel() - p.b + p.target, abs=1e-12)
    reached = max(1e-12, 2 * answers["pgs"].residual)
    again = p.solve("pgs", start=answers["pgs"].impulse, tolerance=reached)
    assert again.iterations <= 1


def test_a_method_that_cannot_says_so() -> None:
    w = settled(PLANE)
    answer = w.problem().solve("direct")
    assert answer.status == "refused"
    assert "A is singular" in str(answer.reason)
    assert not answer.impulse.any()
    w.solver = "direct"
    with pytest.raises(SolverError, match=r"solver 'direct' refused the .* problem") as caught:
        w.step()
    assert caught.value.value == "direct"
    assert "problem of 6 contacts" in str(caught.value)
    phase = "impact" if "impact problem" in str(caught.value) else "contact"
    assert w.problem(phase=phase).n_contacts == 6, "the refused problem itself can be looked at"


def test_the_box_allows_more_friction_than_the_disc_along_a_diagonal() -> None:
    w = SPACE.world(gravity=(0, 0, -10), dt=0.01)
    w.add_static("floor", SPACE.ground(), friction=0.5)
    w.add_body("puck", SPACE.ball(0.5), mass=1.0, position=(0, 0, 0.5), velocity=(3, 3, 0), can_rotate=False)
    p = w.problem()
    disc, box = p.solve("pgs"), p.solve("pgs", friction_law="box")
    size = [np.linalg.norm(answer.impulse[0, 1:]) / answer.impulse[0, 0] for answer in (disc, box)]
    assert size == pytest.approx([0.5, 0.5 * np.sqrt(2)], rel=1e-9)
    assert p.residual(box.impulse, friction_law="box").absolute < 1e-6
    assert p.residual(box.impulse).absolute > 1e-3


@both
@pytest.mark.parametrize("suffix", ["json", "h5"])
def test_files_keep_every_bit(face: Face, suffix: str, tmp_path: Path) -> None:
    p = settled(face).problem()
    path = tmp_path / f"step.{suffix}"
    p.save(path)
    back = ContactProblem.load(path)
    assert back.to_dict() == p.to_dict()
    assert back.space == p.space
    assert back.names == ("floor", "box0", "box1", "box2")
    assert (back.A - p.A).nnz == 0
    assert back.solve("pgs").impulse.tolist() == p.solve("pgs").impulse.tolist()
    assert pickle.loads(pickle.dumps(p)).to_dict() == p.to_dict()
    if suffix == "h5":
        with h5py.File(path) as file:
            assert file["contacts/gap"].attrs["unit"] == "m"
            assert file["inverse_masses/linear"].attrs["unit"] == "1/kg"


def two_bodies(**row: Any) -> dict[str, Any]:
    """A unit mass and an obstacle with one bounded row along x on the mass."""
    still = {"linear": [0.0, 0.0], "angular": [0.0]}
    given = {
        "id": 1,
        "a": 0,
        "b": 1,
        "on_a": {"linear": [1.0, 0.0], "angular": [0.0]},
        "on_b": still,
        "target": 1.0,
    }
    return {
        "space": "planar",
        "friction_law": "disc",
        "inverse_masses": [{"linear": 2.0, "angular": 1.0}, {"linear": 0.0, "angular": 0.0}],
        "velocities": [{"linear": [0.25, 0.0], "angular": [0.0]}, still],
        "contacts": [],
        "rows": [{**given, **row}],
    }


@pytest.mark.parametrize(
    ("bounds", "impulse", "velocity"),
    [(("-inf", "inf"), 0.375, 1.0), ((0.0, 0.125), 0.125, 0.5), ((0.0, "inf"), 0.375, 1.0)],
    ids=["equality", "bounded", "one-sided"],
)
def test_general_rows(bounds: tuple[Any, Any], impulse: float, velocity: float, tmp_path: Path) -> None:
    p = ContactProblem.from_dict(two_bodies(lo=bounds[0], hi=bounds[1]))
    p.save(tmp_path / "rows.h5")
    for problem in (p, ContactProblem.load(tmp_path / "rows.h5")):
        answer = problem.solve("pgs", tolerance=1e-14)
        assert answer.row_impulse == pytest.approx([impulse])
        assert answer.velocity[0] == pytest.approx([velocity, 0, 0])
        assert problem.residual(answer.row_impulse).absolute < 1e-13


def test_spy_draws_the_pattern(tmp_path: Path) -> None:
    p = settled(PLANE).problem()
    axes = p.spy()
    assert "A = J" in axes.get_title()
    shown = axes.images[0].get_array()
    assert shown is not None
    assert (~np.ma.getmaskarray(shown)).sum() <= p.A.nnz
    axes.figure.savefig(tmp_path / "a.png")
    assert PLANE.world().problem().spy().texts[0].get_text() == "no contacts"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"space": "round"}, 'space must be "planar" or "spatial"'),
        ({"inverse_masses": []}, "contact problem: velocities: 2 velocities for 0 bodies"),
        ({"rows": [{}]}, "contact problem: file: missing field `id`; give a file written by"),
        (
            {"rows": two_bodies(lo=3, hi=1)["rows"]},
            r"contact problem: rows\[0\].lo, hi: got \[3, 1\]; give lo <= hi",
        ),
        ({"velocities": [{"linear": [np.nan, 0], "angular": [0]}] * 2}, "give finite numbers and lists"),
    ],
)
def test_numbers_that_are_no_problem(change: dict[str, Any], message: str) -> None:
    with pytest.raises(BuildError, match=message):
        ContactProblem.from_dict({**two_bodies(lo=0, hi=1), **change})


def test_files_that_are_no_problem(tmp_path: Path) -> None:
    p = planar.World().problem()
    with pytest.raises(RunFileError, match=r"has no known suffix; end it in .json or .h5"):
        p.save(tmp_path / "a.txt")
    with pytest.raises(RunFileError, match="cannot be written"):
        p.save(tmp_path / "missing" / "a.json")
    with pytest.raises(RunFileError, match="cannot be read: No such file"):
        ContactProblem.load(tmp_path / "none.h5")
    for name, text in (
        ("a.json", "[1, 2]"),
        ("b.json", "{"),
        ("c.h5", "not HDF5"),
        ("d.json", '{"space": 1}'),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises((RunFileError, BuildError)):
            ContactProblem.load(tmp_path / name)
    with h5py.File(tmp_path / "e.h5", "w") as file:
        file.attrs["format"] = "other"
    with pytest.raises(RunFileError, match="is no contact problem: its format is not carom-problem"):
        ContactProblem.load(tmp_path / "e.h5")
    good = json.dumps(two_bodies(lo=0, hi=1))
    (tmp_path / "f.json").write_text(good)
    assert ContactProblem.load(tmp_path / "f.json").n_bodies == 2
