"""What tests of friction problems share: small problems, and files of them in every layout."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from scipy import sparse

from carom import FrictionProblem

Floats = npt.NDArray[np.float64]

DATA = Path(__file__).parent / "data"
ARCH = DATA / "gen_arch-s1-i00060-55.npz"
ROCKS = DATA / "gen_rocks-s1-i00120-44.npz"
STACK = DATA / "gen_stack_ratio-s1-i00025-38.npz"


def problem_of(w: Any, q: Any, mu: Any, d: int, **more: Any) -> FrictionProblem:
    """A problem from a dense W."""
    rows = sparse.csr_array(np.array(w, dtype=np.float64))
    return FrictionProblem(d, rows.data, rows.indices, rows.indptr, np.array(q), np.array(mu), **more)


def block(q: Any, mu: float, **more: Any) -> FrictionProblem:
    """One contact with W = 1."""
    return problem_of(np.eye(len(q)), np.array(q, dtype=np.float64), [mu], len(q), **more)


def bodies(seed: int, contacts: int, d: int = 3) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Random M, H, G (two bilateral constraints), f and w of a few bodies; all dense."""
    draw = np.random.default_rng(seed)
    v = 6 * contacts
    a = draw.standard_normal((v, v))
    mass = a @ a.T + v * np.eye(v)
    h, g = draw.standard_normal((v, d * contacts)), draw.standard_normal((v, 2))
    return mass, h, g, draw.standard_normal(v), draw.standard_normal(d * contacts)


def write_matrix(group: h5py.Group, name: str, dense: Floats, form: str) -> None:
    """A matrix in one of the storages that FCLIB's files have."""
    place = group.create_group(name)
    if form in ("coo", "coo-header"):
        found = sparse.coo_array(dense)
        i, p = (found.row, found.col) if form == "coo" else (found.col, found.row)
        nz = found.nnz
    else:
        found = sparse.csc_array(dense) if form == "csc" else sparse.csr_array(dense)
        p, i, nz = found.indptr, found.indices, -1 if form == "csc" else -2
    for key, value in (("m", dense.shape[0]), ("n", dense.shape[1]), ("nzmax", found.nnz), ("nz", nz)):
        place.create_dataset(key, data=np.array([value], dtype=np.int32))
    for key, array in (("p", p.astype(np.int32)), ("i", i.astype(np.int32)), ("x", found.data)):
        place.create_dataset(key, data=array)


def write_fclib(path: Path, group: str, d: int, parts: dict[str, Floats], form: str) -> None:
    """A file of FCLIB's layout: matrices by upper case, vectors by lower case."""
    with h5py.File(path, "w") as file:
        top = file.create_group(group)
        top.create_dataset("spacedim", data=np.array([d], dtype=np.int32))
        vectors = top.create_group("vectors")
        for name, array in parts.items():
            if name.isupper():
                write_matrix(top, name, array, form)
            else:
                vectors.create_dataset(name, data=array)
        info = top.create_group("info")
        info.create_dataset("title", data=np.bytes_(b"made for a test"))
        info.attrs["numberOfDegreeOfFreedom"] = 12
