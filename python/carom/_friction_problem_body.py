"""The body form of a friction problem, and its reduction to contact space.

M v = H r + G l + f, G^T v + b = 0, u = H^T v + w: masses M, contact directions H, bilateral constraints G
with multipliers l (the "global" problem of FCLIB). Eliminating v and l leaves u = W r + q with

    [ M  -G ] [X v0]   [H  f]
    [G^T  0 ] [* * ] = [0 -b],   W = H^T X,   q = H^T v0 + w,

without G W = H^T M^-1 H and q = H^T M^-1 f + w. In contact space u = W r + V l + q, V^T r + R l + s = 0
becomes W - V R^-1 V^T and q - V R^-1 s. Knows no files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from carom._friction_problem_sparse import Csr, from_scipy
from carom._space import Floats
from carom.errors import BuildError, refused

if TYPE_CHECKING:
    from carom._friction_problem import FrictionProblem
    from carom._problem import ContactProblem

    Problem = TypeVar("Problem", bound=FrictionProblem)

#: Largest block of a mass matrix that is inverted as it stands; larger ones are factorised with all others.
MOST_IN_BLOCK = 12
#: Right-hand sides that are solved at a time.
AT_A_TIME = 256
#: Most entries of a W that a reduction may make [1].
MOST_ENTRIES = 1 << 28


@dataclass(frozen=True, eq=False)
class BodyForm:
    """M v = H r + G l + f, G^T v + b = 0, u = H^T v + w.

    Attributes
    ----------
    mass : (v, v) M [kg], [kg m^2]
    directions : (v, n) H
    momentum : (v,) float64 array f [N s]
    offset : (n,) float64 array w [m/s]
    bilateral : (v, p) G, or None
    bilateral_offset : (p,) float64 array b [m/s], or None
    """

    mass: Csr
    directions: Csr
    momentum: Floats
    offset: Floats
    bilateral: Csr | None = None
    bilateral_offset: Floats | None = None

    def __post_init__(self) -> None:
        """Checks that shapes fit."""
        v, n = self.directions.shape
        pairs = [
            ("M", self.mass.shape, (v, v)),
            ("f", self.momentum.shape, (v,)),
            ("w", self.offset.shape, (n,)),
        ]
        if (self.bilateral is None) != (self.bilateral_offset is None):
            raise refused(None, "G", "must come with b", None, "give G and b, or neither")
        if self.bilateral is not None and self.bilateral_offset is not None:
            p = self.bilateral.shape[1]
            pairs += [("G", self.bilateral.shape, (v, p)), ("b", self.bilateral_offset.shape, (p,))]
        for name, given, wanted in pairs:
            if given != wanted:
                raise refused(None, name, f"must have shape {wanted}", given, f"H has shape {(v, n)}")

    def reduced(self) -> tuple[Csr, Floats]:
        """W and q.

        Raises
        ------
        BuildError
            When M, or M with G, is singular.
        """
        if self.bilateral is not None and self.bilateral.shape[1]:
            return self._reduced_with_bilaterals()
        h, w = self.directions.matrix.tocsc(), self.offset
        inverse = _block_inverse(self.mass.matrix, "M")
        if inverse is not None:
            x = inverse @ h
            return from_scipy("W", h.T @ x), h.T @ (inverse @ self.momentum) + w
        factor = _factorised(self.mass.matrix, "M")
        return _products(h, factor, h), h.T @ factor.solve(self.momentum) + w

    def _reduced_with_bilaterals(self) -> tuple[Csr, Floats]:
        from scipy import sparse

        assert self.bilateral is not None
        assert self.bilateral_offset is not None
        h, p = self.directions.matrix.tocsc(), self.bilateral.shape[1]
        factor = _factorised(self._with_bilaterals(self.bilateral), "M with G")
        padded = sparse.vstack([h, sparse.csc_array((p, h.shape[1]))], format="csc")
        still = factor.solve(np.concatenate([self.momentum, -self.bilateral_offset]))
        return _products(padded, factor, padded), h.T @ still[: h.shape[0]] + self.offset

    def motion(self, impulse: Floats) -> tuple[Floats, Floats]:
        """(v,) velocities of the bodies after the impulses [m/s], [rad/s], and (p,) bilateral impulses [N s].

        Raises
        ------
        BuildError
            When M, or M with G, is singular.
        """
        load = self.directions.times(impulse) + self.momentum
        if self.bilateral is not None and self.bilateral_offset is not None and self.bilateral.shape[1]:
            both = np.concatenate([load, -self.bilateral_offset])
            found = _factorised(self._with_bilaterals(self.bilateral), "M with G").solve(both)
            return np.asarray(found[: load.size]), np.asarray(found[load.size :])
        inverse = _block_inverse(self.mass.matrix, "M")
        found = inverse @ load if inverse is not None else _factorised(self.mass.matrix, "M").solve(load)
        return np.asarray(found), np.zeros(0)

    def _with_bilaterals(self, bilateral: Csr) -> Any:
        """The matrix of bodies and bilateral impulses together."""
        from scipy import sparse

        g = bilateral.matrix
        return sparse.block_array([[self.mass.matrix, -g], [g.T, None]], format="csc")


def _block_inverse(matrix: Any, name: str) -> Any:
    """The inverse of a matrix of small independent blocks as sparse matrix; None when blocks are large."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(matrix, directed=False)
    sizes = np.bincount(label, minlength=count)
    if not count or sizes.max() > MOST_IN_BLOCK:
        return None if count else sparse.csr_array(matrix.shape)
    order = np.argsort(label, kind="stable")
    starts = np.concatenate([[0], np.cumsum(sizes)])
    place = np.empty(label.size, dtype=np.int64)
    place[order] = np.arange(label.size) - starts[label[order]]
    entries = matrix.tocoo()
    rows, columns, values = [], [], []
    for size in np.unique(sizes):
        blocks = np.flatnonzero(sizes == size)
        number = np.full(count, -1)
        number[blocks] = np.arange(blocks.size)
        mine = number[label[entries.row]] >= 0
        dense = np.zeros((blocks.size, size, size))
        at = number[label[entries.row[mine]]]
        np.add.at(dense, (at, place[entries.row[mine]], place[entries.col[mine]]), entries.data[mine])
        members = order[starts[blocks][:, None] + np.arange(size)]
        try:
            inverse = np.linalg.inv(dense)
        except np.linalg.LinAlgError:
            raise _singular(name) from None
        rows.append(np.repeat(members, size, axis=1).ravel())
        columns.append(np.tile(members, (1, size)).ravel())
        values.append(inverse.ravel())
    data = np.concatenate(values)
    if not np.isfinite(data).all():
        raise _singular(name)
    kept = data != 0
    places = (np.concatenate(rows)[kept], np.concatenate(columns)[kept])
    return sparse.csr_array(sparse.coo_array((data[kept], places), shape=matrix.shape))


