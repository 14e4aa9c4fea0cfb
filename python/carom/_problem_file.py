"""Contact problems as files: JSON as it stands, or HDF5 with one dataset per column and its unit.

Layout of the HDF5 form: attributes format, schema_version, space, friction_law; /names; groups
/inverse_masses (linear, angular), /velocities (linear, angular), /contacts, /rows and, where there are any,
/resistances (a column for each field) and /contacts/slip_target. Knows no physics.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import RunFileError

#: Version of the HDF5 form [1].
LAYOUT_VERSION = 1
#: Largest file that is read [bytes].
MOST_BYTES = 1 << 30

_UNITS = {
    "inverse_masses/linear": "1/kg",
    "inverse_masses/angular": "1/(kg m^2)",
    "velocities/linear": "m/s",
    "velocities/angular": "rad/s",
    "contacts/arm_a": "m",
    "contacts/arm_b": "m",
    "contacts/gap": "m",
    "contacts/target": "m/s",
    "contacts/slip_target": "m/s",
    "resistances/rolling": "m",
    "resistances/spinning": "m",
}
_CONTACTS = ("id", "a", "b", "normal", "arm_a", "arm_b", "gap", "target", "restitution", "friction")
_ROWS = ("id", "a", "b", "target", "lo", "hi")
_RESISTANCES = ("contact", "rolling", "spinning")
_WHOLE = ("id", "a", "b", "contact")


def write_problem(path: Path, table: dict[str, Any]) -> None:
    """Writes a plain problem; the suffix chooses the form.

    Raises
    ------
    RunFileError
        For another suffix, and when the path cannot be written.
    """
    writers = {".json": _write_json, ".h5": _write_hdf5, ".hdf5": _write_hdf5}
    if path.suffix.lower() not in writers:
        raise _refused(path, "has no known suffix", "end it in .json or .h5")
    try:
        writers[path.suffix.lower()](path, table)
    except OSError as error:
        raise _refused(path, f"cannot be written: {_reason(error)}", "choose another path") from error


def read_problem(path: Path) -> dict[str, Any]:
    """A plain problem, not yet checked for physics.

    Raises
    ------
    RunFileError
        When the file is missing, too large, or not of its form.
    """
    readers = {".json": _read_json, ".h5": _read_hdf5, ".hdf5": _read_hdf5}
    if path.suffix.lower() not in readers:
        raise _refused(path, "has no known suffix", "give a file that ends in .json or .h5")
    try:
        if path.stat().st_size > MOST_BYTES:
            raise _refused(path, "is larger than 1 GiB", "solve it in parts")
        return readers[path.suffix.lower()](path)
    except OSError as error:
        raise _refused(path, f"cannot be read: {_reason(error)}", "check the path") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise _refused(
            path, f"is no contact problem: {error}", "give a file that ContactProblem.save wrote"
        ) from error


def _write_json(path: Path, table: dict[str, Any]) -> None:
    path.write_text(json.dumps(table) + "\n", encoding="utf-8")


def _read_json(path: Path) -> dict[str, Any]:
    table = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(table, dict):
        raise ValueError("not a table")
    return table


def _write_hdf5(path: Path, table: dict[str, Any]) -> None:
    import h5py

    spins = 1 if table["space"] == "planar" else 3
    dimension = 2 if spins == 1 else 3
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "carom-problem"
        file.attrs["schema_version"] = LAYOUT_VERSION
        file.attrs["space"] = table["space"]
        file.attrs["friction_law"] = table["friction_law"]
        file.create_dataset(
            "names", data=np.array(table["names"], dtype=object), dtype=h5py.string_dtype("utf-8")
        )
        masses = table["inverse_masses"]
        _column(file, "inverse_masses/linear", [m["linear"] for m in masses])
        _column(
            file, "inverse_masses/angular", [_entries(m["angular"]) for m in masses], 1 if spins == 1 else 6
        )
        _column(file, "velocities/linear", [v["linear"] for v in table["velocities"]], dimension)
        _column(file, "velocities/angular", [v["angular"] for v in table["velocities"]], spins)
        for name in _CONTACTS:
            width = dimension if name in ("normal", "arm_a", "arm_b") else 0
            _column(file, f"contacts/{name}", [c[name] for c in table["contacts"]], width)
        slips = [c.get("slip_target", [0.0] * (dimension - 1)) for c in table["contacts"]]
        # absent where no contact asks for a slip: the layout of old files
        if np.any(slips):
            _column(file, "contacts/slip_target", slips, dimension - 1)
        for name in _ROWS:
            _column(
                file,
                f"rows/{name}",
                [float(r[name]) if name in ("lo", "hi") else r[name] for r in table["rows"]],
            )
        # absent where no contact has rolling or spinning friction: the layout of old files
        for name in _RESISTANCES if table.get("resistances") else ():
            _column(file, f"resistances/{name}", [r[name] for r in table["resistances"]])
        for side in ("on_a", "on_b"):
            _column(
                file,
                f"rows/{side}",
                [r[side]["linear"] + r[side]["angular"] for r in table["rows"]],
                dimension + spins,
            )


def _column(file: Any, path: str, values: list[Any], width: int = 0) -> None:
    name = path.rsplit("/", 1)[-1]
    dtype = np.uint64 if name == "id" else np.int64 if name in _WHOLE else np.float64
    array = np.array(values, dtype=dtype).reshape((len(values), width) if width else (len(values),))
    file.create_dataset(path, data=array).attrs["unit"] = _UNITS.get(path, "1")


def _read_hdf5(path: Path) -> dict[str, Any]:
    import h5py

    with h5py.File(path, "r") as file:
        if file.attrs.get("format") != "carom-problem":
            raise ValueError("its format is not carom-problem")
        if int(file.attrs["schema_version"]) > LAYOUT_VERSION:
            raise ValueError(f"layout version {file.attrs['schema_version']} is newer than this carom")

        def column(path: str) -> list[Any]:
            values: list[Any] = file[path][...].tolist()
            return values

        def twists(group: str) -> list[dict[str, Any]]:
            both = zip(column(f"{group}/linear"), column(f"{group}/angular"), strict=True)
            return [{"linear": linear, "angular": angular} for linear, angular in both]

        masses = zip(column("inverse_masses/linear"), column("inverse_masses/angular"), strict=True)
        asked = ("slip_target",) if "slip_target" in file["contacts"] else ()
        contacts = zip(*(column(f"contacts/{name}") for name in (*_CONTACTS, *asked)), strict=True)
        rows = zip(*(column(f"rows/{name}") for name in (*_ROWS, "on_a", "on_b")), strict=True)
        found = "resistances" in file
        resistances = zip(*(column(f"resistances/{name}") for name in _RESISTANCES if found), strict=True)
        dimension = len(file["velocities/linear"][:1].reshape(-1)) or (
            2 if file.attrs["space"] == "planar" else 3
        )
        return {
            "space": str(file.attrs["space"]),
            "friction_law": str(file.attrs["friction_law"]),
            "names": file["names"].asstr()[...].tolist(),
            "inverse_masses": [
                {"linear": linear, "angular": _inertia(angular)} for linear, angular in masses
            ],
            "velocities": twists("velocities"),
            "contacts": [dict(zip((*_CONTACTS, *asked), values, strict=True)) for values in contacts],
            "rows": [_row(values, dimension) for values in rows],
            "resistances": [dict(zip(_RESISTANCES, values, strict=True)) for values in resistances],
        }


def _row(values: tuple[Any, ...], dimension: int) -> dict[str, Any]:
    row = dict(zip(_ROWS, values[:6], strict=True))
    row["lo"], row["hi"] = (x if np.isfinite(x) else str(x) for x in (row["lo"], row["hi"]))
    for side, numbers in zip(("on_a", "on_b"), values[6:], strict=True):
        row[side] = {"linear": numbers[:dimension], "angular": numbers[dimension:]}
    return row


def _entries(inertia: Any) -> list[float]:
    """Independent entries of an inertia as the engine's JSON has it."""
    return inertia["diagonal"] + inertia["off"] if isinstance(inertia, dict) else [inertia]


def _inertia(entries: list[float]) -> Any:
    return entries[0] if len(entries) == 1 else {"diagonal": entries[:3], "off": entries[3:]}


def _reason(error: OSError) -> str:
    return (error.strerror or str(error).split(",")[0])[:160]


def _refused(path: Path, problem: str, remedy: str) -> RunFileError:
    return RunFileError(
        f"problem file {str(path)!r}: {problem}; {remedy}", field="path", value=str(path), remedy=remedy
    )
