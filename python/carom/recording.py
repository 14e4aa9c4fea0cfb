"""What a run leaves behind, in memory or in an HDF5 file that can be read while it is being written.
Long because the layout stands here as text, as types and as the writer of both: one place to change.

Layout of a file (SI units; every dataset has an attribute ``unit``; f frames, s steps, n bodies, c contacts,
l actions, d = 2 | 3):

==================================  ==========  =========================================================
/frames/time                        (f,)        [s]; the initial state is frame 0
/frames/position                    (f, n, d)   centre of mass [m]
/frames/rotation                    (f, n, 2|4) [cos, sin] | quaternion [w, x, y, z] [1]
/frames/velocity                    (f, n, d)   of the centre of mass [m/s]
/frames/angular_velocity            (f, n, 1|3) world axes [rad/s]
/frames/contact_offsets             (f + 1,)    contacts of frame i: rows offsets[i]:offsets[i + 1]
/frames/action_offsets              (f + 1,)    actions of frame i, likewise; since version 2
/frames/event_offsets               (f + 1,)    events of frame i, likewise; since version 3, on demand
/frames/piece_offsets               (f + 1,)    pieces of frame i, likewise; since version 3, on demand
/contacts                           (c,)        one record per contact, ``unit`` names each field's
/actions                            (l,)        what else moved a body in a frame's last step: its loads' mean
                                                and its position correction; since version 2
/events                             (e,)        what each contact did in each flow and round of impacts of a
                                                frame's last step, by the scheme with events
/pieces                             (p,)        the flows, impacts and projections that each body went through
                                                in it, in order; none for a single flow through the whole step
/steps                              (s,)        one record per *step*, ``unit`` names each column's
/bodies/{name, kind, mass, inertia} (n, ..)     kind 0 dynamic, 1 static, 2 kinematic
/bodies/extent                      (n,)        largest extent of the shape [m]; since version 2
/bodies/{linear, angular}_damping   (n,)        decay rates [1/s]; since version 2
/bodies/shape                       (n,)        row of `/shapes`, -1 for none; not in older files
/bodies/center                      (n, d)      centre of mass in the shape's axes [m]
/shapes                             text        the distinct shapes as a JSON list
/scene, /settings                   text        the scene's own text; settings as JSON
/joints                             text        name, kind and bodies of each joint as JSON; absent without
/progress                           (1,)        status 0 running, 1 complete, 2 interrupted, 3 failed
==================================  ==========  =========================================================

Writing is single-writer-multiple-reader (SWMR): each append ends in a flush, contacts go first and their
offsets last, so a reader that trusts the offsets never sees half a frame, and a killed run leaves a readable
file. Version 2 has what it takes to check a run from its file alone (``carom.check_run``), version 3 also for
runs of the scheme with events; older files are read as before. A record of an event has 213 bytes in space
and 157 in the plane, one of a piece 121 and 73. Knows no physics.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np
import numpy.typing as npt

from carom.errors import RunFileError

Floats = npt.NDArray[np.float64]
Records = npt.NDArray[np.void]

#: Version of the file layout above [1].
LAYOUT_VERSION = 3
#: Kinds of bodies in the order of their codes.
KINDS = ("dynamic", "static", "kinematic")
#: Outcomes of a run in the order of their codes.
STATUSES = ("running", "complete", "interrupted", "failed")

FRAME_UNITS = {
    "time": "s",
    "position": "m",
    "rotation": "1",
    "velocity": "m/s",
    "angular_velocity": "rad/s",
    "contact_offsets": "1",
    "action_offsets": "1",
    "event_offsets": "1",
    "piece_offsets": "1",
}
CONTACT_UNITS = {
    "point": "m",
    "normal": "1",
    "gap": "m",
    "normal_impulse": "N s",
    "friction_impulse": "N s",
    "slip": "m/s",
    "impact_impulse": "N s",
    "kick_arm": "m",
    "moment": "N m s",
}
EVENT_UNITS = {
    "time": "s",
    "length": "s",
    "point": "m",
    "normal": "1",
    "arm_a": "m",
    "arm_b": "m",
    "gap": "m",
    "impulse": "N s",
    "moment": "N m s",
}
PIECE_UNITS = {
    "time": "s",
    "length": "s",
    "shift": "m",
    "turn": "rad",
    "impulse": "N s",
    "moment": "N m s",
}
ACTION_UNITS = {"force": "N", "torque": "N m", "correction": "m", "correction_turn": "rad"}
STEP_UNITS = {
    "time": "s",
    "dt": "s",
    "residual": "m/s",
    "impact_residual": "m/s",
    "deepest_gap": "m",
    "momentum": "kg m/s",
    "angular_momentum": "kg m^2/s",
    "kinetic": "J",
    "potential": "J",
}
#: What solves the contacts of a scheme where no solver is chosen.
OWN_SOLVERS = {"fixed_step": "nncg", "events": "exact", "soft_step": "soft_step's own"}


def solver_of(settings: Mapping[str, Any]) -> str:
    """What solves the contacts by these settings today: the solver that they choose, or the scheme's own."""
    return str(settings.get("solver") or OWN_SOLVERS[settings.get("scheme") or "fixed_step"])


