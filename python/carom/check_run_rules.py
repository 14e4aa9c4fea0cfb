"""What one step of each integrator does, written out again with numpy for the check of recorded runs.

From the state before a step, its impulses, loads and position correction follow the velocities after it; from
the velocities of both ends follows the pose after it. The plane is a slice of space here: vectors get a zero,
angles become (cos, 0, 0, sin). Arrays are (steps, bodies, 3 | 4). Sources: theory eqs. 2.2 to 2.18 (rotation)
and 6.1 to 6.9 (the step). Knows no files and not a line of the engine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

#: Share of the end velocity in a step's displacement, by integrator [1].
END_SHARE = {
    "explicit_euler": 0.0,
    "semi_implicit_euler": 1.0,
    "trapezoid": 0.5,
    "implicit_midpoint": 0.5,
    "rk4": 0.5,
}
#: Rounds of the midpoint rule's fixed point before a step is halved [1].
_ROUNDS = 60


def dot(a: Floats, b: Floats) -> Floats:
    """Products over the last axis, summed."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products over the last axis; numpy's own is several times slower on many short vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return out


def apply(r: Floats, v: Floats) -> Floats:
    """Matrices times vectors."""
    return np.asarray(np.einsum("...ij,...j->...i", r, v))


def apply_back(r: Floats, v: Floats) -> Floats:
    """Transposed matrices times vectors."""
    return np.asarray(np.einsum("...ji,...j->...i", r, v))


def norm(a: Floats) -> Floats:
    """Lengths over the last axis."""
    return np.sqrt(dot(a, a))


def product(p: Floats, q: Floats) -> Floats:
    """Hamilton's product: the rotation `q` followed by `p`."""
    (a, u), (b, v) = (p[..., :1], p[..., 1:]), (q[..., :1], q[..., 1:])
    return np.concatenate([a * b - dot(u, v)[..., None], a * v + b * u + cross(u, v)], axis=-1)


def unit(q: Floats) -> Floats:
    """Unit length restored."""
    return q / norm(q)[..., None]


def matrix(q: Floats) -> Floats:
    """Matrices that turn body axes into world axes; any for bodies of the plane."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    out = np.empty((*q.shape[:-1], 3, 3))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
    )
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = (
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
    )
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2] = (
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
    return out


def angle_between(p: Floats, q: Floats) -> Floats:
    """A bound of the angle between rotations, up to four times it [rad]: twice the distance, either sign."""
    return 4 * np.minimum(norm(p - q), norm(p + q))


@dataclass(frozen=True)
class Bodies:
    """Constants of the bodies; bodies that forces do not move, or not turn, have an inertia of one.

    Attributes
    ----------
    moves, turns : (n,) bool; whether impulses change the velocity, the angular velocity
    mass : (n,) [kg], 1 where nothing moves
    inertia, inverse : (n, 3, 3), body axes [kg m^2] and [1/(kg m^2)]
    moments, axes : (n, 3) ascending principal moments [kg m^2], (n, 3, 3) their axes as columns
    decay, spin_decay : (n,) damping of velocity and of angular velocity [1/s]
    half : 1/2 in space, 1 in the plane, where numbers turn by the whole angle
    """

    moves: npt.NDArray[np.bool_]
    turns: npt.NDArray[np.bool_]
    mass: Floats
    inertia: Floats
    inverse: Floats
    moments: Floats
    axes: Floats
    decay: Floats
    spin_decay: Floats
    half: float

    @property
    def condition(self) -> Floats:
        """(n,) largest over smallest principal moment [1]."""
        return np.asarray(self.moments[:, 2] / self.moments[:, 0])

    def about(self, s: Floats) -> Floats:
        """The rotation by the angle |s| about the axis s."""
        size = norm(s)[..., None] * self.half
        return np.concatenate([np.cos(size), self.half * s * np.sinc(size / np.pi)], axis=-1)

    def rate(self, q: Floats, w: Floats) -> Floats:
        """Time derivative of a rotation's numbers [1/s]."""
        return product(np.concatenate([0 * w[..., :1], self.half * w], axis=-1), q)

    def momentum(self, q: Floats, w: Floats) -> Floats:
        """L = I w in world axes [kg m^2/s]."""
        r = matrix(q)
        return apply(r, apply(self.inertia, apply_back(r, w)))

    def spin(self, q: Floats, momentum: Floats) -> Floats:
        """w = I^-1 L in world axes [rad/s]."""
        r = matrix(q)
        return apply(r, apply(self.inverse, apply_back(r, momentum)))

    def kinetic(self, v: Floats, w: Floats, momentum: Floats) -> Floats:
        """Kinetic energy of each body that forces move [J]."""
        turning = np.where(self.turns, dot(w, momentum), 0.0)
        return 0.5 * (np.where(self.moves, self.mass * dot(v, v), 0.0) + turning)


