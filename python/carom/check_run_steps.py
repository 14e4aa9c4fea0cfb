"""The part of a run's check that looks at steps with a frame at both ends: motion against the rule of the
integrator (`check_run_rules`), velocities against the impulses, impulses against the law of contact, works
against the ledger.

Bounds are rounding: a number of operations times the unit roundoff times the sizes that were added up, and
the condition of the inertia where it was inverted. The contact law is bounded by the recorded residual.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if __package__:
    from carom.check_run_events import EVENT_CHECKS, HALF_WAY, Flows
    from carom.check_run_frames import AUDITED, EPS, OPERATIONS, Checks, Frames, in_space, pair_of
    from carom.check_run_rules import (
        END_SHARE,
        Bodies,
        Floats,
        Step,
        angle_between,
        apply,
        apply_back,
        cross,
        dot,
        matrix,
        norm,
    )
else:
    from check_run_events import (  # type: ignore[import-not-found,no-redef]
        EVENT_CHECKS,
        HALF_WAY,
        Flows,
    )
    from check_run_frames import (  # type: ignore[import-not-found,no-redef]
        AUDITED,
        EPS,
        OPERATIONS,
        Checks,
        Frames,
        in_space,
        pair_of,
    )
    from check_run_rules import (  # type: ignore[import-not-found,no-redef]
        END_SHARE,
        Bodies,
        Floats,
        Step,
        angle_between,
        apply,
        apply_back,
        cross,
        dot,
        matrix,
        norm,
    )

if TYPE_CHECKING:
    from carom.check_run_file import RunFile

#: Checks by name: what must hold, and the unit of value and bound.
STEP_CHECKS = {
    "translation": ("positions follow from velocities by the integrator's rule", "m"),
    "rotation": ("rotations follow from angular velocities by the integrator's rule", "rad"),
    "linear_balance": ("velocities change by gravity, loads and contact impulses", "m/s"),
    "angular_balance": ("angular momenta change by loads and contact impulses", "kg m^2/s"),
    "contact_law": ("impulses solve the law of contact and friction as well as recorded", "m/s"),
    "work_of_gravity": ("the ledger's gravity is that of the motion", "J"),
    "work_of_loads": ("the ledger's applied work is that of the loads", "J"),
    "work_of_damping": ("the ledger's damping is that of the velocities", "J"),
    "work_of_correction": ("the ledger's projection is that of the position correction", "J"),
    "work_of_contacts": ("the ledger's contact lines add up to the work of the impulses", "J"),
}
_LEFT_OUT = "some {} left out, whose loads, moments or shorter turns the file does not tell in full"
#: Lines of the ledger that are no contact's.
_NO_CONTACT = ("gravity", "applied", "damping", "projection", "integrator")


def check_pairs(checks: Checks, file: RunFile, bodies: Bodies, gravity: Floats, frames: Frames) -> None:
    """Everything that needs the state before and after a step, where both were recorded."""
    rule, scheme = file.settings.get("integrator"), file.settings.get("scheme", "fixed_step")
    ends = np.flatnonzero((frames.step[1:] >= 0) & (frames.step[1:] == frames.step[:-1] + 1)) + 1
    apart = "steps between frames are not recorded: run with every=1" if file.every > 1 else ""
    if scheme == "events" and rule in HALF_WAY:
        if frames.events is None:
            apart, ends = apart or "events are not recorded: run with record_events", ends[:0]
        for name in (*STEP_CHECKS, *EVENT_CHECKS):
            checks[name].note = checks[name].note or apart
        if len(ends):
            Flows(checks, file, bodies, gravity, frames, ends).check()
        return
    if rule not in END_SHARE or scheme != "fixed_step":
        apart, ends = f"scheme {scheme!r} with integrator {rule!r} is not known here", ends[:0]
    if file.has_joints:
        apart, ends = "joints move bodies by impulses that the file does not hold", ends[:0]
    for name in STEP_CHECKS:
        checks[name].note = checks[name].note or apart
    if len(ends):
        _Pairs(checks, file, bodies, gravity, frames, ends).check()


class _Pairs:
    """Steps side by side, their contacts summed up body by body."""

    def __init__(
        self, checks: Checks, file: RunFile, bodies: Bodies, gravity: Floats, frames: Frames, ends: Any
    ) -> None:
        self.checks, self.file, self.bodies, self.gravity = checks, file, bodies, gravity
        self.number = frames.step[ends]
        first = int(self.number.min())
        self.steps = file.rows("steps", first, int(self.number.max()) + 1)[self.number - first]
        self.is_full = set(AUDITED) <= set(frames.contacts.dtype.names or ()) and frames.actions is not None
        starts, shape = ends - 1, (len(ends), len(file.names), 3)
        place = np.full(len(frames.time), -1)
        place[ends] = np.arange(len(ends))
        mine = place[frames.frame] >= 0
        self.rows, self.f = frames.contacts[mine], place[frames.frame[mine]]
        acts: dict[str, Floats] = {name: np.zeros(shape) for name in ("force", "torque", "moved", "turned")}
        if frames.actions is not None:
            mine = place[frames.acted] >= 0
            actions, f = frames.actions[mine], place[frames.acted[mine]]
            for name, column in zip(acts, ("force", "torque", "correction", "correction_turn"), strict=True):
                acts[name][f, actions["body"]] = in_space(
                    actions[column], spin=column in ("torque", "correction_turn")
                )
        states = [
            a[at] for at in (starts, ends)
            for a in (frames.position, frames.velocity, frames.angular_velocity, frames.rotation)
        ]  # fmt: skip
        self.s = Step(
            file.settings["integrator"],
            np.asarray(self.steps["dt"], dtype=np.float64),
            gravity,
            *states,
            **acts,
        )
        self.touched = np.zeros(shape[:2], dtype=bool)
        self.touched[self.f, self.rows["a"]] = self.touched[self.f, self.rows["b"]] = True

    def check(self) -> None:
        """Fills in what the contacts did, then looks."""
        s, bodies = self.s, self.bodies
        self._impacts()
        s.strike(bodies)
        self._kicks()
        self.v_after, self.spun_after = s.velocities(bodies)
        self._unknown()
        self._sizes()
        self._motion()
        if self.is_full:
            self._balance()
            self._works()
            self._law()
        else:
            for name in (
                "linear_balance",
                "angular_balance",
                "contact_law",
                *(n for n in STEP_CHECKS if "work" in n),
            ):
                self.checks[name].note = "loads and single impulses are recorded since layout version 2"

    def _sum(self, on_a: Floats, on_b: Floats) -> Floats:
        """Sums over contacts, body by body."""
        total = np.zeros((*self.touched.shape, *on_a.shape[1:]))
        np.add.at(total, (self.f, self.rows["a"]), on_a)
        np.add.at(total, (self.f, self.rows["b"]), on_b)
        return total

    def _impacts(self) -> None:
        rows, f, s = self.rows, self.f, self.s
        point, zero = in_space(rows["point"]), np.zeros((len(rows), 3))
        self.impact = in_space(rows["impact_impulse"]) if self.is_full else zero
        self.arms = point - s.x0[f, rows["a"]], point - s.x0[f, rows["b"]]
        whole = rows["normal_impulse"][:, None] * in_space(rows["normal"]) + in_space(
            rows["friction_impulse"]
        )
        self.kick = whole - self.impact if self.is_full else zero
        self.moment = in_space(rows["moment"], spin=True) if self.is_full else zero
        self.size = norm(whole) + norm(self.impact)
        self.reach = norm(point) + np.maximum(norm(s.x0[f, rows["a"]]), norm(s.x0[f, rows["b"]]))
        s.impact = self._sum(self.impact, -self.impact)
        s.impact_moment = self._sum(cross(self.arms[0], self.impact), -cross(self.arms[1], self.impact))

    def _kicks(self) -> None:
        rows, f, s = self.rows, self.f, self.s
        arm = in_space(rows["kick_arm"]) if self.is_full else np.zeros((len(rows), 3))
        self.kick_arms = arm, arm + s.x_kick[f, rows["a"]] - s.x_kick[f, rows["b"]]
        s.kick = self._sum(self.kick, -self.kick)
        turn = [cross(arm, self.kick) + self.moment for arm in self.kick_arms]
        s.kick_moment = self._sum(turn[0], -turn[1])

    def _unknown(self) -> None:
        """Bodies whose step the file does not tell in full."""
        s, loaded = self.s, norm(self.s.force) + norm(self.s.torque) > 0
        self.no_place, self.no_turn = (np.zeros(self.touched.shape, dtype=bool) for _ in range(2))
        if s.rule == "rk4":
            # stages see loads that the record has the mean of
            self.no_place, self.no_turn = loaded.copy(), norm(s.torque) > 0
        self.no_turn |= s.lost
        # what of a moment was the impacts' is not told
        both = (norm(self.moment) > 0) & (norm(self.impact) > 0)
        for side in ("a", "b"):
            self.no_turn[self.f[both], self.rows[side][both]] = True
        if not self.is_full:
            damped = (
                (self.steps["damping"] != 0)[:, None] & self.bodies.moves
                if self.file.damping[0] is None
                else False
            )
            odd = np.asarray(self.touched | damped) | (s.rule == "rk4" and self.bodies.moves)
            self.no_place, self.no_turn = self.no_place | odd, self.no_turn | odd
            self._note(("translation", "rotation"), "layout version 1: bodies without contact only")

    def _note(self, names: tuple[str, ...], note: str) -> None:
        for name in names:
            self.checks[name].note = note

    def _sizes(self) -> None:
        """Absolute terms of each body, summed for bounds: velocities [m/s], angular momenta [kg m^2/s]."""
        s, bodies, h = self.s, self.bodies, self.s.h[:, None]
        push = self._sum(self.size, self.size)
        arm = self.size * (self.reach + norm(self.kick_arms[0]) + norm(self.kick_arms[1]))
        arm = arm + norm(self.moment)
        twist = self._sum(arm, arm)
        self.speed = norm(s.v0) + norm(s.v1)
        self.speed += np.where(
            bodies.moves, h * norm(self.gravity) + (push + h * norm(s.force)) / bodies.mass, 0
        )
        self.spun = bodies.moments[:, 2] * (norm(s.w0) + norm(s.w1))
        self.spun += np.where(bodies.turns, twist + h * norm(s.torque), 0)
        count = self._sum(np.ones(len(self.rows)), np.ones(len(self.rows)))
        self.terms = EPS * (OPERATIONS + 4 * count)

    def _body(self, k: int) -> str:
        return self.file.names[k % len(self.file.names)]

    def _see(self, name: str, value: Floats, bound: Floats, unknown: Any) -> None:
        """Compares body by body, all but what is unknown."""
        known = np.flatnonzero(~np.broadcast_to(unknown, value.shape).ravel())
        step = np.broadcast_to(self.number[:, None], value.shape).ravel()[known]
        bound = np.broadcast_to(bound, value.shape).ravel()[known]
        self.checks[name].see(value.ravel()[known], bound, step, lambda k: self._body(int(known[k])))
        if len(known) < value.size and not self.checks[name].note:
            self.checks[name].note = _LEFT_OUT.format("bodies")

    def _motion(self) -> None:
        s, bodies, h = self.s, self.bodies, self.s.h[:, None]
        away = norm(s.x0) + norm(s.x1) + h * self.speed + norm(s.moved)
        self._see("translation", norm(s.x1 - s.positions()), self.terms * away, self.no_place)
        off = np.min([angle_between(s.q1, q) for q in s.rotations(bodies)], axis=0)
        # nan where the midpoint rule's fixed point does not settle: the engine halves its steps there
        unknown = self.no_turn | (np.isnan(off) & np.isfinite(s.q1).all(axis=-1) & np.isfinite(self.spun))
        turned = 1 + h * self.spun / bodies.moments[:, 0] * bodies.condition
        self._see("rotation", off, self.terms * turned + 0 * off, unknown)

    def _balance(self) -> None:
        s, bodies = self.s, self.bodies
        self._see("linear_balance", norm(s.v_end - self.v_after), self.terms * self.speed, False)
        bound = self.terms * self.spun * bodies.condition
        split = self.no_turn & ((bodies.spin_decay > 0) | (s.rule == "explicit_euler"))
        spun = norm(s.momentum_end - self.spun_after)
        self._see("angular_balance", spun, bound, split & (norm(s.torque) == 0))

    def _works(self) -> None:
        s, bodies, steps = self.s, self.bodies, self.steps
        h, mass = s.h[:, None], np.where(bodies.moves, bodies.mass, 0)
        is_rk4 = s.rule == "rk4"
        mean = 0.5 * (s.v_start + (s.v_loaded if is_rk4 else s.v_end))
        mean_spin = 0.5 * (self._spun_up() + s.w_end)
        gravity = mass * h * (mean @ self.gravity)
        loads = np.where(bodies.moves, h * dot(s.force, mean), 0) + np.where(
            bodies.turns, h * dot(s.torque, mean_spin), 0
        )
        start = bodies.kinetic(s.v_start, s.w_start, s.momentum_start)
        end = bodies.kinetic(s.v_end, s.w_end, s.momentum_end)
        struck = bodies.kinetic(s.v_struck, s.w_struck, bodies.momentum(s.q0, s.w_struck))
        impacts = struck - bodies.kinetic(s.v0, s.w0, bodies.momentum(s.q0, s.w0))
        loaded = bodies.kinetic(s.v_loaded, s.w_loaded, bodies.momentum(s.q_kick, s.w_loaded))
        if is_rk4:
            kicks = end - loaded
        else:
            kicks = end - start - gravity - loads
            if s.rule == "explicit_euler":
                kicks = kicks - self._gyroscopic_work()
        uncorrected = s.uncorrected(bodies)
        last = bodies.momentum(s.q1, s.w1)
        w_last = bodies.spin(uncorrected, last)
        first_spin = bodies.spin(s.q0, s.momentum_start)
        unfaded_spin = np.exp(0.5 * h * bodies.spin_decay)[..., None] * last
        unfaded = bodies.kinetic(s.v_end, bodies.spin(uncorrected, unfaded_spin), unfaded_spin)
        damped = bodies.kinetic(s.v_start, first_spin, s.momentum_start) - struck
        damped = damped + bodies.kinetic(s.v1, w_last, last) - unfaded
        corrected = bodies.kinetic(s.v1, s.w1, last) - bodies.kinetic(s.v1, w_last, last)
        corrected = corrected - mass * (s.moved @ self.gravity)
        contacts = sum(steps[name] for name in self._contact_lines())
        size = mass * self.speed**2 + np.where(
            bodies.turns, self.spun**2 / bodies.moments[:, 0] * bodies.condition, 0
        )
        bound = (self.terms * size).sum(axis=1)
        bound = bound + EPS * len(bodies.mass) * size.sum(axis=1)
        # where gravity's work comes from a difference of positions, it has their rounding
        way = norm(s.moved) + (0.1 * (norm(s.x0) + norm(s.x1)) if is_rk4 else 0)
        lifted = (mass * EPS * OPERATIONS * way * norm(self.gravity)).sum(axis=1)
        odd = (self.no_place | self.no_turn).any(axis=1)
        for name, line, work, is_unknown in (
            ("work_of_gravity", steps["gravity"], gravity, odd if is_rk4 else False),
            ("work_of_loads", steps["applied"], 0 * loads if is_rk4 else loads, odd),
            ("work_of_damping", steps["damping"], damped, odd),
            ("work_of_correction", steps["projection"], corrected, False),
            ("work_of_contacts", contacts, impacts + kicks, odd),
        ):
            known = ~np.broadcast_to(is_unknown, line.shape)
            off, most = line - work.sum(axis=1), bound + lifted
            self.checks[name].see(off[known], most[known], self.number[known])
            if not known.all() and not self.checks[name].note:
                self.checks[name].note = _LEFT_OUT.format("steps")

    def _spun_up(self) -> Floats:
        """Angular velocities before loads act, Euler's gyroscopic term included [rad/s]."""
        s, bodies = self.s, self.bodies
        if s.rule != "explicit_euler":
            return np.asarray(s.w_start)
        torque = np.where(bodies.turns[:, None], s.h[:, None, None] * s.torque, 0)
        return np.asarray(s.w_loaded - bodies.spin(s.q0, torque))

    def _gyroscopic_work(self) -> Floats:
        """Energy that Euler's gyroscopic term makes or takes before loads act [J]."""
        s, bodies = self.s, self.bodies
        w = self._spun_up()
        return bodies.kinetic(s.v_start, w, bodies.momentum(s.q0, w)) - bodies.kinetic(
            s.v_start, s.w_start, s.momentum_start
        )

    def _contact_lines(self) -> list[str]:
        columns = self.file.columns("steps")
        lines = columns[columns.index("gravity") : columns.index("closure")]
        return [name for name in lines if name not in _NO_CONTACT]

    # --- the law of contact ---

    def _law(self) -> None:
        """The natural map of the persistent contacts (theory eqs. 5.31 to 5.34), of what was recorded."""
        file, s, bodies, rows = self.file, self.s, self.bodies, self.rows
        if file.settings.get("friction_law") == "box" and file.space == "spatial":
            self._note(("contact_law",), "box friction goes by axes that the file does not tell")
            return
        acts = (norm(self.kick) > 0) | (norm(self.kick_arms[0]) > 0)
        ends = [np.stack([self.f, rows[side]]) for side in ("a", "b")]
        for at in ends:
            acts &= ~self.no_turn[at[0], at[1]]
        rows, f, kick = rows[acts], self.f[acts], self.kick[acts]
        if not len(rows):
            return
        normal, a, b = in_space(rows["kick_normal"]), (f, rows["a"]), (f, rows["b"])
        arms, first_arms = [arm[acts] for arm in self.kick_arms], [arm[acts] for arm in self.arms]

        def across(v: Floats, w: Floats, arms: list[Floats]) -> Floats:
            return np.asarray(v[a] + cross(w[a], arms[0]) - v[b] - cross(w[b], arms[1]))

        w_start = bodies.spin(s.q0, s.momentum_start) if s.rule == "rk4" else s.w_start
        approach = dot(across(s.v_struck, s.w_struck, first_arms), in_space(rows["normal"]))
        before = dot(across(s.v_start, w_start, arms), normal)
        after = across(s.v_end, s.w_end, arms)
        closing = -np.maximum(rows["gap"], 0) / s.h[f]
        share = END_SHARE[s.rule]

        def target(noise: float) -> Floats:
            """End velocity that a contact asks for (theory eqs. 6.8 and 6.8a) [m/s]."""
            c = np.minimum(closing + noise, 0)
            if share == 0:
                return np.asarray(c)
            beyond = approach - c
            start = c + np.maximum(beyond - noise, 0) + np.minimum(beyond, 0)
            return np.asarray((c - (1 - share) * (np.maximum(start, c) + before - approach)) / share)

        stiff = self._inverse_masses(normal, arms, (a, b))
        push, along = dot(kick, normal), dot(after, normal)
        side, slip = kick - push[:, None] * normal, after - along[:, None] * normal
        # recordings from before noise was left out ask for a little more
        rates = [np.minimum(push * stiff[0], along - target(noise)) for noise in (self._noise(), 0.0)]
        gap_rate = np.where(np.abs(rates[0]) <= np.abs(rates[1]), rates[0], rates[1])
        trial = side - slip / stiff[1][:, None]
        limit, length = rows["friction"] * np.maximum(push, 0), norm(trial)
        inside = length <= limit
        nearest = trial * (limit / np.where(length > 0, length, 1))[:, None]
        rub = np.where(inside[:, None], slip, (side - nearest) * stiff[1][:, None])
        value = np.hypot(gap_rate, norm(rub))
        reach = norm(arms[0]) + norm(arms[1]) + norm(first_arms[0]) + norm(first_arms[1])
        rate = self.spun / bodies.moments[:, 0] * bodies.condition
        noise = 4 * (self.terms[a] + self.terms[b]) * (
            self.speed[a] + self.speed[b] + reach * (rate[a] + rate[b]) + np.abs(closing)
            + self.size[acts] * (stiff[0] + stiff[1])
        )  # fmt: skip
        bound = self.steps["residual"][f] * (1 + 1e-6) + noise
        self.checks["contact_law"].see(value, bound, self.number[f], pair_of(file, rows))

    def _noise(self) -> float:
        """What solves leave, where they come to the run's tolerance (theory eq. 6.8a) [m/s]."""
        settings = self.file.settings
        comes_to_it = (
            settings.get("solver") in ("exact", "auto") or settings.get("on_inaccurate") == "escalate"
        )
        return float(settings.get("tolerance", 0.0)) if comes_to_it else 0.0

    def _inverse_masses(self, normal: Floats, arms: list[Floats], sides: Any) -> tuple[Floats, Floats]:
        """1/m of each contact along its normal, and the larger one across it [1/kg]."""
        s, bodies = self.s, self.bodies
        axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
        if self.file.space == "planar":
            axis = np.broadcast_to(np.array([0.0, 0.0, 1.0]), normal.shape)
        first = cross(normal, axis)
        first = first / norm(first)[:, None]
        frame = [normal, first, cross(normal, first)]
        answers = []
        for direction in frame:
            answer = np.zeros_like(normal)
            for arm, (f, i) in zip(arms, sides, strict=True):
                turned = _spin_of(bodies, s.q_kick[f, i], cross(arm, direction), i)
                swing = cross(np.where(bodies.turns[i][:, None], turned, 0), arm)
                answer += np.where(bodies.moves[i][:, None], direction / bodies.mass[i][:, None] + swing, 0)
            answers.append(answer)
        w = [[dot(p, answers[j]) for j in range(3)] for p in frame]
        across = w[1][1]
        if self.file.space == "spatial":
            mean, half = (w[1][1] + w[2][2]) / 2, (w[1][1] - w[2][2]) / 2
            across = mean + np.hypot(half, w[1][2])
        return np.maximum(w[0][0], 1e-300), np.maximum(across, 1e-300)


def _spin_of(bodies: Bodies, q: Floats, momentum: Floats, body: Any) -> Floats:
    """I^-1 L of single bodies, by number."""
    r = matrix(q)
    return apply(r, apply(bodies.inverse[body], apply_back(r, momentum)))
