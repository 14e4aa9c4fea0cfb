"""Values that worlds hand out: the report of a step, energies, mass properties, snapshots, pieces of runs."""

from __future__ import annotations

import json
import weakref
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom._explanation import Explanation, Finding, findings_of
from carom._joint import Reaction, reactions_of
from carom._space import Floats, Records, Space

if TYPE_CHECKING:
    from carom._world import World


class StageReport(NamedTuple):
    """One solver's work on one island.

    Attributes
    ----------
    solver, iterations : its name; spent [1]
    residual : of what it found [m/s]; of what it was given where it refused
    stop_reason : "converged", "out_of_iterations", "out_of_factorisations", "refused" or "interrupted"
    refusal : why it refused, or None
    """

    solver: str
    iterations: int
    residual: float
    stop_reason: str
    refusal: str | None


class IslandReport(NamedTuple):
    """How one island was solved: movable bodies that contacts join; obstacles join nothing.

    Attributes
    ----------
    contacts, rows, bodies : how many it has [1]
    first_body : name of the first of its bodies; names the island in `World.certificate`
    residual, relative_residual : of the impulses returned [m/s], [1]
    worst_contact : names of the two bodies where it is worst, or None
    stages : the solvers that worked on it, in order
    why_further : why it went past the first of them, in words; empty when it did not
    strict_feasibility : when not solved and known, the largest t with some impulses such that
        u_N >= mu |u_T| + t at each of its contacts [m/s]; at or below 0 no solution need exist
    """

    contacts: int
    rows: int
    bodies: int
    first_body: str
    residual: float
    relative_residual: float
    worst_contact: tuple[str, str] | None
    stages: tuple[StageReport, ...]
    why_further: str
    strict_feasibility: float | None = None

    @classmethod
    def _told(cls, fields: Iterable[Any]) -> Self:
        made = cls._make(fields)
        return made._replace(stages=tuple(StageReport._make(stage) for stage in made.stages))

    @property
    def solvers(self) -> tuple[str, ...]:
        """Names of the solvers that worked on it, in order."""
        return tuple(stage.solver for stage in self.stages)


class ImpactReport(NamedTuple):
    """What the impacts of a step came to.

    Attributes
    ----------
    rounds : of impacts [1]
    guarded : islands of impacts that would gain energy by their own law [1]; `energy_guard` says what then
    ended_plastic : times that rounds did not end by themselves and were ended plastically [1]
    gain : energy that the guarded islands' own law gains [J]; in the books with "warn", else not
    gaining_contact : names of the two bodies that gain most, or None
    """

    rounds: int
    guarded: int
    ended_plastic: int
    gain: float
    gaining_contact: tuple[str, str] | None


class EventReport(NamedTuple):
    """What happened within a step of the scheme "events"; zeros for "fixed_step".

    Attributes
    ----------
    arrivals : contacts whose arrival was found within the step [1]
    impacts : impact phases [1]
    slip_stops : stops of slipping contacts that were found [1]
    capped : sets of bodies with so many events that the rest of their step was taken at once [1]
    projections : times that overlaps were projected away [1]
    deepest : the deepest of these overlaps [m]
    islands : sets of bodies that moved apart from others at the step's end [1]
    """

    arrivals: int
    impacts: int
    slip_stops: int
    capped: int
    projections: int
    deepest: float
    islands: int


class GroupReport(NamedTuple):
    """Books of a group of bodies: of a step, or since they are kept.

    Attributes
    ----------
    name : the group's
    kinetic, potential : energy afterwards [J]
    momentum, angular_momentum : afterwards, the latter about the world's origin [kg m/s], [kg m^2/s]
    lines : work by cause on the group's bodies [J]; see `ledger`
    momentum_lines, angular_momentum_lines : what changed the two, by cause; see `momentum_ledger`
    """

    name: str
    kinetic: float
    potential: float
    momentum: tuple[float, ...]
    angular_momentum: tuple[float, ...]
    lines: tuple[float, ...]
    momentum_lines: tuple[tuple[float, ...], ...]
    angular_momentum_lines: tuple[tuple[float, ...], ...]

    @classmethod
    def _told(cls, fields: Iterable[Any]) -> Self:
        name, kinetic, potential, momentum, angular, lines, of_momentum, of_angular = fields
        vectors = [tuple(map(tuple, given)) for given in (of_momentum, of_angular)]
        return cls(name, kinetic, potential, tuple(momentum), tuple(angular), tuple(lines), *vectors)

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]."""
        return self.kinetic + self.potential

    @property
    def ledger(self) -> dict[str, float]:
        """Where the group's energy went: work by cause and the closure [J]."""
        return dict(zip(_carom.LEDGER_LINES, self.lines, strict=True))

    @property
    def momentum_ledger(self) -> dict[str, Floats]:
        """What changed the group's momentum, by cause, and the closure: (d,) arrays [kg m/s]."""
        return _vectors(self.momentum_lines)

    @property
    def angular_momentum_ledger(self) -> dict[str, Floats]:
        """What changed its angular momentum about the world's origin: (1 | 3,) arrays [kg m^2/s]."""
        return _vectors(self.angular_momentum_lines)


