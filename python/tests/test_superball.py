"""Tangential restitution from Python: bodies, materials, scene files, recordings, their check, problems."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from checked import failed
from spaces import Face, both

import carom
from carom import BuildError, CaromError, ContactProblem, FrictionProblem, check_certificate, load_scene
from carom.check_run import check_run

RADIUS, SPEED = 0.1, 2.0
IMPACT = carom.EVENT_KINDS.index("impact")


def superball(face: Face, **settings: Any) -> Any:
    """A superball of 1 kg that falls and goes forward without spin."""
    w = face.world(**{"dt": 1e-2, "scheme": "events", **settings})
    w.add_static("floor", face.ground(), friction=2.0)
    w.add_body("ball", face.ball(RADIUS), mass=1.0, position=face.at(0.0, 0.6), velocity=face.at(SPEED, 0.0),
               friction=2.0, restitution=1.0, tangential_restitution=1.0)  # fmt: skip
    return w


@both
def test_a_superball_bounces_as_garwin_says(face: Face) -> None:
    """Case C8: (3 v - 4 R w)/7 and (-10 v - 3 R w)/7 for the solid sphere, v/3 and -4 v/3 for the disc."""
    w = superball(face)
    assert w["ball"].tangential_restitution == 1.0
    while w["ball"].velocity[-1] <= 0:
        w.step()
    along, rim = (SPEED / 3, -4 * SPEED / 3) if face.dimension == 2 else (3 * SPEED / 7, -10 * SPEED / 7)
    assert w["ball"].velocity[0] == pytest.approx(along, abs=1e-14)
    spin = np.atleast_1d(w["ball"].angular_velocity)
    # about the axis out of the plane, which space has pointing the other way
    turned = spin[0] if face.dimension == 2 else -spin[1]
    assert RADIUS * turned == pytest.approx(rim, abs=1e-14)


# --- recordings ---


@both
@pytest.mark.parametrize("law", ["newton", "generalized_reflections", "sequential"])
def test_the_check_accepts_runs_of_superballs(face: Face, law: str, tmp_path: Path) -> None:
    superball(face, impact=law).run(2.0, out=tmp_path / "run.h5")
    found = check_run(tmp_path / "run.h5")
    assert failed(found) == {}
    impacts = {c.name: c.verdict for c in found.checks}["impact_law"]
    assert impacts == ("not checked" if law == "sequential" else "ok")
    superball(face, impact=law, scheme="fixed_step").run(2.0, out=tmp_path / "fixed.h5")
    assert failed(check_run(tmp_path / "fixed.h5")) == {}


def lower(rows: Any) -> Any:
    rows["tangential_restitution"][rows["kind"] == IMPACT] = 0.9
    return rows


def stop(rows: Any) -> Any:
    """Impulses of impacts that only stop slips, as without tangential restitution."""
    hit = rows["kind"] == IMPACT
    rows["impulse"][hit, 0] *= 0.5
    return rows


def forget(rows: Any) -> Any:
    kept = [name for name in rows.dtype.names if name != "tangential_restitution"]
    return rows[kept].astype([(name, rows.dtype[name]) for name in kept])


@both
@pytest.mark.parametrize("tamper", [lower, stop, forget])
def test_the_check_catches_other_slips(face: Face, tamper: Any, tmp_path: Path) -> None:
    superball(face).run(1.0, out=tmp_path / "sound.h5")
    shutil.copy(tmp_path / "sound.h5", tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        rows = tamper(file["events"][...])
        del file["events"]
        file.create_dataset("events", data=rows)
    assert "impact_law" in failed(check_run(tmp_path / "run.h5"))


# --- materials, files and refusals ---


def test_scene_files_say_it_of_materials_bodies_and_pairs(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'schema_version = 1\nspace = "planar"\n'
        "[materials.rubber]\nrestitution = 0.9\ntangential_restitution = 0.8\n[materials.stone]\n"
        '[[pair]]\nmaterials = ["stone", "rubber"]\ntangential_restitution = 0.6\n'
        '[[body]]\nname = "floor"\nkind = "static"\nmaterial = "stone"\n[body.shape]\ntype = "half_plane"\n'
        "normal = [0, 1]\n"
        '[[body]]\nname = "ball"\nmass = 1.0\nmaterial = "rubber"\nposition = [0, 0.1]\n'
        '[body.shape]\ntype = "circle"\nradius = 0.1\n'
        '[[body]]\nname = "other"\nmass = 1.0\nmaterial = "rubber"\ntangential_restitution = 0.3\n'
        'position = [1, 0.1]\n[body.shape]\ntype = "circle"\nradius = 0.1\n'
    )
    w = load_scene(scene).build(scheme="events")
    assert [w[name].tangential_restitution for name in ("floor", "ball", "other")] == [0.0, 0.8, 0.3]
    w.step()
    assert set(w.event_log["tangential_restitution"]) == {0.6}
    w.set_pair("rubber", "stone", tangential_restitution=0.5)
    w.step()
    assert set(w.event_log["tangential_restitution"]) == {0.5}
    scene.write_text(scene.read_text().replace("restitution = 0.3", "restitution = 1.3"))
    with pytest.raises(CaromError, match="tangential_restitution"):
        load_scene(scene)


@both
def test_what_cannot_be_is_refused_by_name(face: Face) -> None:
    with pytest.raises(BuildError, match=r"tangential_restitution must be in \[0, 1\], got 1.5"):
        face.world().add_static("floor", face.ground(), tangential_restitution=1.5)
    for law in ("moreau", "poisson"):
        with pytest.raises(CaromError, match=f"no tangential restitution: '{law}'; body 'ball' asks for 1"):
            superball(face, impact=law).step()
    with pytest.raises(BuildError, match="tangential_restitution has no gradient"):
        carom.gradient.record(superball(face), 1)


# --- problems ---


@both
@pytest.mark.parametrize("suffix", [".json", ".h5"])
def test_problems_keep_the_slips_that_are_asked_for(face: Face, suffix: str, tmp_path: Path) -> None:
    w = face.stack(2)
    plain = w.problem().to_dict()
    assert all("slip_target" not in contact for contact in plain["contacts"])
    for contact in plain["contacts"]:
        # one slip for each two bodies: what rigid bodies can do, and friction suffices for
        contact["slip_target"] = [0.004 * (-1) ** max(contact["a"], contact["b"])] * (face.dimension - 1)
    problem = ContactProblem.from_dict(plain)
    width = face.dimension
    slips = [contact["slip_target"] for contact in plain["contacts"]]
    assert problem.target.reshape(-1, width)[:, 1:].tolist() == slips
    problem.save(tmp_path / f"problem{suffix}")
    again = ContactProblem.load(tmp_path / f"problem{suffix}")
    assert again.to_dict()["contacts"] == problem.to_dict()["contacts"]
    found = again.solve("exact", tolerance=1e-12)
    assert found.residual <= 1e-12
    after = (problem.A @ found.flat - problem.b + problem.target).reshape(-1, width)
    assert np.abs(after[:, 1:] - slips).max() < 1e-11


@both
@pytest.mark.parametrize("suffix", [".npz", ".hdf5"])
def test_an_independent_check_certifies_them_in_matrix_form(face: Face, suffix: str, tmp_path: Path) -> None:
    plain = face.stack(3).problem().to_dict()
    for k, contact in enumerate(plain["contacts"]):
        contact["slip_target"] = [0.02 * (k + 1)] * (face.dimension - 1)
    problem = FrictionProblem.from_problem(ContactProblem.from_dict(plain), name="belts")
    problem.save(tmp_path / f"belts{suffix}")
    loaded = FrictionProblem.load(tmp_path / f"belts{suffix}")
    impulse = loaded.solve("exact", tolerance=1e-10).impulse
    certificate = loaded.certificate(impulse)
    assert certificate.energy_closure is None or abs(certificate.energy_closure) < 1e-12
    by_itself = check_certificate.load_problem(str(tmp_path / f"belts{suffix}"))
    assert check_certificate.disagreements(certificate.to_dict(), by_itself, impulse.ravel()) == []
