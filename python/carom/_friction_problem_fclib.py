"""Friction problems as FCLIB's HDF5, the exchange format of the Frictional Contact Library (fclib.h).

/fclib_local: spacedim, W, [V, R], vectors/{q, mu, [s]}, info;  /fclib_global: spacedim, M, H, [G],
vectors/{f, w, mu, [b]}, info;  /solution and /guesses/1 ..: r, u, [v, l]. A matrix is a group of m, n, nzmax,
nz, p, i, x with nz = -1 for compressed columns, -2 for compressed rows, else the count of triplets. In
triplets `i` is the row and `p` the column, as the library's users write them; the comment in fclib.h has it
the other way round, which is taken when only that fits. Files are not trusted: only datasets of the file
itself are read, and none before its size is known. Knows no physics.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from carom._friction_problem_body import BodyForm, without_bilaterals
from carom._friction_problem_npz import scalar, text
from carom._friction_problem_sparse import Csr, floats, from_compressed, from_scipy, from_triplets, wholes
from carom._space import Floats
from carom.errors import BuildError, refused

#: Largest dataset that is read [bytes].
MOST_BYTES = 1 << 31

LOCAL, GLOBAL = "fclib_local", "fclib_global"


def read_fclib(file: h5py.File) -> dict[str, Any]:
    """Arguments of a `FrictionProblem` from an open file.

    Raises
    ------
    BuildError
        Naming the dataset that is missing, too large or does not fit.
    """
    if LOCAL in file:
        return _read_local(_group(file, LOCAL))
    if GLOBAL in file:
        return _read_global(_group(file, GLOBAL))
    remedy = "give a file with one of these groups"
    raise BuildError(f"neither /{LOCAL} nor /{GLOBAL} is there; {remedy}", field=LOCAL, remedy=remedy)


def _read_local(group: h5py.Group) -> dict[str, Any]:
    vectors = _group(group, "vectors")
    w, q = _matrix(group, "W"), _vector(vectors, "q")
    if w.shape != (q.size, q.size):
        name = f"{group.name}/W"
        raise refused(None, name, f"must be square with {q.size} rows as q", w.shape, "give a square W")
    if "V" in group or "R" in group:
        v, r, s = _matrix(group, "V"), _matrix(group, "R"), _vector(vectors, "s")
        if v.shape != (q.size, s.size) or r.shape != (s.size, s.size):
            name, wanted = f"{group.name}/V", f"must be {(q.size, s.size)} and R {(s.size, s.size)}"
            raise refused(None, name, wanted, (v.shape, r.shape), "s has one entry per bilateral row")
        w, q = without_bilaterals(w.matrix, v.matrix, r.matrix, q, s)
    return {"data": w.data, "indices": w.indices, "indptr": w.indptr, "q": q, **_common(group, vectors)}


def _read_global(group: h5py.Group) -> dict[str, Any]:
    vectors = _group(group, "vectors")
    has_bilaterals = "G" in group
    try:
        body = BodyForm(
            _matrix(group, "M"),
            _matrix(group, "H"),
            _vector(vectors, "f"),
            _vector(vectors, "w"),
            _matrix(group, "G") if has_bilaterals else None,
            _vector(vectors, "b") if has_bilaterals else None,
        )
        w, q = body.reduced()
    except BuildError as error:
        if str(error).startswith("/"):
            raise
        raise BuildError(
            f"{group.name}: {error}", field=error.field, value=error.value, remedy=error.remedy
        ) from error
    return {
        "data": w.data, "indices": w.indices, "indptr": w.indptr, "q": q, "body_form": body,
        **_common(group, vectors),
    }  # fmt: skip


def _common(group: h5py.Group, vectors: h5py.Group) -> dict[str, Any]:
    name = f"{group.name}/spacedim"
    dimension = scalar(name, _dataset(group, "spacedim", 1))
    if dimension not in (2, 3):
        raise refused(None, name, "must be 2 or 3", dimension, "give the rows per contact")
    meta: dict[str, Any] = {}
    if "info" in group:
        info = _group(group, "info")
        for key in ("title", "description", "math_info"):
            if key in info:
                meta[key] = text(f"{info.name}/{key}", _dataset(info, key, 1))
        for key, value in info.attrs.items():
            if np.asarray(value).dtype.kind in "iuf" and np.asarray(value).size == 1:
                meta[key] = np.asarray(value).item()
    return {"dimension": dimension, "mu": _vector(vectors, "mu"), "name": meta.get("title", ""), "meta": meta}


def read_impulse(path: Path, which: str = "solution") -> Floats:
    """(n,) float64 array of impulses that a file keeps [N s]; `which` is "solution" or "guesses/1", ...

    Raises
    ------
    BuildError
        When there are none, or they are no numbers.
    OSError
        When the file cannot be read.
    """
    with h5py.File(path, "r") as file:
        group: h5py.Group = file
        for part in which.split("/"):
            group = _group(group, part)
        return _vector(group, "r")


def write_fclib(path: Path, problem: Any, impulse: Floats | None, *, whole: bool) -> None:
    """Writes a problem, local or with `whole` in its body form, and impulses as its solution.

    Raises
    ------
    BuildError
        For linear complementarity problems, and a body form that is not known.
    OSError
        When the path cannot be written.
    """
    if problem.dimension == 1:
        raise refused(None, "dimension", "must be 2 or 3 in FCLIB", 1, "save it as .npz")
    body: BodyForm | None = problem.body_form
    if whole and body is None:
        raise refused(None, "body_form", "must be known", None, "save the local form")
    with h5py.File(path, "w") as file:
        group = file.create_group(GLOBAL if whole else LOCAL)
        _whole_number(group, "spacedim", problem.dimension)
        vectors = group.create_group("vectors")
        if whole and body is not None:
            # compressed columns: readers of global problems take no compressed rows
            for name, matrix in (("M", body.mass), ("H", body.directions), ("G", body.bilateral)):
                if matrix is not None:
                    _write_matrix(group, name, matrix.matrix.tocsc(), -1)
            named = {"f": body.momentum, "w": body.offset, "mu": problem.mu, "b": body.bilateral_offset}
        else:
            _write_matrix(group, "W", problem.csr.matrix, -2)
            named = {"q": problem.q, "mu": problem.mu}
        for name, vector in named.items():
            if vector is not None:
                vectors.create_dataset(name, data=vector)
        info = group.create_group("info")
        for name, words in (("title", problem.name), ("description", problem.source), ("math_info", "")):
            _text(info, name, words)
        if impulse is not None:
            solution = file.create_group("solution")
            solution.create_dataset("r", data=impulse)
            solution.create_dataset("u", data=problem.csr.times(impulse) + problem.q)
            if whole and body is not None:
                velocity, bilateral = body.motion(impulse)
                solution.create_dataset("v", data=velocity)
                if bilateral.size:
                    solution.create_dataset("l", data=bilateral)


def _write_matrix(group: h5py.Group, name: str, matrix: Any, nz: int) -> None:
    place = group.create_group(name)
    for key, value in (("m", matrix.shape[0]), ("n", matrix.shape[1]), ("nzmax", matrix.nnz), ("nz", nz)):
        _whole_number(place, key, value)
    place.create_dataset("p", data=matrix.indptr.astype(np.int32))
    place.create_dataset("i", data=matrix.indices.astype(np.int32))
    place.create_dataset("x", data=matrix.data)


def _text(group: h5py.Group, name: str, words: str) -> None:
    """A text with the closing zero that readers in C count on."""
    written = words.encode("utf-8")
    group.create_dataset(name, data=written, dtype=h5py.string_dtype("utf-8", len(written) + 1))


def _whole_number(group: h5py.Group, name: str, value: int) -> None:
    group.create_dataset(name, data=np.array([value], dtype=np.int32))


def _matrix(group: h5py.Group, name: str) -> Csr:
    place = _group(group, name)
    where = str(place.name)
    m, n, nz = (scalar(f"{where}/{key}", _dataset(place, key, 1)) for key in ("m", "n", "nz"))
    if m < 0 or n < 0:
        raise refused(None, f"{where}/m", "and n must be >= 0", (m, n), "give rows and columns")
    if nz < -2:
        remedy = "-1: compressed columns, -2: compressed rows, else the count of triplets"
        raise refused(None, f"{where}/nz", "must be >= -2", nz, remedy)
    p, i = (wholes(f"{where}/{key}", _dataset(place, key)) for key in ("p", "i"))
    x = floats(f"{where}/x", _dataset(place, "x"))
    if nz >= 0:
        found = _triplets(where, p, i, x, nz, (m, n))
    else:
        # files may hold room for more values than there are
        used = int(p[-1]) if p.size and 0 <= p[-1] <= min(i.size, x.size) else max(i.size, x.size)
        shape = (n, m) if nz == -1 else (m, n)
        found = from_compressed(where, x[:used], i[:used], p, shape)
        found = from_scipy(where, found.matrix.T) if nz == -1 else found
    if int(np.asarray(place.attrs.get("symmetric_packed", 0)).reshape(-1)[0]) == 1:
        lower = found.matrix  # the lower triangle stands for both
        from scipy import sparse

        found = from_scipy(where, lower + lower.T - sparse.diags_array(lower.diagonal()))
    return found


def _triplets(
    where: str, p: npt.NDArray[np.int64], i: npt.NDArray[np.int64], x: Floats, nz: int, shape: tuple[int, int]
) -> Csr:
    if min(p.size, i.size, x.size) < nz:
        problem = f"must be at most {min(p.size, i.size, x.size)}, the entries of p, i and x"
        raise refused(None, f"{where}/nz", problem, nz, "give as many triplets")
    p, i, x = p[:nz], i[:nz], x[:nz]
    rows, columns = i, p
    if nz and not (rows.max() < shape[0] and columns.max() < shape[1]):
        rows, columns = p, i
    return from_triplets(where, rows, columns, x, shape)


def _vector(group: h5py.Group, name: str) -> Floats:
    return floats(f"{group.name.rstrip('/')}/{name}", _dataset(group, name))


def _group(parent: h5py.Group, name: str) -> h5py.Group:
    return _child(parent, name, h5py.Group, "group")


def _dataset(group: h5py.Group, name: str, most: int | None = None) -> Any:
    """The values of a dataset, whose size is looked at first."""
    where = f"{group.name.rstrip('/')}/{name}"
    dataset = _child(group, name, h5py.Dataset, "dataset")
    if dataset.external or dataset.is_virtual:
        raise refused(None, where, "must be kept in the file itself", "external data", "copy the data in")
    if dataset.shape is None:
        raise refused(None, where, "must hold values", None, "save the file again")
    size = math.prod(dataset.shape) * max(1, dataset.dtype.itemsize)
    if most is not None and math.prod(dataset.shape) > most:
        raise refused(None, where, "must be one value", dataset.shape, "give one value")
    if size > MOST_BYTES:
        raise refused(None, where, f"must be at most {MOST_BYTES} bytes", size, "split the problem")
    return dataset[()]


def _child(parent: h5py.Group, name: str, kind: type, word: str) -> Any:
    where = f"{parent.name.rstrip('/')}/{name}"
    if name not in parent:
        remedy = "the layout is FCLIB's"
        raise BuildError(f"{where} is missing; {remedy}", field=where, remedy=remedy)
    if not isinstance(parent.get(name, getlink=True), h5py.HardLink):
        raise refused(None, where, "must be in the file itself", "a link", "copy the data in")
    child = parent[name]
    if not isinstance(child, kind):
        raise refused(None, where, f"must be a {word}", type(child).__name__, "the layout is FCLIB's")
    return child