def _vectors(lines: tuple[tuple[float, ...], ...]) -> dict[str, Floats]:
    return {name: np.array(line) for name, line in zip(_carom.MOMENTUM_LINES, lines, strict=True)}


class _StepFields(NamedTuple):
    step: int
    time: float
    dt: float
    residual: float
    relative_residual: float
    worst_contact: tuple[str, str] | None
    iterations: int
    stop_reason: str
    contacts: int
    asleep: int
    deepest_gap: float | None
    deepest_contact: tuple[str, str] | None
    impact_residual: float
    kinetic: float
    potential: float
    momentum: tuple[float, ...]
    angular_momentum: tuple[float, ...]
    lines: tuple[float, ...]
    solver: str
    tolerance: float
    accurate: bool
    impacts: ImpactReport
    events: EventReport
    islands: tuple[IslandReport, ...]
    joints: dict[str, Reaction]
    findings: tuple[Finding, ...]
    groups: dict[str, GroupReport]


class StepReport(_StepFields):
    """What one step tells of itself.

    Attributes
    ----------
    step, time, dt : number of the step from 1, time after it [s], its length [s]
    residual, relative_residual : worst of the step's solves [m/s], [1]
    worst_contact : names of the two bodies where it is worst, or None
    iterations, stop_reason : of all solves together; "converged", "out_of_iterations" or
        "out_of_factorisations"
    contacts : found at the step's start, those about to close included
    asleep : bodies that sleep after the step
    deepest_gap, deepest_contact : smallest gap at the step's start [m], negative for overlap, and its bodies
    impact_residual : of the impacts alone [m/s]
    kinetic, potential : energy after the step [J]
    momentum, angular_momentum : totals after the step [kg m/s], [kg m^2/s]
    lines : the step's work by cause [J], in the order of `carom._carom.LEDGER_LINES`; see `ledger`
    solver, tolerance : asked for; the residual in m/s
    accurate : whether every solve is within the tolerance by its residual; a tolerance of 0 asks for nothing
    impacts : `ImpactReport`: rounds, and what the energy guard did
    events : `EventReport`: what the scheme "events" found within the step
    islands : `IslandReport` of each island where anything pressed, from solvers that go island by island:
        those of impacts, then those of persistent contacts
    joints : `Reaction` of each joint by its name
    findings : `Finding` of the step in brief; see `explain`
    groups : `GroupReport` of each group in ``world.ledger_groups``, by name
    """

    _world: weakref.ref[World] | None = None

    @classmethod
    def _told(cls, fields: Iterable[Any], world: World) -> Self:
        *plain, impacts, events, islands, joints, findings, groups = fields
        told = tuple(IslandReport._told(island) for island in islands)
        made = cls._make(
            (
                *plain,
                ImpactReport._make(impacts),
                EventReport._make(events),
                told,
                reactions_of(joints, world._space),
                findings_of(findings),
                {group.name: group for group in map(GroupReport._told, groups)},
            )
        )
        made._world = weakref.ref(world)
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self)._make, (tuple(self),)

    def explain(self) -> Explanation:
        """Why the step is as accurate as it is, in plain words with the bodies' names, and what to do.

        Asked before the world goes on, it also estimates the condition of the worst island, for the cost of
        some fifty sweeps; afterwards it tells the findings that were made with the step.
        """
        world = self._world() if self._world is not None else None
        if world is not None and not self.accurate:
            found = world._native.explain(self.step)
            if found is not None:
                return Explanation.of(self.accurate, found)
        return Explanation(self.accurate, self.findings)

    @property
    def ledger(self) -> dict[str, float]:
        """Where the step's energy went: work by cause and the closure [J]."""
        return dict(zip(_carom.LEDGER_LINES, self.lines, strict=True))

    @property
    def energy(self) -> float:
        """Kinetic and potential energy after the step [J]."""
        return self.kinetic + self.potential

    @property
    def closure(self) -> float:
        """What the ledger failed to account for in this step [J]; rounding when all is well."""
        return self.lines[-1]

    @property
    def converged(self) -> bool:
        """Whether every solve reached the tolerance."""
        return self.stop_reason == "converged"

    def __repr__(self) -> str:
        place = (
            f" at {self.worst_contact[0]} / {self.worst_contact[1]}" if self.worst_contact is not None else ""
        )
        return (
            f"<StepReport {self.step} at t = {self.time:.6g} s: {self.contacts} contacts, residual "
            f"{self.residual:.1e} m/s{place}, {self.iterations} iterations ({self.stop_reason}), energy "
            f"{self.energy:.6g} J, closure {self.closure:.0e} J>"
        )