def free_turn(bodies: Bodies, rule: str, q: Floats, momentum: Floats, h: Floats) -> list[Floats]:
    """Free rotation over a time: by splitting (trapezoid), or by the midpoint rule, whole and halved."""
    if rule != "implicit_midpoint":
        return [_split(bodies, q, momentum, h)]
    whole = _midpoint(bodies, q, momentum, h)
    halves = _midpoint(bodies, _midpoint(bodies, q, momentum, h / 2), momentum, h / 2)
    return [whole, halves]


def _split(bodies: Bodies, q: Floats, momentum: Floats, h: Floats) -> Floats:
    """T = L^2/(2 I_m) + the excesses of two axes: Strang's product of their exact flows (eq. 2.15)."""
    reference = 1 / bodies.moments[:, 1]
    for axis, share in ((0, 0.5), (2, 1.0), (0, 0.5)):
        excess = 1 / bodies.moments[:, axis] - reference
        direction = apply(matrix(q), bodies.axes[:, :, axis])
        along = dot(direction, momentum)
        q = product(bodies.about(direction * (share * h * excess * along)[..., None]), q)
    return unit(product(bodies.about(momentum * (h * reference)[..., None]), q))


def _midpoint(bodies: Bodies, q: Floats, momentum: Floats, h: Floats) -> Floats:
    """p1 = p0 + h pm x I^-1 pm in body axes, R1 = R0 cay(h I^-1 pm) (eq. 2.16); nan if unsettled."""
    steady = bodies.moments[:, 0] == bodies.moments[:, 2]
    start = apply_back(matrix(q), momentum)
    middle, change = start, norm(start)
    for _ in range(_ROUNDS):
        turned = cross(middle, apply(bodies.inverse, middle))
        last, middle = middle, start + np.where(steady, 0, 0.5 * h)[..., None] * turned
        change = norm(middle - last)
        if (steady | (change <= 1e-16 * norm(start))).all():
            break
    spin = apply(bodies.inverse, middle)
    turn = h[..., None] * spin
    cayley = unit(np.concatenate([np.ones_like(turn[..., :1]), 0.5 * turn], axis=-1))
    step = np.where(steady[..., None], bodies.about(turn), cayley)
    settled = (change <= 1e-14 * norm(start)) | steady
    return np.where(settled[..., None], unit(product(q, step)), np.nan)


def rk4_turn(bodies: Bodies, q: Floats, momentum: Floats, h: Floats) -> Floats:
    """Runge and Kutta's rotation without torque: four stages of unit length, L constant (eq. 2.18)."""
    out, rate = q, 0 * q
    for weight, at in ((1 / 6, 0.0), (1 / 3, 0.5), (1 / 3, 0.5), (1 / 6, 1.0)):
        stage = unit(q + (at * h)[..., None] * rate)
        rate = bodies.rate(stage, bodies.spin(stage, momentum))
        out = out + (weight * h)[..., None] * rate
    return unit(out)


