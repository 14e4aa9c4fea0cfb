"""Values that worlds hand out: the report of a step, energies, mass properties, snapshots, pieces of runs."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy.typing as npt

from carom import _carom
from carom._space import Floats, Records, Space


class StepReport(NamedTuple):
    """What one step tells of itself.

    Attributes
    ----------
    step, time, dt : number of the step from 1, time after it [s], its length [s]
    residual, relative_residual : worst of the step's solves [m/s], [1]
    worst_contact : names of the two bodies where it is worst, or None
    iterations, stop_reason : of all solves together; "converged" or "out_of_iterations"
    contacts : found at the step's start, those about to close included
    deepest_gap, deepest_contact : smallest gap at the step's start [m], negative for overlap, and its bodies
    impact_residual : of the impacts alone [m/s]
    kinetic, potential : energy after the step [J]
    momentum, angular_momentum : totals after the step [kg m/s], [kg m^2/s]
    lines : the step's work by cause [J], in the order of `carom._carom.LEDGER_LINES`; see `ledger`
    """

    step: int
    time: float
    dt: float
    residual: float
    relative_residual: float
    worst_contact: tuple[str, str] | None
    iterations: int
    stop_reason: str
    contacts: int
    deepest_gap: float | None
    deepest_contact: tuple[str, str] | None
    impact_residual: float
    kinetic: float
    potential: float
    momentum: tuple[float, ...]
    angular_momentum: tuple[float, ...]
    lines: tuple[float, ...]

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
    """A piece of a run: f frames, s steps, n bodies; shapes and units as in `carom.recording`."""

    time: Floats
    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats
    contact_offsets: npt.NDArray[Any]
    contacts: Records
    steps: Records


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
        steps=recorded["steps"].view(space.step_type),
    )
