"""The world: bodies, settings, steps; one text for `carom.planar` and `carom.spatial`.

The engine holds the state. ``position``, ``rotation``, ``velocity`` and ``angular_velocity`` are arrays over
its own memory: reading them costs nothing, writing them moves the bodies, and while one of them is alive no
body can be added or removed. A step runs without the interpreter's lock; arrays keep showing the state before
it until it ends.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Never, Self

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom._adding import attributed, body_arguments
from carom._arrayed import Arrayed
from carom._body import Body
from carom._drowsy import Drowsy
from carom._force import Force
from carom._forced import Forced
from carom._jointed import Jointed
from carom._judged import Judged, SolveProgress
from carom._observed import Observed
from carom._report import Chunk, Snapshot, StepReport, chunk_of
from carom._setting import Setting
from carom._shapes import ShapeLike
from carom._space import Floats, Space, number
from carom._threaded import Threaded
from carom.errors import BuildError, StepError, refused, unknown
from carom.recording import solver_of

if TYPE_CHECKING:
    from carom.run import ProgressLike, Run

Density = float | Callable[[Floats], npt.ArrayLike]


class World(Arrayed, Forced, Jointed, Observed, Judged, Threaded, Drowsy):
    """Bodies, settings and time.

    Parameters
    ----------
    gravity : (d,) [m/s^2]; 9.81 downwards along the last axis when absent
    dt : length of a step [s]; 1/240 when absent
    threads : who share a step's work [1]; the same bits for any number
    settings : any other attribute named below

    Raises
    ------
    BuildError
        Naming a setting that is unknown or out of range.
    """

    _space: ClassVar[Space]
    __slots__ = ("__weakref__", "_forces", "_late_error", "_native", "_progress", "last_run")

    gravity: Setting[Any] = Setting("(d,) acceleration of uniform gravity [m/s^2].")
    dt: Setting[float] = Setting("Length of a step [s].")
    integrator: Setting[str] = Setting(
        '"trapezoid" (default), "explicit_euler", "semi_implicit_euler", "implicit_midpoint" or "rk4".'
    )
    scheme: Setting[str] = Setting(
        'Time-stepping scheme: "fixed_step" (default), "events" (impacts and stops of slipping found '
        'inside the step; exact at any dt) or "soft_step" (substeps of soft contacts in f32: fast).'
    )
    events: Setting[dict[str, Any]] = Setting(
        'Choices of the scheme "events": touching, rest_speed_factor, tolerance, slip_stops, cap, overlap, '
        "plastic_arrivals, warm_start; those left out get their defaults."
    )
    soft: Setting[dict[str, Any]] = Setting(
        'Choices of the scheme "soft_step": substeps [1], hertz [Hz], damping_ratio [1], push_speed [m/s], '
        "sleeping, sleep_speed [m/s], sleep_time [s]; those left out get their defaults. With sleeping, "
        "islands of bodies that rest on obstacles fall asleep, and cost nothing until something stirs them: "
        "see `asleep`."
    )
    solver: Setting[str | None] = Setting(
        'None (default): the scheme\'s own, "nncg" for "fixed_step", "exact" for "events", for "soft_step" '
        'springs with a sweep each; "auto" (sweeps first, stronger where asked), or another of '
        '`carom.SOLVERS`. "soft_step" takes "pgs" and "nncg": they sweep rigid contacts in its lanes.'
    )
    iterations: Setting[int] = Setting(
        'Most iterations per solve [1]; in "soft_step" with a solver sweeps of a substep before bodies move, '
        "and as many after, all of which are taken, at most 1000."
    )
    tolerance: Setting[float] = Setting("Residual at which a solve stops [m/s]; 0 spends all iterations.")
    factorisations: Setting[int] = Setting(
        "Most factorisations per solve [1], read by solvers that factorise; 2000 unless said."
    )
    impulses: Setting[str] = Setting(
        'Which of several impulses that solve: "any" (default) or "minimum_norm", the least in N s, which '
        'depend neither on the steps before nor on the order of contacts; found by "exact" and "auto".'
    )
    on_inaccurate: Setting[str] = Setting(
        'What happens to a solve above the tolerance: "ignore", "warn" (default; once per run), "raise" (the '
        'step is not taken) or "escalate" (its islands go on to stronger solvers).'
    )
    warm_start: Setting[bool] = Setting(
        "Whether a solve of a fixed step starts from the last step's impulses."
    )
    friction_law: Setting[str] = Setting('"disc" (Coulomb, default) or "box" (each tangent on its own).')
    impact: Setting[str | None] = Setting(
        'Impact law: "generalized_reflections", "newton", "sequential", "moreau" or "poisson", see '
        '`carom.impact`; None (default): the scheme\'s own, "newton" for "fixed_step" and '
        '"generalized_reflections" for "events".'
    )
    energy_guard: Setting[str] = Setting(
        'What happens to impacts that would gain energy: "clamp" (default; they get Moreau\'s law), "warn" '
        '(once per run) or "raise" (the step is not taken).'
    )
    rest_speed_factor: Setting[float] = Setting("Impacts slower than this times |g| dt do not bounce [1].")
    position_correction: Setting[str] = Setting('"split_impulse" (default), "nudge" or "none".')
    correction_fraction: Setting[float] = Setting("Share of an overlap that a step corrects [1].")
    correction_slop: Setting[float | None] = Setting("Overlap left alone [m]; None: from the smallest body.")
    contact_margin: Setting[float | None] = Setting(
        "Gap up to which contacts are found [m]; None: from speed."
    )
    friction_mixing: Setting[str] = Setting(
        '"geometric" (default), "min", "max", "mean", "product", "harmonic".'
    )
    restitution_mixing: Setting[str] = Setting(
        '"max" (default) or another of the same mixings; for tangential restitution too.'
    )

    def __init__(
        self, gravity: Any = None, dt: float | None = None, *, threads: int = 1, **settings: Any
    ) -> None:
        self._native: Any = self._space.world()
        self._forces: dict[str, Force] = {}
        self._late_error: BaseException | None = None
        self._progress: SolveProgress | None = None
        self._forget_warnings()
        self.last_run: Run | None = None
        given = {"gravity": gravity, "dt": dt}
        for name, value in {**{k: v for k, v in given.items() if v is not None}, **settings}.items():
            self._set(name, value)
        self.threads = threads

    @classmethod
    def _adopt(cls, native: _carom.PlanarWorld | _carom.SpatialWorld) -> Self:
        """A world around one that the engine made."""
        world = cls()
        world._native = native
        return world

    # --- settings ---

    @property
    def settings(self) -> dict[str, Any]:
        """All settings as plain values."""
        found: dict[str, Any] = json.loads(self._native.settings())
        return found

    def _set(self, name: str, value: Any) -> None:
        known = list(self.settings)
        if name not in known:
            raise unknown("setting", name, known)
        if name == "gravity":
            value = self._space.vector(value, "gravity", "m/s^2")
        plain = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
        remedy = f"see World.{name}: {getattr(type(self), name).__doc__}"
        if isinstance(self.settings[name], dict) and not isinstance(plain, dict):
            raise refused(None, name, "must be a dict of named choices", value, remedy)
        parts = plain.items() if isinstance(plain, dict) else [("", plain)]
        for part, part_value in parts:
            if isinstance(part_value, float) and not np.isfinite(part_value):
                field = f"{name}.{part}" if part else name
                raise refused(None, field, "must be finite", part_value, remedy)
        try:
            text = json.dumps(plain)
        except TypeError:
            raise refused(None, name, "must be a plain value", value, remedy) from None
        with attributed({name: value}):
            self._native.set(name, text)
        self._forget_warnings()

    # --- bodies ---

    def add_body(
        self,
        name: str,
        shape: ShapeLike | None = None,
        *,
        density: Density | None = None,
        mass: float | None = None,
        inertia: Any = None,
        center_of_mass: Any = None,
        position: Any = None,
        origin: Any = None,
        rotation: Any = None,
        velocity: Any = None,
        angular_velocity: Any = None,
        friction: float = 0.5,
        rolling_friction: float = 0.0,
        spinning_friction: float = 0.0,
        restitution: float = 0.0,
        tangential_restitution: float = 0.0,
        material: str | None = None,
        linear_damping: float = 0.0,
        angular_damping: float = 0.0,
        collision_groups: int = 1,
        collision_mask: int = 0xFFFF_FFFF,
        can_rotate: bool = True,
        density_tolerance: float = 1e-6,
        kind: str = "dynamic",
        **unknown_arguments: Never,
    ) -> Body:
        """Adds a body.

        Parameters
        ----------
        name : unlike that of any other body
        shape : None makes a particle, which needs a mass and does not rotate
        density : [kg/m^2] in the plane, [kg/m^3] in space; or a function of (n, d) points in shape axes [m]
            that returns (n,) densities, integrated to the relative `density_tolerance`
        mass : [kg], spread evenly over the shape unless `inertia` is given
        inertia : float | (3, 3) about the centre of mass in shape axes [kg m^2]; with `mass`
        center_of_mass : (d,) in shape axes [m]; with `mass` and `inertia`; the shape's centroid when absent
        position : (d,) of the centre of mass [m]; or
        origin : (d,) of the shape's own frame [m]; the world's origin when neither is given
        rotation : angle [rad] or [cos, sin] | quaternion [w, x, y, z]
        velocity, angular_velocity : (d,) [m/s] of the centre of mass; float | (3,) [rad/s], world axes
        friction, restitution : coefficients [1]
        tangential_restitution : share of the slip that a bounce turns round, as far as friction reaches [1];
            1 for a superball. Source: Garwin 1969 (theory eq. 3.19); acts where `restitution` makes a contact
            bounce, under the impact laws "newton", "generalized_reflections" and "sequential"
        rolling_friction, spinning_friction : largest moment against rolling, and about the normal, per
            normal force [m]; a contact takes the larger of its two bodies'; spinning has no effect in the
            plane. Source: Coulomb's law for moments (theory eqs. 3.24 to 3.26); solved by "pgs", "nncg" and
            "apgd"
        material : name by which `set_pair` tells pairs of bodies apart
        linear_damping, angular_damping : decay rates [1/s]
        collision_groups, collision_mask : groups as bits; two bodies collide when each one's groups meet the
            other's mask
        can_rotate : False for a body that nothing turns
        kind : "dynamic", "static" or "kinematic"; see `add_static`, `add_kinematic`

        Raises
        ------
        BuildError
            Naming body, field, value and remedy; nothing is added then.
        ViewError
            While arrays over the bodies are alive.
        """
        given = {key: value for key, value in locals().items() if key not in ("self", "unknown_arguments")}
        return self._add(given, unknown_arguments)

    def add_static(
        self,
        name: str,
        shape: ShapeLike,
        *,
        position: Any = None,
        origin: Any = None,
        rotation: Any = None,
        friction: float = 0.5,
        rolling_friction: float = 0.0,
        spinning_friction: float = 0.0,
        restitution: float = 0.0,
        tangential_restitution: float = 0.0,
        material: str | None = None,
        collision_groups: int = 1,
        collision_mask: int = 0xFFFF_FFFF,
        **unknown_arguments: Never,
    ) -> Body:
        """Adds an obstacle that never moves; `position` and `origin` both place the shape's frame.

        Arguments and errors as for `add_body`.
        """
        given = {key: value for key, value in locals().items() if key not in ("self", "unknown_arguments")}
        return self._add({**given, "kind": "static"}, unknown_arguments)

    def add_kinematic(
        self,
        name: str,
        shape: ShapeLike,
        *,
        velocity: Any = None,
        angular_velocity: Any = None,
        position: Any = None,
        origin: Any = None,
        rotation: Any = None,
        friction: float = 0.5,
        rolling_friction: float = 0.0,
        spinning_friction: float = 0.0,
        restitution: float = 0.0,
        tangential_restitution: float = 0.0,
        material: str | None = None,
        collision_groups: int = 1,
        collision_mask: int = 0xFFFF_FFFF,
        **unknown_arguments: Never,
    ) -> Body:
        """Adds an obstacle that moves with the velocity it is given, whatever it meets.

        Arguments and errors as for `add_body`; `position` and `origin` both place the shape's frame.
        """
        given = {key: value for key, value in locals().items() if key not in ("self", "unknown_arguments")}
        return self._add({**given, "kind": "kinematic"}, unknown_arguments)

    def set_pair(
        self,
        one: str,
        other: str,
        *,
        friction: float | None = None,
        restitution: float | None = None,
        tangential_restitution: float | None = None,
        rolling_friction: float | None = None,
        spinning_friction: float | None = None,
    ) -> None:
        """Says the coefficients of a pair of materials, in either order; what is left out is mixed.

        Parameters
        ----------
        one, other : materials of bodies; the same twice for bodies of one material
        friction, restitution, tangential_restitution : coefficients [1]
        rolling_friction, spinning_friction : largest moments per normal force [m]

        Raises
        ------
        BuildError
            For a material that no body has, with the nearest name, or a coefficient out of range.
        """
        given = {
            "friction": friction,
            "restitution": restitution,
            "tangential_restitution": tangential_restitution,
            "rolling_friction": rolling_friction,
            "spinning_friction": spinning_friction,
        }
        plain = {key: number(value, key, "1") for key, value in given.items() if value is not None}
        with attributed({**given, "material": [one, other]}):
            self._native.set_pair(one, other, json.dumps(plain))

    def remove_pair(self, one: str, other: str) -> None:
        """Forgets what was said of a pair of materials: their coefficients are mixed again.

        Raises
        ------
        BuildError
            For a material that no body has.
        """
        with attributed({"material": [one, other]}):
            self._native.set_pair(one, other, None)

    @property
    def pairs(self) -> dict[tuple[str, str], dict[str, float]]:
        """What was said of pairs of materials, by their names."""
        return {(one, other): json.loads(text) for one, other, text in self._native.pairs()}

    def _add(self, given: dict[str, Any], unknown_arguments: Mapping[str, Any]) -> Body:
        name, kind = given["name"], given["kind"]
        for word, value in unknown_arguments.items():
            if word in (World.add_body.__kwdefaults__ or {}):
                remedy = "leave it out, or add it with add_kinematic or add_body"
                raise refused(name, word, f"has no meaning for a {kind} body", value, remedy)
            known = [key for key in given if key != "name" and (key != "kind" or kind == "dynamic")]
            raise unknown("argument", word, known, name)
        arguments, shape = body_arguments(given, self._space)
        with attributed({**given, "shape": shape}):
            self._native.add(name, arguments)
        return Body(self, name)

    def remove(self, name: str | Body) -> None:
        """Removes a body; rows of arrays after its own move up by one.

        Raises
        ------
        BuildError
            When there is no such body, or a joint holds it: remove the joint first.
        ViewError
            While arrays over the bodies are alive.
        """
        self._native.remove(name.name if isinstance(name, Body) else name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies in the order of their rows."""
        return tuple(self._native.names())

    def __getitem__(self, name: str) -> Body:
        if not isinstance(name, str):
            raise refused(None, "name", "must be a body's name", name, "see w.names")
        self._native.index(name)
        return Body(self, name)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and self._native.has(name)

    def __len__(self) -> int:
        return int(self._native.count())

    def __iter__(self) -> Iterator[Body]:
        return (Body(self, name) for name in self.names)

    # --- motion ---

    @property
    def time(self) -> float:
        """Time [s]."""
        return float(self._native.time())

    def step(self, dt: float | None = None, *, progress: SolveProgress | None = None) -> StepReport:
        """Takes one step, without the interpreter's lock.

        Parameters
        ----------
        dt : its length [s]; the setting when absent
        progress : called now and then while a solve is long, with what the solver is doing, the iterations
            and the residual so far; what it raises ends the step

        Raises
        ------
        StepError
            Naming the body whose numbers are not finite, or the argument; the world is as before.
        SolverError
            When the solver refuses the contact problem; the world is as before.
        InaccurateError
            When a solve ends above the tolerance and `on_inaccurate` is "raise"; the world is as before.
        EnergyGainError
            When impacts would gain energy and `energy_guard` is "raise"; the world is as before.
        KeyboardInterrupt
            After Ctrl-C in a long solve; the world is as before.
        BusyError
            When another thread steps this world.

        Warns
        -----
        InaccurateWarning
            At the first inaccurate step since a setting changed ("warn"; "escalate" where nothing helped).
        EnergyGainWarning
            At the first step since a setting changed whose impacts gained energy (`energy_guard` "warn").
        """
        length = None if dt is None else number(dt, "dt", "s")
        try:
            report = StepReport._told(self._native.step(length, progress), self)
            if report.impacts.guarded and not self._warned_of_gain and self.energy_guard == "warn":
                self._warn_of_gain(report.step, report.time, report.findings)
            if not report.accurate and not self._warned and self.on_inaccurate in ("warn", "escalate"):
                self._warn(report.step, report.time, report.explain().findings)
            return report
        except StepError as error:
            if error.field == "dt":
                error.value = dt
            raise

    def run(
        self,
        duration: float,
        *,
        dt: float | None = None,
        solver: str | None = None,
        iterations: int | None = None,
        tolerance: float | None = None,
        on_inaccurate: str | None = None,
        every: int = 1,
        record_events: bool | None = None,
        out: str | Path | None = None,
        progress: ProgressLike = None,
    ) -> Run:
        """Takes steps for a duration [s] and records them; see `carom.run.run_world`.

        Parameters
        ----------
        dt, solver, iterations, tolerance, on_inaccurate : settings for this run alone
        every : steps between recorded frames
        record_events : whether to record what contacts did within the steps of the scheme "events"; when
            absent, where every step is a frame
        out : HDF5 file to record into; in memory when absent
        progress : True for a bar, or a function of a `carom.run.Moment`

        Raises
        ------
        StepError, KeyboardInterrupt
            What was done until then is in ``last_run``.

        Warns as `step` does; the run goes on.
        """
        from carom.run import run_world

        return run_world(
            self,
            duration,
            dt=dt,
            solver=solver,
            iterations=iterations,
            tolerance=tolerance,
            on_inaccurate=on_inaccurate,
            every=every,
            record_events=record_events,
            out=out,
            progress=progress,
        )

    def _advance(self, n_steps: int, dt: float, every: int) -> Chunk:
        """Takes steps and records a frame after every `every`-th (none for 0); ends before a step that fails.

        The failure is raised at once when no step was taken, else by the next call.
        """
        late, self._late_error = self._late_error, None
        if late is not None:
            raise late
        recorded, error = self._native.advance(n_steps, dt, every, not self._warned, self._progress)
        chunk = chunk_of(recorded, self._space, len(self))
        if chunk.inaccurate is not None:
            self._warn(*chunk.inaccurate)
        if chunk.gaining is not None:
            self._warn_of_gain(*chunk.gaining)
        if error is not None and len(chunk.steps) == 0:
            raise error
        self._late_error = error
        return chunk

    def _frame(self) -> Chunk:
        """The present state and the contacts of the last step as one frame."""
        self._late_error = None
        return chunk_of(self._native.frame(), self._space, len(self))

    # --- snapshots ---

    def snapshot(self) -> Snapshot:
        """The whole state as bytes: settings, bodies, motion, warm starts, ledger, waiting forces.

        Raises
        ------
        BuildError
            When a body's numbers are not finite.
        """
        return Snapshot(self._native.snapshot().encode())

    def restore(self, snapshot: bytes) -> None:
        """Brings back a state, bit for bit; force fields are those that it had, by name.

        Raises
        ------
        BuildError
            When it is no snapshot of this space, or had a force field that this world lacks.
        ViewError
            While arrays over the bodies are alive.
        """
        given: Any = snapshot
        if not isinstance(given, (bytes, bytearray)):
            remedy = "give what w.snapshot() returned"
            raise refused(None, "snapshot", "must be a snapshot", given, remedy)
        self._native.restore(given.decode(errors="replace"))
        self._late_error = None
        self._forget_warnings()
        self._forces = {name: self._forces[name] for name in self.forces}

    def __reduce__(self) -> tuple[Any, ...]:
        if self._forces:
            names = ", ".join(repr(name) for name in self._forces)
            remedy = "remove_force before pickling, and add_force after loading"
            raise BuildError(
                f"world: force fields are Python functions and cannot be pickled ({names}); {remedy}",
                field="forces", value=tuple(self._forces), remedy=remedy,
            )  # fmt: skip
        return _restored, (type(self), bytes(self.snapshot()))

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        made = type(self)()
        for name, function in self._forces.items():
            made.add_force(name, copy.deepcopy(function, memo))
        made.restore(self.snapshot())
        made.threads = self.threads
        return made

    def __copy__(self) -> Self:
        return copy.deepcopy(self)

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            super().__setattr__(name, value)
        except AttributeError:
            settings = list(self.settings)
            if name in settings or hasattr(type(self), name):
                raise
            raise AttributeError(str(unknown("setting", name, settings))) from None

    def __repr__(self) -> str:
        kinds = [body.kind for body in self] if len(self) <= 1000 else []
        still = len([kind for kind in kinds if kind != "dynamic"])
        parts = f"{len(self)} bodies" + (f" ({still} obstacles)" if still else "")
        solver = solver_of(self.settings)
        return f"<{self._space.name}.World {parts}, t = {self.time:.6g} s, solver {solver}>"


def _restored(kind: type[World], snapshot: bytes) -> World:
    """A world from its pickle."""
    world = kind()
    world.restore(snapshot)
    return world