@dataclass
class Step:
    """Steps side by side: what was recorded, then what `follow` makes of it.

    Attributes
    ----------
    h : (f,) lengths [s]
    gravity : (3,) [m/s^2]
    x0, v0, w0, q0, x1, v1, w1, q1 : (f, n, 3 | 4) states before and after, SI units
    impact, impact_moment, kick, kick_moment : (f, n, 3) sums of the contacts' impulses [N s], and of their
        moments about the centre of mass [N m s]
    force, torque, moved, turned : (f, n, 3) loads [N], [N m]; position correction [m], [rad]
    v_start, w_start, v_end, w_end : velocities between which the kick acts [m/s], [rad/s]
    v_loaded, w_loaded : after loads, before the kick's contacts [m/s], [rad/s]
    v_struck, w_struck : velocities after the impacts
    x_kick, q_kick : poses where the kick acts
    momentum_start, momentum_end : angular momenta beside `w_start` and `w_end` [kg m^2/s]
    lost : (f, n) bool; where the midpoint rule does not settle and the engine halves its steps
    """

    rule: str
    h: Floats
    gravity: Floats
    x0: Floats
    v0: Floats
    w0: Floats
    q0: Floats
    x1: Floats
    v1: Floats
    w1: Floats
    q1: Floats
    force: Floats
    torque: Floats
    moved: Floats
    turned: Floats
    impact: Floats = None  # type: ignore[assignment]
    impact_moment: Floats = None  # type: ignore[assignment]
    kick: Floats = None  # type: ignore[assignment]
    kick_moment: Floats = None  # type: ignore[assignment]
    v_start: Any = None
    w_start: Any = None
    v_end: Any = None
    w_end: Any = None
    v_loaded: Any = None
    w_loaded: Any = None
    v_struck: Any = None
    w_struck: Any = None
    x_kick: Any = None
    q_kick: Any = None
    lost: Any = None
    momentum_start: Any = None
    momentum_end: Any = None

    def strike(self, bodies: Bodies) -> None:
        """From the impacts to the pose of the kick: velocities after impacts and damping, drift."""
        h = self.h[:, None]
        moves, turns = bodies.moves[:, None], bodies.turns[:, None]
        self.v_struck = self.v0 + np.where(moves, self.impact / bodies.mass[:, None], 0)
        spun = bodies.momentum(self.q0, self.w0) + np.where(turns, self.impact_moment, 0)
        self.w_struck = np.where(turns, bodies.spin(self.q0, spun), self.w0)
        fade = np.exp(-0.5 * h * bodies.decay)[..., None]
        fade_spin = np.exp(-0.5 * h * bodies.spin_decay)[..., None]
        self.v_start, self.momentum_start = fade * self.v_struck, fade_spin * spun
        self.v_end = self.v1 / fade
        self.momentum_end = bodies.momentum(self.q1, self.w1) / fade_spin
        is_half_way = self.rule in ("trapezoid", "implicit_midpoint")
        self.x_kick = self.x0 + (0.5 if is_half_way else 0.0) * h[..., None] * self.v_start
        if self.rule == "rk4":  # half a step back from where the contacts' impulses carry on
            self.x_kick = self.x1 - self.moved - 0.5 * h[..., None] * self.v_end
        self.q_kick, self.lost = self.q0, np.zeros(self.q0.shape[:2], dtype=bool)
        if self.rule in ("trapezoid", "implicit_midpoint"):
            turned = free_turn(bodies, self.rule, self.q0, self.momentum_start, 0.5 * h + 0 * bodies.mass)
            self.lost = np.isnan(turned[0]).any(axis=-1)
            self.q_kick = np.where(self.lost[..., None], self.q0, turned[0])
        elif self.rule == "rk4":
            self.q_kick = rk4_turn(bodies, self.q0, self.momentum_start, h + 0 * bodies.mass)
        self.w_start = bodies.spin(self.q_kick, self.momentum_start)
        self.w_end = bodies.spin(self.q_kick, self.momentum_end)
        if self.rule == "explicit_euler":
            # a correction that turns a body keeps its momentum, and here the kick is followed by its velocity
            self.w_end = bodies.spin(self.uncorrected(bodies), bodies.momentum(self.q1, self.w1)) / fade_spin
            self.momentum_end = bodies.momentum(self.q0, self.w_end)

    def uncorrected(self, bodies: Bodies) -> Floats:
        """Rotations after the step and before the position correction."""
        return product(bodies.about(-self.turned), self.q1)

    def velocities(self, bodies: Bodies) -> tuple[Floats, Floats]:
        """Velocities [m/s] and angular momenta [kg m^2/s] after the kick, from impulses and loads."""
        h = self.h[:, None, None]
        moves, turns = bodies.moves[:, None], bodies.turns[:, None]
        load = np.where(moves, h * self.gravity + h * self.force / bodies.mass[:, None], 0)
        self.v_loaded = self.v_start + load
        torque = np.where(turns, h * self.torque, 0)
        loaded = self.momentum_start + torque
        if self.rule == "explicit_euler":
            loaded = loaded + np.where(turns, self._gyroscopic(bodies), 0)
        self.w_loaded = bodies.spin(self.q_kick, loaded)
        v = self.v_loaded + np.where(moves, self.kick / bodies.mass[:, None], 0)
        return v, loaded + np.where(turns, self.kick_moment, 0)

    def _gyroscopic(self, bodies: Bodies) -> Floats:
        """Euler's equation in body axes carried on by the step's own turn (eq. 2.6), as I0 dw [kg m^2/s]."""
        h, w = self.h[:, None, None], self.w_start
        rate = bodies.spin(self.q0, cross(self.momentum_start, w))
        in_body = apply_back(matrix(self.q0), w + h * rate)
        turned = unit(self.q0 + h * bodies.rate(self.q0, w))
        change = apply(matrix(turned), in_body) - w
        steady = (bodies.moments[:, 0] == bodies.moments[:, 2])[:, None]
        return bodies.momentum(self.q0, np.where(steady, 0, change))

    def positions(self) -> Floats:
        """Positions after the step from the velocities of both ends, correction included [m]."""
        share = END_SHARE[self.rule]
        mean = (1 - share) * self.v_start + share * self.v_end
        return np.asarray(self.x0 + self.h[:, None, None] * mean + self.moved)

    def rotations(self, bodies: Bodies) -> list[Floats]:
        """Rotations after the step from the angular momenta of both ends, corrected; alternatives."""
        h = self.h[:, None] + 0 * bodies.mass
        if self.rule == "explicit_euler":
            ends = [unit(self.q0 + h[..., None] * bodies.rate(self.q0, self.w_start))]
        elif self.rule == "semi_implicit_euler":
            ends = [product(bodies.about(h[..., None] * self.w_end), self.q0)]
        elif self.rule == "rk4":
            back = bodies.about(0.5 * h[..., None] * (self.w_end - self.w_start))
            ends = [product(back, self.q_kick)]
        else:
            halves = free_turn(bodies, self.rule, self.q0, self.momentum_start, 0.5 * h)
            ends = [
                q for half in halves for q in free_turn(bodies, self.rule, half, self.momentum_end, 0.5 * h)
            ]
        turn = bodies.about(self.turned)
        return [product(turn, q) for q in ends]
