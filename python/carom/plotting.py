"""Pictures of a run: energy ledger, momentum, residual, contacts, and the matrix A = J M^-1 J^T at a step.

Colours are Okabe and Ito's, told apart by colour-blind readers, and every line has its own dash as well.
Figures are made without pyplot, so no window opens and no global state changes. J and A follow theory
chapter 3: row i of J is [n, r_a x n, -n, -(r_b x n)] for the normal of contact i.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from carom.errors import CaromError

if TYPE_CHECKING:
    from carom.recorded import Run
    from carom.recording import Floats

#: Okabe and Ito's palette for colour-blind readers (2008), black first.
PALETTE = (
    "#000000",
    "#E69F00",
    "#56B4E9",
    "#009E73",
    "#D55E00",
    "#0072B2",
    "#CC79A7",
    "#999933",
    "#882255",
    "#44AA99",
)
#: Dates are left out of files.
_UNDATED: dict[str, Any] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
DASHES: tuple[Any, ...] = (
    "-",
    "--",
    "-.",
    ":",
    (0, (5, 1)),
    (0, (3, 1, 1, 1)),
    (0, (1, 1)),
    (0, (7, 2, 2, 2)),
)
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
#: Pictures that there are.
KINDS = ("energy", "momentum", "residual", "contacts", "matrix")
#: Most contacts for which A is drawn as coloured squares; beyond, as dots.
MOST_SQUARES = 1500


def plot(run: Run, kind: str = "all", *, step: int | None = None) -> Figure:
    """A figure of one kind, or of all.

    Parameters
    ----------
    kind : "energy", "momentum", "residual", "contacts", "matrix" or "all"
    step : step whose contacts make the matrix, from 0; the recorded frame with most contacts when absent

    Raises
    ------
    CaromError
        When the kind is unknown or the step is outside the run.
    """
    if kind not in (*KINDS, "all"):
        raise CaromError(
            f"unknown plot {kind!r}; choose one of {', '.join(KINDS)}, all", field="kind", value=kind,
            remedy=f"choose one of {', '.join(KINDS)}, all",
        )  # fmt: skip
    kinds = KINDS if kind == "all" else (kind,)
    rows = (len(kinds) + 1) // 2
    size = (13.0, 3.6 * rows) if kind == "all" else (8.0, 5.0) if kind != "matrix" else (6.5, 6.0)
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subfigures(rows, 2 if kind == "all" else 1, squeeze=False).reshape(-1)
    for name, panel in zip(kinds, panels, strict=False):
        axes = panel.add_subplot()
        if name == "matrix":
            matrix_picture(run, axes, step)
        else:
            PICTURES[name](run, axes)
    scene = run.header.scene_name or "run"
    figure.suptitle(f"{scene}: {len(run.steps)} steps of {run.header.dt:.4g} s, {run.summary()['solver']}")
    return figure


def save_figure(figure: Figure | Axes, path: str | Path) -> None:
    """Writes a figure, or that of axes; the suffix chooses PNG, or SVG or PDF with lines as lines.

    The PDF's text is text, the SVG's is lines.

    The same figure gives the same bytes: files carry no date.

    Raises
    ------
    CaromError
        When the suffix is none of these or the path cannot be written.
    """
    if isinstance(figure, Axes):
        whole = figure.get_figure(root=True)
        assert whole is not None
        figure = whole
    path = Path(path)
    if path.suffix.lower() not in (".png", ".svg", ".pdf"):
        remedy = "give a path that ends in .png, .svg or .pdf"
        problem = f"unknown kind of picture {path.suffix!r}"
        raise CaromError(f"{problem}; {remedy}", field="out", value=str(path), remedy=remedy)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with rc_context({"pdf.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "carom"}):
            figure.savefig(path, dpi=150, metadata=_UNDATED.get(path.suffix.lower()))
    except OSError as error:
        raise CaromError(
            f"{str(path)!r} cannot be written: {error.strerror or error}; choose another path", field="out",
            value=str(path), remedy="choose another path",
        ) from error  # fmt: skip


def style(number: int) -> dict[str, Any]:
    """Colour and dash of the line of that number."""
    return {
        "color": PALETTE[number % len(PALETTE)],
        "linestyle": DASHES[number % len(DASHES)],
        "linewidth": 1.4,
    }


def energy_picture(run: Run, axes: Axes) -> None:
    """Energies and the ledger's lines that reach a thousandth of the energy that moved [J]."""
    from carom._plot_ledger import ledger_lines

    ledger_lines(run.ledger, axes)
    _label(axes, "energy [J]", f"energy ledger, closed to {run.energy_closure:.1e} J")


