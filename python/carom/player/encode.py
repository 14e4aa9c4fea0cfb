"""A run as the payload of a page: what is kept of it, how it is stored, and what that loses.

Motion is kept at every frame, or at every k-th where the page would grow too large; details (contacts and
velocities) at every m-th of those. What was left out and the largest errors of positions and rotations are
measured and told in the page. Knows no drawing.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from carom.errors import CaromError
from carom.player.payload import Payload
from carom.player.quantise import (
    FINEST,
    encode_position,
    encode_rotation,
    halves,
    position_error,
    rotation_error,
)
from carom.player.shapes import shapes_of_run
from carom.player.steps import columns_of
from carom.player.words import Told
from carom.recording import OWN_LAWS, Floats, Records

if TYPE_CHECKING:
    from carom.recorded import Run

#: Size that a page is kept below when nothing else is asked for [bytes].
MAX_BYTES = 20_000_000
#: Raw numbers that are packed at most before anything is measured: motion (body-frames), details (contacts).
_MOST_BODY_FRAMES, _MOST_CONTACTS = 4_000_000, 2_000_000
#: Share of the size that motion may take before details go [1].
_MOTION_SHARE = 0.7


@dataclass(frozen=True)
class Thinning:
    """Frames that are kept: every `frames`-th; every `details`-th of those with contacts and velocities."""

    frames: int = 1
    details: int = 1


def encode_run(run: Run, max_bytes: int, told: Told | None = None) -> tuple[Payload, Thinning]:
    """The payload of a run that packs into about `max_bytes`, and how it was thinned for that.

    `told` is what running its scene again said.

    Raises
    ------
    CaromError
        When the run has no frame, or a pose that is not finite.
    """
    _check(run)
    told = Told({}) if told is None else told
    thinning = _first_guess(run)
    while True:
        payload, motion, details, size = _encoded(run, thinning, told)
        if size <= max_bytes or thinning.frames >= len(run.time):
            return payload, thinning
        thinning = _thinner(thinning, motion, details, size, max_bytes)


def _check(run: Run) -> None:
    if len(run.time) == 0:
        raise CaromError("replay: the run holds no frame; run the scene again", field="run")
    if not run.names:
        raise CaromError("replay: the run holds no body; add one and run it again", field="run")
    for name in ("position", "rotation", "velocity", "angular_velocity"):
        bad = np.argwhere(~np.isfinite(getattr(run, name)))
        if len(bad):
            frame, body = int(bad[0][0]), int(bad[0][1])
            remedy = "find the step with carom check"
            raise CaromError(
                f"body {run.names[body]!r}: {name} is not finite at frame {frame}; {remedy}",
                body=run.names[body], field=name, remedy=remedy,
            )  # fmt: skip


def _first_guess(run: Run) -> Thinning:
    frames = max(1, math.ceil(len(run.time) * len(run.names) / _MOST_BODY_FRAMES))
    contacts = int(run.contacts.offsets[-1]) / frames
    return Thinning(frames, max(1, math.ceil(contacts / _MOST_CONTACTS)))


def _thinner(given: Thinning, motion: float, details: float, size: float, limit: int) -> Thinning:
    """Fewer details first; fewer frames when motion alone takes most of what there is."""
    if motion > _MOTION_SHARE * limit or given.details >= 16:
        factor = max(2, math.ceil(size / limit))
        return Thinning(given.frames * factor, max(1, given.details // factor))
    left = max(limit - (size - details), 0.1 * limit)
    return Thinning(given.frames, given.details * max(2, math.ceil(details / left)))


def _encoded(run: Run, thinning: Thinning, told: Told) -> tuple[Payload, float, float, int]:
    """The payload, and about how many bytes of the page motion, details and all of it take."""
    frames = _every(len(run.time), thinning.frames)
    details = frames[_every(len(frames), thinning.details)]
    payload = Payload()
    payload.table |= _about(run)
    moved = _add_motion(payload, run, frames)
    payload.table["words"] = told.table
    detailed = _add_details(payload, run, details, frames)
    detailed += _add_residuals(payload, run, details, told)
    points = _add_steps(payload, run)
    _add_bodies(payload, run)
    payload.table["kept"] = {
        "frames": len(frames),
        "of_frames": len(run.time),
        "details": len(details),
        "steps_per_point": points,
        "steps": len(run.steps),
    }
    return payload, moved, detailed, len(payload.packed())


def _every(count: int, stride: int) -> npt.NDArray[np.int64]:
    """Every `stride`-th of `count`, and the last."""
    return np.unique(np.append(np.arange(0, count, stride), count - 1))


def _about(run: Run) -> dict[str, Any]:
    header = run.header
    gravity = [float(g) for g in np.atleast_1d(header.settings.get("gravity", [0.0]))]
    return {
        "title": header.scene_name or "run",
        "space": run.space,
        "status": run.status,
        "created": header.created,
        "carom": header.version,
        "dt": header.dt,
        "ms_per_step": run.ms_per_step if math.isfinite(run.ms_per_step) else None,
        "gravity": gravity,
        "solver": run.summary()["solver"],
        "impact": header.settings.get("impact") or OWN_LAWS[header.settings.get("scheme") or "fixed_step"],
        "settings": {name: _told(value) for name, value in header.settings.items() if value is not None},
        "sleeping": _may_sleep(header.settings),
        "names": list(run.names),
        "joints": [dict(joint) for joint in header.joints],
        "energy_closure": run.energy_closure,
        "worst": _extreme(run.worst),
        "deepest": _extreme(run.deepest),
    }


def _may_sleep(settings: Mapping[str, Any]) -> bool:
    """Whether bodies of a run may fall asleep: what is held has no velocity then."""
    soft = settings.get("soft")
    return settings.get("scheme") == "soft_step" and isinstance(soft, dict) and soft.get("sleeping") is True


def _told(value: Any) -> Any:
    """A setting as text that can be shown; long ones are cut."""
    return value if isinstance(value, (bool, int, str)) else str(value)[:200]


def _extreme(worst: Any) -> dict[str, Any]:
    return {
        "value": float(worst.value) if math.isfinite(worst.value) else None,
        "step": int(worst.step),
        "time": float(worst.time) if math.isfinite(worst.time) else None,
        "between": list(worst.between) if worst.between is not None else None,
    }


def _add_motion(payload: Payload, run: Run, frames: npt.NDArray[np.int64]) -> float:
    position, rotation = run.position[frames], run.rotation[frames]
    size = float(np.ptp(position.reshape(-1, position.shape[2]), axis=0).max(initial=0.0))
    codes, low, step = encode_position(position, max(size, 1e-9) * FINEST)
    turns = encode_rotation(rotation)
    payload.table["error"] = {
        "position": position_error(position, codes, low, step),
        "rotation": rotation_error(rotation, turns),
    }
    payload.add("time", run.time[frames])
    payload.add("position", codes, "delta shuffle")
    payload.add("position_low", low)
    payload.add("position_step", step)
    payload.add("rotation", turns, "delta shuffle")
    return _size(np.diff(codes, axis=0, prepend=codes[:1])) + _size(np.diff(turns, axis=0, prepend=turns[:1]))


def _add_details(
    payload: Payload, run: Run, details: npt.NDArray[np.int64], frames: npt.NDArray[np.int64]
) -> float:
    """Contacts and velocities of some of the kept frames; "detail_frames" numbers them among the kept."""
    parts = [run.contacts[int(frame)] for frame in details] if len(details) < len(run.time) else None
    contacts = run.contacts.all() if parts is None else np.concatenate(parts)
    counts = np.diff(run.contacts.offsets)[details]
    payload.add("detail_frames", np.searchsorted(frames, details).astype(np.int32))
    payload.add("contact_offsets", np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32))
    taken = 0.0
    for name, values, scale in (
        *_motion_columns(run, details),
        *_contact_columns(contacts, len(run.names)),
    ):
        payload.add(name, values, "shuffle" if values.itemsize == 2 else "")
        payload.table.setdefault("scale", {})[name] = scale
        taken += _size(values)
    return taken


def _add_residuals(payload: Payload, run: Run, details: npt.NDArray[np.int64], told: Told) -> float:
    """Residuals of the contacts, a byte of their logarithm: 0 where not known, else a twelfth of a digit."""
    codes = [np.zeros(0, dtype=np.uint8)]
    for frame in details:
        contacts = run.contacts[int(frame)]
        residual = told.residuals_of(int(frame), contacts["a"], contacts["b"])
        with np.errstate(divide="ignore"):
            code = 1 + np.clip(np.rint(12 * (np.log10(residual) + 18)), 0, 254)
        codes.append(np.where(np.isnan(residual), 0, np.nan_to_num(code)).astype(np.uint8))
    column = np.concatenate(codes)
    payload.add("contact_residual", column)
    return _size(column)


def _motion_columns(run: Run, details: npt.NDArray[np.int64]) -> list[tuple[str, npt.NDArray[Any], float]]:
    return [
        ("velocity", *halves(run.velocity[details])),
        ("angular_velocity", *halves(run.angular_velocity[details])),
    ]


def _contact_columns(contacts: Records, bodies: int) -> list[tuple[str, npt.NDArray[Any], float]]:
    """Columns of the contacts: bodies, place, direction, gap, impulses, slip and status."""
    number = np.uint16 if bodies < 65535 else np.int32
    point = contacts["point"]
    low = point.min(axis=0) if len(point) else np.zeros(point.shape[1])
    span = (float(np.ptp(point, axis=0).max()) if len(point) else 0.0) or 1.0
    place = np.rint((point - low) / span * 65535).astype(np.uint16)
    columns: list[tuple[str, npt.NDArray[Any], float]] = [
        ("contact_a", contacts["a"].astype(number), 1.0),
        ("contact_b", contacts["b"].astype(number), 1.0),
        ("contact_point", place, span / 65535),
        ("contact_point_low", low.astype(np.float64), 1.0),
        ("contact_status", contacts["status"].astype(np.uint8), 1.0),
    ]
    for name, field in (
        ("normal", "normal"),
        ("gap", "gap"),
        ("normal_impulse", "normal_impulse"),
        ("friction_impulse", "friction_impulse"),
        ("slip", "slip"),
        ("friction", "friction"),
    ):
        if field in (contacts.dtype.names or ()):
            columns.append((f"contact_{name}", *halves(_finite(contacts[field]))))
    return columns


def _finite(values: Floats) -> Floats:
    return np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)


def _add_steps(payload: Payload, run: Run) -> int:
    columns, every = columns_of(run.steps)
    for name, values in columns.items():
        payload.add(f"step_{name}", values)
    return every


def _add_bodies(payload: Payload, run: Run) -> None:
    header, shapes = run.header, shapes_of_run(run)
    payload.table["shapes"] = [dict(shape) for shape in shapes.tables]
    if shapes.note:
        payload.table["note"] = shapes.note
    payload.add("kind", header.kind.astype(np.uint8))
    payload.add("shape", shapes.index.astype(np.int32))
    payload.add("center", shapes.center)
    payload.add("inverse_mass", np.where(np.isfinite(header.mass), 1 / header.mass, 0.0))
    payload.add("inverse_inertia", _inverse_inertia(run))


def _inverse_inertia(run: Run) -> Floats:
    """(n, 1) or (n, 9), body axes [1/(kg m^2)]; 0 for what nothing turns."""
    inertia = run.header.inertia
    found = np.zeros((len(inertia), 1 if inertia.ndim == 1 else 9))
    for body, given in enumerate(inertia):
        if np.isfinite(given).all() and np.trace(np.atleast_2d(given)) > 0:
            found[body] = np.linalg.inv(np.atleast_2d(given)).reshape(-1)
    return found


def _size(values: npt.NDArray[Any]) -> float:
    """About how many bytes of base64 an array takes."""
    raw = np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.itemsize).T.tobytes()
    return 4 / 3 * len(zlib.compress(raw, 1))
