"""The certificate of a solve: what impulses are worth in SI units, with what is needed to check it again.

Per contact, with u = W r + q, u_hat = u + mu |u_T| n, l the spectral norm of the contact's block of W:
residual |(r - P_K(r - u_hat / l)) l| [m/s]. Energy identity of any impulses: Delta T = r . (u+ + u-) / 2,
with u- = q + target and u+ = u + target, and, where the bodies are known, the change of their kinetic energy,
which must be the same. `carom.check_certificate` repeats it from the problem and the impulses alone.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from carom._space import Floats
from carom.errors import RunFileError

if TYPE_CHECKING:
    from carom._friction_problem import FrictionProblem

#: Version of a certificate's fields [1].
VERSION = 1

UNITS = {
    "residual": "m/s", "penetration": "m/s", "cone_violation": "N s", "complementarity": "J",
    "slip_angle_error": "rad", "energy_change": "J", "energy_change_by_bodies": "J", "energy_closure": "J",
}  # fmt: skip


@dataclass(frozen=True)
class Certificate:
    """What impulses are worth.

    Attributes
    ----------
    problem, kind : name and "friction" | "lcp"
    dimension, contacts : rows per contact, count [1]
    problem_sha256, impulse_sha256 : of the numbers that were judged
    tolerance, solved : "solved" is err_nat <= tolerance, err_scaled <= 10 tolerance, cone <= 1e-12
    err_nat, err_scaled, cone : the measures of collections, see `FrictionMeasure` [1]
    residual : largest over contacts [m/s]
    relative_residual : the same over the largest entry of q [1]
    worst_contact : where it is largest; None where it is 0 everywhere
    cone_violation : largest |r_T| - mu r_N or -r_N, 0 when there is none [N s]
    penetration : largest -u_N, 0 when there is none [m/s]
    complementarity : largest |u_hat . r| [J]
    slip_angle_error : largest angle between friction and the direction against the slip [rad]
    energy_change : r . (u+ + u-) / 2 [J]; without known targets that of the problem as it stands
    energy_change_by_bodies : from the velocities of the bodies [J]; None where they are not known
    energy_closure : how far the two differ [J]; None where one is not known
    take_off, stick, slip : counts of contacts
    islands : the same errors island by island, where asked for
    """

    problem: str
    kind: str
    dimension: int
    contacts: int
    problem_sha256: str
    impulse_sha256: str
    tolerance: float
    solved: bool
    err_nat: float
    err_scaled: float
    cone: float
    residual: float
    relative_residual: float
    worst_contact: int | None
    cone_violation: float
    penetration: float
    complementarity: float
    slip_angle_error: float
    energy_change: float
    energy_change_by_bodies: float | None
    energy_closure: float | None
    take_off: int
    stick: int
    slip: int
    islands: tuple[dict[str, Any], ...] = field(default=())

    def to_dict(self) -> dict[str, Any]:
        """Plain values, with format, version and units."""
        head = {"format": "carom-certificate", "schema_version": VERSION, "units": UNITS}
        return {**head, **asdict(self), "islands": [dict(island) for island in self.islands]}

    def save(self, path: str | Path) -> None:
        """Writes the certificate as JSON (``.json``) or HDF5 (``.h5``, ``.hdf5``: attributes, units as such).

        Raises
        ------
        RunFileError
            For another suffix, and when the path cannot be written.
        """
        where = Path(path)
        suffix = where.suffix.lower()
        if suffix not in (".json", ".h5", ".hdf5"):
            raise _refused(where, "has no known suffix", "end it in .json or .h5")
        try:
            if suffix == ".json":
                where.write_text(json.dumps(self.to_dict(), indent=2) + "\n", encoding="utf-8")
            else:
                self._write_hdf5(where)
        except OSError as error:
            raise _refused(where, f"cannot be written: {error.strerror}", "choose another path") from error

    def _write_hdf5(self, path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for key, value in self.to_dict().items():
                if key in ("units", "islands"):
                    continue
                # an attribute cannot be absent and known at once: what is unknown is left out
                if value is not None:
                    file.attrs[key] = value
                    if key in UNITS:
                        file.attrs[f"{key}.unit"] = UNITS[key]
            if self.islands:
                group = file.create_group("islands")
                for key in self.islands[0]:
                    values = [-1 if island[key] is None else island[key] for island in self.islands]
                    group.create_dataset(key, data=np.array(values)).attrs["unit"] = UNITS.get(key, "1")

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Reads a certificate that `save` wrote; nothing in it is checked.

        Raises
        ------
        RunFileError
            When the file is no certificate.
        """
        where = Path(path)
        try:
            table = _read_hdf5(where) if where.suffix.lower() in (".h5", ".hdf5") else _read_json(where)
            if (
                table.pop("format", None) != "carom-certificate"
                or table.pop("schema_version", None) != VERSION
            ):
                raise ValueError("its format is not carom-certificate 1")
            table.pop("units", None)
            return cls(**{**table, "islands": tuple(table.get("islands", ()))})
        except (OSError, ValueError, TypeError, RecursionError) as error:
            raise _refused(where, f"is no certificate: {str(error)[:200]}", "make one anew") from error

    def __str__(self) -> str:
        """In words."""
        state = "solved" if self.solved else "not solved"
        where = f" at contact {self.worst_contact}" if self.worst_contact is not None else ""
        return (
            f"{self.problem or 'problem'}: {self.contacts} contacts {state} at {self.tolerance:g}; residual "
            f"{self.residual:.2e} m/s{where}, err_nat {self.err_nat:.2e}, err_scaled {self.err_scaled:.2e}, "
            f"cone {self.cone:.1e}; {self.take_off} take off, {self.stick} stick, {self.slip} slip"
        )


