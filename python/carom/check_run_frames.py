"""The part of a run's check that looks at single frames: recorded totals against those of the bodies,
contacts against what their step told of them. numpy alone.

Bounds are rounding: a number of operations times the unit roundoff times the sizes that were added up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

if __package__:
    from carom.check_run_rules import Bodies, Floats, cross, dot, norm
else:
    from check_run_rules import Bodies, Floats, cross, dot, norm  # type: ignore[import-not-found,no-redef]

if TYPE_CHECKING:
    from carom.check_run_file import RunFile

EPS = float(np.finfo(np.float64).eps)
#: Unit roundoffs that a chain of some dozen operations on one body may add up to [1].
OPERATIONS = 256
#: Rounds of impacts whose errors may add up in one contact [1].
ROUNDS = 16

#: Checks by name: what must hold, and the unit of value and bound.
FRAME_CHECKS = {
    "unit_rotations": ("rotations have unit length", "1"),
    "kinetic": ("kinetic energy is that of masses, inertias and velocities", "J"),
    "potential": ("potential energy is that of masses and positions", "J"),
    "momentum": ("momentum is that of masses and velocities", "kg m/s"),
    "angular_momentum": ("angular momentum about the origin is that of the bodies", "kg m^2/s"),
    "cone": ("contact impulses push, and friction stays within its limit", "N s"),
}
#: Columns of contacts since layout version 2.
AUDITED = ("friction", "impact_impulse", "kick_normal", "kick_arm", "moment")

Checks = dict[str, Any]


def in_space(array: Any, spin: bool = False) -> Floats:
    """Vectors of the plane as vectors of space, spins along the third axis."""
    given: Floats = np.asarray(array, dtype=np.float64)
    if given.shape[-1] == 3:
        return given
    out: Floats = np.zeros((*given.shape[:-1], 3), dtype=np.float64)
    if spin:
        out[..., 2] = given[..., 0]
    else:
        out[..., :2] = given
    return out


def bodies_of(file: RunFile) -> Bodies:
    """The constants of a run's bodies; one that forces do not move, or not turn, gets an inertia of one."""
    n = len(file.names)
    if not (file.mass[file.kind == 0] > 0).all():
        raise ValueError("a dynamic body has no positive mass")
    moves = (file.kind == 0) & np.isfinite(file.mass)
    inertia = file.inertia[:, None, None] * np.eye(3) if file.space == "planar" else file.inertia
    trace = np.trace(inertia, axis1=1, axis2=2)
    turns = moves & (trace > 0) & np.isfinite(trace)
    inertia = np.where(turns[:, None, None], inertia, np.eye(3))
    moments, axes = np.linalg.eigh(inertia) if n else (np.ones((0, 3)), np.ones((0, 3, 3)))
    if not (moments > 0).all() or (inertia != np.swapaxes(inertia, 1, 2)).any():
        raise ValueError("the inertia of a body is not symmetric and positive")
    # equal moments differ by rounding: they turn steadily
    even = moments[:, 2] - moments[:, 0] <= 8 * EPS * moments[:, 2] if n else np.zeros(0, dtype=bool)
    moments = np.where(even[:, None], moments[:, 1:2], moments)
    zero = np.zeros(n)
    decay, spin_decay = (
        np.where(moves, zero if rate is None else rate, 0.0) for rate in (file.damping[0], file.damping[1])
    )
    half = 1.0 if file.space == "planar" else 0.5
    mass = np.where(moves, file.mass, 1.0)
    inverse: Floats = np.linalg.inv(inertia).astype(np.float64)
    return Bodies(moves, turns, mass, inertia, inverse, moments, axes, decay, spin_decay, half)


