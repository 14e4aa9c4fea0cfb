"""Problem files: the collection's .npz, and the flat binary that the timed programs read."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy

from bench_contact.measure import Problem


def from_npz(path: Path) -> Problem:
    """A problem of a collection: d, W_data, W_indices, W_indptr, q, mu; KeyError for a missing array."""
    with numpy.load(path, allow_pickle=False) as file:
        q = numpy.asarray(file["q"], dtype=float)
        d = int(file["d"])
        friction = numpy.asarray(file["mu"], dtype=float) if "mu" in file.files else numpy.zeros(len(q) // d)
        starts, columns = file["W_indptr"].astype(numpy.int64), file["W_indices"].astype(numpy.int64)
        return Problem(path.stem, d, starts, columns, numpy.asarray(file["W_data"], dtype=float), q, friction)


def from_flat(path: Path) -> Problem:
    """A problem of a flat file. Raises ValueError when the file is cut short."""
    data = path.read_bytes()
    d, nc, nnz = struct.unpack_from("<iii", data)
    place = 12
    arrays = []
    for kind, count in (("<i4", d * nc + 1), ("<i4", nnz), ("<f8", nnz), ("<f8", d * nc), ("<f8", nc)):
        arrays.append(numpy.frombuffer(data, kind, count, place))
        place += arrays[-1].nbytes
    starts, columns = arrays[0].astype(numpy.int64), arrays[1].astype(numpy.int64)
    return Problem(path.stem, d, starts, columns, arrays[2], arrays[3], arrays[4])


def to_flat(problem: Problem, path: Path) -> None:
    """Writes a flat file."""
    with path.open("wb") as file:
        file.write(struct.pack("<iii", problem.rows_per_contact, problem.contacts, len(problem.values)))
        for values, kind in (
            (problem.starts, "<i4"),
            (problem.columns, "<i4"),
            (problem.values, "<f8"),
            (problem.velocity, "<f8"),
            (problem.friction, "<f8"),
        ):
            file.write(values.astype(kind).tobytes())


def read(path: Path) -> Problem:
    """A problem of either format."""
    return from_npz(path) if path.suffix == ".npz" else from_flat(path)