#: Impact law of each scheme when none is asked for.
OWN_LAWS = {"fixed_step": "newton", "events": "generalized_reflections", "soft_step": "soft_step's own"}
#: Lines of the energy ledger, as columns of the steps [J].
LEDGER_LINES = (
    "gravity",
    "applied",
    "driven",
    "damping",
    "contact_normal",
    "friction",
    "impact_normal",
    "impact_friction",
    "rest_cut",
    "fallback",
    "constraint",
    "projection",
    "integrator",
    "sleep",
)

_PROGRESS = np.dtype(
    [("status", "u1"), ("steps", "i8"), ("time", "f8"), ("wall_time", "f8"), ("step_time", "f8")]
)
_CHUNK_BYTES = 64 * 1024
#: Offsets, and the records that they divide.
_RAGGED = {
    "contact_offsets": "contacts",
    "action_offsets": "actions",
    "event_offsets": "events",
    "piece_offsets": "pieces",
}
#: Those of them that a file may lack: old ones, and what was not asked for.
_OPTIONAL = ("action_offsets", "event_offsets", "piece_offsets")


class Chunk(Protocol):
    """A piece of a run as the engine hands it over; shapes and units as in the table above."""

    @property
    def time(self) -> Floats:
        """(f,) [s]."""

    @property
    def position(self) -> Floats:
        """(f, n, d) [m]."""

    @property
    def rotation(self) -> Floats:
        """(f, n, 2|4) [1]."""

    @property
    def velocity(self) -> Floats:
        """(f, n, d) [m/s]."""

    @property
    def angular_velocity(self) -> Floats:
        """(f, n, 1|3) [rad/s]."""

    @property
    def contact_offsets(self) -> npt.NDArray[Any]:
        """(f + 1,) rows of `contacts` by frame."""

    @property
    def contacts(self) -> Records:
        """(c,) records."""

    @property
    def action_offsets(self) -> npt.NDArray[Any]:
        """(f + 1,) rows of `actions` by frame."""

    @property
    def actions(self) -> Records | None:
        """(l,) records; None where they were not recorded."""

    @property
    def event_offsets(self) -> npt.NDArray[Any]:
        """(f + 1,) rows of `events` by frame."""

    @property
    def events(self) -> Records | None:
        """(e,) records; None where they were not recorded."""

    @property
    def piece_offsets(self) -> npt.NDArray[Any]:
        """(f + 1,) rows of `pieces` by frame."""

    @property
    def pieces(self) -> Records | None:
        """(p,) records; None where they were not recorded."""

    @property
    def steps(self) -> Records:
        """(s,) records."""


@dataclass(frozen=True)
class Header:
    """What is known when a run begins.

    Attributes
    ----------
    names : names of the bodies, in order
    kind : (n,) uint8 array, index into `KINDS`
    mass : (n,) float64 array [kg]; inf for bodies that forces do not move
    inertia : (n,) | (n, 3, 3) float64 array about the centre of mass, body axes [kg m^2]
    extent : (n,) float64 array, largest extent of the shape [m]; None in files of version 1
    linear_damping, angular_damping : (n,) float64 arrays of decay rates [1/s]; likewise
    joints : name, kind, a, b and length [m] of each joint
    shapes : the distinct shapes as tables, as scene files have them
    shape : (n,) int32 array, index into `shapes`, -1 for a particle; None in older files
    center : (n, d) float64 array, centre of mass in the shape's axes [m]; likewise
    solver : what solves the contacts, by name; empty in files that do not tell
    """

    space: str
    names: tuple[str, ...]
    kind: npt.NDArray[np.uint8]
    mass: Floats
    inertia: Floats
    settings: Mapping[str, Any]
    scene: str = ""
    scene_name: str = ""
    version: str = ""
    dt: float = 0.0
    every: int = 1
    extent: Floats | None = None
    linear_damping: Floats | None = None
    angular_damping: Floats | None = None
    joints: tuple[Mapping[str, Any], ...] = ()
    shapes: tuple[Mapping[str, Any], ...] = ()
    shape: npt.NDArray[np.int32] | None = None
    center: Floats | None = None
    solver: str = ""
    created: str = field(default_factory=lambda: datetime.now(UTC).isoformat(timespec="microseconds"))


