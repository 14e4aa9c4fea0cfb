"""A recorded run: arrays over frames, records over steps, and what to think of it.

Worst residual, deepest penetration and energy closure are read off the steps, which are all recorded even
when only some of them are frames. Knows no physics and no worlds.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from carom.errors import BuildError
from carom.ragged import RaggedContacts, RaggedEvents
from carom.recording import LEDGER_LINES, FileData, Floats, Header, Records, RunData, copy_into, solver_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from carom._friction_problem import FrictionProblem
    from carom._problem import ContactProblem


@dataclass(frozen=True)
class Worst:
    """An extreme value of a run and where it occurred.

    Attributes
    ----------
    value : float, unit of the quantity
    step : number of the step, from 0; -1 when there is none
    time : at the end of that step [s]
    between : names of the two bodies, or None when no contact is to blame
    """

    value: float
    step: int
    time: float
    between: tuple[str, str] | None

    def where(self) -> str:
        """The place in words; nothing when there is nothing to blame."""
        if self.step < 0 or self.value == 0:
            return ""
        pair = f"{self.between[0]} / {self.between[1]}, " if self.between is not None else ""
        return f"{pair}step {self.step}, t = {self.time:.4g} s"


class Ledger:
    """Energy bookkeeping of a run: the work of each cause, cumulated over the steps [J].

    Attributes
    ----------
    time : (s,) float64 array, end of each step [s]
    lines : name -> (s,) float64 array of cumulated work [J]
    kinetic, potential, energy : (s,) float64 arrays after each step [J]
    closure : (s,) float64 array, energy gained so far minus all lines but gravity, which only turns
        potential into kinetic energy [J]; rounding alone is left of it
    """

    def __init__(self, steps: Records) -> None:
        """Cumulates the columns of the steps."""
        columns = steps.dtype.names or ()
        self.time: Floats = steps["time"]
        self.lines: dict[str, Floats] = {
            name: np.cumsum(steps[name]) for name in LEDGER_LINES if name in columns
        }
        self.kinetic: Floats = steps["kinetic"]
        self.potential: Floats = steps["potential"]
        self.energy: Floats = self.kinetic + self.potential
        self.closure: Floats = np.cumsum(steps["closure"])

    def __getitem__(self, line: str) -> Floats:
        """Cumulated work of a line, or the closure [J]."""
        return self.closure if line == "closure" else self.lines[line]

    def totals(self) -> dict[str, float]:
        """Work of each cause over the whole run, and the closure [J]."""
        found = {name: float(work[-1]) if len(work) else 0.0 for name, work in self.lines.items()}
        return {**found, "closure": float(self.closure[-1]) if len(self.closure) else 0.0}

    def plot(self, lines: Sequence[str] | None = None) -> Figure:
        """A figure: energies and works by cause above, the closure below [J].

        Parameters
        ----------
        lines : names of the works to draw; those above a thousandth of the energy that moved when absent

        Raises
        ------
        CaromError
            When a line is unknown.
        """
        from carom._plot_ledger import plot_ledger

        return plot_ledger(self, lines)

    def __repr__(self) -> str:
        """Totals of all lines."""
        lines = ", ".join(f"{name} {work:.4g} J" for name, work in self.totals().items())
        return f"<Ledger {lines}>"


class Run:
    """A recorded run: arrays over frames, records over steps, and what to think of it.

    Shapes: f frames, s steps, n bodies, d = 2 | 3. Arrays of a run in a file are read when first asked for.
    """

    def __init__(self, data: RunData) -> None:
        """A run over recorded data."""
        self._data = data

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Opens a run file; also one that is still being written, as far as it has come.

        Raises
        ------
        RunFileError
            When the file is missing or no run of carom.
        """
        return cls(FileData(Path(path)))

    def save(self, path: str | Path) -> None:
        """Writes the run as HDF5 (layout: ``carom.recording``); an existing run there is replaced.

        Raises
        ------
        RunFileError
            When the path cannot be written or holds something else.
        """
        copy_into(Path(path), self._data, _Whole(self))

    @property
    def path(self) -> Path | None:
        """File that holds the run, or None."""
        return self._data.path

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies, in order."""
        return self._data.header.names

    @property
    def header(self) -> Header:
        """What was known when the run began."""
        return self._data.header

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings of the world during the run."""
        return self._data.header.settings

    @property
    def space(self) -> str:
        """ "planar" or "spatial"."""
        return self._data.header.space

    @property
    def status(self) -> str:
        """ "complete", "interrupted", "failed", or "running" (also when the writer was killed)."""
        return self._data.progress.status

    @property
    def wall_time(self) -> float:
        """Wall time of the run, recording included [s]."""
        return self._data.progress.wall_time

    @property
    def ms_per_step(self) -> float:
        """Wall time of one step, recording excluded [ms]; nan without steps."""
        progress = self._data.progress
        return 1e3 * progress.step_time / progress.steps if progress.steps else math.nan

    @property
    def time(self) -> Floats:
        """(f,) float64 array [s]."""
        return self._data.frames("time")

    @property
    def position(self) -> Floats:
        """(f, n, d) float64 array, centres of mass [m]."""
        return self._data.frames("position")

    @property
    def rotation(self) -> Floats:
        """(f, n, 2|4) float64 array, [cos, sin] | [w, x, y, z] [1]."""
        return self._data.frames("rotation")

    @property
    def velocity(self) -> Floats:
        """(f, n, d) float64 array [m/s]."""
        return self._data.frames("velocity")

    @property
    def angular_velocity(self) -> Floats:
        """(f, n, 1|3) float64 array, world axes [rad/s]."""
        return self._data.frames("angular_velocity")

    @property
    def steps(self) -> Records:
        """(s,) structured array, one record per step; units: ``carom.recording.unit_of("steps", column)``."""
        return self._data.steps()

    @property
    def contacts(self) -> RaggedContacts:
        """Contacts by frame, or by time with ``.at(t)``."""
        return RaggedContacts(self._data)

    @cached_property
    def events(self) -> RaggedEvents:
        """What the contacts did in the last step before each frame, by frame or by time with ``.at(t)``;
        fields as of ``world.event_log``.

        Raises
        ------
        BuildError
            When they were not recorded.
        """
        records = self._data.table("events")
        if records is None:
            raise BuildError(
                "run: events were not recorded; run the scheme 'events' with record_events=True",
                field="record_events",
                value=False,
                remedy="run the scheme 'events' with record_events=True",
            )
        return RaggedEvents(self._data, records)

    @cached_property
    def ledger(self) -> Ledger:
        """Energy bookkeeping, cumulated [J]."""
        return Ledger(self.steps)

    @cached_property
    def worst(self) -> Worst:
        """Largest residual [m/s] and where."""
        return self._extreme("residual", "worst", largest=True)

    @cached_property
    def deepest(self) -> Worst:
        """Deepest penetration [m], 0 when nothing overlapped, and where."""
        found = self._extreme("deepest_gap", "deepest", largest=False)
        if not found.value < 0:
            return Worst(0.0, -1, math.nan, None)
        return replace(found, value=-found.value)

    @property
    def worst_residual(self) -> float:
        """Largest residual of all steps [m/s]."""
        return self.worst.value

    @property
    def deepest_penetration(self) -> float:
        """Deepest overlap of all steps [m], 0 when nothing overlapped."""
        return self.deepest.value

    @cached_property
    def energy_closure(self) -> float:
        """Largest amount by which the energy ledger ever failed to add up [J]."""
        closure = self.ledger.closure
        return float(np.max(np.abs(closure))) if len(closure) else 0.0

    def index(self, name: str) -> int:
        """Number of a body in the arrays."""
        try:
            return self.names.index(name)
        except ValueError:
            raise BuildError(
                f"no body {name!r} in this run; see run.names",
                field="name",
                value=name,
                remedy="see run.names",
            ) from None

    def summary(self) -> dict[str, Any]:
        """The closing table as plain values; units: s, ms, m/s, J, m."""
        worst, deepest = self.worst, self.deepest
        return {
            "scene": self.header.scene_name,
            "space": self.space,
            "status": self.status,
            "bodies": len(self.names),
            "steps": len(self.steps),
            "frames": len(self.time),
            "time": float(self.steps["time"][-1]) if len(self.steps) else 0.0,
            "dt": self.header.dt,
            "solver": self.header.solver or solver_of(self.settings),
            "wall_time": self.wall_time,
            "ms_per_step": _finite(self.ms_per_step),
            "mean_iterations": float(np.mean(self.steps["iterations"])) if len(self.steps) else 0.0,
            "worst_residual": _told(worst),
            "energy_closure": self.energy_closure,
            "deepest_penetration": _told(deepest),
            "out": str(self.path) if self.path is not None else None,
        }

    def plot(self, kind: str = "all", *, step: int | None = None) -> Figure:
        """A figure: "energy", "momentum", "residual", "contacts", "matrix" (at `step`) or "all"."""
        from carom.plotting import plot

        return plot(self, kind, step=step)

    def to_html(
        self,
        path: str | Path,
        *,
        other: Run | None = None,
        max_bytes: int | None = None,
        explain_seconds: float | None = None,
    ) -> Path:
        """Writes a page that replays the run: one HTML file that opens in any browser, without network.

        Parameters
        ----------
        other : a run of the same scene, shown as ghosts or beside this one, with the distance between them
        max_bytes : about the size of the page at most, 2e7 when absent; larger runs are thinned, which the
            page tells [bytes]
        explain_seconds : the worst step, and as many others as there is time for, are explained in words when
            running the scene again up to the worst takes no longer, 5 when absent; 0 for never [s]

        Returns
        -------
        The path.

        Raises
        ------
        CaromError
            When the run has no frame or a pose that is not finite, this installation holds no page, the runs
            share no body or no moment, or the path cannot be written.
        """
        from carom.player import write_page

        return write_page(path, self._page(other, max_bytes, explain_seconds))

    def to_png(
        self,
        path: str | Path,
        t: float | None = None,
        *,
        size: tuple[int, int] = (1280, 800),
        theme: str = "light",
        contacts: bool = True,
    ) -> Path:
        """Writes a picture of the frame nearest to a moment, drawn by a headless Chromium.

        Parameters
        ----------
        t : moment [s]; the end when absent
        size : width and height [pixels]
        theme : "light" or "dark"
        contacts : whether contacts and their impulses are drawn

        Raises
        ------
        CaromError
            When there is no Chromium and the run is of space (the plane is then drawn by matplotlib), an
            argument is refused, or the path cannot be written.
        """
        from carom.player.film import write_png

        return write_png(self, path, t, size, theme, contacts)

    def to_mp4(
        self,
        path: str | Path,
        *,
        speed: float = 1.0,
        fps: int = 30,
        size: tuple[int, int] = (1280, 720),
        theme: str = "light",
        contacts: bool = True,
    ) -> Path:
        """Writes a film, drawn and encoded by a headless Chromium (H.264, else VP9).

        Parameters
        ----------
        speed : simulated seconds per second of film [1]
        fps : pictures per second [1/s]
        size, theme, contacts : as for `to_png`

        Raises
        ------
        CaromError
            When there is no Chromium (runs of the plane are then drawn by matplotlib, if ffmpeg is there), an
            argument is refused, or the path cannot be written.
        """
        from carom.player.film import write_mp4

        return write_mp4(self, path, speed=speed, fps=fps, size=size, theme=theme, contacts=contacts)

    def _repr_html_(self) -> str:
        """The replay as a frame in a notebook, at most 5e6 bytes; its text where it cannot be shown."""
        from carom.errors import CaromError
        from carom.player import notebook_frame

        try:
            return notebook_frame(self._page(None, 5_000_000, 0.5))
        except CaromError as error:
            return f"<pre>{html.escape(repr(self))}\n{html.escape(str(error))}</pre>"

    def _page(self, other: Run | None, max_bytes: int | None, explain_seconds: float | None) -> str:
        from carom.player import EXPLAIN_SECONDS, MAX_BYTES, page_of

        return page_of(
            self,
            other,
            max_bytes=MAX_BYTES if max_bytes is None else int(max_bytes),
            explain_seconds=EXPLAIN_SECONDS if explain_seconds is None else explain_seconds,
        )

    def problem(
        self, step: int, *, phase: str = "contact", folder: str | Path | None = None
    ) -> ContactProblem:
        """The contact problem that step `step` (from 0) solved, found by running the scene again up to there.

        Parameters
        ----------
        phase : "contact" for the persistent contacts, "impact" for the impacts before them
        folder : where the scene's mesh files lie; the run file's folder when absent

        Raises
        ------
        RunFileError
            When there is no such step, the run does not come from a scene, or this carom runs it differently.
        """
        from carom._friction_problem_of_run import problem_of_run

        return problem_of_run(self, int(step), phase, None if folder is None else Path(folder))

    def save_problem(
        self, path: str | Path, step: int, *, phase: str = "contact", folder: str | Path | None = None
    ) -> FrictionProblem:
        """Writes the problem of a step in matrix form, as ``.npz`` or FCLIB's ``.hdf5``, and gives it.

        Raises
        ------
        RunFileError
            As for `problem`, and when the path cannot be written.
        BuildError
            When the problem has bounded rows or friction by the box, which the matrix form lacks.
        """
        from carom._friction_problem import FrictionProblem

        scene = self.header.scene_name or "run"
        found = FrictionProblem.from_problem(
            self.problem(step, phase=phase, folder=folder),
            name=f"{Path(scene).stem}-step{int(step)}",
            source=f"carom {self.header.version}: step {int(step)} of scene {scene}, {phase} problem",
        )
        found.save(path)
        return found

    def to_dataframe(self) -> Any:
        """One row per frame and body as a pandas frame: time, body, coordinates, velocities."""
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_dataframe needs pandas; install it with `pip install pandas`") from error
        frames, bodies = len(self.time), len(self.names)
        columns: dict[str, Any] = {"time": np.repeat(self.time, bodies), "body": list(self.names) * frames}
        axes = "xyz"[: self.position.shape[2]]
        turns = ("cos", "sin") if self.space == "planar" else ("qw", "qx", "qy", "qz")
        spins = ("w",) if self.space == "planar" else ("wx", "wy", "wz")
        for array, names in (
            (self.position, tuple(axes)),
            (self.rotation, turns),
            (self.velocity, tuple(f"v{axis}" for axis in axes)),
            (self.angular_velocity, spins),
        ):
            flat = array.reshape(frames * bodies, -1)
            columns |= {name: flat[:, number] for number, name in enumerate(names)}
        return pandas.DataFrame(columns)

    def __len__(self) -> int:
        """Number of steps."""
        return len(self.steps)

    def __repr__(self) -> str:
        """Steps, worst residual and energy closure."""
        state = "" if self.status == "complete" else f" ({self.status})"
        return (
            f"<Run {len(self.steps)} steps{state}, worst residual {self.worst_residual:.1e} m/s, "
            f"energy closure {self.energy_closure:.0e} J>"
        )

    def _extreme(self, column: str, pair: str, *, largest: bool) -> Worst:
        steps = self.steps
        if not len(steps) or np.isnan(steps[column]).all():
            return Worst(0.0, -1, math.nan, None)
        step = int(np.nanargmax(steps[column]) if largest else np.nanargmin(steps[column]))
        row = steps[step]
        between = None
        if f"{pair}_a" in (steps.dtype.names or ()) and row[f"{pair}_a"] >= 0:
            between = (self.names[int(row[f"{pair}_a"])], self.names[int(row[f"{pair}_b"])])
        return Worst(float(row[column]), step, float(row["time"]), between)


class _Whole:
    """A run as one chunk."""

    def __init__(self, run: Run) -> None:
        self.time = run.time
        self.position = run.position
        self.rotation = run.rotation
        self.velocity = run.velocity
        self.angular_velocity = run.angular_velocity
        self.contact_offsets: npt.NDArray[Any] = run.contacts.offsets
        self.contacts = run.contacts.all()
        self.actions = run._data.table("actions")
        self.action_offsets: npt.NDArray[Any] = run._data.frames("action_offsets")
        self.events = run._data.table("events")
        self.event_offsets: npt.NDArray[Any] = run._data.frames("event_offsets")
        self.pieces = run._data.table("pieces")
        self.piece_offsets: npt.NDArray[Any] = run._data.frames("piece_offsets")
        self.steps = run.steps


def _told(worst: Worst) -> dict[str, Any]:
    return {
        "value": _finite(worst.value),
        "step": worst.step if worst.step >= 0 else None,
        "time": _finite(worst.time),
        "between": list(worst.between) if worst.between is not None else None,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
