"""A world that needs no engine: particles that fall and bounce, with failures and slowness on demand.

It stands in where a test needs a step to fail or to be slow at a given moment; physics is tested with the
engine. Free fall is exact (x += h (v + v')/2, v' = v + h g), a particle below the floor has its velocity
turned upward, and a particle lower than 0.5 m counts as a contact with the floor, body 0.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from carom.errors import StepError

SOLVER_RESIDUALS = {"pgs": 1e-6, "sequential": 1e-3, "lemke": 1e-12}


@dataclass
class ScriptedChunk:
    """What `_advance` hands over; shapes as in `carom.recording`."""

    time: np.ndarray
    position: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    contact_offsets: np.ndarray
    contacts: np.ndarray
    steps: np.ndarray
    action_offsets: np.ndarray = field(default_factory=lambda: np.zeros(1))
    actions: np.ndarray | None = None
    event_offsets: np.ndarray = field(default_factory=lambda: np.zeros(1))
    events: np.ndarray | None = None
    piece_offsets: np.ndarray = field(default_factory=lambda: np.zeros(1))
    pieces: np.ndarray | None = None


class ScriptedWorld:
    """Particles of 2 kg above a floor; step number `fails_at` raises, each step lasts `delay` s."""

    def __init__(
        self, bodies: int = 3, dimension: int = 2, fails_at: int | None = None, delay: float = 0.0
    ) -> None:
        self.dimension = dimension
        self.names = ("floor", *(f"ball{i}" for i in range(bodies)))
        self.settings: dict[str, Any] = {"dt": 0.01, "solver": "pgs", "iterations": 10, "tolerance": 1e-6}
        self.time, self.taken, self.fails_at, self.delay = 0.0, 0, fails_at, delay
        self.position = np.zeros((bodies + 1, dimension))
        self.position[1:, -1] = 1.0 + 0.25 * np.arange(bodies)
        self.position[:, 0] = np.arange(bodies + 1)
        self.velocity = np.zeros_like(self.position)
        self.calls: list[tuple[int, float, int]] = []
        self.last_run: Any = None

    def __setattr__(self, name: str, value: Any) -> None:
        if name in ("solver", "iterations", "tolerance", "dt"):
            self.settings[name] = value
        super().__setattr__(name, value)

    def __getitem__(self, name: str) -> Any:
        index = self.names.index(name)
        inertia = 1.0 if self.dimension == 2 else np.eye(3)
        kind = "static" if index == 0 else "dynamic"
        return SimpleNamespace(name=name, kind=kind, mass=2.0, inertia=inertia, __index__=lambda: index)

    def contacts(self) -> np.ndarray:
        low = [i for i in range(1, len(self.names)) if self.position[i, -1] < 0.5]
        d = self.dimension
        form = [
            ("a", "i4"),
            ("b", "i4"),
            ("id", "u8"),
            ("point", "f8", d),
            ("normal", "f8", d),
            ("gap", "f8"),
            ("normal_impulse", "f8"),
            ("friction_impulse", "f8", d),
            ("slip", "f8", d),
            ("status", "u1"),
        ]
        rows = np.zeros(len(low), dtype=form)
        for row, body in zip(rows, low, strict=True):
            row["a"], row["b"], row["id"] = body, 0, body
            row["point"], row["gap"] = self.position[body], self.position[body, -1]
            row["normal"][-1] = 1.0
        return rows

    def energy(self) -> tuple[float, float]:
        return float((self.velocity[1:] ** 2).sum()), float(2.0 * 9.81 * self.position[1:, -1].sum())

    def step(self, dt: float) -> np.ndarray:
        if self.fails_at is not None and self.taken >= self.fails_at:
            raise StepError(
                f"step at t = {self.time} s: body 'ball0': velocity is not finite; remove the NaN force",
                body="ball0",
                field="velocity",
                value=float("nan"),
                remedy="remove the NaN force",
            )
        time.sleep(self.delay)
        kinetic, _ = self.energy()
        gravity = np.zeros(self.dimension)
        gravity[-1] = -9.81
        after = self.velocity[1:] + dt * gravity
        move = dt * (self.velocity[1:] + after) / 2
        work = float((2.0 * gravity * move).sum())
        self.position[1:] += move
        after[self.position[1:, -1] < 0, -1] *= -1
        after[(self.position[1:, -1] < 0) & (after[:, -1] < 0), -1] *= -1
        self.velocity[1:] = after
        self.time, self.taken = self.time + dt, self.taken + 1
        row = self.empty_steps(1)
        row["time"], row["residual"] = (
            self.time,
            SOLVER_RESIDUALS[self.settings["solver"]] * (1 + self.taken % 7),
        )
        row["worst_a"], row["worst_b"] = (1, 0)
        row["deepest_a"], row["deepest_b"] = (1, 0)
        row["iterations"], row["contacts"] = 5, len(self.contacts())
        row["deepest_gap"] = self.position[1:, -1].min()
        row["kinetic"], row["potential"] = self.energy()
        row["momentum"] = 2.0 * self.velocity[1:].sum(axis=0)
        row["gravity"] = work
        row["closure"] = row["kinetic"] - kinetic - work
        return row

    def empty_steps(self, count: int) -> np.ndarray:
        d = self.dimension
        spin = () if d == 2 else (3,)
        lines = (
            "gravity",
            "applied",
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
            "closure",
        )
        form = [
            ("time", "f8"),
            ("residual", "f8"),
            ("relative_residual", "f8"),
            ("worst_a", "i4"),
            ("worst_b", "i4"),
            ("deepest_a", "i4"),
            ("deepest_b", "i4"),
            ("iterations", "i4"),
            ("stop", "u1"),
            ("contacts", "i4"),
            ("deepest_gap", "f8"),
            ("kinetic", "f8"),
            ("potential", "f8"),
            ("momentum", "f8", d),
            ("angular_momentum", "f8", spin),
            *((line, "f8") for line in lines),
        ]
        return np.zeros(count, dtype=form)

    def chunk(self, frames: list[Any], steps: np.ndarray) -> ScriptedChunk:
        n, d = self.position.shape
        turn = np.zeros((len(frames), n, 2 if d == 2 else 4))
        turn[..., 0] = 1.0
        contacts = [frame[3] for frame in frames]
        return ScriptedChunk(
            time=np.array([frame[0] for frame in frames]),
            position=np.array([frame[1] for frame in frames]).reshape(len(frames), n, d),
            rotation=turn,
            velocity=np.array([frame[2] for frame in frames]).reshape(len(frames), n, d),
            angular_velocity=np.zeros((len(frames), n, 1 if d == 2 else 3)),
            contact_offsets=np.cumsum([0, *(len(part) for part in contacts)]).astype(np.uint64),
            contacts=np.concatenate([*contacts, self.contacts()[:0]]),
            steps=steps,
        )

    def state(self) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        return self.time, self.position.copy(), self.velocity.copy(), self.contacts()

    def _frame(self) -> ScriptedChunk:
        return self.chunk([self.state()], self.empty_steps(0))

    def _advance(self, steps: int, dt: float, every: int) -> ScriptedChunk:
        self.calls.append((steps, dt, every))
        rows, frames = [], []
        for number in range(1, steps + 1):
            try:
                rows.append(self.step(dt))
            except StepError:
                if number == 1:
                    raise
                break
            if every and number % every == 0:
                frames.append(self.state())
        return self.chunk(frames, np.concatenate(rows))
