"""The certificate of a solve: what impulses are worth as an answer, measured from problem and impulses alone.

The residual is that of the natural map (theory eqs. 5.31 to 5.34); the energy identity is
Delta T = 1/2 x^T (u+ + u-), which holds for any impulses. Knows no solver.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self

from carom.errors import RunFileError

#: Units of the figures, as files state them.
UNITS = {
    "contacts": "1",
    "rows": "1",
    "residual": "m/s",
    "relative_residual": "1",
    "cone_violation": "N s",
    "complementarity": "J",
    "slip_angle_error": "rad",
    "sliding": "1",
    "energy_identity": "J",
    "energy_change": "J",
    "energy_turned_over": "J",
    "largest_impulse": "N s",
    "velocity_scale": "m/s",
}


@dataclass(frozen=True)
class Certificate(Mapping[str, Any]):
    """What impulses are worth as an answer to a contact problem; also a mapping from its field names.

    Attributes
    ----------
    contacts, rows : of the problem, or of the island that was asked for [1]
    residual, relative_residual : largest of the natural map [m/s]; over that of no impulses at all [1]
    worst_contact : index of the contact where it is largest, or None
    worst_bodies, worst_names : rows of its bodies; their names, where known
    cone_violation : largest pull, or friction beyond its limit [N s]; of a row, distance from its bounds
    complementarity : largest |gamma_n (u_n - target)| [J]
    slip_angle_error : largest angle between friction and the opposite of the slip [rad], over the `sliding`
        contacts: those that press and slip faster than a hundred residuals
    energy_identity : energy change - work of the impulses - work of moving obstacles [J]; rounding of
        energy_turned_over when masses, rows and velocities belong together
    energy_change, energy_turned_over : change of kinetic energy; sum of the absolute terms of both sides [J]
    largest_impulse, velocity_scale : largest normal impulse [N s]; residual of no impulses at all [m/s]
    """

    contacts: int
    rows: int
    residual: float
    relative_residual: float
    worst_contact: int | None
    worst_bodies: tuple[int, int] | None
    worst_names: tuple[str, str] | None
    cone_violation: float
    complementarity: float
    slip_angle_error: float
    sliding: int
    energy_identity: float
    energy_change: float
    energy_turned_over: float
    largest_impulse: float
    velocity_scale: float

    @classmethod
    def from_json(cls, text: str) -> Self:
        """A certificate from its JSON text; unknown names are refused by TypeError."""
        table = json.loads(text)
        for name in ("worst_bodies", "worst_names"):
            table[name] = None if table[name] is None else tuple(table[name])
        return cls(**table)

    def to_json(self) -> str:
        """The certificate as a JSON text; numbers keep every bit."""
        return json.dumps(asdict(self))

    def save(self, path: str | Path) -> None:
        """Writes the certificate: ``.json``, or ``.h5`` (a group "certificate" with units as attributes).

        Raises
        ------
        RunFileError
            For another suffix, and when the path cannot be written.
        """
        path = Path(path)
        try:
            if path.suffix == ".json":
                path.write_text(self.to_json() + "\n")
            elif path.suffix in (".h5", ".hdf5"):
                self._save_hdf5(path)
            else:
                remedy = "use .json or .h5"
                raise RunFileError(
                    f"certificate: cannot write {path.name!r}; {remedy}",
                    field="path",
                    value=str(path),
                    remedy=remedy,
                )
        except OSError as error:
            remedy = "choose a path that can be written"
            raise RunFileError(
                f"certificate: {error}; {remedy}", field="path", value=str(path), remedy=remedy
            ) from None

    def _save_hdf5(self, path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            group = file.create_group("certificate")
            for name, value in self.items():
                if value is None:
                    continue
                made = group.create_dataset(name, data=list(value) if isinstance(value, tuple) else value)
                if name in UNITS:
                    made.attrs["unit"] = UNITS[name]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Reads a certificate that `save` wrote.

        Raises
        ------
        RunFileError
            When the file cannot be read as one.
        """
        path = Path(path)
        try:
            if path.suffix == ".json":
                return cls.from_json(path.read_text())
            return cls._load_hdf5(path)
        except (OSError, KeyError, TypeError, ValueError) as error:
            remedy = "give a file that Certificate.save wrote"
            raise RunFileError(
                f"certificate: {error}; {remedy}", field="path", value=str(path), remedy=remedy
            ) from None

    @classmethod
    def _load_hdf5(cls, path: Path) -> Self:
        import h5py

        table: dict[str, Any] = {field.name: None for field in fields(cls)}
        with h5py.File(path) as file:
            for name, stored in file["certificate"].items():
                value = stored[()]
                if name == "worst_names":
                    table[name] = tuple(str(one.decode()) for one in value)
                else:
                    table[name] = tuple(value.tolist()) if value.ndim else value.item()
        return cls(**table)

    def __getitem__(self, name: str) -> Any:
        if name not in self.__dataclass_fields__:
            raise KeyError(name)
        return getattr(self, name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.__dataclass_fields__)

    def __len__(self) -> int:
        return len(self.__dataclass_fields__)

    def __repr__(self) -> str:
        place = f" at {' / '.join(self.worst_names)}" if self.worst_names is not None else ""
        return (
            f"<Certificate of {self.contacts} contacts: residual {self.residual:.1e} m/s "
            f"({self.relative_residual:.1e}){place}, cone {self.cone_violation:.0e} N s, slip angle "
            f"{self.slip_angle_error:.0e} rad over {self.sliding} sliding, energy identity "
            f"{self.energy_identity:.0e} J>"
        )
