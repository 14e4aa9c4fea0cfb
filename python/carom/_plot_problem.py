"""Pictures of contact problems: the pattern of A = J M^-1 J^T, and residuals while solvers work.

Theory chapter 5. Curves join measured points, one solve each (`carom._convergence`). Knows no worlds.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from carom.errors import CaromError
from carom.plotting import MARKERS, MOST_SQUARES, PALETTE, style

if TYPE_CHECKING:
    from carom._convergence import Convergence
    from carom._problem import ContactProblem

#: What a convergence curve may run against.
AGAINST = ("iterations", "time")


def spy(matrix: Any, axes: Axes, unit: str, what: str) -> None:
    """|A| as coloured squares on a logarithmic scale, or its pattern alone when it is large."""
    axes.set_xlabel(f"{what} [1]")
    axes.set_ylabel(f"{what} [1]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if matrix.nnz == 0:
        axes.text(0.5, 0.5, "no contacts", ha="center", va="center", transform=axes.transAxes)
    elif matrix.shape[0] > MOST_SQUARES:
        axes.spy(matrix, markersize=0.5, color=PALETTE[5])
    else:
        size = np.abs(matrix.toarray())
        shown = np.ma.masked_less_equal(size, 1e-12 * size.max())
        low, high = float(shown.min()), float(shown.max())
        norm = LogNorm(vmin=low, vmax=high) if low < high else LogNorm(vmin=low / 2, vmax=2 * high)
        image = axes.imshow(shown, norm=norm, cmap="cividis", interpolation="nearest")
        axes.figure.colorbar(image, ax=axes, label=f"|A| [{unit}]", shrink=0.8)


def convergence_picture(curves: Sequence[Convergence], axes: Axes, against: str = "iterations") -> None:
    """Residual [m/s] against iterations spent [1] or the wall time of the solve [ms], both axes logarithmic.

    Raises
    ------
    CaromError
        When `against` is neither.
    """
    if against not in AGAINST:
        raise CaromError(
            f"unknown axis {against!r}; choose one of {', '.join(AGAINST)}", field="against", value=against,
            remedy=f"choose one of {', '.join(AGAINST)}",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("iterations [1]" if against == "iterations" else "wall time of the solve [ms]")
    axes.set_ylabel("residual [m/s]")
    axes.grid(True, alpha=0.3)
    refused = []
    for count, curve in enumerate(curves):
        shown = curve.residual > 0
        if not shown.any():
            refused.append(f"{curve.solver}: " + ("refused" if not len(curve.residual) else "residual 0"))
            continue
        along = np.maximum(curve.spent, 1.0) if against == "iterations" else 1e3 * curve.seconds
        label = curve.solver + ("" if curve.counts == "iterations" else f" (budget of {curve.counts})")
        mark = {"marker": MARKERS[count % len(MARKERS)], "markersize": 3.5}
        axes.plot(along[shown], curve.residual[shown], label=label, **{**style(count), **mark})
    if axes.get_lines():
        _label_decades(axes)
        title = "; ".join(refused) if refused else None
        axes.legend(fontsize="small", title=title, title_fontsize="x-small")
    elif refused:
        axes.text(0.5, 0.5, "\n".join(refused), ha="center", va="center", transform=axes.transAxes)


def _label_decades(axes: Axes) -> None:
    """Labels whole decades where there are two, else 1, 2 and 5: all nine would stand on each other."""
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if high >= 100 * low else (1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def plot_problem(problem: ContactProblem, curves: Sequence[Convergence]) -> Figure:
    """The pattern of A, and residuals against iterations and against time."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    panels = figure.subplots(1, 3)
    problem.spy(panels[0])
    for axes, against in zip(panels[1:], AGAINST, strict=True):
        convergence_picture(curves, axes, against)
    known = panels[1].get_legend()
    if known is not None:  # one for both, where it hides no point
        handles, labels = panels[1].get_legend_handles_labels()
        title = known.get_title().get_text() or None
        figure.legend(handles, labels, loc="outside lower right", ncols=len(labels), fontsize="small",
                      title=title, title_fontsize="x-small")  # fmt: skip
        for axes in panels[1:]:
            axes.get_legend().remove()
    panels[1].set_title("residual against iterations", fontsize="medium")
    panels[2].set_title("residual against time", fontsize="medium")
    return figure
