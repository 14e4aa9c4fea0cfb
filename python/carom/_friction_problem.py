"""Frictional contact in matrix form as a value, the form in which public collections exchange problems.

u = W r + q in contact frames, normal first, and at every contact r in K, u + mu |u_T| n in K*, orthogonal to
each other, with K = {|r_T| <= mu r_N} (De Saxce's form of Coulomb's law). With one row per contact it is the
linear complementarity problem 0 <= W r + q, 0 <= r, not both positive. Knows no bodies beyond the optional
body form that W was reduced from.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom._friction_problem_sparse import Csr, Wholes, floats, from_compressed
from carom._space import Floats, frozen, number, whole
from carom.errors import refused, unknown

if TYPE_CHECKING:
    from carom._friction_problem_body import BodyForm
    from carom._friction_problem_certificate import FrictionCertificate
    from carom._problem import ContactProblem

#: Told of a solve now and then: stage, iterations of the stage, residual of the best so far; False stops it.
Tell = Callable[[str, int, float], bool | None]


@dataclass(frozen=True)
class FrictionMeasure:
    """What impulses are worth; every error is 0 exactly at a solution.

    Attributes
    ----------
    err_nat : |r - P_K(r - u_hat)| / |q| [1], u_hat = u + mu |u_T| n (Acary, Bremond and Huber 2018)
    err_scaled : |(r - P_K(r - u_hat / l)) l| / |q| [1], l the spectral norm of each diagonal block of W;
        does not change with the unit of impulse
    cone : largest |r_T| - mu r_N or -r_N over the largest |r| [1]
    penetration : largest -u_N over the largest entry of q [1]
    complementarity : largest |u_hat . r| over the largest |r| times the largest entry of q [1]
    slip_alignment : over slipping contacts, largest |u_T + |u_T| r_T / |r_T|| over the largest entry of q [1]
    take_off, stick, slip : counts of contacts
    """

    err_nat: float
    err_scaled: float
    cone: float
    penetration: float
    complementarity: float
    slip_alignment: float
    take_off: int
    stick: int
    slip: int

    def solves(self, tolerance: float) -> bool:
        """Whether err_nat <= tolerance, err_scaled <= 10 tolerance and cone <= 1e-12."""
        return self.err_nat <= tolerance and self.err_scaled <= 10 * tolerance and self.cone <= 1e-12


@dataclass(frozen=True, repr=False, eq=False)
class FrictionSolution:
    """What a solver found.

    Attributes
    ----------
    solver : its name
    impulse : (k, d) float64 array, normal then tangents of each contact, in its frame [N s]
    measure : of these impulses, by the judge of all solvers
    solved : whether the measure passes the tolerance
    stages : (name, iterations) of each stage gone through, in order
    factorisations : spent in all stages [1]
    seconds : wall time of the solve alone [s]
    reason : why it is not solved; empty when it is
    strict_feasibility : when not solved and known, the largest t with some r such that u_N >= mu |u_T| + t
        everywhere [m/s]; at or below 0 no solution need exist
    stopped : whether whoever watched asked to stop
    """

    solver: str
    impulse: Floats
    measure: FrictionMeasure
    solved: bool
    stages: tuple[tuple[str, int], ...]
    factorisations: int
    seconds: float
    reason: str
    strict_feasibility: float | None
    stopped: bool

    @property
    def iterations(self) -> int:
        """Spent in all stages [1]."""
        return sum(count for _, count in self.stages)

    def __repr__(self) -> str:
        """Solver, errors, stages and time."""
        state = "solved" if self.solved else f"not solved ({self.reason})"
        stages = ", ".join(f"{name} {count}" for name, count in self.stages) or "no stage"
        return (
            f"<FrictionSolution by {self.solver}: {len(self.impulse)} contacts {state}, "
            f"err_nat {self.measure.err_nat:.1e}, err_scaled {self.measure.err_scaled:.1e}, {stages}, "
            f"{self.factorisations} factorisations, {1e3 * self.seconds:.3g} ms>"
        )


@dataclass(frozen=True, repr=False, eq=False)
class FrictionProblem:
    """Find impulses r with u = W r + q and Coulomb's law at every contact.

    Contact i owns rows d i .. d i + d - 1, normal first.
    From a file with `load`, from a contact problem of a world with `from_problem`, or from arrays. Arrays are
    copied and read-only.

    Parameters
    ----------
    dimension : d, rows per contact: 1 (no friction, a linear complementarity problem), 2 or 3
    data, indices, indptr : W in compressed rows, (z,) float64, (z,) and (n + 1,) int64 [1/kg]; need not be
        symmetric
    q : (n,) float64 array, relative velocities without impulses less what contacts aim for [m/s]
    mu : (k,) float64 array, coefficients of friction [1]
    name, source, meta : where it comes from, for people
    target : (n,) float64 array, velocity that is contained in q with a minus [m/s]; None for none
    body_form : what W and q were reduced from, where known

    Raises
    ------
    BuildError
        Naming the array or entry that does not fit.
    """

    dimension: int
    data: Floats
    indices: Wholes
    indptr: Wholes
    q: Floats
    mu: Floats
    name: str = ""
    source: str = ""
    meta: Mapping[str, Any] = field(default_factory=dict)
    target: Floats | None = None
    body_form: BodyForm | None = None

    def __post_init__(self) -> None:
        """Checks shapes and numbers."""
        count = whole(self.dimension, "dimension", "give 1, 2 or 3 rows per contact")
        if count not in (1, 2, 3):
            raise refused(None, "dimension", "must be 1, 2 or 3", count, "give the rows per contact")
        mu = floats("mu", self.mu)
        if (mu < 0).any():
            first = int(np.argmax(mu < 0))
            raise refused(None, f"mu[{first}]", "must be >= 0", float(mu[first]), "give friction >= 0")
        q = floats("q", self.q)
        if q.size != count * mu.size:
            problem = f"must have {count} x {mu.size} entries"
            raise refused(
                None, "q", problem, q.size, "give `dimension` velocities per coefficient of friction"
            )
        w = from_compressed("W", self.data, self.indices, self.indptr, (q.size, q.size))
        target = None if self.target is None else floats("target", self.target)
        if target is not None and target.size != q.size:
            raise refused(None, "target", f"must have {q.size} entries", target.size, "give one per row of W")
        checked: dict[str, Any] = {"dimension": count, "q": frozen(q), "mu": frozen(mu)}
        checked |= {"data": w.data, "indices": w.indices, "indptr": w.indptr}
        checked["target"] = None if target is None else frozen(target)
        checked["meta"] = dict(self.meta)
        for key, value in checked.items():
            object.__setattr__(self, key, value)

    @classmethod
    def from_problem(cls, problem: ContactProblem, *, name: str = "", source: str = "") -> Self:
        """The matrix form of a contact problem: W = J M^-1 J^T, q = J v - target, with its body form.

        General rows that are bounded to neither side (bilateral) are eliminated exactly.

        Raises
        ------
        BuildError
            For rows with bounds, and for friction by the box in space: Coulomb's cones hold neither.
        """
        from carom._friction_problem_body import reduced_contact_problem

        return reduced_contact_problem(cls, problem, name, source)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Reads a problem: ``.npz``, FCLIB's HDF5 (local or global), or what `ContactProblem.save` wrote.

        Raises
        ------
        RunFileError
            When the file is missing, too large, of no known form, or holds numbers that are no problem: the
            dataset, the value and the remedy are named.
        """
        from carom._friction_problem_file import read_friction_problem

        return read_friction_problem(cls, Path(path))

    def save(self, path: str | Path, *, impulse: npt.ArrayLike | None = None) -> None:
        """Writes the problem as ``.npz``, or as FCLIB's HDF5 for ``.hdf5`` and ``.h5``.

        Parameters
        ----------
        impulse : kept as FCLIB's solution; HDF5 only [N s]

        Raises
        ------
        RunFileError
            For another suffix, and when the path cannot be written.
        """
        from carom._friction_problem_file import write_friction_problem

        write_friction_problem(Path(path), self, None if impulse is None else self.flat(impulse, "impulse"))

    def solve(
        self,
        solver: str = "exact",
        tolerance: float = 1e-8,
        *,
        iterations: int = 100_000,
        factorisations: int = 2000,
        impulses: str = "any",
        start: npt.ArrayLike | None = None,
        tell: Tell | None = None,
    ) -> FrictionSolution:
        """Solves the problem, without the interpreter's lock; Ctrl-C stops it.

        Parameters
        ----------
        solver : one of ``carom.FRICTION_SOLVERS``
        tolerance : solved means `FrictionMeasure.solves` of it [1]
        iterations : most sweeps or first-order iterations to spend [1]
        factorisations : most factorisations to spend, by solvers that factorise [1]
        impulses : "any" of those that solve the problem, or those of "minimum_norm" [N s], found by "exact"
            where W is symmetric
        start : (k, d) or (n,) impulses to start from [N s]; zeros when absent
        tell : called about every 50 ms with stage, iterations and residual; False stops the solve, which then
            gives its best

        Raises
        ------
        BuildError
            For an unknown solver, and numbers out of range.
        KeyboardInterrupt
            After Ctrl-C; its attribute ``best`` is the solution so far.

        A problem that is not solved is told in the solution: `solved`, `reason`, `strict_feasibility`.
        """
        if solver not in _carom.FRICTION_SOLVERS:
            raise unknown("solver", str(solver), _carom.FRICTION_SOLVERS)
        limit = number(tolerance, "tolerance", "1")
        if not 0 <= limit < np.inf:
            raise refused(None, "tolerance", "must be finite and >= 0", limit, "e.g. 1e-8")
        budgets: list[int] = []
        for label, value in (("iterations", iterations), ("factorisations", factorisations)):
            most = whole(value, label, "give the most to spend")
            if not 0 <= most < 2**63:
                raise refused(None, label, "must be >= 0", most, "give the most to spend")
            budgets.append(most)
        flat = None if start is None else self.flat(start, "start")
        found = self._native.solve(solver, limit, budgets[0], budgets[1], str(impulses), flat, tell)
        error, solution = found.pop("error"), self._solution(solver, found)
        if error is not None:
            error.best = solution
            raise error
        return solution

    def _solution(self, solver: str, found: dict[str, Any]) -> FrictionSolution:
        """What the engine found, as users read it."""
        impulse = found.pop("impulse").reshape(-1, self.dimension)
        measure, stages = FrictionMeasure(**found.pop("measure")), tuple(found.pop("stages"))
        return FrictionSolution(solver=solver, impulse=impulse, measure=measure, stages=stages, **found)

    def measure(self, impulse: npt.ArrayLike) -> FrictionMeasure:
        """Judges impulses; independent of every solver.

        Parameters
        ----------
        impulse : (k, d) or (n,) [N s]

        Raises
        ------
        BuildError
            For a wrong count, and numbers that are not finite.
        """
        return FrictionMeasure(**self._native.measure(self.flat(impulse, "impulse")))

    def certificate(
        self, impulse: npt.ArrayLike, tolerance: float = 1e-8, *, islands: bool = False
    ) -> FrictionCertificate:
        """What can be said of impulses, in SI units, to be kept and checked by others.

        Parameters
        ----------
        impulse : (k, d) or (n,) [N s]
        tolerance : at which "solved" is said [1]
        islands : also for each island, a set of contacts that W couples

        Raises
        ------
        BuildError
            For a wrong count, and numbers that are not finite.
        """
        from carom._friction_problem_certificate import certify

        limit = number(tolerance, "tolerance", "1")
        return certify(self, self.flat(impulse, "impulse"), limit, islands)

    def velocity(self, impulse: npt.ArrayLike) -> Floats:
        """(n,) float64 array u = W r + q [m/s]."""
        return self.csr.times(self.flat(impulse, "impulse")) + self.q

    def flat(self, impulse: npt.ArrayLike, label: str = "impulse") -> Floats:
        """Impulses as n numbers, refused when they are not."""
        try:
            array = np.asarray(impulse, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.full(1, np.nan)
        right = ((len(self), self.dimension), (self.q.size,))
        if array.shape not in right or not np.isfinite(array).all():
            problem = f"must be {self.q.size} finite numbers of shape {right[0]} or {right[1]}"
            given = f"shape {array.shape}" if array.shape not in right else impulse
            raise refused(None, label, problem, given, "give normal, then tangents of each contact in N s")
        return np.ascontiguousarray(array.reshape(-1))

    def renamed(self, name: str, source: str | None = None) -> Self:
        """The same problem under another name."""
        return replace(self, name=name, source=self.source if source is None else source)

    @property
    def kind(self) -> str:
        """ "lcp" with one row per contact, else "friction"."""
        return "lcp" if self.dimension == 1 else "friction"

    @cached_property
    def csr(self) -> Csr:
        """W as plain arrays."""
        return Csr(self.data, self.indices, self.indptr, (self.q.size, self.q.size))

    @property
    def matrix(self) -> Any:
        """W as scipy.sparse csr_array [1/kg]."""
        return self.csr.matrix

    @cached_property
    def _native(self) -> _carom.FrictionProblem:
        return _carom.FrictionProblem(self.dimension, self.data, self.indices, self.indptr, self.q, self.mu)

    def __len__(self) -> int:
        """Number of contacts."""
        return int(self.mu.size)

    def __getstate__(self) -> dict[str, Any]:
        """Without what is computed on demand."""
        return {key: value for key, value in self.__dict__.items() if key not in ("_native", "csr")}

    def __repr__(self) -> str:
        """Name, kind and sizes."""
        name = f" {self.name!r}" if self.name else ""
        return (
            f"<FrictionProblem{name}: {self.kind}, {len(self)} contacts of {self.dimension} rows, "
            f"{self.data.size} entries>"
        )
