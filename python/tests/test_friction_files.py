"""Files of friction problems: what is kept, what is reduced, and what is refused."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from friction_files import ROCKS, block, bodies, problem_of, write_fclib, write_matrix
from scipy import sparse
from spaces import PLANE, SPACE, Face, both

from carom import ContactProblem, FrictionProblem, RunFileError
from carom._friction_problem_file import read_impulse_file, write_friction_problem


def local(seed: int = 3, contacts: int = 4, d: int = 3) -> FrictionProblem:
    """A random problem with a full W that is not symmetric."""
    draw = np.random.default_rng(seed)
    n = d * contacts
    a = draw.standard_normal((n, n))
    w = a @ a.T + 0.1 * draw.standard_normal((n, n))
    w[abs(w) < 0.4] = 0
    return problem_of(w, draw.standard_normal(n), draw.uniform(0.1, 1, contacts), d, name="random")


@both
@pytest.mark.parametrize("suffix", ["npz", "hdf5"])
def test_files_keep_every_bit(face: Face, suffix: str, tmp_path: Path) -> None:
    w = face.pile(5)
    for _ in range(60):
        w.step()
    p = FrictionProblem.from_problem(w.problem(), name="pile", source="a test")
    path = tmp_path / f"p.{suffix}"
    p.save(path)
    back = FrictionProblem.load(path)
    for name in ("data", "indices", "indptr", "q", "mu"):
        assert getattr(back, name).tobytes() == getattr(p, name).tobytes()
    assert back.dimension == p.dimension
    assert back.name == "pile"
    if suffix == "npz":
        assert back.source == "a test"
        assert back.target is not None
        assert back.target.tolist() == p.target.tolist()  # type: ignore[union-attr]
        assert back.body_form is not None
        assert back.body_form.momentum.tolist() == p.body_form.momentum.tolist()  # type: ignore[union-attr]
    again = tmp_path / f"q.{suffix}"
    back.save(again)
    if suffix == "npz":
        assert again.read_bytes() == path.read_bytes()


def test_the_npz_is_the_form_of_collections(tmp_path: Path) -> None:
    given = np.load(ROCKS)
    p = FrictionProblem.load(ROCKS)
    assert p.name == str(given["name"])
    assert p.meta == json.loads(str(given["meta"]))
    p.save(tmp_path / "p.npz")
    saved = np.load(tmp_path / "p.npz")
    assert set(given.files) <= set(saved.files)
    for name in given.files:
        assert saved[name].tolist() == given[name].tolist() or name == "meta"


def test_linear_complementarity_problems(tmp_path: Path) -> None:
    p = problem_of([[2.0, -1.0], [-1.0, 2.0]], [-1.0, 1.0], [0.0, 0.0], 1)
    p.save(tmp_path / "lcp.npz")
    assert "mu" not in np.load(tmp_path / "lcp.npz").files
    back = FrictionProblem.load(tmp_path / "lcp.npz")
    assert back.kind == "lcp"
    assert back.mu.tolist() == [0, 0]
    assert back.solve("exact").impulse.ravel() == pytest.approx([0.5, 0.0])
    with pytest.raises(RunFileError, match="dimension must be 2 or 3 in FCLIB"):
        p.save(tmp_path / "lcp.hdf5")


@pytest.mark.parametrize("form", ["csr", "csc", "coo"])
@pytest.mark.parametrize("d", [2, 3])
def test_local_problems_of_fclib(form: str, d: int, tmp_path: Path) -> None:
    p = local(d=d)
    path = tmp_path / "local.hdf5"
    write_fclib(path, "fclib_local", d, {"W": p.matrix.toarray(), "q": p.q, "mu": p.mu}, form)
    back = FrictionProblem.load(path)
    assert back.dimension == d
    assert back.matrix.toarray().tolist() == p.matrix.toarray().tolist()
    assert back.q.tolist() == p.q.tolist()
    assert back.name == "made for a test"
    assert back.meta["numberOfDegreeOfFreedom"] == 12


def test_symmetric_halves_are_filled(tmp_path: Path) -> None:
    w = np.array([[2.0, 0.5], [0.5, 1.0]])
    path = tmp_path / "half.hdf5"
    write_fclib(path, "fclib_local", 2, {"W": np.tril(w), "q": np.ones(2), "mu": np.ones(1)}, "csc")
    with h5py.File(path, "a") as file:
        file["fclib_local/W"].attrs["symmetric_packed"] = 1
    assert FrictionProblem.load(path).matrix.toarray().tolist() == w.tolist()


@pytest.mark.parametrize("form", ["csr", "csc", "coo", "coo-header"])
def test_global_problems_of_fclib_are_reduced(form: str, tmp_path: Path) -> None:
    mass, h, _, f, w = bodies(1, 4)
    path = tmp_path / "global.hdf5"
    parts = {"M": mass, "H": h, "f": f, "w": w, "mu": np.full(4, 0.4)}
    if form == "coo-header":
        assert h.shape[0] > h.shape[1], "only then do the indices tell rows from columns"
    write_fclib(path, "fclib_global", 3, parts, form)
    p = FrictionProblem.load(path)
    expected = h.T @ np.linalg.solve(mass, h)
    assert np.abs(p.matrix.toarray() - expected).max() < 1e-12 * np.abs(expected).max()
    assert p.q == pytest.approx(h.T @ np.linalg.solve(mass, f) + w, abs=1e-12)
    r = p.solve("exact").impulse
    assert p.body_form is not None
    velocity, _ = p.body_form.motion(r.ravel())
    assert mass @ velocity == pytest.approx(h @ r.ravel() + f)
    # and out again, in the same form, with a solution
    again = tmp_path / "again.hdf5"
    write_friction_problem(again, p, r.ravel(), whole=True)
    back = FrictionProblem.load(again)
    assert back.data.tolist() == p.data.tolist()
    assert read_impulse_file(again).tolist() == r.ravel().tolist()
    with h5py.File(again) as file:
        assert file["solution/u"][...] == pytest.approx(p.velocity(r))
        assert file["solution/v"][...] == pytest.approx(velocity)


def test_small_bodies_are_reduced_block_by_block(tmp_path: Path) -> None:
    draw = np.random.default_rng(4)
    blocks = [draw.standard_normal((n, n)) for n in (6, 3, 6, 1)]
    mass = sparse.block_diag([b @ b.T + np.eye(len(b)) for b in blocks]).toarray()
    order = draw.permutation(len(mass))
    mass = mass[np.ix_(order, order)]
    h, f, w = draw.standard_normal((16, 6)), draw.standard_normal(16), draw.standard_normal(6)
    path = tmp_path / "global.hdf5"
    write_fclib(path, "fclib_global", 3, {"M": mass, "H": h, "f": f, "w": w, "mu": np.ones(2)}, "coo")
    p = FrictionProblem.load(path)
    assert np.abs(p.matrix.toarray() - h.T @ np.linalg.solve(mass, h)).max() < 1e-12
    assert p.q == pytest.approx(h.T @ np.linalg.solve(mass, f) + w, abs=1e-12)


def test_bilateral_constraints_are_eliminated_alike_in_both_forms(tmp_path: Path) -> None:
    """M v = H r + G l + f, G^T v + b = 0 against its contact-space form W, V, R, s."""
    mass, h, g, f, w = bodies(2, 3)
    b, mu = np.array([0.3, -0.2]), np.full(3, 0.5)
    path = tmp_path / "global.hdf5"
    write_fclib(path, "fclib_global", 3, {"M": mass, "H": h, "G": g, "f": f, "w": w, "b": b, "mu": mu}, "csc")
    p = FrictionProblem.load(path)
    inverse = np.linalg.inv(mass)
    parts = {
        "W": h.T @ inverse @ h, "V": h.T @ inverse @ g, "R": g.T @ inverse @ g,
        "q": h.T @ inverse @ f + w, "s": g.T @ inverse @ f + b, "mu": mu,
    }  # fmt: skip
    other = tmp_path / "local.hdf5"
    write_fclib(other, "fclib_local", 3, parts, "csr")
    same = FrictionProblem.load(other)
    assert np.abs((same.matrix - p.matrix).toarray()).max() < 1e-12 * np.abs(p.data).max()
    assert same.q == pytest.approx(p.q, abs=1e-12)
    r = p.solve("exact").impulse.ravel()
    assert p.body_form is not None
    velocity, multiplier = p.body_form.motion(r)
    assert mass @ velocity == pytest.approx(h @ r + g @ multiplier + f)
    assert g.T @ velocity == pytest.approx(-b)
    assert h.T @ velocity + w == pytest.approx(p.velocity(r))


def test_worlds_problems_in_their_own_form_are_read_too(tmp_path: Path) -> None:
    w = PLANE.stack(2)
    w.step()
    for suffix in ("h5", "json"):
        w.problem().save(tmp_path / f"p.{suffix}")
        p = FrictionProblem.load(tmp_path / f"p.{suffix}")
        assert p.q.tolist() == FrictionProblem.from_problem(w.problem()).q.tolist()
        assert p.name == "p"
    path = tmp_path / "singular.hdf5"
    parts = {"M": np.zeros((3, 3)), "H": np.ones((3, 2)), "f": np.ones(3), "w": np.ones(2), "mu": np.ones(1)}
    write_fclib(path, "fclib_global", 2, parts, "csc")
    with pytest.raises(RunFileError, match="/fclib_global: M is singular"):
        FrictionProblem.load(path)


# --- files that are not to be trusted ---


def npz(path: Path, change: dict[str, Any], drop: tuple[str, ...] = ()) -> Path:
    """A good file with some entries changed."""
    arrays = {name: array for name, array in np.load(ROCKS).items() if name not in drop}
    np.savez(path, **{**arrays, **change})
    return path


@pytest.mark.parametrize(
    ("change", "drop", "words"),
    [
        ({}, ("q",), "q is missing"),
        ({}, ("mu",), "mu is missing"),
        ({}, ("W_indptr",), "W_indptr is missing"),
        ({"kind": "spin"}, (), "kind must be 'friction' or 'lcp', got 'spin'"),
        ({"kind": np.array(3)}, (), "kind must be a text"),
        ({"d": 4}, (), "d must be 2 or 3 for kind 'friction', got 4"),
        ({"d": 1}, (), "d must be 2 or 3"),
        ({"d": 3.5}, (), "d must be one whole number"),
        ({"d": np.array([3, 3])}, (), "d must be one whole number"),
        ({"kind": "lcp"}, (), "d must be 1 for kind 'lcp', got 3"),
        ({"W_shape": np.array([3, 3])}, (), "W_shape must be"),
        ({"W_shape": np.array([-132, -132])}, (), "W_shape must be"),
        ({"W_data": np.array([np.nan])}, (), r"W_data\[0\] must be finite"),
        ({"W_indptr": np.array([0, 1])}, (), "W_indptr must have 133 entries"),
        ({"W_indices": np.array([0])}, (), "W_indices must have as many entries"),
        ({"q": np.array([[1.0, 2.0]])}, (), "must be"),
        ({"q": np.full(132, np.inf)}, (), r"q\[0\] must be finite"),
        ({"mu": np.full(44, -1.0)}, (), r"mu\[0\] must be >= 0"),
        ({"mu": np.full(3, 1.0)}, (), "q must have 3 x 3 entries"),
        ({"mu": np.array([{"a": 1}], dtype=object)}, (), "mu must hold plain numbers"),
        ({"name": np.array("x" * (1 << 21))}, (), "name must be a text of at most"),
        ({"target": np.ones(3)}, (), "target must have 132 entries"),
        ({"body_M_data": np.ones(1)}, (), "body_M_indices is missing"),
    ],
)
def test_what_is_wrong_with_an_npz_is_named(
    change: dict[str, Any], drop: tuple[str, ...], words: str, tmp_path: Path
) -> None:
    path = npz(tmp_path / "bad.npz", change, drop)
    with pytest.raises(RunFileError, match=words) as caught:
        FrictionProblem.load(path)
    assert str(path) in str(caught.value)


def entry(header: dict[str, Any], data: bytes) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, header)
    return stream.getvalue() + data


@pytest.mark.parametrize("shape", [(10**12,), (-5,), (2**62, 2**62)])
def test_arrays_that_promise_more_than_they_hold_are_not_made(shape: tuple[int, ...], tmp_path: Path) -> None:
    path = npz(tmp_path / "bad.npz", {}, ("q",))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(
            "q.npy", entry({"descr": "<f8", "fortran_order": False, "shape": shape}, b"12345678")
        )
    with pytest.raises(RunFileError, match=r"q must hold 8 bytes|no friction problem|no archive"):
        FrictionProblem.load(path)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 nothing", b"\x89HDF\r\n\x1a\n" + 400 * b"\0", b"{"])
@pytest.mark.parametrize("suffix", ["npz", "hdf5", "h5", "json", "txt"])
def test_files_of_no_such_form_are_refused(content: bytes, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"bad.{suffix}"
    path.write_bytes(content)
    with pytest.raises(RunFileError, match="problem file"):
        FrictionProblem.load(path)


def test_a_missing_file_and_a_folder_are_told(tmp_path: Path) -> None:
    with pytest.raises(RunFileError, match="No such file"):
        FrictionProblem.load(tmp_path / "none.npz")
    (tmp_path / "folder.npz").mkdir()
    with pytest.raises(RunFileError, match="problem file"):
        FrictionProblem.load(tmp_path / "folder.npz")
    with pytest.raises(RunFileError, match="cannot be written"):
        block([-1.0, 0.0], 0.1).save(tmp_path / "none" / "p.npz")
    with pytest.raises(RunFileError, match="no known suffix"):
        block([-1.0, 0.0], 0.1).save(tmp_path / "p.txt")


def set_(path: str, values: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[path]
        file[path] = values

    return change


def linked(path: str, link: Any) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[path]
        file[path] = link

    return change


def grouped(file: h5py.File) -> None:
    del file["fclib_local/vectors/q"]
    file.create_group("fclib_local/vectors/q")


def external(file: h5py.File) -> None:
    del file["fclib_local/vectors/q"]
    file["fclib_local/vectors"].create_dataset(
        "q", shape=(12,), dtype="f8", external=[("/etc/hostname", 0, h5py.h5f.UNLIMITED)]
    )


def enormous(file: h5py.File) -> None:
    del file["fclib_local/W/x"]
    file["fclib_local/W"].create_dataset("x", shape=(1 << 40,), dtype="f8", chunks=(1 << 16,))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f.__delitem__("fclib_local/W"), "/fclib_local/W is missing"),
        (lambda f: f.__delitem__("fclib_local/W/p"), "/fclib_local/W/p is missing"),
        (lambda f: f.__delitem__("fclib_local/vectors/mu"), "/fclib_local/vectors/mu is missing"),
        (lambda f: f.__delitem__("fclib_local"), "neither /fclib_local nor /fclib_global"),
        (set_("fclib_local/spacedim", np.array([5])), "/fclib_local/spacedim must be 2 or 3, got 5"),
        (set_("fclib_local/spacedim", np.array([3, 3])), "spacedim must be one value"),
        (set_("fclib_local/spacedim", 3.0), "spacedim must be one whole number"),
        (set_("fclib_local/W/nz", np.array([-3])), "/fclib_local/W/nz must be >= -2, got -3"),
        (set_("fclib_local/W/nz", np.array([10**6])), "/fclib_local/W/nz must be at most"),
        (set_("fclib_local/W/m", np.array([-1])), "/fclib_local/W/m and n must be >= 0"),
        (set_("fclib_local/W/m", np.array([13])), "/fclib_local/W.indptr must have 14 entries"),
        (
            set_("fclib_local/W/i", np.full(200, 99)),
            r"indices\[0\] must be in 0 .. 11, got 99|as many entries",
        ),
        (set_("fclib_local/W/x", np.array([np.nan])), r"/fclib_local/W/x\[0\] must be finite"),
        (set_("fclib_local/W/p", np.full(13, -7)), "/fclib_local/W.indptr must ascend"),
        (set_("fclib_local/vectors/q", np.ones(11)), "/fclib_local/W must be square with 11 rows"),
        (set_("fclib_local/vectors/q", "text"), "/fclib_local/vectors/q must be a list of numbers"),
        (
            set_("fclib_local/vectors/mu", np.ones((2, 2))),
            "/fclib_local/vectors/mu must be a list of numbers",
        ),
        (linked("fclib_local/W", h5py.ExternalLink("other.h5", "/W")), "/fclib_local/W must be in the file"),
        (linked("fclib_local/W/x", h5py.SoftLink("/fclib_local/vectors/q")), "must be in the file itself"),
        (grouped, "/fclib_local/vectors/q must be a dataset"),
        (external, "/fclib_local/vectors/q must be kept in the file itself"),
        (enormous, "/fclib_local/W/x must be at most"),
        (lambda f: write_matrix(f["fclib_local"], "V", np.ones((12, 2)), "csr"), "/fclib_local/R is missing"),
    ],
)
def test_what_is_wrong_with_an_fclib_file_is_named(
    change: Callable[[h5py.File], None], words: str, tmp_path: Path
) -> None:
    p = local()
    path = tmp_path / "bad.hdf5"
    write_fclib(path, "fclib_local", 3, {"W": p.matrix.toarray(), "q": p.q, "mu": p.mu}, "csr")
    assert FrictionProblem.load(path).q.tolist() == p.q.tolist()
    with h5py.File(path, "a") as file:
        change(file)
    with pytest.raises(RunFileError, match=words) as caught:
        FrictionProblem.load(path)
    assert str(path) in str(caught.value)


def test_a_body_form_that_is_another_problem_is_refused(tmp_path: Path) -> None:
    w = SPACE.stack(2)
    w.step()
    p = FrictionProblem.from_problem(w.problem())
    p.save(tmp_path / "p.npz")
    arrays = dict(np.load(tmp_path / "p.npz").items())
    arrays["body_f"] = arrays["body_f"] + 1
    np.savez(tmp_path / "other.npz", **arrays)
    with pytest.raises(RunFileError, match="body form must give the same velocities as W and q"):
        FrictionProblem.load(tmp_path / "other.npz")
    with pytest.raises(RunFileError, match="body_form must be known"):
        write_friction_problem(tmp_path / "p.hdf5", local(), None, whole=True)
    assert ContactProblem.from_dict(w.problem().to_dict()).n_contacts == len(p)