def _read_json(path: Path) -> dict[str, Any]:
    table = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(table, dict):
        raise ValueError("not a table")
    return table


def _read_hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        table: dict[str, Any] = {
            key: value.item() if hasattr(value, "item") else value
            for key, value in file.attrs.items()
            if not key.endswith(".unit")
        }
        for key in ("worst_contact", "energy_change_by_bodies", "energy_closure"):
            table.setdefault(key, None)
        if "islands" in file:
            columns = {key: column[...].tolist() for key, column in file["islands"].items()}
            rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
            for row in rows:
                row["worst_contact"] = None if row["worst_contact"] < 0 else row["worst_contact"]
            table["islands"] = rows
    return table


def certify(problem: FrictionProblem, impulse: Floats, tolerance: float, has_islands: bool) -> Certificate:
    """See `FrictionProblem.certificate`."""
    measure = problem.measure(impulse)
    parts = _Parts(problem, impulse)
    residual = float(parts.residual.max(initial=0.0))
    change, by_bodies = _energy(problem, impulse, parts.velocity.ravel())
    return Certificate(
        problem=problem.name,
        kind=problem.kind,
        dimension=problem.dimension,
        contacts=len(problem),
        problem_sha256=problem_digest(problem),
        impulse_sha256=digest([impulse]),
        tolerance=tolerance,
        solved=measure.solves(tolerance),
        err_nat=measure.err_nat,
        err_scaled=measure.err_scaled,
        cone=measure.cone,
        residual=residual,
        relative_residual=residual / parts.top,
        **parts.errors(np.arange(len(problem))),
        energy_change=change,
        energy_change_by_bodies=by_bodies,
        energy_closure=None if by_bodies is None else abs(change - by_bodies),
        islands=_islands(problem, parts) if has_islands else (),
    )


class _Parts:
    """Errors contact by contact."""

    def __init__(self, problem: FrictionProblem, impulse: Floats) -> None:
        d, mu = problem.dimension, problem.mu
        self.mu = mu
        self.impulse = impulse.reshape(-1, d)
        self.velocity = (problem.csr.times(impulse) + problem.q).reshape(-1, d)
        self.top = float(np.abs(problem.q).max(initial=0.0)) or 1.0
        self.strongest = max(float(_length(self.impulse).max(initial=0.0)), 1e-300)
        norms = np.linalg.norm(diagonal_blocks(problem), 2, axis=(1, 2)) if len(problem) else np.zeros(0)
        norms[norms <= 0] = 1.0
        self.u_hat = self.velocity.copy()
        self.u_hat[:, 0] += mu * _length(self.velocity[:, 1:])
        moved = project_on_cones(self.impulse - self.u_hat / norms[:, None], mu)
        self.residual = _length((self.impulse - moved) * norms[:, None])

    def errors(self, which: npt.NDArray[np.int64]) -> dict[str, Any]:
        """Extremes and counts over some contacts."""
        r, u, mu = self.impulse[which], self.velocity[which], self.mu[which]
        push, slip = _length(r[:, 1:]), _length(u[:, 1:])
        presses = r[:, 0] > 1e-9 * self.strongest
        slips = presses & (push > 0) & (push >= mu * r[:, 0] * (1 - 1e-6)) & (slip > 1e-9 * self.top)
        residual = self.residual[which]
        worst = int(which[np.argmax(residual)]) if residual.size and residual.max() > 0 else None
        return {
            "worst_contact": worst,
            "cone_violation": max(0.0, _largest(push - mu * r[:, 0]), _largest(-r[:, 0])),
            "penetration": max(0.0, _largest(-u[:, 0])),
            "complementarity": max(0.0, _largest(np.abs((self.u_hat[which] * r).sum(axis=1)))),
            "slip_angle_error": max(0.0, _largest(_angles(u[slips, 1:], -r[slips, 1:]))),
            "take_off": int((~presses).sum()),
            "stick": int((presses & ~slips).sum()),
            "slip": int(slips.sum()),
        }


