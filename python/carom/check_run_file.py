"""Reads recorded runs for their check, without trust in them: sizes are bounded before anything is read, rows
come in blocks, links and values that are Python objects are refused. h5py and numpy, not a line of the
engine. Layout: `carom.recording`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Records = npt.NDArray[np.void]

#: Latest layout that is understood [1].
LATEST = 3
#: Most bodies [1], steps [1], and bytes of text, of one chunk and of one block of rows.
MOST_BODIES, MOST_STEPS = 1_000_000, 200_000_000
MOST_TEXT, MOST_CHUNK, BLOCK = 1 << 26, 1 << 28, 1 << 25
#: Times that rows may be larger than what is stored of them: what sound compression reaches [1].
MOST_INFLATION = 1100
_FILTERS = {1, 2, 3}  # deflate, shuffle, checksum
_REFUSED = (
    OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, ArithmeticError, MemoryError
)  # fmt: skip
_STATUSES = ("running", "complete", "interrupted", "failed")


class UnreadableRunError(Exception):
    """The file is no run, is damaged, or asks for more than a run may; the text says which."""


class RunFile:
    """A run file, open for reading. Attributes in SI units; n bodies, f frames, s steps, d = 2 | 3."""

    def __init__(self, path: Path) -> None:
        """Opens the file and reads its header.

        Raises
        ------
        UnreadableRunError
            When it is missing, no run, of a later layout, or unsafe to read.
        """
        try:
            self._file = _opened(path)
            self._read_header()
            self._read_shapes()
        except _REFUSED as error:
            raise UnreadableRunError(f"{path}: {_why(path, error)}") from error

    def _read_header(self) -> None:
        attributes = self._file.attrs
        if _word(attributes, "format") != "carom-run":
            raise ValueError("HDF5, but no run of carom")
        self.version = int(attributes["schema_version"])
        if not 1 <= self.version <= LATEST:
            raise ValueError(f"layout version {self.version} is not known here; take the carom that wrote it")
        self.dt, self.every = float(attributes["dt"]), int(attributes["every"])
        self.space, self.scene_name = _word(attributes, "space"), _word(attributes, "scene_name")
        if self.space not in ("planar", "spatial"):
            raise ValueError(f"unknown space {self.space!r}")
        self.dimension, self.spins, self.turns = (2, 1, 2) if self.space == "planar" else (3, 3, 4)
        settings = json.loads(self._text("settings")[0])
        if not isinstance(settings, dict):
            raise ValueError("settings are no JSON object")
        self.settings: dict[str, Any] = settings
        self.names = self._text("bodies/name")
        n = len(self.names)
        self.kind = self._whole("bodies/kind", (n,))
        self.mass = self._whole("bodies/mass", (n,)).astype(np.float64)
        shape = (n,) if self.space == "planar" else (n, 3, 3)
        self.inertia = self._whole("bodies/inertia", shape).astype(np.float64)
        self.damping = [
            self._whole(name, (n,)).astype(np.float64) if self._has(name) else None
            for name in ("bodies/linear_damping", "bodies/angular_damping")
        ]
        self.extent = self._whole("bodies/extent", (n,)) if self._has("bodies/extent") else None
        self.has_joints = self._has("joints")
        row = self._whole("progress", (1,))[0]
        self.status = _STATUSES[int(row["status"])]
        self.steps_told = int(row["steps"])

    def _read_shapes(self) -> None:
        """Shapes of all growing arrays, and how many frames all of them have."""
        n, d = len(self.names), self.dimension
        widths = {
            "time": (), "position": (n, d), "rotation": (n, self.turns), "velocity": (n, d),
            "angular_velocity": (n, self.spins), "contact_offsets": (),
        }  # fmt: skip
        self.has_actions = self._has("frames/action_offsets") and self._has("actions")
        if self.has_actions:
            widths["action_offsets"] = ()
        self.has_events = all(
            self._has(name) for name in ("frames/event_offsets", "frames/piece_offsets", "events", "pieces")
        )
        if self.has_events:
            widths |= {"event_offsets": (), "piece_offsets": ()}
        self._arrays: dict[str, Any] = {}
        lengths = []
        for name, shape in widths.items():
            array = self._arrays[name] = self._dataset(f"frames/{name}")
            if array.shape[1:] != shape or array.dtype.kind not in ("iu" if "offsets" in name else "f"):
                raise ValueError(f"frames/{name} holds {array.dtype} of shape {array.shape}")
            lengths.append(len(array) - ("offsets" in name))
        self.frame_count, self.is_even = max(0, min(lengths)), len(set(lengths)) == 1
        more = ["actions"] if self.has_actions else []
        more += ["events", "pieces"] if self.has_events else []
        for name in ("contacts", "steps", *more):
            self._arrays[name] = self._dataset(name)
            if self._arrays[name].dtype.names is None:
                raise ValueError(f"{name} holds no records")
        self.step_count = len(self._arrays["steps"])
        if self.step_count > MOST_STEPS:
            raise ValueError(f"{self.step_count} steps; at most {MOST_STEPS} are checked")
        needed = {
            "steps": ("time", "dt", "residual", "kinetic", "potential", "momentum", "angular_momentum",
                      "contacts", "deepest_gap", "deepest_a", "deepest_b", "gravity", "closure"),
            "contacts": ("a", "b", "point", "normal", "gap", "normal_impulse", "friction_impulse"),
            "actions": ("body", "force", "torque", "correction", "correction_turn"),
            "events": ("act", "kind", "time", "length", "a", "b", "point", "normal", "arm_a", "arm_b", "gap",
                       "impulse", "moment", "friction", "restitution"),
            "pieces": ("act", "kind", "body", "time", "length", "shift", "turn", "impulse", "moment"),
        }  # fmt: skip
        for name, columns in needed.items():
            lacking = set(columns) - set(self.columns(name)) if name in self._arrays else set()
            if lacking:
                raise ValueError(f"{name} lack {', '.join(sorted(lacking))}")

    def columns(self, table: str) -> tuple[str, ...]:
        """Names of a table's columns, in order."""
        return tuple(self._arrays[table].dtype.names)

    def rows(self, name: str, begin: int, end: int) -> Any:
        """Rows of an array over frames, or of a table.

        Raises
        ------
        UnreadableRunError
            When they lie outside the array, are too many, or cannot be read.
        """
        array = self._arrays[name]
        size = array.dtype.itemsize * int(np.prod(array.shape[1:], dtype=np.int64))
        if not 0 <= begin <= end <= len(array) or (end - begin) * size > 64 * BLOCK:
            raise UnreadableRunError(f"{name}: rows {begin} to {end} of {len(array)} cannot be read at once")
        try:
            return array[begin:end]
        except (OSError, ValueError, RuntimeError) as error:
            raise UnreadableRunError(f"{name}: {str(error)[:200]}") from error

    def ranges(self, name: str) -> Iterator[tuple[int, int]]:
        """Begin and end of blocks of a table's rows, in order."""
        array = self._arrays[name]
        step = max(1, BLOCK // max(1, array.dtype.itemsize))
        return ((begin, min(begin + step, len(array))) for begin in range(0, len(array), step))

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    # --- what may be read ---

    def _has(self, name: str) -> bool:
        group, _, last = name.rpartition("/")
        if group and not isinstance(self._file.get(group, getlink=True), h5py.HardLink):
            raise ValueError(f"{group} is a link, or absent; a run holds its data itself")
        return last in (self._file[group] if group else self._file)

    def _dataset(self, name: str) -> Any:
        """A dataset that lies in this very file and holds plain numbers of a credible size."""
        place = self._file
        for part in name.split("/"):
            if not isinstance(place, h5py.Group) or part not in place:
                raise ValueError(f"holds no {name}")
            if not isinstance(place.get(part, getlink=True), h5py.HardLink):
                raise ValueError(f"{name} is a link; a run holds its data itself")
            place = place[part]
        if not isinstance(place, h5py.Dataset) or place.external or place.is_virtual:
            raise ValueError(f"{name} does not hold its data in this file")
        plist = place.id.get_create_plist()
        filters = {plist.get_filter(k)[0] for k in range(plist.get_nfilters())}
        if not filters <= _FILTERS:
            raise ValueError(f"{name} is packed by filters {sorted(filters - _FILTERS)}, which are not read")
        cell = place.dtype.itemsize
        if place.chunks is not None and int(np.prod(place.chunks, dtype=np.float64)) * cell > MOST_CHUNK:
            raise ValueError(f"{name} has chunks of more than {MOST_CHUNK} bytes")
        claimed = float(np.prod(place.shape, dtype=np.float64)) * cell
        if claimed > MOST_INFLATION * place.id.get_storage_size() + (1 << 20):
            raise ValueError(f"{name} claims {claimed:.3g} bytes and stores {place.id.get_storage_size()}")
        if h5py.check_string_dtype(place.dtype) is None and not _is_plain(place.dtype):
            raise ValueError(f"{name} holds {place.dtype}, not numbers")
        return place

    def _text(self, name: str) -> list[str]:
        """Texts of a dataset, one or many."""
        place = self._dataset(name)
        if h5py.check_string_dtype(place.dtype) is None or place.size > MOST_BODIES:
            raise ValueError(f"{name} holds no text, or more than {MOST_BODIES} lines")
        # many rows may name one long text: as many at a time as cannot be longer than the file allows
        step = min(4096, max(1, MOST_TEXT // max(1, self._file.id.get_filesize())))
        texts: list[str] = []
        blocks = [()] if place.shape == () else [slice(k, k + step) for k in range(0, len(place), step)]
        for block in blocks:
            texts += np.atleast_1d(place.asstr()[block]).tolist()
            if sum(map(len, texts)) > MOST_TEXT:
                raise ValueError(f"{name} is longer than {MOST_TEXT} characters")
        return [str(text) for text in texts]

    def _whole(self, name: str, shape: tuple[int, ...]) -> npt.NDArray[Any]:
        place = self._dataset(name)
        if place.shape != shape:
            raise ValueError(f"{name} has shape {place.shape}, expected {shape}")
        return np.asarray(place[...])


def _why(path: Path, error: BaseException) -> str:
    """What is wrong with a file, and what to do; the library's own words are of file descriptors."""
    if not path.exists():
        return "no such file; check the path"
    if path.is_dir():
        return "is a folder; give a file that `carom run` wrote"
    if isinstance(error, OSError) and not h5py.is_hdf5(path):
        reason = (error.strerror or str(error).split(",")[0])[:160]
        return f"is no HDF5 file ({reason}); give one that `carom run` wrote"
    return str(error)[:300]


def _opened(path: Path) -> Any:
    """Plain first; as a reader beside a writer when the file says that it is being written."""
    try:
        return h5py.File(path, "r", libver="latest")
    except FileNotFoundError:
        raise
    except OSError:
        return h5py.File(path, "r", libver="latest", swmr=True)


def _is_plain(dtype: Any) -> bool:
    """True for numbers, and for records of numbers."""
    base = dtype.base
    if base.names is not None:
        return all(_is_plain(base[name]) for name in base.names)
    return bool(base.kind in "fiu")


def _word(attributes: Any, name: str) -> str:
    value = attributes.get(name, "")
    return value.decode() if isinstance(value, bytes) else str(value)