def momentum_picture(run: Run, axes: Axes) -> None:
    """Components of the total momentum [kg m/s] and, on the right, of the angular momentum [kg m^2/s]."""
    steps = run.steps
    momentum, turning = _columns(steps["momentum"]), _columns(steps["angular_momentum"])
    for number in range(momentum.shape[1]):
        axes.plot(steps["time"], momentum[:, number], label=f"P{'xyz'[number]}", **style(number))
    _label(axes, "momentum [kg m/s]", "momentum (left) and angular momentum about the origin (right)")
    right = axes.twinx()
    names = ["L"] if turning.shape[1] == 1 else ["Lx", "Ly", "Lz"]
    for number, name in enumerate(names):
        right.plot(steps["time"], turning[:, number], label=name, **style(number + 4))
    right.set_ylabel("angular momentum [kg m²/s]")
    handles = [*axes.get_lines(), *right.get_lines()]
    right.legend(handles, [str(line.get_label()) for line in handles], fontsize="small")


def _alone(values: Floats) -> npt.NDArray[np.bool_]:
    """Values without one beside them: a line through them shows nothing."""
    missing = np.concatenate(([True], np.isnan(values), [True]))
    return ~missing[1:-1] & missing[:-2] & missing[2:]


def residual_picture(run: Run, axes: Axes) -> None:
    """Residual of each step on a logarithmic axis [m/s]; steps at exactly zero are not drawn."""
    steps, worst = run.steps, run.worst
    _label(axes, "residual [m/s]", f"contact law, worst residual {worst.value:.1e} m/s")
    if not worst.value > 0:
        axes.text(0.5, 0.5, "no step has a residual", ha="center", va="center", transform=axes.transAxes)
        return
    values = np.where(steps["residual"] > 0, steps["residual"], np.nan)
    axes.semilogy(steps["time"], values, label="residual", color=PALETTE[5], linewidth=0.9)
    alone = _alone(values)
    axes.plot(steps["time"][alone], values[alone], "o", color=PALETTE[5], markersize=3)
    if len(values) > 1:
        axes.set_xlim(steps["time"][0], steps["time"][-1])
    axes.plot([worst.time], [worst.value], "o", color=PALETTE[0], label=f"worst, {worst.where()}")
    tolerance = run.settings.get("tolerance")
    if tolerance:
        axes.axhline(float(tolerance), label="tolerance", **style(4))
    axes.legend(fontsize="small")


def contacts_picture(run: Run, axes: Axes) -> None:
    """Number of contacts and, on the right, the deepest penetration [m]."""
    steps = run.steps
    axes.plot(steps["time"], steps["contacts"], label="contacts", color=PALETTE[5])
    _label(axes, "contacts [1]", f"contacts, deepest penetration {run.deepest_penetration:.1e} m")
    right = axes.twinx()
    depth = np.maximum(0.0, -np.nan_to_num(steps["deepest_gap"], posinf=0.0))
    right.plot(steps["time"], depth, label="deepest penetration", **style(4))
    right.set_ylabel("deepest penetration [m]")
    handles = [*axes.get_lines(), *right.get_lines()]
    right.legend(handles, [str(line.get_label()) for line in handles], fontsize="small")


def matrix_picture(run: Run, axes: Axes, step: int | None = None) -> None:
    """Pattern and size of A = J M^-1 J^T of the normals at the recorded frame nearest to a step [1/kg].

    Raises
    ------
    CaromError
        When the step is outside the run.
    """
    from carom._plot_problem import spy

    frame = _frame_of(run, step)
    matrix = normal_matrix(run, frame)
    title = f"A = J M⁻¹ Jᵀ at t = {run.time[frame]:.4g} s, {matrix.shape[0]} contacts"
    axes.set_title(title, fontsize="medium")
    spy(matrix, axes, "1/kg", "contact")