def _islands(problem: FrictionProblem, parts: _Parts) -> tuple[dict[str, Any], ...]:
    """Sets of contacts that W couples, in the order of their first contact."""
    found = []
    for members in islands_of(problem):
        residual = float(parts.residual[members].max(initial=0.0))
        found.append(
            {"first_contact": int(members[0]), "contacts": len(members), "residual": residual,
             **parts.errors(members)}
        )  # fmt: skip
    return tuple(found)


def islands_of(problem: FrictionProblem) -> list[npt.NDArray[np.int64]]:
    """Contacts of each set that W couples, in the order of their first contact."""
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    k, d = len(problem), problem.dimension
    places = (problem.csr.rows // d, problem.indices // d)
    graph = sparse.coo_array((np.ones(problem.data.size), places), shape=(k, k))
    count, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(label, minlength=count))[:-1]) if count else []
    return sorted(parts, key=lambda members: int(members[0]))


def _energy(problem: FrictionProblem, impulse: Floats, velocity: Floats) -> tuple[float, float | None]:
    """Change of kinetic energy from the impulses, and from the bodies where they are known [J]."""
    target = 0.0 if problem.target is None else problem.target
    change = float(impulse @ ((velocity + problem.q) / 2 + target))
    body = problem.body_form
    if body is None or body.bilateral is not None:
        return change, None  # bilateral impulses do work of their own
    after, _ = body.motion(impulse)
    before, _ = body.motion(np.zeros_like(impulse))
    by_bodies = float((after - before) @ body.mass.times(after + before) / 2)
    # u also has what obstacles do, whose work no body of ours shows, and lacks what contacts aim for
    offset = body.offset if problem.target is None else body.offset + target
    return change, by_bodies + float(impulse @ offset)


def diagonal_blocks(problem: FrictionProblem) -> Floats:
    """(k, d, d) float64 array, the block of W of each contact with itself."""
    d = problem.dimension
    blocks = np.zeros((len(problem), d, d))
    rows = problem.csr.rows
    inside = rows // d == problem.indices // d
    r, c = rows[inside], problem.indices[inside]
    blocks[r // d, r % d, c % d] = problem.data[inside]
    return blocks


def project_on_cones(x: Floats, mu: Floats) -> Floats:
    """Rows of (k, d) projected on |x_T| <= mu x_N."""
    normal, push = x[:, 0], _length(x[:, 1:])
    found = x.copy()
    is_inside = (push <= mu * normal) & (normal >= 0)  # 0 <= -0 where there is no friction
    is_polar = ~is_inside & (mu * push <= -normal)
    found[is_polar] = 0.0
    sides = np.flatnonzero(~is_inside & ~is_polar)
    along = (normal[sides] + mu[sides] * push[sides]) / (1 + mu[sides] ** 2)
    found[sides, 0] = along
    found[sides, 1:] *= (mu[sides] * along / push[sides])[:, None]
    return found


def problem_digest(problem: FrictionProblem) -> str:
    """SHA-256 of d, the entries of W that are not 0 (rows, columns, values), q, mu and targets."""
    kept = problem.data != 0
    entries = [problem.csr.rows[kept], problem.indices[kept], problem.data[kept]]
    target = np.zeros(problem.q.size) if problem.target is None else problem.target
    return digest([np.array([problem.dimension]), *entries, problem.q, problem.mu, target])


def digest(arrays: list[npt.NDArray[Any]]) -> str:
    """SHA-256 of whole numbers as int64 and others as float64, little-endian."""
    hashed = hashlib.sha256()
    for array in arrays:
        hashed.update(
            np.ascontiguousarray(array, dtype="<i8" if array.dtype.kind in "iu" else "<f8").tobytes()
        )
    return hashed.hexdigest()


def _length(rows: Floats) -> Floats:
    return np.asarray(np.sqrt((rows * rows).sum(axis=-1)))


def _largest(values: Floats) -> float:
    return float(values.max(initial=-np.inf))


def _angles(a: Floats, b: Floats) -> Floats:
    """Angles between rows of one or two numbers [rad]."""
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] if a.shape[1] == 2 else np.zeros(len(a))
    return np.asarray(np.arctan2(np.abs(cross), (a * b).sum(axis=1)))


def _refused(path: Path, problem: str, remedy: str) -> RunFileError:
    message = f"certificate {str(path)!r}: {problem}; {remedy}"
    return RunFileError(message, field="path", value=str(path), remedy=remedy)