@dataclass
class Frames:
    """Frames one after another, in space; `step` is the number of the step that ends at each, -1 for none."""

    begin: int
    time: Floats
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    contacts: npt.NDArray[np.void]
    frame: npt.NDArray[np.int64]
    actions: npt.NDArray[np.void] | None
    acted: npt.NDArray[np.int64]
    step: npt.NDArray[np.int64]
    raw_rotation: Floats
    events: Any = None
    of_event: Any = None
    pieces: Any = None
    of_piece: Any = None

    @classmethod
    def read(cls, file: RunFile, begin: int, end: int) -> Frames:
        """Frames begin to end of a file, with their contacts and actions."""
        take = {
            name: file.rows(name, begin, end) for name in ("time", "position", "velocity", "angular_velocity")
        }
        raw = np.asarray(file.rows("rotation", begin, end), dtype=np.float64)
        rotation = raw
        if file.space == "planar":
            rotation = np.concatenate([raw[..., :1], np.zeros((*raw.shape[:-1], 2)), raw[..., 1:]], axis=-1)
        contacts, frame = _ragged(file, "contacts", "contact_offsets", begin, end)
        actions, acted = None, frame[:0]
        if file.has_actions:
            actions, acted = _ragged(file, "actions", "action_offsets", begin, end)
        more: dict[str, Any] = {}
        if file.has_events:
            more["events"], more["of_event"] = _ragged(file, "events", "event_offsets", begin, end)
            more["pieces"], more["of_piece"] = _ragged(file, "pieces", "piece_offsets", begin, end)
        return cls(
            begin, np.asarray(take["time"], dtype=np.float64), in_space(take["position"]), rotation,
            in_space(take["velocity"]), in_space(take["angular_velocity"], spin=True), contacts, frame,
            actions, acted, np.full(end - begin, -1), raw, **more,
        )  # fmt: skip

    def find_steps(self, times: Floats, start: float) -> None:
        """Which step ends at each frame; -2 for a time at which none does."""
        at = np.searchsorted(times, self.time)
        hit = (
            (at < len(times)) & (times[np.minimum(at, len(times) - 1)] == self.time) if len(times) else at < 0
        )
        self.step = np.where(hit, at, np.where(self.time == start, -1, -2))

    def arrays(self) -> Iterator[tuple[str, Floats]]:
        """Names and numbers of the arrays over frames."""
        for name in ("time", "position", "rotation", "velocity", "angular_velocity"):
            yield name, getattr(self, name)

    def tables(self) -> Iterator[tuple[str, Any, Any]]:
        """Names, records and frame of each record of the ragged tables."""
        yield "contacts", self.contacts, self.frame
        if self.actions is not None:
            yield "actions", self.actions, self.acted
        if self.events is not None:
            yield "events", self.events, self.of_event
            yield "pieces", self.pieces, self.of_piece

    def energies(self, bodies: Bodies, gravity: Floats) -> tuple[Floats, Floats, Floats]:
        """Kinetic and potential energy of each frame, and the sum of the absolute terms of both [J]."""
        v, w = self.velocity, self.angular_velocity
        spun = bodies.momentum(self.rotation, w)
        kinetic = bodies.kinetic(v, w, spun)
        potential = np.where(bodies.moves, -bodies.mass * (self.position @ gravity), 0)
        sizes = bodies.mass[:, None] * np.abs(self.position * gravity)
        # an inertia that is turned has the rounding of its largest moment, about whatever axis the body spins
        spinning = np.where(bodies.turns, 0.5 * bodies.moments[:, 2] * dot(w, w), 0)
        size = kinetic + spinning + np.where(bodies.moves, sizes.sum(axis=-1), 0)
        return kinetic.sum(axis=1), potential.sum(axis=1), size.sum(axis=1)


def _ragged(file: RunFile, table: str, offsets: str, begin: int, end: int) -> tuple[Any, Any]:
    """Records of some frames, and the frame of each, from 0; offsets that make no sense are an error."""
    at = (
        np.asarray(file.rows(offsets, begin, end + 1), dtype=np.int64)
        if end > begin
        else np.zeros(1, np.int64)
    )
    if (np.diff(at) < 0).any() or at[0] < 0:
        raise ValueError(f"{offsets} of frames {begin} to {end} do not increase")
    rows = file.rows(table, int(at[0]), int(at[-1]))
    return rows, np.repeat(np.arange(end - begin), np.diff(at))


# --- totals of frames ---


def check_frames(
    checks: Checks, file: RunFile, bodies: Bodies, gravity: Floats, frames: Frames, fresh: slice
) -> None:
    """Rotations, contacts and recorded totals of frames; `fresh` are those not looked at before."""
    names = file.names
    step = frames.step[fresh]
    off = norm(frames.raw_rotation[fresh]) - 1
    checks["unit_rotations"].see(off, 8 * EPS, step[:, None], lambda k: names[k % len(names)])
    has_step = np.flatnonzero(frames.step >= 0)
    has_step = has_step[has_step >= (fresh.start or 0)]
    _check_contacts(checks, file, bodies, frames, has_step)
    if not len(has_step):
        return
    first, last = int(frames.step[has_step].min()), int(frames.step[has_step].max())
    rows = file.rows("steps", first, last + 1)[frames.step[has_step] - first]
    number = frames.step[has_step]
    kinetic, potential, size = (e[has_step] for e in frames.energies(bodies, gravity))
    many = EPS * (OPERATIONS + len(names))
    bound = many * size
    checks["kinetic"].see(rows["kinetic"] - kinetic, bound, number)
    checks["potential"].see(rows["potential"] - potential, bound, number)
    v, w, x = (a[has_step] for a in (frames.velocity, frames.angular_velocity, frames.position))
    moves, turns = bodies.moves[:, None], bodies.turns[:, None]
    p = np.where(moves, bodies.mass[:, None] * v, 0)
    spun = np.where(turns, bodies.momentum(frames.rotation[has_step], w), 0)
    told = in_space(rows["momentum"])
    checks["momentum"].see(norm(told - p.sum(axis=1)), many * norm(p).sum(axis=1), number)
    spin = rows["angular_momentum"]
    told = in_space(spin.reshape(len(spin), -1), spin=True)
    total = (cross(x, p) + spun).sum(axis=1)
    size = (norm(x) * norm(p) + np.where(bodies.turns, bodies.moments[:, 2] * norm(w), 0)).sum(axis=1)
    checks["angular_momentum"].see(norm(told - total), many * size, number)


