"""Several solvers on one scene as a figure: residual, iterations, cost and distance from the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from carom.plotting import MARKERS, PALETTE, style

if TYPE_CHECKING:
    from carom.comparison import Comparison


def plot_comparison(comparison: Comparison) -> Figure:
    """Four panels: residual and iterations by step, distance from the reference, accuracy against cost."""
    figure = Figure(figsize=(13.0, 7.6), layout="constrained")
    panels = figure.subplots(2, 2)
    residuals(comparison, panels[0, 0])
    work(comparison, panels[0, 1])
    distances(comparison, panels[1, 0])
    cost(comparison, panels[1, 1])
    return figure


def residuals(comparison: Comparison, axes: Axes) -> None:
    """Residual of each step [m/s]; steps at exactly zero are not drawn."""
    for number, (name, run) in enumerate(comparison.runs.items()):
        values = np.where(run.steps["residual"] > 0, run.steps["residual"], np.nan)
        axes.semilogy(run.steps["time"], values, label=name, **style(number))
    _label(axes, "time [s]", "residual [m/s]", "residual of each step")


def work(comparison: Comparison, axes: Axes) -> None:
    """Iterations of each step [1]."""
    for number, (name, run) in enumerate(comparison.runs.items()):
        axes.plot(run.steps["time"], run.steps["iterations"], label=name, **style(number))
    axes.set_yscale("symlog", linthresh=1)
    _label(axes, "time [s]", "iterations [1]", "iterations of each step")


def distances(comparison: Comparison, axes: Axes) -> None:
    """Largest distance of a body from where the reference has it, by frame [m]."""
    if comparison.reference is None:
        _label(axes, "time [s]", "distance [m]", "no solver came to the end")
        return
    reference = comparison.runs[comparison.reference]
    for number, (name, run) in enumerate(comparison.runs.items()):
        count = min(len(run.time), len(reference.time))
        if (
            name == comparison.reference
            or count == 0
            or run.position.shape[1:] != reference.position.shape[1:]
        ):
            continue
        apart = np.linalg.norm(run.position[:count] - reference.position[:count], axis=2).max(axis=1)
        apart[~np.isclose(run.time[:count], reference.time[:count], rtol=0, atol=1e-9)] = np.nan
        axes.semilogy(run.time[:count], np.where(apart > 0, apart, np.nan), label=name, **style(number))
    _label(axes, "time [s]", "distance [m]", f"largest distance from {comparison.reference}")


def cost(comparison: Comparison, axes: Axes) -> None:
    """Mean residual [m/s] against wall time per step [ms], a point per solver."""
    for number, row in enumerate(comparison.rows):
        if not (row.ms_per_step > 0 and row.mean_residual >= 0):
            continue
        shown = max(row.mean_residual, 1e-18)
        mark, colour = MARKERS[number % len(MARKERS)], PALETTE[number % len(PALETTE)]
        axes.plot([row.ms_per_step], [shown], mark, color=colour, label=row.solver, markersize=8)
    axes.set_xscale("log")
    axes.set_yscale("log")
    _label(axes, "time per step [ms]", "mean residual [m/s]", "accuracy against cost (exact zeros at 1e-18)")


def _label(axes: Axes, along: str, up: str, title: str) -> None:
    axes.set_xlabel(along)
    axes.set_ylabel(up)
    axes.set_title(title, fontsize="medium")
    axes.grid(True, alpha=0.3)
    if axes.get_lines():
        axes.legend(fontsize="small")
