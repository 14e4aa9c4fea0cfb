"""Certificates: what they state, and that others find the same from problem and impulses alone."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from friction_files import ARCH, DATA, ROCKS, block, problem_of
from hypothesis import given, settings
from hypothesis import strategies as st

from carom import FRICTION_SOLVERS, FrictionProblem, RunFileError, check_certificate
from carom._friction_problem_certificate import Certificate, project_on_cones

FOLDER = Path(os.environ.get("CAROM_CONTACT_PROBLEMS", "/nonexistent"))
PUBLIC = sorted([*DATA.glob("*.npz"), *FOLDER.glob("*.npz")], key=lambda path: path.name)


def impulses_of(p: FrictionProblem) -> dict[str, Any]:
    """None, good ones, bad ones, and ones outside the cones."""
    draw = np.random.default_rng(1)
    found = p.solve("exact", 1e-8, factorisations=300).impulse.ravel()
    scale = np.abs(found).max(initial=0) or 1.0
    rough = found + 1e-4 * scale * draw.standard_normal(found.size)
    return {"zero": np.zeros(p.q.size), "found": found, "rough": rough, "doubled": 2 * found}


def noise_of(p: FrictionProblem, r: Any) -> float:
    """What rounding may do to errors that are over |q| [1]."""
    size = np.abs(p.data).max(initial=0) * np.abs(r).max(initial=0) + np.abs(r).max(initial=0)
    return float(1e-15 * np.sqrt(p.q.size) * (1 + 10 * size / (np.linalg.norm(p.q) or 1.0)))


@pytest.mark.parametrize("path", PUBLIC, ids=lambda path: str(path.stem))
def test_three_judges_agree(path: Path) -> None:
    """The engine's measure, the certificate and the independent checker, to 14 digits.

    And the collection's own checker, where its folder is named.
    """
    p = FrictionProblem.load(path)
    plain = check_certificate.load_problem(str(path))
    theirs = _collections_checker()
    for name, r in impulses_of(p).items():
        m, c = p.measure(r), p.certificate(r)
        found, _, each = check_certificate.measured(plain, r, 1e-8)
        noise = noise_of(p, r)
        for key in ("err_nat", "err_scaled", "cone"):
            assert getattr(m, key) == pytest.approx(found[key], rel=1e-14, abs=noise), (name, key)
            assert getattr(c, key) == getattr(m, key)
        for key in ("residual", "penetration", "complementarity", "energy_change"):
            scale = np.abs(r).max(initial=0) if key in ("complementarity", "energy_change") else 1.0
            limit = float(noise * (np.linalg.norm(p.q) + 1e-300) * max(scale, 1e-300) * 10 * len(p))
            assert getattr(c, key) == pytest.approx(found[key], rel=1e-12, abs=limit), (name, key)
        if c.residual > 1e-12:
            assert each[c.worst_contact] == pytest.approx(each.max(), rel=1e-9)
        assert (c.take_off, c.stick, c.slip) == (found["take_off"], found["stick"], found["slip"])
        assert check_certificate.disagreements(c.to_dict(), plain, r) == []
        if theirs is not None:
            _agrees_with(theirs.check(theirs.load(str(path)), r), m, noise, p.kind)


def _collections_checker() -> Any:
    if not (FOLDER / "checker.py").is_file():
        return None
    spec = importlib.util.spec_from_file_location("collections_checker", FOLDER / "checker.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _agrees_with(theirs: dict[str, Any], ours: Any, noise: float, kind: str) -> None:
    if kind == "lcp":
        return
    names = {"penetration": "penetration", "compl": "complementarity", "slip_align": "slip_alignment"}
    for key, mine in {"err_nat": "err_nat", "err_scaled": "err_scaled", "cone": "cone"}.items():
        assert getattr(ours, mine) == pytest.approx(theirs[key], rel=1e-14, abs=noise), key
    for key, mine in names.items():
        assert getattr(ours, mine) == pytest.approx(theirs[key], rel=1e-12, abs=10 * noise), key
    assert theirs["status"] == {"take_off": ours.take_off, "stick": ours.stick, "slip": ours.slip}


@pytest.mark.parametrize("solver", FRICTION_SOLVERS)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    contacts=st.integers(1, 6),
    d=st.integers(1, 3),
    rank=st.integers(1, 18),
    scale=st.sampled_from([1.0, 1e-6, 1e6]),
    friction=st.sampled_from([0.0, 0.3, 1.0, 10.0]),
    asymmetry=st.sampled_from([0.0, 1e-3]),
)
def test_every_answer_is_certified_or_refused(
    solver: str, seed: int, contacts: int, d: int, rank: int, scale: float, friction: float, asymmetry: float
) -> None:
    """Full rank or not, badly scaled between contacts, frictionless or sticky, not symmetric."""
    draw = np.random.default_rng(seed)
    n = d * contacts
    sizes = np.repeat(scale ** draw.uniform(0, 1, contacts), d)
    a = draw.standard_normal((n, rank)) * sizes[:, None]
    w = a @ a.T
    w = w * (1 + asymmetry * draw.standard_normal((n, n)))
    mu = np.full(contacts, friction if d > 1 else 0.0)
    p = problem_of(w, draw.standard_normal(n), mu, d)
    found = p.solve(solver, 1e-8, iterations=2000, factorisations=200)
    assert np.isfinite(found.impulse).all()
    assert found.measure == p.measure(found.impulse)
    assert found.solved == found.measure.solves(1e-8)
    assert found.solved == (not found.reason)
    certificate = p.certificate(found.impulse).to_dict()
    rows, columns = np.nonzero(w)
    plain = {"d": d, "q": p.q, "mu": p.mu, "target": np.zeros(n), "w": (rows, columns, w[rows, columns])}
    assert check_certificate.disagreements(certificate, plain, found.impulse.ravel()) == []


def test_linear_complementarity_has_the_smaller_of_both_as_its_error() -> None:
    p = problem_of([[2.0, 1.0], [0.0, 3.0]], [-4.0, 3.0], [0.0, 0.0], 1)
    r = np.array([1.5, 0.25])
    w = p.velocity(r)
    assert p.measure(r).err_nat == pytest.approx(np.linalg.norm(np.minimum(r, w)) / 5)


def test_errors_in_si_units_of_one_contact() -> None:
    c = block([-1.0, 2.0, 0.0], 0.5).certificate([1.0, -0.3, 0.4])
    assert c.contacts == c.slip == 1
    assert c.residual > 0.1
    assert c.worst_contact == 0
    u, r, q = np.array([0.0, 1.7, 0.4]), np.array([1.0, -0.3, 0.4]), np.array([-1.0, 2.0, 0.0])
    cosine = -(u[1:] @ r[1:]) / np.linalg.norm(u[1:]) / np.linalg.norm(r[1:])
    assert c.slip_angle_error == pytest.approx(np.arccos(cosine))
    assert c.energy_change == pytest.approx(r @ (u + q) / 2)
    assert c.energy_change_by_bodies is None
    assert c.complementarity == pytest.approx(abs(0.5 * np.linalg.norm(u[1:]) + u @ r))
    outside = block([-1.0, 2.0, 0.0], 0.5).certificate([1.0, -2.0, 0.0])
    assert outside.cone_violation == pytest.approx(1.5)
    assert outside.penetration == 0
    assert block([-1.0, 2.0, 0.0], 0.5).certificate(np.zeros(3)).penetration == 1
    right = block([-1.0, 2.0, 0.0], 0.5).certificate([1.0, -0.5, 0.0])
    assert right.solved
    assert right.residual < 1e-15
    assert "1 contacts solved at 1e-08" in str(right)


def test_islands_are_told_one_by_one() -> None:
    w = np.kron(np.diag([1.0, 2.0, 3.0]), np.eye(2))
    w[0, 4] = w[4, 0] = 0.1
    p = problem_of(w, [-1.0, 0, -1, 0, -1, 0], [0.5] * 3, 2)
    c = p.certificate(np.zeros(6), islands=True)
    assert [island["first_contact"] for island in c.islands] == [0, 1]
    assert [island["contacts"] for island in c.islands] == [2, 1]
    assert all(island["residual"] == pytest.approx(1) for island in c.islands)
    assert check_certificate.islands(3, *(np.array(a) // 2 for a in np.nonzero(w))).tolist() == [0, 1, 0]


@pytest.fixture(scope="module")
def certified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a problem, its impulses and its certificates."""
    folder = tmp_path_factory.mktemp("certified")
    p = FrictionProblem.load(ROCKS)
    found = p.solve("exact", 1e-8)
    np.save(folder / "r.npy", found.impulse)
    p.save(folder / "p.npz")
    p.save(folder / "p.hdf5")
    certificate = p.certificate(found.impulse, islands=True)
    for suffix in ("json", "h5"):
        certificate.save(folder / f"c.{suffix}")
        assert Certificate.load(folder / f"c.{suffix}") == certificate
    return folder