def _factorised(matrix: Any, name: str) -> Any:
    from scipy.sparse.linalg import splu

    try:
        return splu(matrix.tocsc())
    except RuntimeError:
        raise _singular(name) from None


def _products(left: Any, factor: Any, right: Any) -> Csr:
    """left^T A^-1 right of a factorised A, a few columns at a time."""
    from scipy import sparse

    parts, entries = [], 0
    for begin in range(0, right.shape[1], AT_A_TIME):
        solved = factor.solve(right[:, begin : begin + AT_A_TIME].toarray())
        part = sparse.csc_array(left.T @ solved)
        entries += part.nnz
        if entries > MOST_ENTRIES:
            problem = f"would have more than {MOST_ENTRIES} entries"
            raise refused(None, "W", problem, entries, "keep the problem in body form, or split it")
        parts.append(part)
    found = sparse.hstack(parts, format="csr") if parts else sparse.csr_array((left.shape[1], 0))
    if not np.isfinite(found.data).all():
        raise _singular("M")
    return from_scipy("W", found)


def _singular(name: str) -> BuildError:
    remedy = "every body needs mass and inertia, and bilateral constraints must not repeat each other"
    return BuildError(f"{name} is singular; {remedy}", field=name, remedy=remedy)


def without_bilaterals(w: Any, v: Any, r: Any, q: Floats, s: Floats) -> tuple[Csr, Floats]:
    """W - V R^-1 V^T and q - V R^-1 s of scipy matrices.

    Raises
    ------
    BuildError
        When R is singular: bilateral constraints that repeat each other have no unique multipliers.
    """
    factor = _factorised(r, "R")
    solved = factor.solve(v.T.toarray())
    if not np.isfinite(solved).all():
        raise _singular("R")
    from scipy import sparse

    return from_scipy("W", w - sparse.csr_array(v @ solved)), q - v @ factor.solve(s)


def reduced_contact_problem(cls: type[Problem], problem: ContactProblem, name: str, source: str) -> Problem:
    """See `FrictionProblem.from_problem`."""
    table = problem.to_dict()
    dimension = 2 if problem.space == "planar" else 3
    if table["friction_law"] == "box" and dimension == 3:
        remedy = 'use friction_law = "disc"'
        raise refused(None, "friction_law", "must be the disc of Coulomb's cones", "box", remedy)
    n = dimension * problem.n_contacts
    for number, row in enumerate(table["rows"]):
        if not (float(row["lo"]) == -np.inf and float(row["hi"]) == np.inf):
            raise refused(
                None, f"rows[{number}]", "must be bilateral", (row["lo"], row["hi"]),
                "only rows without bounds can be eliminated",
            )  # fmt: skip
    a, q, target = problem.A, -problem.b, problem.target
    w, reduced = from_scipy("W", a[:n, :n]), q[:n]
    if table["rows"]:
        w, reduced = without_bilaterals(a[:n, :n], a[:n, n:], a[n:, n:], q[:n], q[n:])
    return cls(
        dimension, w.data, w.indices, w.indptr, reduced, problem.friction, name=name, source=source,
        target=target[:n], body_form=_body_form(problem, table, n),
    )  # fmt: skip


def _body_form(problem: ContactProblem, table: dict[str, Any], n: int) -> BodyForm:
    """The bodies that impulses move; what obstacles do is in w."""
    from scipy import sparse

    inverse = problem.inverse_mass_matrix
    moves = np.diff(inverse.indptr) > 0
    moves &= np.asarray(abs(inverse).sum(axis=1)).ravel() > 0
    j, target = problem.J.tocsc(), problem.target
    velocity = np.array(
        [[*v["linear"], *np.atleast_1d(v["angular"])] for v in table["velocities"]], dtype=np.float64
    ).ravel()
    driven = j[:, ~moves] @ velocity[~moves] - target
    mass = _block_inverse(inverse[moves][:, moves], "M^-1")
    free = sparse.csc_array(j[:, moves].T)
    rows = from_scipy("G", free[:, n:]) if table["rows"] else None
    return BodyForm(
        from_scipy("M", mass), from_scipy("H", free[:, :n]), mass @ velocity[moves], driven[:n],
        rows, driven[n:] if rows is not None else None,
    )  # fmt: skip