class KineticEnergy(NamedTuple):
    """Kinetic energy of a body in its parts [J]."""

    translational: float
    rotational: float

    @property
    def total(self) -> float:
        """Both parts [J]."""
        return self.translational + self.rotational


class MassProperties(NamedTuple):
    """Mass, centre of mass and inertia in the axes of the shape.

    Attributes
    ----------
    mass : [kg]
    center_of_mass : (2,) | (3,) float64 array [m]
    inertia : float | (3, 3) float64 array, about the centre of mass [kg m^2]
    error : estimated relative error of a density function's quadrature [1]; 0 for closed forms
    """

    mass: float
    center_of_mass: Floats
    inertia: Any
    error: float

    @property
    def quadrature_error(self) -> float:
        """The same as `error` [1]."""
        return self.error

    def __repr__(self) -> str:
        inertia = self.inertia if isinstance(self.inertia, float) else self.inertia.tolist()
        error = f", error={self.error:.1e}" if self.error else ""
        return (
            f"MassProperties(mass={self.mass:.9g} kg, center_of_mass={self.center_of_mass.tolist()} m, "
            f"inertia={inertia} kg m^2{error})"
        )


class Snapshot(bytes):
    """The whole state of a world; `World.restore` brings it back bit for bit, warm starts included."""

    def _state(self) -> dict[str, Any]:
        state: dict[str, Any] = json.loads(self)
        return state

    @property
    def space(self) -> str:
        """ "planar" or "spatial"."""
        return str(self._state()["space"])

    @property
    def time(self) -> float:
        """Time of the state [s]."""
        return float(self._state()["time"])

    def __repr__(self) -> str:
        state = self._state()
        bodies = f"{len(state['bodies'])} bodies"
        return f"<Snapshot {state['space']}, {bodies}, t = {state['time']:.6g} s, {len(self)} bytes>"


@dataclass(frozen=True)
class Chunk:
    """A piece of a run: f frames, s steps, n bodies; shapes and units as in `carom.recording`.

    `inaccurate` has the number, the time [s] and the findings of the first step above the tolerance, when
    it was asked for; `gaining` the same of the first whose impacts gained energy under a guard that warns.
    """

    time: Floats
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    contact_offsets: npt.NDArray[Any]
    contacts: Records
    action_offsets: npt.NDArray[Any]
    actions: Records
    steps: Records
    event_offsets: npt.NDArray[Any]
    events: Records | None
    piece_offsets: npt.NDArray[Any]
    pieces: Records | None
    inaccurate: tuple[int, float, tuple[Finding, ...]] | None = None
    gaining: tuple[int, float, tuple[Finding, ...]] | None = None


def chunk_of(recorded: dict[str, Any], space: Space, bodies: int) -> Chunk:
    """A chunk from the engine's flat arrays, without copies."""
    frames = len(recorded["time"])

    def shaped(name: str, width: int) -> Floats:
        array: Floats = recorded[name].reshape(frames, bodies, width)
        return array

    return Chunk(
        time=recorded["time"],
        position=shaped("position", space.dimension),
        rotation=shaped("rotation", space.turns),
        velocity=shaped("velocity", space.dimension),
        angular_velocity=shaped("angular_velocity", space.spins),
        contact_offsets=recorded["contact_offsets"],
        contacts=recorded["contacts"].view(space.contact_type),
        action_offsets=recorded["action_offsets"],
        actions=recorded["actions"].view(space.action_type),
        steps=recorded["steps"].view(space.step_type),
        event_offsets=recorded["event_offsets"],
        events=recorded["events"].view(space.event_type),
        piece_offsets=recorded["piece_offsets"],
        pieces=recorded["pieces"].view(space.piece_type),
        inaccurate=_first(recorded["inaccurate"]),
        gaining=_first(recorded["gaining"]),
    )


def _first(
    told: tuple[int, float, list[Any]] | None,
) -> tuple[int, float, tuple[Finding, ...]] | None:
    """Number and time of the first step that is worth a warning, and why."""
    return None if told is None else (told[0], told[1], findings_of(told[2]))