@pytest.mark.parametrize("suffix", ["json", "h5"])
@pytest.mark.parametrize("problem", ["p.npz", "p.hdf5"])
def test_the_checker_bears_out_a_certificate(
    certified: Path, problem: str, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(certified / name) for name in (problem, "r.npy", f"c.{suffix}")]
    assert check_certificate.main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["certificate_agrees"] is True
    assert told["solved"] is True
    assert check_certificate.main(words[:2]) == 0


def test_the_checker_runs_without_the_engine(certified: Path) -> None:
    """As a plain file, with only numpy and h5py to import."""
    script = Path(check_certificate.__file__)
    code = """
import sys
sys.modules["carom"] = None
sys.path.insert(0, sys.argv[1])
import check_certificate
code = check_certificate.main(sys.argv[2:])
assert not any(name.startswith(("carom.", "scipy")) for name in sys.modules)
sys.exit(code)
"""
    words = [str(certified / name) for name in ("p.hdf5", "r.npy", "c.h5")]
    done = subprocess.run(
        [sys.executable, "-c", code, str(script.parent), *words], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    done = subprocess.run(
        [sys.executable, "-m", "carom.check_certificate", *words], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    text = script.read_text()
    assert len([line for line in text.splitlines() if line.strip()]) < 150
    assert "_carom" not in text


TAMPERED = [
    ("err_nat", 1e-12), ("err_scaled", 0.0), ("residual", 1e-14), ("relative_residual", 0.0),
    ("solved", False), ("tolerance", 1e-13), ("worst_contact", 999), ("worst_contact", None), ("slip", 0),
    ("stick", 1), ("energy_change", 0.0), ("problem_sha256", "0" * 64), ("impulse_sha256", "0" * 64),
    ("contacts", 43), ("complementarity", 0.0), ("slip_angle_error", 1.0), ("cone_violation", 1.0),
    ("err_nat", None),
]  # fmt: skip


@pytest.mark.parametrize(("field", "value"), TAMPERED)
def test_a_tampered_certificate_is_caught(
    certified: Path, field: str, value: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """Impulses that miss by a little, so that nothing is at rounding level, and a field stated otherwise."""
    p = FrictionProblem.load(certified / "p.npz")
    r = np.load(certified / "r.npy").ravel()
    r = r * (1 + 1e-6 * np.random.default_rng(2).standard_normal(r.size))
    r = project_on_cones(r.reshape(-1, 3), p.mu).ravel()
    table = p.certificate(r, 1e-3).to_dict()
    np.save(certified / "rough.npy", r)
    path = certified / "tampered.json"
    words = [str(certified / name) for name in ("p.npz", "rough.npy", "tampered.json")]
    path.write_text(json.dumps(table))
    assert check_certificate.main(words) == 0, capsys.readouterr().out
    path.write_text(json.dumps({**table, field: value}))
    capsys.readouterr()
    assert check_certificate.main(words) == 1
    told = json.loads(capsys.readouterr().out)
    assert any(word.startswith("solved" if field == "tolerance" else field) for word in told["disagreements"])


def test_other_impulses_and_another_problem_are_caught(
    certified: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    r = np.load(certified / "r.npy")
    r[3, 0] *= 1 + 1e-15
    r[3, 0] = np.nextafter(r[3, 0], np.inf)
    np.save(certified / "other.npy", r)
    words = [str(certified / name) for name in ("p.npz", "other.npy", "c.json")]
    assert check_certificate.main(words) == 1
    assert "impulse_sha256" in capsys.readouterr().out
    assert check_certificate.main([str(ARCH), words[1], words[2]]) == 2
    table = json.loads((certified / "c.json").read_text())
    table["islands"][0]["residual"] = 1.0
    (certified / "tampered.json").write_text(json.dumps(table))
    assert check_certificate.main([words[0], str(certified / "r.npy"), str(certified / "tampered.json")]) == 1
    assert "island of contact" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words", [[], ["p.npz"], ["none.npz", "r.npy"], ["p.npz", "p.npz"], ["r.npy", "r.npy"]]
)
def test_the_checker_says_what_it_cannot_read(
    words: list[str], certified: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert check_certificate.main([str(certified / word) for word in words]) == 2
    assert "cannot check" in capsys.readouterr().err


def test_bad_certificates_are_refused(certified: Path, tmp_path: Path) -> None:
    for name, text in (("a.json", "[1"), ("b.json", "[]"), ("c.json", "{}"), ("d.h5", "no")):
        (tmp_path / name).write_text(text)
        with pytest.raises(RunFileError, match="is no certificate"):
            Certificate.load(tmp_path / name)
    with h5py.File(certified / "c.h5") as file:
        assert file.attrs["residual.unit"] == "m/s"
        assert file["islands/residual"].attrs["unit"] == "m/s"
    with pytest.raises(RunFileError, match="no known suffix"):
        Certificate.load(certified / "c.json").save(tmp_path / "c.txt")
    with pytest.raises(RunFileError, match="cannot be written"):
        Certificate.load(certified / "c.json").save(tmp_path / "none" / "c.json")