@dataclass(frozen=True)
class Progress:
    """How far a run has come: status as in `STATUSES`, steps [1], times [s]."""

    status: str = "running"
    steps: int = 0
    time: float = 0.0
    wall_time: float = 0.0
    step_time: float = 0.0


def unit_of(kind: str, name: str) -> str:
    """Unit of a column: `kind` is "frames", "steps" or a table's name; ledger lines are in J."""
    units = {
        "frames": FRAME_UNITS,
        "contacts": CONTACT_UNITS,
        "actions": ACTION_UNITS,
        "events": EVENT_UNITS,
        "pieces": PIECE_UNITS,
    }
    if kind in units:
        return units[kind].get(name, "1")
    return "J" if name in LEDGER_LINES or name == "closure" else STEP_UNITS.get(name, "1")


class RunData(Protocol):
    """Read access to a recorded run, wherever it is kept."""

    @property
    def header(self) -> Header:
        """What was known when the run began."""

    @property
    def progress(self) -> Progress:
        """How far the run came."""

    @property
    def path(self) -> Path | None:
        """File that holds the run, or None."""

    def frames(self, name: str) -> npt.NDArray[Any]:
        """One array over all frames; `name` is a key of `FRAME_UNITS`."""

    def steps(self) -> Records:
        """One record per step."""

    def contacts(self, begin: int, end: int) -> Records:
        """Contact records by row."""

    def table(self, name: str) -> Records | None:
        """Records of all frames, "actions", "events" or "pieces", by their offsets among `frames`; None where
        they were not recorded."""


class Recorder(Protocol):
    """Takes chunks while a run goes on."""

    def append(self, chunk: Chunk) -> None:
        """Adds a chunk."""

    def tell(self, progress: Progress) -> None:
        """Notes how far the run has come."""

    def close(self) -> RunData:
        """Ends the recording and gives what was recorded."""


class MemoryRecorder:
    """Keeps a run in memory; is its own data."""

    def __init__(self, header: Header) -> None:
        """An empty recording."""
        self.header = header
        self.progress = Progress()
        self.path: Path | None = None
        self._frames: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in FRAME_UNITS}
        self._tables: dict[str, list[Records]] = {table: [] for table in _RAGGED.values()}
        self._steps: list[Records] = []
        self._joined: dict[str, npt.NDArray[Any]] = {}

    def append(self, chunk: Chunk) -> None:
        """Adds a chunk; its arrays are kept, not copied."""
        self._joined.clear()
        for name in _arrays(chunk):
            part = np.asarray(getattr(chunk, name))
            if name in _RAGGED:
                before = sum(len(records) for records in self._tables[_RAGGED[name]])
                part = part.astype(np.int64)[1:] + before
            self._frames[name].append(part)
        for table, parts in self._tables.items():
            if (records := _records(chunk, table)) is not None:
                parts.append(records)
        self._steps.append(np.asarray(chunk.steps))

    def tell(self, progress: Progress) -> None:
        """Notes how far the run has come."""
        self.progress = progress

    def close(self) -> RunData:
        """The data; more may still be appended."""
        return self

    def frames(self, name: str) -> npt.NDArray[Any]:
        """One array over all frames."""
        if name not in self._joined:
            parts = self._frames[name]
            if name in _OPTIONAL and not parts:
                return np.zeros(len(self.frames("time")) + 1, dtype=np.int64)
            if name in _RAGGED:
                parts = [np.zeros(1, dtype=np.int64), *parts]
            self._joined[name] = np.concatenate(parts)
        return self._joined[name]

    def steps(self) -> Records:
        """One record per step."""
        if "steps" not in self._joined:
            self._joined["steps"] = np.concatenate(self._steps)
        return self._joined["steps"]

    def contacts(self, begin: int, end: int) -> Records:
        """Contact records by row."""
        records = self.table("contacts")
        assert records is not None  # every chunk has some
        return records[begin:end]

    def table(self, name: str) -> Records | None:
        """Records of all frames; None where they were not recorded."""
        if name not in self._joined and self._tables[name]:
            self._joined[name] = np.concatenate(self._tables[name])
        return self._joined.get(name)