def _check_contacts(checks: Checks, file: RunFile, bodies: Bodies, frames: Frames, has_step: Any) -> None:
    """Contacts against what their step told of them, and against their own limits."""
    rows, frame = frames.contacts, frames.frame
    n = len(file.names)
    check = checks["contact_table"]
    bad = (rows["a"] < 0) | (rows["a"] >= n) | (rows["b"] < 0) | (rows["b"] >= n) | (rows["a"] == rows["b"])
    if bad.any():
        raise ValueError(
            f"a contact of frame {frames.begin + int(frame[bad][0])} names bodies that are not there"
        )
    if frames.actions is not None and ((frames.actions["body"] < 0) | (frames.actions["body"] >= n)).any():
        raise ValueError("an action names a body that is not there")
    mine = np.isin(frame, has_step)
    rows, frame = rows[mine], frame[mine]
    number, pair = frames.step[frame], pair_of(file, rows)
    normal = in_space(rows["normal"])
    check.see(norm(normal) - 1, 8 * EPS, number, pair)
    if len(has_step):
        first, last = int(frames.step[has_step].min()), int(frames.step[has_step].max())
        steps = file.rows("steps", first, last + 1)[frames.step[has_step] - first]
        count = np.bincount(frame, minlength=len(frames.time))[has_step]
        check.see(
            count - steps["contacts"].astype(float),
            0.0,
            frames.step[has_step],
            lambda k: "number of contacts",
        )
        deepest = np.full(len(frames.time), np.inf)
        np.minimum.at(deepest, frame, rows["gap"])
        off = np.where(count > 0, deepest[has_step] - steps["deepest_gap"], 0.0)
        check.see(off, 0.0, frames.step[has_step], lambda k: "smallest gap")
    if not set(AUDITED) <= set(rows.dtype.names or ()):
        checks["cone"].note = "coefficients of friction are recorded since layout version 2"
        return
    if not len(rows) or file.settings.get("scheme") == "events":
        return  # of a step that is divided these are sums; the cone is that of each event
    if file.settings.get("scheme") == "soft_step":
        checks["cone"].note = "friction of soft steps is limited face by face, not point by point"
        return
    residual = np.zeros(len(frames.time))
    residual[has_step] = steps["residual"]
    check = checks["cone"]
    whole = rows["normal_impulse"][:, None] * normal + in_space(rows["friction_impulse"])
    impact, kick_normal = in_space(rows["impact_impulse"]), in_space(rows["kick_normal"])
    check_units = checks["contact_table"]
    check_units.see(norm(kick_normal) - 1, 8 * EPS, number, pair)
    light = _reduced_mass(bodies, rows)
    spread = np.sqrt(2) if file.settings.get("friction_law") == "box" and file.space == "spatial" else 1.0
    for impulse, along, rounds in ((impact, normal, ROUNDS), (whole - impact, kick_normal, 1)):
        push = dot(impulse, along)
        side = norm(impulse - push[:, None] * along)
        outside = np.maximum(side - spread * rows["friction"] * np.maximum(push, 0), np.maximum(-push, 0))
        size = norm(whole) + norm(impact)
        bound = rounds * residual[frame] * light + OPERATIONS * EPS * size
        check.see(np.maximum(outside, 0), bound, number, pair)


def _reduced_mass(bodies: Bodies, rows: Any) -> Floats:
    """The largest effective mass that a contact can have: that of a blow through both centres [kg]."""
    inverse = np.where(bodies.moves, 1 / bodies.mass, 0.0)
    return np.asarray(1 / np.maximum(inverse[rows["a"]] + inverse[rows["b"]], 1e-300))


def pair_of(file: RunFile, rows: Any) -> Callable[[int], str]:
    """Names a contact by its bodies, from its place among the rows."""
    return lambda k: f"{file.names[int(rows['a'][k])]} / {file.names[int(rows['b'][k])]}"
