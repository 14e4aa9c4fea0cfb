"""The contact problem as a value: matrices, solvers, residual, files (theory chapter 5, items 28-47).

Find impulses gamma with u = J (v + M^-1 J^T gamma) so that 0 <= gamma_n, u_n - target >= 0, not both
positive, and friction opposes the slip within its limit. Scalar rows come contact by contact, normal first,
then tangents; then general bounded rows; then moments of rolling and spinning friction. A velocity has the
linear components first. Knows no shapes and no time.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom._certificate import Certificate
from carom._problem_file import read_problem, write_problem
from carom._report import IslandReport
from carom._space import PLANAR, SPATIAL, Floats, Space, frozen, number, whole
from carom.errors import BuildError, refused, unknown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from carom._convergence import Convergence


class Residual(NamedTuple):
    """How far impulses are from solving a problem, by the natural map of the contact law.

    Attributes
    ----------
    absolute : largest over contacts and rows [m/s]
    relative : the same by the largest velocity that impulses had to change [1]
    worst : ("contact" | "row", index) where it is largest; None when it is 0 everywhere
    """

    absolute: float
    relative: float
    worst: tuple[str, int] | None


@dataclass(frozen=True, repr=False)
class Solution:
    """What a solver found.

    Attributes
    ----------
    solver : its name
    impulse : (k, d) float64 array, normal and tangential impulse of each contact, in its frame [N s]
    row_impulse : (r,) float64 array of the general rows
    moment : (m, 1|3) float64 array, moment of rolling and spinning friction of each contact that has it, in
        its frame: in space about the normal, then the tangents [N m s] (theory eqs. 3.24 to 3.26)
    velocity : (n, 3|6) float64 array after the impulses, linear then angular [m/s], [rad/s]
    residual, relative_residual, worst : see `Residual`
    iterations : spent, factorisations among them [1]
    factorisations : spent, by solvers with a budget of them [1]
    status : "converged", "out_of_iterations", "out_of_factorisations" or "refused"
    reason : why the method refused, else None; the impulses are then those it started from
    islands : `carom.IslandReport` of each island where anything pressed, from solvers that go by island;
        bodies that have no names are told by their rows
    strict_feasibility : when not solved and known, the largest t, at most the largest entry of q, with some
        impulses such that u_N >= mu |u_T| + t at every contact [m/s]; at or below 0 no solution need exist
    """

    solver: str
    impulse: Floats
    row_impulse: Floats
    velocity: Floats
    residual: float
    relative_residual: float
    worst: tuple[str, int] | None
    iterations: int
    factorisations: int
    status: str
    reason: str | None
    islands: tuple[IslandReport, ...] = ()
    moment: Floats = field(default_factory=lambda: np.zeros((0, 1)))
    strict_feasibility: float | None = None

    @property
    def flat(self) -> Floats:
        """All impulses in scalar order: contacts, general rows, moments [N s], [N m s]."""
        return np.concatenate([self.impulse.ravel(), self.row_impulse, self.moment.ravel()])

    @property
    def converged(self) -> bool:
        """Whether the residual is at or below the tolerance."""
        return self.status == "converged"

    def __repr__(self) -> str:
        why = f" ({self.reason})" if self.reason is not None else ""
        return (
            f"<Solution by {self.solver}: {len(self.impulse)} contacts, residual {self.residual:.1e} m/s, "
            f"{self.iterations} iterations, {self.status}{why}>"
        )


class ContactProblem:
    """Simultaneous contacts and bounded rows between bodies; does not change.

    From ``w.problem()``, from a file with `load`, or from plain numbers with `from_dict`.
    """

    __slots__ = ("_names", "_native", "_space")
    _native: Any
    _space: Space
    _names: tuple[str, ...]

    def __init__(self) -> None:
        raise TypeError("use w.problem(), ContactProblem.load(path) or ContactProblem.from_dict(table)")

    @classmethod
    def _of(cls, space: Space, native: Any, names: tuple[str, ...] = ()) -> Self:
        made = cls.__new__(cls)
        made._native, made._space, made._names = native, space, names
        return made

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Self:
        """A problem from the plain form of `to_dict`; arrays and sequences are taken.

        Raises
        ------
        BuildError
            Naming the entry that is missing, of a wrong count, or no physics, e.g. ``contacts[3].normal``.
        """
        space = {"planar": PLANAR, "spatial": SPATIAL}.get(str(table.get("space")))
        if space is None:
            remedy = 'give "planar" or "spatial"'
            raise refused(None, "space", 'must be "planar" or "spatial"', table.get("space"), remedy)
        plain = {key: value for key, value in table.items() if key != "names"}
        try:
            text = json.dumps(plain, default=_plain, allow_nan=False)
        except (TypeError, ValueError) as error:
            remedy = "give finite numbers and lists"
            raise BuildError(f"contact problem: {error}; {remedy}", field="table", remedy=remedy) from None
        return cls._of(space, space.problem.from_json(text), tuple(table.get("names", ())))

    def to_dict(self) -> dict[str, Any]:
        """The problem as plain values: space, masses, velocities, contacts, rows, friction_law, names."""
        table: dict[str, Any] = json.loads(self._native.to_json())
        return {**table, "names": list(self._names)}

    def save(self, path: str | Path) -> None:
        """Writes the problem as JSON (``.json``) or HDF5 (``.h5``, with units).

        Raises
        ------
        RunFileError
            For another suffix, and when the path cannot be written.
        """
        write_problem(Path(path), self.to_dict())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Reads a problem that `save` wrote, and checks it.

        Raises
        ------
        RunFileError
            When the file cannot be read as one.
        BuildError
            When its numbers are no contact problem.
        """
        return cls.from_dict(read_problem(Path(path)))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self).from_dict, (self.to_dict(),)

    @property
    def space(self) -> str:
        """ "planar" or "spatial"."""
        return self._space.name

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies, where known."""
        return self._names

    @property
    def n_bodies(self) -> int:
        """Number of bodies [1]."""
        return int(self._native.counts()[0])

    @property
    def n_contacts(self) -> int:
        """Number of contacts [1]."""
        return int(self._native.counts()[1])

    def __len__(self) -> int:
        return self.n_contacts

    @property
    def pairs(self) -> npt.NDArray[np.int64]:
        """(k, 2) int64 array, rows of bodies a and b."""
        return np.array(self._native.pairs(), dtype=np.int64).reshape(-1, 2)

    @property
    def A(self) -> Any:  # noqa: N802
        """Delassus matrix J M^-1 J^T over scalar rows: scipy.sparse csr_array [1/kg]."""
        return self._matrix("A")

    @property
    def J(self) -> Any:  # noqa: N802
        """Jacobian, scalar rows x (3 | 6) n: scipy.sparse csr_array."""
        return self._matrix("J")

    @property
    def inverse_mass_matrix(self) -> Any:
        """M^-1, block diagonal, world axes: scipy.sparse csr_array [1/kg], [1/(kg m^2)]."""
        return self._matrix("M")

    def _matrix(self, which: str) -> Any:
        from scipy import sparse

        values, columns, starts, shape = self._native.matrix(which)
        return sparse.csr_array((values, columns, starts), shape=shape)

    @property
    def b(self) -> Floats:
        """(rows,) float64 array, target - J v [m/s]: A gamma = b where every contact presses and sticks."""
        return frozen(self._native.vector("b"))

    @property
    def target(self) -> Floats:
        """(rows,) float64 array [m/s]: normal velocity that a pressed contact ends with, and the slip that it
        ends with inside its friction limit; 0 for moments."""
        return frozen(self._native.vector("target"))

    @property
    def friction(self) -> Floats:
        """(k,) float64 array, coefficients of friction [1]."""
        return frozen(self._native.vector("friction"))

    @property
    def restitution(self) -> Floats:
        """(k,) float64 array, coefficients of restitution [1]; contained in the targets already."""
        return frozen(self._native.vector("restitution"))

    @property
    def gap(self) -> Floats:
        """(k,) float64 array, distance of the surfaces [m]; negative for overlap."""
        return frozen(self._native.vector("gap"))

    def solve(
        self,
        solver: str = "pgs",
        *,
        iterations: int = 100,
        tolerance: float = 1e-6,
        factorisations: int = 2000,
        impulses: str = "any",
        friction_law: str | None = None,
        start: npt.ArrayLike | None = None,
    ) -> Solution:
        """Solves the problem, without the interpreter's lock.

        Parameters
        ----------
        solver : one of `carom.SOLVERS`
        iterations : most to spend [1]
        tolerance : residual at which to stop [m/s]; 0 spends all iterations
        factorisations : most to spend, by solvers that factorise [1]
        impulses : "any" of those that solve the problem, or those of "minimum_norm" [N s], which depend
            neither on the order of contacts nor on the start; found by "exact" and "auto"
        friction_law : "disc" or "box"; the problem's own when absent
        start : impulses to start from, as `Solution.impulse` (with rows: flat, in scalar order) [N s]

        Raises
        ------
        BuildError
            For an unknown solver or law, and numbers out of range.

        KeyboardInterrupt
            After Ctrl-C in a long solve.

        A method that cannot solve the problem says so in the solution's status and reason.
        """
        if solver not in _carom.SOLVERS:
            raise unknown("solver", str(solver), _carom.SOLVERS)
        most = whole(iterations, "iterations", "give the most iterations to spend")
        limit = number(tolerance, "tolerance", "m/s")
        if most < 1 or not limit >= 0:
            field, value = ("iterations", most) if most < 1 else ("tolerance", limit)
            raise refused(None, field, "must be >= 1" if most < 1 else "must be >= 0", value, "see its unit")
        factors = whole(factorisations, "factorisations", "give the most factorisations to spend")
        if factors < 0:
            raise refused(None, "factorisations", "must be >= 0", factors, "give the most to spend")
        flat = None if start is None else self._flat(start, "start")
        found = self._native.solve(str(solver), (most, factors), limit, str(impulses), friction_law, flat)
        split = self.n_contacts * self._space.dimension
        moments = split + self._native.counts()[2]
        residual = Residual(*found["residual"])
        return Solution(
            solver=str(solver),
            impulse=found["impulse"][:split].reshape(-1, self._space.dimension),
            row_impulse=found["impulse"][split:moments],
            moment=found["impulse"][moments:].reshape(-1, self._space.spins),
            velocity=found["velocity"],
            residual=residual.absolute,
            relative_residual=residual.relative,
            worst=residual.worst,
            iterations=found["iterations"],
            factorisations=found["factorisations"],
            status=found["status"],
            reason=found["reason"],
            islands=tuple(self._island(fields) for fields in found["islands"]),
            strict_feasibility=found["strict_feasibility"],
        )

    def residual(self, impulse: npt.ArrayLike, *, friction_law: str | None = None) -> Residual:
        """Residual of any impulses: the one number that judges every solver.

        Parameters
        ----------
        impulse : (k, d), or flat in scalar order with rows and moments [N s]
        friction_law : "disc" or "box"; the problem's own when absent

        Raises
        ------
        BuildError
            For a wrong count.
        """
        return Residual(*self._native.residual(self._flat(impulse, "impulse"), friction_law))

    def residuals(self, impulse: npt.ArrayLike, *, friction_law: str | None = None) -> Floats:
        """Residual of every contact for any impulses: where an answer is off, and by how much.

        Parameters
        ----------
        impulse : (k, d), or flat in scalar order with rows and moments [N s]
        friction_law : "disc" or "box"; the problem's own when absent

        Returns
        -------
        (k,) float64 array [m/s]; rolling and spinning friction count with their contact.

        Raises
        ------
        BuildError
            For a wrong count.
        """
        found: Floats = frozen(self._native.residuals(self._flat(impulse, "impulse"), friction_law))
        return found

    def _island(self, fields: tuple[Any, ...]) -> IslandReport:
        contacts, rows, bodies, first, residual, relative, worst, stages, why, feasible = fields

        def name(body: int) -> str:
            return self._names[body] if self._names else str(body)

        pair = None if worst is None else (name(worst[0]), name(worst[1]))
        return IslandReport._told(
            (contacts, rows, bodies, name(first), residual, relative, pair, stages, why, feasible)
        )

    def certificate(
        self, impulse: npt.ArrayLike, *, friction_law: str | None = None, island: int | str | None = None
    ) -> Certificate:
        """The certificate of any impulses, measured from them and the problem alone.

        Parameters
        ----------
        impulse : (k, d), or flat in scalar order with rows and moments [N s]
        friction_law : "disc" or "box"; the problem's own when absent
        island : row or name of a body whose island alone is meant; contacts keep their numbers

        Raises
        ------
        BuildError
            For a wrong count, and when nothing touches the body of the island.
        """
        body: int | None
        if isinstance(island, str):
            body = self._names.index(island) if island in self._names else self.n_bodies
        else:
            body = None if island is None else whole(island, "island", "give a body's row")
        known = body is None or 0 <= body < self.n_bodies
        flat = self._flat(impulse, "impulse")
        found = self._native.certificate(flat, friction_law, body) if known else None
        if found is None:
            remedy = "name a body that has contacts"
            raise refused(None, "island", "must be a touching body", island, remedy)
        made = Certificate.from_json(found)
        if made.worst_bodies is None or not self._names:
            return made
        a, b = made.worst_bodies
        return replace(made, worst_names=(self._names[a], self._names[b]))

    def _flat(self, value: npt.ArrayLike, field: str) -> list[float]:
        _, contacts, rows, resistances = self._native.counts()
        count = contacts * self._space.dimension + rows + resistances * self._space.spins
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.full(1, np.nan)
        if array.size != count or not np.isfinite(array).all():
            remedy = (
                f"give ({contacts}, {self._space.dimension}) finite numbers: normal, then tangents, in N s"
            )
            raise refused(None, field, f"must be {count} finite numbers", value, remedy)
        flat: list[float] = array.ravel().tolist()
        return flat

    def spy(self, ax: Axes | None = None) -> Axes:
        """Draws A: size by colour, or its pattern alone when it is large.

        Parameters
        ----------
        ax : axes to draw into; a figure of its own when absent
        """
        from matplotlib.figure import Figure

        from carom._plot_problem import spy

        axes = ax if ax is not None else Figure(figsize=(6.5, 6.0), layout="constrained").add_subplot()
        matrix = self.A
        axes.set_title(f"A = J M⁻¹ Jᵀ: {matrix.shape[0]} rows, {matrix.nnz} entries", fontsize="medium")
        spy(matrix, axes, "1/kg", "scalar row")
        return axes

    def convergence(
        self,
        solvers: Sequence[str] = ("pgs", "nncg", "apgd", "exact"),
        *,
        iterations: int = 1000,
        tolerance: float = 1e-12,
        repeats: int = 1,
    ) -> tuple[Convergence, ...]:
        """How the residual falls while solvers work: a solve for each of a growing series of budgets.

        Parameters
        ----------
        solvers : names, of `carom.SOLVERS`
        iterations : largest budget; of factorisations for "exact" [1]
        tolerance : residual at which a solver's series ends [m/s]
        repeats : how often each solve is timed; the best counts [1]

        Returns
        -------
        A `Convergence` per solver, with iterations, residuals [m/s] and wall times [s], each of one solve.

        Raises
        ------
        BuildError
            For an unknown solver and numbers out of range.
        """
        from carom._convergence import converge

        return converge(self, solvers, iterations=iterations, tolerance=tolerance, repeats=repeats)

    def plot(
        self,
        solvers: Sequence[str] = ("pgs", "nncg", "apgd", "exact"),
        *,
        iterations: int = 1000,
        tolerance: float = 1e-12,
        repeats: int = 1,
    ) -> Figure:
        """A figure: the pattern of A, and `convergence` against iterations and against time."""
        from carom._plot_problem import plot_problem

        curves = self.convergence(solvers, iterations=iterations, tolerance=tolerance, repeats=repeats)
        return plot_problem(self, curves)

    def __repr__(self) -> str:
        bodies, contacts, rows, _ = self._native.counts()
        general = f", {rows} general rows" if rows else ""
        return f"<{self.space} ContactProblem: {contacts} contacts{general} between {bodies} bodies>"


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} is no plain value")
