"""The world: bodies, settings, steps; one text for `carom.planar` and `carom.spatial`.

The engine holds the state. ``position``, ``rotation``, ``velocity`` and ``angular_velocity`` are arrays over
its own memory: reading them costs nothing, writing them moves the bodies, and while one of them is alive no
body can be added or removed. A step runs without the interpreter's lock; arrays keep showing the state before
it until it ends. Long because it is one class, the world's face, and its docstrings.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Never, Self

import numpy as np
import numpy.typing as npt

from carom import _carom
from carom._adding import attributed, body_arguments
from carom._body import ANGULAR_VELOCITY, POSITION, ROTATION, VELOCITY, Body
from carom._force import Force, loads
from carom._joint import Joint, joint_arguments
from carom._judged import Judged, SolveProgress
from carom._report import Chunk, GroupReport, Snapshot, StepReport, chunk_of
from carom._setting import Setting
from carom._shapes import ShapeLike
from carom._space import Floats, Records, Space, frozen, number
from carom.errors import BuildError, StepError, refused, unknown

if TYPE_CHECKING:
    from carom.run import ProgressLike, Run

Density = float | Callable[[Floats], npt.ArrayLike]


class World(Judged):
    """Bodies, settings and time.

    Parameters
    ----------
    gravity : (d,) [m/s^2]; 9.81 downwards along the last axis when absent
    dt : length of a step [s]; 1/240 when absent
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
        'Time-stepping scheme: "fixed_step" (default), or "events" (impacts and stops of slipping found '
        "inside the step; exact at any dt)."
    )
    events: Setting[dict[str, Any]] = Setting(
        'Choices of the scheme "events": touching, rest_speed_factor, tolerance, slip_stops, cap, overlap, '
        "plastic_arrivals, warm_start; those left out get their defaults."
    )
    solver: Setting[str | None] = Setting(
        'None (default): the scheme\'s own, "pgs" for "fixed_step" and "exact" for "events"; "auto" (sweeps '
        "first, stronger where asked), or another of `carom.SOLVERS`."
    )
    iterations: Setting[int] = Setting("Most iterations per solve [1].")
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

    def __init__(self, gravity: Any = None, dt: float | None = None, **settings: Any) -> None:
        self._native: Any = self._space.world()
        self._forces: dict[str, Force] = {}
        self._late_error: BaseException | None = None
        self._progress: SolveProgress | None = None
        self._forget_warnings()
        self.last_run: Run | None = None
        given = {"gravity": gravity, "dt": dt}
        for name, value in {**{k: v for k, v in given.items() if v is not None}, **settings}.items():
            self._set(name, value)

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
        if isinstance(plain, float) and not np.isfinite(plain):
            raise refused(None, name, "must be finite", plain, remedy)
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

    # --- joints ---

    def add_point_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        point: Any = None,
        anchor_a: Any = None,
        anchor_b: Any = None,
        collide: bool = False,
    ) -> Joint:
        """Holds a point of a at a point of b, or of the world: a hinge in the plane, a ball joint in space.

        Parameters
        ----------
        name : unlike that of any other joint
        a, b : bodies; without b the world itself
        point : (d,) place of the world where both are held now [m]; or
        anchor_a, anchor_b : (d,) points in the axes of the bodies' shapes, from the shapes' origins [m]; of
            the world a place [m]; where one is left out, it is where the other is
        collide : whether a and b collide with each other

        Raises
        ------
        BuildError
            Naming joint, field, value and remedy; anchors that are more than 1 % of the bodies' size apart
            are refused, smaller distances are closed by the first step. Nothing is added then.

        Constraint and rows: theory chapter 9.
        """
        return self._join({"kind": "point", **{k: v for k, v in locals().items() if k != "self"}})

    def add_distance_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        anchor_a: Any = None,
        anchor_b: Any = None,
        length: float | None = None,
        collide: bool = False,
    ) -> Joint:
        """Keeps the distance of two points, as a rod without mass does.

        Parameters
        ----------
        anchor_a, anchor_b : as for `add_point_joint`; the centres of mass when absent
        length : [m]; the present distance when absent

        Raises
        ------
        BuildError
            As `add_point_joint`.
        """
        return self._join({"kind": "distance", **{k: v for k, v in locals().items() if k != "self"}})

    def add_fixed_joint(
        self,
        name: str,
        a: str | Body,
        b: str | Body | None = None,
        *,
        point: Any = None,
        anchor_a: Any = None,
        anchor_b: Any = None,
        collide: bool = False,
    ) -> Joint:
        """Keeps the present relative pose of a and b, or of a and the world, as a weld does.

        Parameters
        ----------
        point, anchor_a, anchor_b : where its force acts, as for `add_point_joint`; a's centre of mass when
            all are absent

        Raises
        ------
        BuildError
            As `add_point_joint`, and for bodies that nothing turns.
        """
        return self._join({"kind": "fixed", **{k: v for k, v in locals().items() if k != "self"}})

    def _join(self, given: dict[str, Any]) -> Joint:
        bodies = {key: g.name if isinstance(g := given[key], Body) else g for key in ("a", "b")}
        given = given | bodies
        with attributed(given):
            self._native.add_joint(given["name"], joint_arguments(given, self._space))
        return Joint(self, given["name"])

    def remove_joint(self, name: str | Joint) -> None:
        """Removes a joint.

        Raises
        ------
        BuildError
            When there is no such joint.
        """
        self._native.remove_joint(name.name if isinstance(name, Joint) else name)

    @property
    def joints(self) -> dict[str, Joint]:
        """The joints by name, in the order in which they were added."""
        return {name: Joint(self, name) for name in self._native.joint_names()}

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

    # --- arrays over all bodies ---

    @property
    def position(self) -> Floats:
        """(n, d) float64 view, centres of mass [m]; valid and writable until dropped."""
        array: Floats = self._native.view(POSITION)
        return array

    @position.setter
    def position(self, value: npt.ArrayLike) -> None:
        self._fill(self.position, "position", value)

    @property
    def rotation(self) -> Floats:
        """(n, 2) [cos, sin] | (n, 4) [w, x, y, z] float64 view; length 1 is restored by the next step."""
        array: Floats = self._native.view(ROTATION)
        return array

    @rotation.setter
    def rotation(self, value: npt.ArrayLike) -> None:
        self._fill(self.rotation, "rotation", value)

    @property
    def velocity(self) -> Floats:
        """(n, d) float64 view, velocities of the centres of mass [m/s]; static bodies must keep 0."""
        array: Floats = self._native.view(VELOCITY)
        return array

    @velocity.setter
    def velocity(self, value: npt.ArrayLike) -> None:
        self._fill(self.velocity, "velocity", value)

    @property
    def angular_velocity(self) -> Floats:
        """(n,) | (n, 3) float64 view, world axes [rad/s]; static bodies must keep 0."""
        array: Floats = self._native.view(ANGULAR_VELOCITY)
        return array[:, 0] if self._space.is_planar else array

    @angular_velocity.setter
    def angular_velocity(self, value: npt.ArrayLike) -> None:
        self._fill(self.angular_velocity, "angular_velocity", value)

    @staticmethod
    def _fill(view: Floats, field: str, value: npt.ArrayLike) -> None:
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.zeros(0)
        if array.shape != view.shape:
            raise refused(None, field, f"must be a {view.shape} array", value, "give a row for each body")
        view[...] = array

    @property
    def mass(self) -> Floats:
        """(n,) float64 array [kg]; inf for bodies that forces do not move."""
        return frozen(self._native.masses())

    # --- loads ---

    def add_force(self, name: str, function: Force) -> None:
        """Adds a force field, or replaces the one of this name.

        Parameters
        ----------
        function : called at least once per step with the time [s] and copies of positions (n, d) [m] and
            velocities (n, d) [m/s]; returns forces (n, d) [N] at the centres of mass, or a dictionary with
            "force" and "torque" ((n,) | (n, 3) [N m]). Rows of static and kinematic bodies are ignored. An
            exception that it raises comes out of `step`, and the step is not taken. It should depend on its
            arguments alone: an integrator may ask several times in a step.

        Raises
        ------
        BuildError
            When `function` cannot be called.
        """
        if not callable(function):
            raise refused(None, "function", "must be callable", function, "give f(time, position, velocity)")
        self._native.add_force(name, loads(name, function, self._space))
        self._forces[name] = function

    def remove_force(self, name: str) -> None:
        """Removes a force field.

        Raises
        ------
        BuildError
            When there is none of this name.
        """
        if not self._native.remove_force(name):
            raise unknown("force field", name, list(self._forces))
        self._forces.pop(name, None)

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the force fields, in the order they act."""
        return tuple(self._native.force_fields())

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

    # --- what is known of the state ---

    @property
    def contacts(self) -> Records:
        """Contacts of the last step: a structured array, empty before the first.

        Fields
        ------
        a, b : rows of the two bodies
        id : names the contact from step to step
        point, normal : (d,) at the step's start [m]; unit normal from b to a
        gap : distance of the surfaces at the step's start [m], negative for overlap
        normal_impulse : on a along the normal, over the whole step [N s]
        friction_impulse : (d,) on a, world axes [N s]
        slip : (d,) velocity of a's point against b's across the normal, after the step [m/s]
        status : index into ``carom.CONTACT_STATUS``: apart, sticks, slips, strikes
        friction : coefficient of the pair [1]
        impact_impulse : (d,) what of the impulse is the impacts' at the step's start, on a, world axes [N s]
        kick_normal : (d,) unit normal with which the persistent contact acted
        kick_arm : (d,) from a's centre of mass to the point where it acted [m]; 0 for none
        moment : (1 | 3,) rolling and spinning friction on a, world axes, over the whole step [N m s]
        """
        packed: Records = self._native.contacts().view(self._space.contact_type)
        return packed

    @property
    def event_log(self) -> Records:
        """What the contacts did in the last step, act by act: a structured array, empty before the first step
        and for the scheme "fixed_step".

        Fields
        ------
        act : number of the flow or round of impacts that it is part of; those of one body increase with time
        kind : index into ``carom.EVENT_KINDS``: flow, flow_to_end (friction against the slip at its end),
            impact, rest_cut (an approach too slow to bounce), fallback_impact, fallback_flow, slowed and
            closing (plastic arrivals within the step)
        time, length : when it began, how long it lasted [s]; 0 for impacts
        a, b : rows of the two bodies
        id : names the contact from step to step
        point, normal : (d,) where it acted, half-way through a flow [m]; unit normal from b to a there
        arm_a, arm_b : (d,) from the centres of mass to where the impulse acted [m]
        gap : when it began [m]
        impulse : (d,) on a, world axes [N s]
        moment : (1 | 3,) rolling and spinning friction on a, world axes [N m s]
        friction, restitution, tangential_restitution : coefficients of the pair [1]
        """
        packed: Records = self._native.events().view(self._space.event_type)
        return packed

    @property
    def energy(self) -> dict[str, float]:
        """Energies of all dynamic bodies [J]; potential is zero at the world's origin."""
        translational, rotational, potential = self._native.energy()
        return {
            "kinetic_translational": translational,
            "kinetic_rotational": rotational,
            "potential": potential,
            "total": translational + rotational + potential,
        }

    @property
    def momentum(self) -> Floats:
        """(d,) float64 array, sum of m v [kg m/s]."""
        return frozen(np.array(self._native.momenta()[0]))

    @property
    def angular_momentum(self) -> Any:
        """Sum of x x p + I w about the world's origin, a float | (3,) float64 array [kg m^2/s]."""
        return self._space.plain_spin(self._native.momenta()[1])

    @property
    def ledger(self) -> dict[str, float]:
        """Work by cause since the world began, and the closure [J]."""
        return dict(zip(_carom.LEDGER_LINES, self._native.ledger(), strict=True))

    @property
    def ledger_groups(self) -> dict[str, tuple[str, ...] | None]:
        """Groups of bodies with books of their own: names of their bodies by group, None for all that move.

        Setting them begins their books anew; ``{}`` ends them. Each step's report then has energy, momentum
        and angular momentum by cause for each group (``report.groups``), `group_ledgers` their sums. Groups
        may overlap; those that divide the world add up to it. Snapshots do not have them.

        Raises
        ------
        BuildError
            For a group's name that is empty, or a body that is not there, named twice or an obstacle; the old
            groups stay then.
        """
        return {name: None if of is None else tuple(of) for name, of in self._native.groups()}

    @ledger_groups.setter
    def ledger_groups(self, groups: Mapping[str, Iterable[str] | None]) -> None:
        remedy = "give names of groups, each with names of bodies or None, e.g. {'pile': ['box1', 'box2']}"
        if not isinstance(groups, Mapping):
            raise refused(None, "ledger_groups", "must be a mapping", groups, remedy)
        told: list[tuple[str, list[str] | None]] = []
        for name, of in groups.items():
            plain = None if of is None or isinstance(of, str) else [str(body) for body in of]
            if isinstance(of, str) or not isinstance(name, str):
                raise refused(None, "ledger_groups", "must name lists of bodies", groups, remedy)
            told.append((name, plain))
        self._native.set_groups(told)

    @property
    def group_ledgers(self) -> dict[str, GroupReport]:
        """Books of the `ledger_groups` since these were set; energies and momenta after the last step."""
        return {group.name: group for group in map(GroupReport._told, self._native.group_ledgers())}

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
        solver = self.solver or ("exact" if self.scheme == "events" else "pgs")
        return f"<{self._space.name}.World {parts}, t = {self.time:.6g} s, solver {solver}>"


def _restored(kind: type[World], snapshot: bytes) -> World:
    """A world from its pickle."""
    world = kind()
    world.restore(snapshot)
    return world