def normal_matrix(run: Run, frame: int) -> Any:
    """A = J M^-1 J^T of the contact normals of a recorded frame.

    Returns
    -------
    (k, k) scipy.sparse.csr_array [1/kg]; bodies that forces do not move add nothing.
    """
    from scipy import sparse

    contacts = run.contacts[frame]
    dimension = run.position.shape[2]
    spins = 1 if dimension == 2 else 3
    width = dimension + spins
    rows: list[npt.NDArray[np.int64]] = []
    columns: list[npt.NDArray[np.int64]] = []
    values: list[npt.NDArray[np.float64]] = []
    for side, sign in (("a", 1.0), ("b", -1.0)):
        body = contacts[side].astype(np.int64)
        used = np.flatnonzero((body >= 0) & (run.header.kind[body] == 0))
        body = body[used]
        normal = contacts["normal"][used] * sign
        arm = contacts["point"][used] - run.position[frame, body]
        turn = (
            np.cross(arm, normal) if dimension == 3 else arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]
        )
        block = np.hstack([normal, turn.reshape(len(used), spins)])
        rows.append(np.repeat(used, width))
        columns.append((body[:, None] * width + np.arange(width)).reshape(-1))
        values.append(block.reshape(-1))
    shape = (len(contacts), len(run.names) * width)
    where = (np.concatenate(rows), np.concatenate(columns))
    jacobian = sparse.csr_array(sparse.coo_array((np.concatenate(values), where), shape=shape))
    return sparse.csr_array(jacobian @ _inverse_mass(run, frame, np.unique(where[1] // width)) @ jacobian.T)


def _inverse_mass(run: Run, frame: int, bodies: npt.NDArray[np.int64]) -> Any:
    """M^-1 in world axes with a block for each of the given bodies, zero elsewhere."""
    from scipy import sparse

    dimension = run.position.shape[2]
    width = 3 if dimension == 2 else 6
    blocks = np.zeros((len(bodies), width, width))
    for number, body in enumerate(bodies):
        blocks[number, range(dimension), range(dimension)] = 1.0 / run.header.mass[body]
        inertia = np.atleast_2d(run.header.inertia[body])
        if np.isfinite(inertia).all() and np.trace(inertia) > 0:  # a particle has none
            turn = np.eye(1) if dimension == 2 else _matrix_of(run.rotation[frame, body])
            blocks[number, dimension:, dimension:] = turn @ np.linalg.inv(inertia) @ turn.T
    places = bodies[:, None] * width + np.arange(width)
    rows = np.repeat(places, width, axis=1).reshape(-1)
    columns = np.tile(places, (1, width)).reshape(-1)
    size = len(run.names) * width
    return sparse.csr_array(sparse.coo_array((blocks.reshape(-1), (rows, columns)), shape=(size, size)))


def _matrix_of(q: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Rotation matrix of a unit quaternion [w, x, y, z]."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _frame_of(run: Run, step: int | None) -> int:
    """Recorded frame nearest to the end of a step; the one with most contacts when no step is asked for."""
    if step is None:
        return int(np.argmax(np.diff(run.contacts.offsets)))
    if not 0 <= step < len(run.steps):
        raise CaromError(
            f"step {step} is outside the run of {len(run.steps)} steps; give 0 to {len(run.steps) - 1}",
            field="step", value=step, remedy=f"give 0 to {len(run.steps) - 1}",
        )  # fmt: skip
    return int(np.argmin(np.abs(run.time - run.steps["time"][step])))


def _columns(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """One column per component, also when there is but one."""
    return values[:, None] if values.ndim == 1 else values


def _label(axes: Axes, quantity: str, title: str) -> None:
    axes.set_xlabel("time [s]")
    axes.set_ylabel(quantity)
    axes.set_title(title, fontsize="medium")
    axes.grid(True, alpha=0.3)


#: Pictures over time, by name.
PICTURES: dict[str, Callable[[Run, Axes], None]] = {
    "energy": energy_picture,
    "momentum": momentum_picture,
    "residual": residual_picture,
    "contacts": contacts_picture,
}
