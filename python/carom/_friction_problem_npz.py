"""Friction problems as numpy's ``.npz``.

Entries: kind, name, source, d, W_data, W_indices, W_indptr, W_shape, q, mu, meta; for friction problems (kind
"friction", d = 2 or 3) and linear complementarity problems (kind "lcp", d = 1, no mu). Ours may add `target`,
and the body form as body_M_*, body_H_*, body_G_*, body_f, body_w, body_b. Files are not trusted: sizes are
checked before anything is unpacked. Knows no physics.
"""

from __future__ import annotations

import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from carom._friction_problem_sparse import Csr
from carom.errors import BuildError, refused

#: Largest file, unpacked, that is read [bytes].
MOST_BYTES = 1 << 32
#: Longest text that is read [characters].
LONGEST = 1 << 20

_TEXTS = ("kind", "name", "source", "meta")
_NEEDED = ("kind", "d", "W_data", "W_indices", "W_indptr", "W_shape", "q")
_BODY = ("M", "H", "G")
_BODY_VECTORS = ("f", "w", "b")


def read_npz(path: Path) -> dict[str, Any]:
    """Arrays and texts of a file as they stand, by name; not yet checked to be a problem.

    Raises
    ------
    BuildError
        Naming the entry that is missing, too large, or no plain array.
    OSError, zipfile.BadZipFile, ValueError, EOFError
        When the file is no such archive.
    """
    known = {*_TEXTS, *_NEEDED, "mu", "target"}
    known |= {f"body_{name}_{part}" for name in _BODY for part in ("data", "indices", "indptr", "shape")}
    known |= {f"body_{name}" for name in _BODY_VECTORS}
    found: dict[str, Any] = {}
    with zipfile.ZipFile(path) as archive:
        members = {info.filename: info for info in archive.infolist()}
        wanted = {name: members[f"{name}.npy"] for name in sorted(known) if f"{name}.npy" in members}
        total = sum(info.file_size for info in wanted.values())
        if total > MOST_BYTES:
            raise refused(None, "size", f"must be at most {MOST_BYTES} bytes", total, "split the problem")
        for name, info in wanted.items():
            found[name] = _array(archive, name, info)
    for name in _NEEDED:
        if name not in found:
            remedy = f"the format has {', '.join(_NEEDED)}, and mu for kind 'friction'"
            raise BuildError(f"{name} is missing; {remedy}", field=name, remedy=remedy)
    return found


def _array(archive: zipfile.ZipFile, name: str, info: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """One entry; what its header promises must be what it holds."""
    header = np.lib.format
    with archive.open(info) as stream:
        version = header.read_magic(stream)
        read = header.read_array_header_1_0 if version == (1, 0) else header.read_array_header_2_0
        shape, _, dtype = read(stream)
        before = stream.tell()
    if dtype.hasobject:
        raise refused(None, name, "must hold plain numbers or text", str(dtype), "save it without objects")
    if any(side < 0 for side in shape) or math.prod(shape) * dtype.itemsize != info.file_size - before:
        remedy = "save the file again"
        raise refused(None, name, f"must hold {info.file_size - before} bytes", f"{dtype} {shape}", remedy)
    with archive.open(info) as stream:
        array: npt.NDArray[Any] = header.read_array(stream, allow_pickle=False)
    return array


def problem_arguments(found: dict[str, Any]) -> dict[str, Any]:
    """Arguments of a `FrictionProblem` from what a file holds.

    Raises
    ------
    BuildError
        Naming the entry that does not fit.
    """
    texts = {name: text(name, found.get(name, "")) for name in _TEXTS}
    if texts["kind"] not in ("friction", "lcp"):
        raise refused(None, "kind", "must be 'friction' or 'lcp'", texts["kind"], "give one of these")
    d = scalar("d", found["d"])
    wanted = (1,) if texts["kind"] == "lcp" else (2, 3)
    if d not in wanted:
        problem = f"must be {' or '.join(map(str, wanted))} for kind {texts['kind']!r}"
        raise refused(None, "d", problem, d, "give the rows per contact")
    q = np.atleast_1d(found["q"])
    if "mu" not in found and texts["kind"] == "friction":
        raise BuildError("mu is missing; give a coefficient per contact", field="mu",
                         remedy="give a coefficient per contact")  # fmt: skip
    mu = np.zeros(q.size) if texts["kind"] == "lcp" else found["mu"]
    shape = np.atleast_1d(found["W_shape"]).tolist()
    if shape != [q.size, q.size]:
        problem = f"must be {(q.size, q.size)}, q has {q.size} entries"
        raise refused(None, "W_shape", problem, shape, "give a square W and as many velocities")
    return {
        "dimension": d, "data": found["W_data"], "indices": found["W_indices"], "indptr": found["W_indptr"],
        "q": q, "mu": mu, "name": texts["name"], "source": texts["source"], "meta": _meta(texts["meta"]),
        "target": found.get("target"),
    }  # fmt: skip


def text(name: str, value: Any) -> str:
    """A text of a file, refused when it is none or too long."""
    plain = value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
    if isinstance(plain, bytes):
        plain = plain.decode("utf-8", "replace")
    if not isinstance(plain, str) or len(plain) > LONGEST:
        raise refused(None, name, f"must be a text of at most {LONGEST} characters", plain, "give a text")
    return plain


def scalar(name: str, value: Any) -> int:
    """A whole number of a file."""
    array = np.asarray(value)
    if array.size != 1 or array.dtype.kind not in "iu":
        raise refused(None, name, "must be one whole number", value, "give a whole number")
    return int(array.reshape(-1)[0])


def _meta(given: str) -> dict[str, Any]:
    """The table of a JSON text; what is no table is kept as text."""
    if not given:
        return {}
    try:
        table = json.loads(given)
    except (ValueError, RecursionError):
        return {"text": given}
    return table if isinstance(table, dict) else {"text": given}


def write_npz(path: Path, arrays: dict[str, Any]) -> None:
    """Writes arrays and texts by name."""
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def csr_arrays(prefix: str, matrix: Csr) -> dict[str, Any]:
    """The four arrays of a matrix by name."""
    return {
        f"{prefix}_data": matrix.data, f"{prefix}_indices": matrix.indices,
        f"{prefix}_indptr": matrix.indptr, f"{prefix}_shape": np.array(matrix.shape, dtype=np.int64),
    }  # fmt: skip
