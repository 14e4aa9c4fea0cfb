"""Sparse matrices in compressed rows as plain arrays, checked as they come in.

Row i holds values data[indptr[i]:indptr[i + 1]] in the columns of the same range of `indices`. Columns ascend
within a row and occur once. Knows no contacts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from carom._space import Floats, frozen
from carom.errors import BuildError, refused

Wholes = npt.NDArray[np.int64]

_COMPRESSED = "give the arrays of a compressed matrix: starts ascend from 0 to the count of values"


@dataclass(frozen=True, eq=False)
class Csr:
    """A sparse matrix in compressed rows; arrays are read-only.

    Attributes
    ----------
    data : (z,) float64 array
    indices : (z,) int64 array, column of each value
    indptr : (rows + 1,) int64 array, first value of each row
    shape : rows and columns
    """

    data: Floats
    indices: Wholes
    indptr: Wholes
    shape: tuple[int, int]

    @property
    def rows(self) -> Wholes:
        """(z,) int64 array, row of each value."""
        return np.repeat(np.arange(self.shape[0]), np.diff(self.indptr))

    @property
    def matrix(self) -> Any:
        """The same as scipy.sparse csr_array.

        Raises
        ------
        ImportError
            Without scipy.
        """
        try:
            from scipy import sparse
        except ImportError as error:
            raise ImportError("matrices need scipy; install it with `pip install scipy`") from error
        return sparse.csr_array((self.data, self.indices, self.indptr), shape=self.shape)

    def times(self, x: Floats) -> Floats:
        """The product with a vector."""
        products = np.bincount(self.rows, weights=self.data * x[self.indices], minlength=self.shape[0])
        return products.astype(np.float64)  # of no values, counts are whole


def from_compressed(name: str, data: Any, indices: Any, indptr: Any, shape: Any) -> Csr:
    """A matrix from compressed rows.

    Parameters
    ----------
    name : for messages, e.g. "W"

    Raises
    ------
    BuildError
        Naming the array, e.g. ``W.indices``, that is no part of such a matrix.
    """
    size = checked_shape(name, shape)
    values = floats(f"{name}.data", data)
    columns = wholes(f"{name}.indices", indices)
    starts = wholes(f"{name}.indptr", indptr)
    if starts.shape != (size[0] + 1,):
        raise refused(None, f"{name}.indptr", f"must have {size[0] + 1} entries", starts.size, _COMPRESSED)
    if columns.shape != values.shape:
        problem = f"must have as many entries as data, {values.size}"
        raise refused(None, f"{name}.indices", problem, columns.size, _COMPRESSED)
    if starts[0] != 0 or starts[-1] != values.size or (np.diff(starts) < 0).any():
        raise refused(None, f"{name}.indptr", f"must ascend from 0 to {values.size}", starts, _COMPRESSED)
    within(f"{name}.indices", columns, size[1])
    rows = np.repeat(np.arange(size[0]), np.diff(starts))
    follows = (columns[1:] > columns[:-1]) | (rows[1:] > rows[:-1])
    if follows.all():
        return Csr(frozen(values), _still(columns), _still(starts), size)
    return _assembled(rows, columns, values, size)


def from_triplets(name: str, rows: Any, columns: Any, data: Any, shape: Any) -> Csr:
    """A matrix from triplets; values of one place are added up.

    Raises
    ------
    BuildError
        Naming the array with an entry that does not fit.
    """
    size = checked_shape(name, shape)
    values = floats(f"{name}.data", data)
    places = []
    for which, given, limit in (("rows", rows, size[0]), ("columns", columns, size[1])):
        place = wholes(f"{name}.{which}", given)
        if place.shape != values.shape:
            problem = f"must have as many entries as data, {values.size}"
            raise refused(None, f"{name}.{which}", problem, place.size, "give one row and column per value")
        within(f"{name}.{which}", place, limit)
        places.append(place)
    return _assembled(places[0], places[1], values, size)


def from_scipy(name: str, matrix: Any) -> Csr:
    """A matrix from any scipy.sparse matrix."""
    rows = matrix.tocsr()
    return from_compressed(name, rows.data, rows.indices, rows.indptr, rows.shape)


def _assembled(rows: Wholes, columns: Wholes, values: Floats, shape: tuple[int, int]) -> Csr:
    """Sorts by row and column and adds up what shares a place."""
    order = np.lexsort((columns, rows))
    rows, columns, values = rows[order], columns[order], values[order]
    is_first = np.ones(rows.size, dtype=bool)
    is_first[1:] = (rows[1:] != rows[:-1]) | (columns[1:] != columns[:-1])
    firsts = np.flatnonzero(is_first)
    data = np.add.reduceat(values, firsts) if firsts.size else np.zeros(0)
    starts = np.zeros(shape[0] + 1, dtype=np.int64)
    np.cumsum(np.bincount(rows[firsts], minlength=shape[0]), out=starts[1:])
    return Csr(frozen(data), _still(columns[firsts]), _still(starts), shape)


def checked_shape(name: str, shape: Any) -> tuple[int, int]:
    """Two counts >= 0."""
    sizes = wholes(f"{name}.shape", shape)
    if sizes.shape != (2,) or (sizes < 0).any():
        raise refused(None, f"{name}.shape", "must be two counts >= 0", sizes, "give rows and columns")
    return int(sizes[0]), int(sizes[1])


def floats(field: str, values: Any) -> Floats:
    """A one-dimensional array of finite numbers, copied."""
    remedy = "give finite numbers"
    try:
        array = np.array(values)
        found = array.astype(np.float64) if array.dtype.kind in "fiu" or not array.size else None
    except (TypeError, ValueError, OverflowError, BuildError):
        found = None
    if found is None or found.ndim != 1:
        raise refused(None, field, "must be a list of numbers", _kind_of(values), remedy)
    is_bad = ~np.isfinite(found)
    if is_bad.any():
        first = int(np.argmax(is_bad))
        raise refused(None, f"{field}[{first}]", "must be finite", float(found[first]), remedy)
    return found


def wholes(field: str, values: Any) -> Wholes:
    """A one-dimensional array of whole numbers, copied."""
    try:
        array = np.array(values)
    except (TypeError, ValueError, OverflowError):
        array = np.array(None)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise refused(None, field, "must be a list of whole numbers", _kind_of(values), "give whole numbers")
    if array.size and array.dtype.kind == "u" and array.max() > np.iinfo(np.int64).max:
        raise refused(None, field, "must be below 2^63", int(array.max()), "give whole numbers")
    return array.astype(np.int64)


def within(field: str, places: Wholes, limit: int) -> None:
    """Refuses places outside 0 .. limit - 1."""
    is_bad = (places < 0) | (places >= limit)
    if is_bad.any():
        first = int(np.argmax(is_bad))
        problem = f"must be in 0 .. {limit - 1}"
        raise refused(None, f"{field}[{first}]", problem, int(places[first]), "count rows and columns from 0")


def _still(array: Wholes) -> Wholes:
    array.flags.writeable = False
    return array


def _kind_of(values: Any) -> Any:
    """What was given, in few words."""
    return f"{values.dtype} array of shape {values.shape}" if isinstance(values, np.ndarray) else values