class FileRecorder:
    """Writes a run to an HDF5 file, chunk by chunk."""

    def __init__(self, path: Path, header: Header) -> None:
        """Makes the file, or refuses with a `RunFileError`."""
        self.header = header
        self.path = path
        try:
            self._refuse_foreign(path)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = h5py.File(path, "w", libver="latest")
        except OSError as error:
            raise RunFileError(
                f"run file {str(path)!r}: cannot be written: {_reason(error)}; choose another path",
                field="out",
                value=str(path),
                remedy="choose another path",
            ) from error
        self._written = dict.fromkeys(_RAGGED, 0)
        self._is_started = False
        self._write_header()

    @staticmethod
    def _refuse_foreign(path: Path) -> None:
        """An existing file is replaced only if it is a run of ours."""
        if path.is_dir() or (path.exists() and path.stat().st_size > 0 and not is_run_file(path)):
            raise RunFileError(
                f"run file {str(path)!r}: exists and is no run of carom; choose another path",
                field="out",
                value=str(path),
                remedy="choose another path",
            )

    def _write_header(self) -> None:
        file, header = self._file, self.header
        file.attrs["format"] = "carom-run"
        file.attrs["carom_version"] = header.version
        file.attrs["schema_version"] = LAYOUT_VERSION
        file.attrs["created"] = header.created
        file.attrs["space"] = header.space
        file.attrs["scene_name"] = header.scene_name
        file.attrs["solver"] = header.solver
        file.attrs["dt"] = header.dt
        file.attrs["every"] = header.every
        text = h5py.string_dtype("utf-8")
        for name, value in (
            ("scene", header.scene),
            ("settings", json.dumps(dict(header.settings), default=_plain)),
        ):
            file.create_dataset(name, data=value, dtype=text).attrs["unit"] = "1"
        if header.joints:
            told = json.dumps([dict(joint) for joint in header.joints])
            file.create_dataset("joints", data=told, dtype=text).attrs["unit"] = "1"
        if header.shape is not None:
            told = json.dumps([dict(shape) for shape in header.shapes])
            file.create_dataset("shapes", data=told, dtype=text).attrs["unit"] = "1"
        bodies = file.create_group("bodies")
        names = np.array(header.names, dtype=object)
        bodies.create_dataset("name", data=names, dtype=text).attrs["unit"] = "1"
        for name, array, unit in (
            ("kind", header.kind, "1"),
            ("mass", header.mass, "kg"),
            ("inertia", header.inertia, "kg m^2"),
            ("extent", header.extent, "m"),
            ("linear_damping", header.linear_damping, "1/s"),
            ("angular_damping", header.angular_damping, "1/s"),
            ("shape", header.shape, "1"),
            ("center", header.center, "m"),
        ):
            if array is None:
                continue
            bodies.create_dataset(name, data=array).attrs["unit"] = unit
        file.create_dataset("progress", data=np.zeros(1, dtype=_PROGRESS))
        file["progress"].attrs["unit"] = json.dumps({"time": "s", "wall_time": "s", "step_time": "s"})

    def _start(self, chunk: Chunk) -> None:
        """Makes the growing datasets; none can be made once readers are let in."""
        group = self._file.create_group("frames")
        for name in _arrays(chunk):
            example = np.asarray(getattr(chunk, name))
            dtype = np.dtype(np.int64) if name in _RAGGED else example.dtype
            self._growing(group, name, example.shape[1:], dtype).attrs["unit"] = FRAME_UNITS[name]
        tables = {"steps": np.asarray(chunk.steps)}
        for table in _RAGGED.values():
            if (found := _records(chunk, table)) is not None:
                tables[table] = found
        for name, records in tables.items():
            dataset = self._growing(self._file, name, (), records.dtype)
            columns = records.dtype.names or ()
            dataset.attrs["unit"] = json.dumps({column: unit_of(name, column) for column in columns})
        for name in _RAGGED.keys() & group.keys():
            group[name].resize(1, axis=0)
        self._file.swmr_mode = True
        self._is_started = True

    @staticmethod
    def _growing(group: Any, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> Any:
        row = max(1, dtype.itemsize * int(np.prod(shape, dtype=int)))
        chunks = (max(1, _CHUNK_BYTES // row), *(max(1, size) for size in shape))
        # a chunk has a size, also of a world without bodies, and must fit into the largest shape
        most = (None, *(size or None for size in shape))
        # no compression: on a pile's contacts gzip saves a third and makes recording ten times slower
        return group.create_dataset(name, (0, *shape), maxshape=most, dtype=dtype, chunks=chunks)

    def append(self, chunk: Chunk) -> None:
        """Writes a chunk and flushes it."""
        if not self._is_started:
            self._start(chunk)
        file = self._file
        _extend(file["steps"], np.asarray(chunk.steps))
        offsets = {}
        for name in _RAGGED.keys() & file["frames"].keys():
            records = np.asarray(getattr(chunk, _RAGGED[name]))
            offsets[name] = np.asarray(getattr(chunk, name)).astype(np.int64)[1:] + self._written[name]
            self._written[name] += _extend(file[_RAGGED[name]], records)
        file.flush()
        for name in file["frames"]:
            _extend(file["frames"][name], offsets[name] if name in offsets else getattr(chunk, name))
        file.flush()

    def tell(self, progress: Progress) -> None:
        """Writes how far the run has come."""
        row = np.zeros(1, dtype=_PROGRESS)
        row[0] = (
            STATUSES.index(progress.status),
            progress.steps,
            progress.time,
            progress.wall_time,
            progress.step_time,
        )
        self._file["progress"][...] = row
        self._file.flush()

    def close(self) -> RunData:
        """Closes the file; the data are then read from it on demand."""
        self._file.close()
        return FileData(self.path)


class FileData:
    """Reads a run file on demand; arrays are kept once read. The length is that at the time of opening."""

    def __init__(self, path: Path) -> None:
        """Reads the header; see `open_run` for what is refused."""
        self.path = path
        self._place = path.absolute()  # it is read again later, wherever the program is then
        self._kept: dict[str, npt.NDArray[Any]] = {}
        with open_run(path) as file:
            self.header = _read_header(file)
            row = file["progress"][0]
            self.progress = Progress(
                STATUSES[int(row["status"])],
                int(row["steps"]),
                float(row["time"]),
                float(row["wall_time"]),
                float(row["step_time"]),
            )
            frames = file.get("frames")
            lengths = [len(array) - (name in _RAGGED) for name, array in frames.items()] if frames else [0]
            self._length = max(0, min(lengths))

    def frames(self, name: str) -> npt.NDArray[Any]:
        """One array over all frames."""
        if name not in self._kept:
            end = self._length + (name in _RAGGED)
            with self._again() as file:
                if name in _OPTIONAL and f"frames/{name}" not in file:
                    return np.zeros(end, dtype=np.int64)
                self._kept[name] = self._growing(file, f"frames/{name}")[:end]
        return self._kept[name]

    def steps(self) -> Records:
        """One record per step."""
        if "steps" not in self._kept:
            with self._again() as file:
                self._kept["steps"] = self._growing(file, "steps")[...]
        return self._kept["steps"]

    def contacts(self, begin: int, end: int) -> Records:
        """Contact records by row, read from the file each time."""
        with self._again() as file:
            return np.asarray(self._growing(file, "contacts")[begin:end])

    def table(self, name: str) -> Records | None:
        """Records of all frames; None where they were not recorded."""
        with self._again() as file:
            return np.asarray(file[name][...]) if name in file else None

    def _again(self) -> Any:
        """The file, if it still is that of this run."""
        file = open_run(self._place)
        if _attribute(file, "created") != self.header.created:
            file.close()
            problem = "holds another run since this one was opened"
            raise _unreadable(self.path, problem, "record each run into a file of its own", None)
        return file

    def _growing(self, file: Any, name: str) -> Any:
        """A dataset of the run; a run that failed before its first frame has none."""
        if name not in file:
            raise _unreadable(self.path, "holds no frames", "run the scene again", None)
        return file[name]


def open_run(path: Path) -> Any:
    """Opens a run file for reading, also while it is being written and after its writer was killed.

    Raises
    ------
    RunFileError
        When the file is missing, is no HDF5, is no run of carom or is of a later layout.
    """
    try:
        file = _open(path)
    except FileNotFoundError as error:
        raise _unreadable(path, "no such file", "check the path", error) from None
    except OSError as error:
        problem = f"cannot be read as HDF5 ({_reason(error)})"
        raise _unreadable(path, problem, "give a file that `carom run` wrote", error) from None
    if _attribute(file, "format") != "carom-run":
        file.close()
        raise _unreadable(path, "is HDF5 but no run of carom", "give a file that `carom run` wrote", None)
    version = int(file.attrs["schema_version"])
    if version > LAYOUT_VERSION:
        file.close()
        raise _unreadable(path, f"has layout version {version}", "install the carom that wrote it", None)
    return file


def is_run_file(path: Path) -> bool:
    """Whether a file is a run of ours."""
    try:
        with _open(path) as file:
            return bool(_attribute(file, "format") == "carom-run")
    except OSError:
        return False


def record(path: str | Path | None, header: Header) -> Recorder:
    """A recorder into a file, or into memory when there is no path."""
    if path is None:
        return MemoryRecorder(header)
    if not isinstance(path, (str, Path)) or "\0" in str(path):
        raise RunFileError(
            f"run file {path!r}: is no path; give one that ends in .h5", field="out", value=path,
            remedy="give a path that ends in .h5",
        )  # fmt: skip
    return FileRecorder(Path(path), header)


def copy_into(path: Path, data: RunData, chunk: Chunk) -> None:
    """Writes a whole run to a file."""
    if data.path is not None and path.exists() and os.path.samefile(path, data.path):
        return
    recorder = FileRecorder(path, data.header)
    recorder.append(chunk)
    recorder.tell(data.progress)
    recorder.close()


def _open(path: Path) -> Any:
    """Plain first; as a reader beside a writer when the file says that it is being written."""
    try:
        return h5py.File(path, "r", libver="latest")
    except FileNotFoundError:
        raise
    except OSError:
        return h5py.File(path, "r", libver="latest", swmr=True)


def _records(chunk: Chunk, table: str) -> Records | None:
    """Records of a chunk; None where they were not recorded."""
    records = getattr(chunk, table, None)
    return None if records is None else np.asarray(records)


def _arrays(chunk: Chunk) -> list[str]:
    """Names of the arrays over frames that a chunk has."""
    return [name for name in FRAME_UNITS if name not in _RAGGED or _records(chunk, _RAGGED[name]) is not None]


def _extend(dataset: Any, part: npt.NDArray[Any]) -> int:
    """Appends rows; returns how many."""
    count = len(part)
    if count:
        length = dataset.shape[0]
        dataset.resize(length + count, axis=0)
        dataset[length:] = part
    return count


def _read_header(file: Any) -> Header:
    bodies = file["bodies"]
    return Header(
        space=_attribute(file, "space"),
        names=tuple(bodies["name"].asstr()[...].tolist()),
        kind=bodies["kind"][...],
        mass=bodies["mass"][...],
        inertia=bodies["inertia"][...],
        settings=json.loads(file["settings"].asstr()[()]),
        scene=file["scene"].asstr()[()],
        scene_name=_attribute(file, "scene_name"),
        version=_attribute(file, "carom_version"),
        dt=float(file.attrs["dt"]),
        every=int(file.attrs["every"]),
        extent=bodies["extent"][...] if "extent" in bodies else None,
        linear_damping=bodies["linear_damping"][...] if "linear_damping" in bodies else None,
        angular_damping=bodies["angular_damping"][...] if "angular_damping" in bodies else None,
        joints=tuple(json.loads(file["joints"].asstr()[()])) if "joints" in file else (),
        shapes=tuple(json.loads(file["shapes"].asstr()[()])) if "shapes" in file else (),
        shape=bodies["shape"][...] if "shape" in bodies else None,
        center=bodies["center"][...] if "center" in bodies else None,
        solver=_attribute(file, "solver"),
        created=_attribute(file, "created"),
    )


def _attribute(file: Any, name: str) -> str:
    value = file.attrs.get(name, "")
    return value.decode() if isinstance(value, bytes) else str(value)


def _plain(value: Any) -> Any:
    """Numpy values as JSON."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Sequence):
        return list(value)
    return str(value)


def _reason(error: OSError) -> str:
    return (error.strerror or str(error).split(",")[0])[:160]


def _unreadable(path: Path, problem: str, remedy: str, error: BaseException | None) -> RunFileError:
    refusal = RunFileError(
        f"run file {str(path)!r}: {problem}; {remedy}", field="path", value=str(path), remedy=remedy
    )
    refusal.__cause__ = error
    return refusal
