"""The part of a run's check that looks at steps of the scheme "events": each body's way through a step is
repeated piece by piece, flow by flow and impact by impact, from the state before the step and the recorded
impulses alone (theory eqs. 8.1 to 8.3). Where it ends must be the state after the step; velocities, works and
the law of contact are those that the repetition finds on the way. numpy alone.

Bounds are rounding, as for other schemes (`check_run_steps`); the contact law is bounded by the recorded
residual. Long because the repetition is one way through a step, whose pieces share what they know of it.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if __package__:
    from carom.check_run_frames import EPS, OPERATIONS, Checks, Frames, in_space, pair_of
    from carom.check_run_rules import (
        Bodies,
        Floats,
        angle_between,
        apply,
        apply_back,
        cross,
        dot,
        free_turn,
        matrix,
        norm,
        product,
    )
else:
    from check_run_frames import (  # type: ignore[import-not-found,no-redef]
        EPS,
        OPERATIONS,
        Checks,
        Frames,
        in_space,
        pair_of,
    )
    from check_run_rules import (  # type: ignore[import-not-found,no-redef]
        Bodies,
        Floats,
        angle_between,
        apply,
        apply_back,
        cross,
        dot,
        free_turn,
        matrix,
        norm,
        product,
    )

if TYPE_CHECKING:
    from carom.check_run_file import RunFile

#: Checks by name, of runs with events: what must hold, and the unit of value and bound.
EVENT_CHECKS = {
    "event_table": ("events are parts of the bodies' ways, which fill the step; normals are units", "1"),
    "one_point": ("impulses act at one point of both bodies", "m"),
    "impact_law": ("impacts end as restitution and friction ask, as well as recorded", "m/s"),
}
#: Integrators of the scheme, whose kicks act half-way.
HALF_WAY = ("trapezoid", "implicit_midpoint")
#: Kinds of pieces and of events in the order of their codes.
FLOW, IMPACT, FALLBACK, PROJECTION = range(4)
PERSISTS, PERSISTS_TO_END, BOUNCES, REST_CUT, FALLBACK_IMPACT, FALLBACK_FLOW, SLOWED, CLOSING = range(8)
#: Impact laws whose contacts end with minus restitution times their approach.
_NEWTONS = (None, "newton", "generalized_reflections")
#: How far arms may end from each other in a flow whose rounds settled, over the bodies' size [1].
SETTLED = 1e-12


class Flows:
    """Steps side by side: the ways of their bodies, and what the contacts did on them.

    Arrays of the ways are over pieces, those of the contacts over events; `f` is the place of a step among
    the steps that are looked at, `body` that of a body.
    """

    def __init__(
        self, checks: Checks, file: RunFile, bodies: Bodies, gravity: Floats, frames: Frames, ends: Any
    ) -> None:
        """Sorts the events and pieces of the steps that end at frames `ends`."""
        self.checks, self.file, self.bodies, self.gravity = checks, file, bodies, gravity
        self.number, self.rule = frames.step[ends], str(file.settings["integrator"])
        first = int(self.number.min())
        self.steps = file.rows("steps", first, int(self.number.max()) + 1)[self.number - first]
        self.h = np.asarray(self.steps["dt"], dtype=np.float64)
        starts = ends - 1
        self.begun = frames.time[starts]
        self.n = len(file.names)
        place = np.full(len(frames.time), -1)
        place[ends] = np.arange(len(ends))
        arrays = (frames.position, frames.velocity, frames.angular_velocity, frames.rotation)
        self.x0, self.v0, self.w0, self.q0 = (a[starts] for a in arrays)
        self.x1, self.v1, self.w1, self.q1 = (a[ends] for a in arrays)
        self.force, self.torque = (np.zeros((len(ends), self.n, 3)) for _ in range(2))
        if frames.actions is not None:
            mine = place[frames.acted] >= 0
            rows, f = frames.actions[mine], place[frames.acted[mine]]
            self.force[f, rows["body"]] = in_space(rows["force"])
            self.torque[f, rows["body"]] = in_space(rows["torque"], spin=True)
        mine = place[frames.of_event] >= 0
        self.rows, self.f = frames.events[mine], place[frames.of_event[mine]]
        mine = place[frames.of_piece] >= 0
        self._order(frames.pieces[mine], place[frames.of_piece[mine]])

    def check(self) -> None:
        """Goes all ways, then looks."""
        self._join()
        self._go()
        self._sizes()
        self._points()
        self._arrive()
        self._works()
        self._laws()

    # --- the pieces of the ways, and which events belong to which ---

    def _order(self, rows: Any, f: Any) -> None:
        """All pieces, by step, body and act; a body that moves and has none goes in one flow."""
        if ((rows["body"] < 0) | (rows["body"] >= self.n) | (rows["kind"] > PROJECTION)).any():
            raise ValueError("a piece of a way names a body or a kind that is not there")
        listed = np.zeros((len(self.h), self.n), dtype=bool)
        listed[f, rows["body"]] = True
        whole = np.argwhere(~listed & self.bodies.moves)
        count = len(whole)

        def joined(column: str, of_whole: Any) -> Any:
            return np.concatenate([np.asarray(rows[column]), of_whole])

        zero = np.zeros((count, 3))
        act = joined("act", np.full(count, -1)).astype(np.int64)
        step = np.concatenate([f, whole[:, 0]]).astype(np.int64)
        body = joined("body", whole[:, 1]).astype(np.int64)
        order = np.lexsort((act, body, step))
        self.act, self.p_f, self.p_body = act[order], step[order], body[order]
        self.kind = joined("kind", np.full(count, FLOW))[order]
        self.time = joined("time", self.begun[whole[:, 0]])[order]
        self.length = joined("length", self.h[whole[:, 0]])[order]
        self.shift, self.turn, self.pull, self.twist = (
            np.concatenate([in_space(rows[name], spin=name in ("turn", "moment")), zero])[order]
            for name in ("shift", "turn", "impulse", "moment")
        )
        way = self.p_f * self.n + self.p_body
        fresh = np.ones(len(way), dtype=bool)
        fresh[1:] = way[1:] != way[:-1]
        begin = np.flatnonzero(fresh)
        self.rank = np.arange(len(way)) - np.repeat(begin, np.diff(np.append(begin, len(way))))
        self._fill(fresh)

    def _fill(self, fresh: Any) -> None:
        """The pieces of a way follow each other and fill the step."""
        last = np.append(fresh[1:], True) if len(fresh) else fresh
        end = self.time + self.length
        wanted = np.where(fresh, self.begun[self.p_f], np.concatenate([[0.0], end[:-1]]) if len(end) else end)
        scale = np.abs(self.time) + self.h[self.p_f]
        step = self.number[self.p_f]
        check = self.checks["event_table"]
        name = self._piece_name
        check.see((self.time - wanted) / scale, 8 * EPS, step, name)
        off = np.where(last, end - self.begun[self.p_f] - self.h[self.p_f], 0.0)
        check.see(off / scale, 8 * EPS, step, name)
        lasts = np.isin(self.kind, (FLOW, FALLBACK))
        check.see(np.where(lasts, self.length <= 0, self.length != 0).astype(float), 0.0, step, name)
        check.see(
            np.where(self.act[1:] <= self.act[:-1], ~fresh[1:], False).astype(float), 0.0, step[1:], name
        )

    def _piece_name(self, k: int) -> str:
        return self.file.names[int(self.p_body[k])]

    def _join(self) -> None:
        """The piece of each event's two bodies; -1 for a body that does not move."""
        rows, f, n = self.rows, self.f, self.n
        wrong = (rows["a"] < 0) | (rows["a"] >= n) | (rows["b"] < 0) | (rows["b"] >= n)
        if (wrong | (rows["a"] == rows["b"]) | (rows["kind"] > CLOSING)).any():
            raise ValueError("an event names bodies or a kind that are not there")
        acts = int(max(self.act.max(initial=0), rows["act"].max(initial=0))) + 2
        codes = (self.p_f * n + self.p_body) * acts + self.act + 1
        kinds = np.array([FLOW, FLOW, IMPACT, IMPACT, IMPACT, FALLBACK, IMPACT, FLOW])[rows["kind"]]
        check, pair = self.checks["event_table"], pair_of(self.file, rows)
        step = self.number[f]
        self.sides = []
        for side in ("a", "b"):
            moves = self.bodies.moves[rows[side]]
            way = (f * n + rows[side]) * acts
            at = self._found(codes, way + rows["act"] + 1)
            at = np.where(at < 0, self._found(codes, way), at)
            missing = moves & (at < 0)
            at = np.where(moves, at, -1)
            off = missing.astype(float)
            if len(codes):
                same = (self.time[at] == rows["time"]) & (self.length[at] == rows["length"])
                off = np.where(moves & ~(same & (self.kind[at] == kinds)), 1.0, off)
            check.see(off, 0.0, step, pair)
            self.sides.append(np.where(missing, -1, at))
        self.normal, self.point = in_space(rows["normal"]), in_space(rows["point"])
        self.arms = [in_space(rows["arm_a"]), in_space(rows["arm_b"])]
        self.impulse, self.moment = in_space(rows["impulse"]), in_space(rows["moment"], spin=True)
        check.see(norm(self.normal) - 1, 8 * EPS, step, pair)

    @staticmethod
    def _found(codes: Any, wanted: Any) -> Any:
        if not len(codes):
            return np.full(len(wanted), -1)
        at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
        return np.where(codes[at] == wanted, at, -1)

    # --- the ways ---

    def _go(self) -> None:
        """From piece to piece: all first ones, all second ones, and so on."""
        bodies, h = self.bodies, self.h[:, None]
        self.fade = np.exp(-0.5 * h * bodies.decay)[..., None]
        self.fade_spin = np.exp(-0.5 * h * bodies.spin_decay)[..., None]
        self.x, self.q = self.x0.copy(), self.q0.copy()
        self.v = np.where(bodies.moves[:, None], self.fade * self.v0, self.v0)
        self.spun = self.fade_spin * bodies.momentum(self.q0, self.w0)
        count = len(self.act)
        names = ("va", "wa", "vb", "wb", "middle", "way", "turned", "lifted")
        self.on: dict[str, Floats] = {name: np.zeros((count, 3)) for name in names}
        self.on["attitude"] = np.zeros((count, 4))
        self.on["turned"], self.on["lifted"] = np.zeros(count), np.zeros(count)
        self.lost = np.zeros((len(self.h), self.n), dtype=bool)
        sorted_sides = [np.argsort(side, kind="stable") for side in self.sides]
        self._by_piece = [(order, side[order]) for order, side in zip(sorted_sides, self.sides, strict=True)]
        order = np.argsort(self.rank, kind="stable")
        borders = np.searchsorted(self.rank[order], np.arange(int(self.rank.max(initial=-1)) + 2))
        for begin, end in pairwise(borders):
            at = order[begin:end]
            for kind, take in (
                (FLOW, self._flow), (IMPACT, self._impact),
                (FALLBACK, self._fallback), (PROJECTION, self._projection),
            ):  # fmt: skip
                some = at[self.kind[at] == kind]
                if len(some):
                    take(some)

    def _some(self, at: Any) -> tuple[Any, Bodies, Floats, Floats, Floats, Floats]:
        """Where pieces stand in the arrays of states, their bodies, and the states."""
        body = self.p_body[at]
        b = self.bodies
        part = replace(
            b, moves=b.moves[body], turns=b.turns[body], mass=b.mass[body], inertia=b.inertia[body],
            inverse=b.inverse[body], moments=b.moments[body], axes=b.axes[body], decay=b.decay[body],
            spin_decay=b.spin_decay[body],
        )  # fmt: skip
        i = (self.p_f[at], body)
        return i, part, self.x[i], self.v[i], self.q[i], self.spun[i]

    def _pushed(self, at: Any, moments: bool = False) -> Floats:
        """Sums over the events of pieces: impulses, or moments about the centres of mass."""
        total: Floats = (self.twist if moments else self.pull)[at].copy()
        for (order, pieces), arms, sign in zip(self._by_piece, self.arms, (1, -1), strict=True):
            begin, end = np.searchsorted(pieces, at), np.searchsorted(pieces, at, side="right")
            counts = end - begin
            if not counts.any():
                continue
            which = np.repeat(begin - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
            events, owner = order[which], np.repeat(np.arange(len(at)), counts)
            push = self.impulse[events]
            if moments:
                push = cross(arms[events], push) + self.moment[events]
            np.add.at(total, owner, sign * push)
        return total

    def _keep(self, i: Any, **states: Floats) -> None:
        for name in ("x", "v", "q", "spun"):
            if name in states:
                getattr(self, name)[i] = states[name]

    def _note(self, at: Any, part: Bodies, middle: Floats, attitude: Floats, states: Any) -> None:
        """Velocities before and after the kick of pieces, where it acts."""
        (v, spun), (v1, spun1) = states
        on = self.on
        on["middle"][at], on["attitude"][at] = middle, attitude
        on["va"][at], on["vb"][at] = v, v1
        on["wa"][at], on["wb"][at] = part.spin(attitude, spun), part.spin(attitude, spun1)

    def _turned(self, part: Bodies, q: Floats, spun: Floats, time: Floats, i: Any) -> Floats:
        """Free rotation; a body that tumbles too fast for one step of the midpoint rule is left out."""
        out = free_turn(part, self.rule, q, spun, time)[0]
        bad: Any = np.isnan(out).any(axis=-1)
        self.lost[i[0][bad], i[1][bad]] = True
        return np.asarray(np.where(bad[:, None], q, out))

    def _flow(self, at: Any) -> None:
        i, part, x, v, q, spun = self._some(at)
        tau = self.length[at]
        loads = tau[:, None] * (self.gravity + self.force[i] / part.mass[:, None])
        v1 = v + loads + self._pushed(at) / part.mass[:, None]
        mean = 0.5 * (v + v1)
        middle = x + 0.5 * tau[:, None] * mean
        attitude = self._turned(part, q, spun, 0.5 * tau, i)
        turns = part.turns[:, None]
        spun1 = spun + np.where(turns, tau[:, None] * self.torque[i] + self._pushed(at, moments=True), 0)
        q1 = self._turned(part, attitude, spun1, 0.5 * tau, i)
        self._note(at, part, middle, attitude, ((v, spun), (v1, spun1)))
        self.on["way"][at] = tau[:, None] * mean
        changes = self._spin_energy(part, attitude, spun) - self._spin_energy(part, q, spun)
        changes += self._spin_energy(part, q1, spun1) - self._spin_energy(part, attitude, spun1)
        self.on["turned"][at] = changes
        self._keep(i, x=x + tau[:, None] * mean, v=v1, q=q1, spun=spun1)

    def _impact(self, at: Any) -> None:
        i, part, x, v, q, spun = self._some(at)
        v1 = v + self._pushed(at) / part.mass[:, None]
        spun1 = spun + np.where(part.turns[:, None], self._pushed(at, moments=True), 0)
        self._note(at, part, x, q, ((v, spun), (v1, spun1)))
        self._keep(i, v=v1, spun=spun1)

    def _fallback(self, at: Any) -> None:
        i, part, x, v, q, spun = self._some(at)
        tau = self.length[at]
        loads = tau[:, None] * (self.gravity + self.force[i] / part.mass[:, None])
        v1 = v + loads + self._pushed(at) / part.mass[:, None]
        middle = x + 0.5 * tau[:, None] * v
        turns = part.turns[:, None]
        spun1 = spun + np.where(turns, tau[:, None] * self.torque[i] + self._pushed(at, moments=True), 0)
        q1 = self._turned(part, q, spun1, tau, i)
        self._note(at, part, middle, q, ((v, spun), (v1, spun1)))
        way = 0.5 * tau[:, None] * (v + v1)
        self.on["way"][at] = way
        self.on["turned"][at] = self._spin_energy(part, q1, spun1) - self._spin_energy(part, q, spun1)
        self._keep(i, x=x + way, v=v1, q=q1, spun=spun1)

    def _projection(self, at: Any) -> None:
        i, part, x, v, q, spun = self._some(at)
        shift = self.shift[at]
        q1 = product(part.about(self.turn[at]), q)
        self._note(at, part, x, q, ((v, spun), (v, spun)))
        lifted = -np.where(part.moves, part.mass, 0) * (shift @ self.gravity)
        self.on["lifted"][at] = lifted + self._spin_energy(part, q1, spun) - self._spin_energy(part, q, spun)
        self._keep(i, x=x + shift, q=q1)

    @staticmethod
    def _spin_energy(part: Bodies, q: Floats, spun: Floats) -> Floats:
        return np.asarray(np.where(part.turns, 0.5 * dot(part.spin(q, spun), spun), 0.0))

    # --- where they end ---

    def _per_body(self, values: Floats) -> Floats:
        """Sums over the pieces of each body."""
        total = np.zeros((len(self.h), self.n, *values.shape[1:]))
        np.add.at(total, (self.p_f, self.p_body), values)
        return total

    def _sizes(self) -> None:
        """Absolute terms of each body, summed for bounds: velocities [m/s], angular momenta [kg m^2/s]."""
        bodies, h = self.bodies, self.h[:, None]
        push, arm, count = (np.zeros((len(self.h), self.n)) for _ in range(3))
        for side, arms in zip("ab", self.arms, strict=True):
            at = (self.f, self.rows[side])
            strength = norm(self.impulse)
            np.add.at(push, at, strength)
            np.add.at(arm, at, strength * norm(arms) + norm(self.moment))
            np.add.at(count, at, 1.0)
        push += self._per_body(norm(self.pull))
        arm += self._per_body(norm(self.twist))
        self.speed = norm(self.v0) + norm(self.v1)
        self.speed += np.where(
            bodies.moves, h * norm(self.gravity) + (push + h * norm(self.force)) / bodies.mass, 0
        )
        self.spinning = bodies.moments[:, 2] * (norm(self.w0) + norm(self.w1))
        self.spinning += np.where(bodies.turns, arm + h * norm(self.torque), 0)
        pieces = self._per_body(np.ones(len(self.act)))
        self.terms = EPS * (OPERATIONS * (1 + 0.25 * pieces) + 4 * count)

    def _see(self, name: str, value: Floats, bound: Floats, unknown: Any) -> None:
        known = np.flatnonzero(~np.broadcast_to(unknown, value.shape).ravel())
        step = np.broadcast_to(self.number[:, None], value.shape).ravel()[known]
        bound = np.broadcast_to(bound, value.shape).ravel()[known]
        names, n = self.file.names, self.n
        self.checks[name].see(value.ravel()[known], bound, step, lambda k: names[int(known[k]) % n])
        if len(known) < value.size and not self.checks[name].note:
            self.checks[name].note = "some bodies left out, whose shorter turns the file does not tell"

    def _arrive(self) -> None:
        """States after the steps against those that the ways end in."""
        bodies, h = self.bodies, self.h[:, None]
        still = ~bodies.moves
        # bodies that forces do not move go as they are told
        x = np.where(still[:, None], self.x0 + h[..., None] * self.v0, self.x)
        turn = bodies.about(h[..., None] * self.w0)
        q = np.where(still[:, None], product(turn, self.q0), self.q)
        shifted = self._per_body(norm(self.shift))
        away = norm(self.x0) + norm(self.x1) + h * self.speed + shifted
        self._see("translation", norm(self.x1 - x), self.terms * away, False)
        rate = self.spinning / bodies.moments[:, 0] * bodies.condition
        self._see("rotation", angle_between(self.q1, q), self.terms * (1 + h * rate), self.lost)
        v_end = np.where(bodies.moves[:, None], self.fade * self.v, self.v0)
        self._see("linear_balance", norm(self.v1 - v_end), self.terms * self.speed, False)
        end = np.where(bodies.turns[:, None], self.fade_spin * self.spun, bodies.momentum(self.q1, self.w0))
        off = norm(bodies.momentum(self.q1, self.w1) - end)
        bound = self.terms * self.spinning * bodies.condition
        self._see("angular_balance", off, bound, self.lost)

    # --- works ---

    def _across(self, velocity: str, spin: str) -> Floats:
        """Velocity of a's point against b's, of each event; before (va, wa) or after (vb, wb) it."""
        return self._at(0, velocity, spin) - self._at(1, velocity, spin)

    def _at(self, side: int, velocity: str, spin: str) -> Floats:
        """Velocity of one body's point at each event."""
        at, body = self.sides[side], (self.f, self.rows["ab"[side]])
        moves = (at >= 0)[:, None]
        if not len(self.act):
            at = np.zeros(0, dtype=int) if not len(at) else at
        v = np.where(moves, self._taken(velocity, at), self.v0[body])
        w = np.where(moves, self._taken(spin, at), self.w0[body])
        return np.asarray(v + cross(w, self.arms[side]))

    def _taken(self, name: str, at: Any) -> Floats:
        """What the ways' pieces have, by event; anything for bodies that do not move."""
        if not len(self.act):
            return np.zeros((len(at), self.on[name].shape[-1]))
        return np.asarray(self.on[name][at])

    def _points(self) -> None:
        """Both bodies' arms end in the recorded point where the rounds of a flow settled; else a warning."""
        if not len(self.rows):
            return
        pair, step = pair_of(self.file, self.rows), self.number[self.f]
        time = self.rows["time"] + 0.5 * self.rows["length"] - self.begun[self.f]
        extent = self.file.extent
        sizes = np.zeros(self.n) if extent is None else np.where(np.isfinite(extent), np.abs(extent), 0.0)
        size = sizes[self.rows["a"]] + sizes[self.rows["b"]]
        for side in (0, 1):
            at, body = self.sides[side], (self.f, self.rows["ab"[side]])
            carried = self.x0[body] + time[:, None] * self.v0[body]
            center = np.where((at >= 0)[:, None], self._taken("middle", at), carried)
            off = norm(center + self.arms[side] - self.point)
            way = self.speed[body] * self.h[self.f]
            away = norm(center) + norm(self.point) + norm(self.arms[side]) + way
            bound = SETTLED * (size + way) + self.terms[body] * away
            self.checks["one_point"].see(off, bound, step, pair, is_lenient=True)

    def _per_step(self, values: Floats, f: Any) -> Floats:
        total = np.zeros(len(self.h))
        np.add.at(total, f, values)
        return total

    def _works(self) -> None:
        """Lines of the ledger from impulses and velocities."""
        bodies, on, kind = self.bodies, self.on, self.rows["kind"]
        before, after = self._across("va", "wa"), self._across("vb", "wb")
        self.u0, self.u1 = before, after
        mean = 0.5 * (before + after)
        self.push = dot(self.impulse, self.normal)
        along = self.push * dot(mean, self.normal)
        spin = 0.5 * (self._spins("wa") + self._spins("wb"))
        across = dot(self.impulse, mean) - along + dot(self.moment, spin)
        flows = (kind <= PERSISTS_TO_END) | (kind == CLOSING)
        bounces = (kind == BOUNCES) | (kind == SLOWED)
        cuts, rest = kind == REST_CUT, (kind == FALLBACK_IMPACT) | (kind == FALLBACK_FLOW)
        zero = np.zeros(len(kind))
        part = self.p_body
        mass = np.where(bodies.moves, bodies.mass, 0)[part]
        i = (self.p_f, part)
        w = 0.5 * (on["wa"] + on["wb"])
        turning = np.where(bodies.turns[part], self.length * dot(self.torque[i], w), 0)
        pulled = dot(self.pull, 0.5 * (on["va"] + on["vb"])) + np.where(
            bodies.turns[part], dot(self.twist, w), 0
        )
        lines = {
            "gravity": self._per_step(mass * (on["way"] @ self.gravity), self.p_f),
            "applied": self._per_step(dot(self.force[i], on["way"]) + turning, self.p_f),
            "driven": self._per_step(self._driven(), self.f),
            "contact_normal": self._per_step(np.where(flows, along, zero), self.f),
            "friction": self._per_step(np.where(flows, across, zero), self.f),
            "impact_normal": self._per_step(np.where(bounces, along, zero), self.f),
            "rest_cut": self._per_step(np.where(cuts, along, zero), self.f),
            "impact_friction": self._per_step(np.where(bounces | cuts, across, zero), self.f),
            "fallback": self._per_step(np.where(rest, along + across, zero), self.f),
            "constraint": self._per_step(pulled, self.p_f),
            "projection": self._per_step(on["lifted"], self.p_f),
            "integrator": self._per_step(on["turned"], self.p_f),
            "damping": self._damped(),
        }
        size = np.where(bodies.moves, bodies.mass, 0) * self.speed**2
        size = size + np.where(bodies.turns, self.spinning**2 / bodies.moments[:, 0] * bodies.condition, 0)
        bound = (self.terms * size).sum(axis=1) + EPS * self.n * size.sum(axis=1)
        lifted = self._per_body(norm(self.shift)) > 0
        # differences of positions have the rounding of the positions, and the integrator's line has them
        heavy = np.where(bodies.moves, bodies.mass * norm(self.gravity) * (norm(self.x0) + norm(self.x1)), 0)
        far = EPS * np.where(lifted, OPERATIONS, 4 * (1 + self._per_body(np.ones(len(self.act))))) * heavy
        odd = self.lost.any(axis=1)
        checks = {
            "gravity": "work_of_gravity", "applied": "work_of_loads", "damping": "work_of_damping",
            "projection": "work_of_correction",
        }  # fmt: skip
        for name, work in lines.items():
            if name not in self.steps.dtype.names:
                continue
            most = bound + (far.sum(axis=1) if name in ("projection", "integrator") else 0)
            off = (self.steps[name] - work)[~odd]
            check = self.checks[checks.get(name, "work_of_contacts")]
            check.see(off, most[~odd], self.number[~odd], lambda k, name=name: name)

    def _spins(self, spin: str) -> Floats:
        """Angular velocity of a against b, of each event."""
        both = [
            np.where((at >= 0)[:, None], self._taken(spin, at), self.w0[self.f, self.rows[side]])
            for at, side in zip(self.sides, "ab", strict=True)
        ]
        return np.asarray(both[0] - both[1])

    def _driven(self) -> Floats:
        """What obstacles that move paid, by event."""
        work = np.zeros(len(self.rows))
        for side, sign in ((0, -1.0), (1, 1.0)):
            fixed = self.sides[side] < 0
            spin = self.w0[self.f, self.rows["ab"[side]]]
            paid = dot(self.impulse, self._at(side, "vb", "wb")) + dot(self.moment, spin)
            work += np.where(fixed, sign * paid, 0.0)
        return work

    def _damped(self) -> Floats:
        bodies = self.bodies
        first = bodies.momentum(self.q0, self.w0)
        v, spun = self.fade * self.v0, self.fade_spin * first
        start = bodies.kinetic(v, bodies.spin(self.q0, spun), spun) - bodies.kinetic(self.v0, self.w0, first)
        v, spun = self.v1 / self.fade, bodies.momentum(self.q1, self.w1)
        faded = spun / self.fade_spin
        end = bodies.kinetic(self.v1, self.w1, spun) - bodies.kinetic(v, bodies.spin(self.q1, faded), faded)
        return np.asarray((start + end).sum(axis=1))

    # --- the laws of contact and of impact ---

    def _laws(self) -> None:
        """Cones, and the natural map (theory eqs. 5.31 to 5.34) of flows and impacts."""
        rows, f, pair = self.rows, self.f, pair_of(self.file, self.rows)
        if not len(rows):
            return
        step, kind = self.number[f], rows["kind"]
        side = self.impulse - self.push[:, None] * self.normal
        size = norm(self.impulse)
        stiff = self._inverse_masses()
        residual = self.steps["residual"][f]
        box = self.file.settings.get("friction_law") == "box" and self.file.space == "spatial"
        spread = np.sqrt(2) if box else 1.0
        limit = rows["friction"] * np.maximum(self.push, 0)
        outside = np.maximum(np.maximum(norm(side) - spread * limit, -self.push), 0)
        bound = residual / stiff[0] + OPERATIONS * EPS * size
        self.checks["cone"].see(outside, bound, step, pair)
        if box:
            note = "box friction goes by axes that the file does not tell"
            self.checks["contact_law"].note = self.checks["impact_law"].note = note
            return
        value, target = self._natural_map(side, limit, stiff)
        reach = norm(self.arms[0]) + norm(self.arms[1])
        noise = self._noise(reach, size, stiff, target)
        known = ~(self.lost[f, rows["a"]] | self.lost[f, rows["b"]])
        persists = known & ((kind <= PERSISTS_TO_END) | (kind == FALLBACK_FLOW))
        guarded = self.steps["guarded"][f] > 0 if "guarded" in self.steps.dtype.names else False
        strikes = known & ((kind == BOUNCES) | (kind == REST_CUT)) & ~guarded
        if self.file.settings.get("impact") not in _NEWTONS:
            strikes &= False
            self.checks["impact_law"].note = "impacts of this law have no targets of their own"
        for name, which in (("contact_law", persists), ("impact_law", strikes)):
            at = np.flatnonzero(which)
            bound = residual[at] * (1 + 1e-6) + noise[at]
            self.checks[name].see(value[at], bound, step[at], lambda k, at=at: pair(int(at[k])))

    def _natural_map(self, side: Floats, limit: Floats, stiff: Any) -> tuple[Floats, Floats]:
        """Its length for each event [m/s], and the normal velocities that were asked for."""
        kind, u0, u1, normal = self.rows["kind"], self.u0, self.u1, self.normal
        n0, n1 = dot(u0, normal), dot(u1, normal)
        sums = (kind == PERSISTS) | (kind == FALLBACK_FLOW)
        u = np.where(sums[:, None], u0 + u1, u1)
        along = np.where(sums, n0 + n1, n1)
        rest = np.where(self.rows["length"] > 0, self.rows["length"], 1.0)
        target = np.zeros(len(kind))
        target = np.where(kind == PERSISTS_TO_END, -n0, target)
        target = np.where(kind == BOUNCES, -self.rows["restitution"] * np.minimum(n0, 0), target)
        target = np.where(kind == FALLBACK_FLOW, -2 * np.maximum(self.rows["gap"], 0) / rest, target)
        slip = u - dot(u, normal)[:, None] * normal
        if "tangential_restitution" in self.rows.dtype.names:
            bounces = (kind == BOUNCES) & (self.rows["restitution"] > 0)
            turned = np.where(bounces, self.rows["tangential_restitution"], 0.0)
            slip = slip + turned[:, None] * (u0 - n0[:, None] * normal)
        gap_rate = np.minimum(self.push * stiff[0], along - target)
        trial = side - slip / stiff[1][:, None]
        length = norm(trial)
        nearest = trial * (limit / np.where(length > 0, length, 1))[:, None]
        rub = np.where((length <= limit)[:, None], slip, (side - nearest) * stiff[1][:, None])
        return np.hypot(gap_rate, norm(rub)), target

    def _noise(self, reach: Floats, size: Floats, stiff: Any, target: Floats) -> Floats:
        """Rounding of the natural map [m/s]."""
        bodies, f = self.bodies, self.f
        a, b = (f, self.rows["a"]), (f, self.rows["b"])
        rate = self.spinning / bodies.moments[:, 0] * bodies.condition
        speeds = self.speed[a] + self.speed[b] + reach * (rate[a] + rate[b])
        terms = 4 * (self.terms[a] + self.terms[b])
        noise = terms * (speeds + np.abs(target) + size * (stiff[0] + stiff[1]))
        return np.asarray(noise)

    def _inverse_masses(self) -> tuple[Floats, Floats]:
        """1/m of each event along its normal, and the larger one across it [1/kg]."""
        normal, bodies = self.normal, self.bodies
        axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
        if self.file.space == "planar":
            axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), normal.shape)
        first = cross(normal, axis)
        first = first / norm(first)[:, None]
        frame = [normal, first, cross(normal, first)]
        answers = [np.zeros_like(normal) for _ in frame]
        for k in (0, 1):
            at, body, arm = self.sides[k], self.rows["ab"[k]], self.arms[k]
            q = np.where((at >= 0)[:, None], self._taken("attitude", at), self.q0[self.f, body])
            r = matrix(q)
            moves, turns = bodies.moves[body][:, None], bodies.turns[body][:, None]
            for answer, direction in zip(answers, frame, strict=True):
                turned = apply(r, apply(bodies.inverse[body], apply_back(r, cross(arm, direction))))
                swing = cross(np.where(turns, turned, 0), arm)
                answer += np.where(moves, direction / bodies.mass[body][:, None] + swing, 0)
        w = [[dot(p, answer) for answer in answers] for p in frame]
        across = w[1][1]
        if self.file.space == "spatial":
            mean, half = (w[1][1] + w[2][2]) / 2, (w[1][1] - w[2][2]) / 2
            across = mean + np.hypot(half, w[1][2])
        return np.maximum(w[0][0], 1e-300), np.maximum(across, 1e-300)
