"""The energy ledger as a figure: energies and works above, what fails to add up below. Theory chapter 6."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from carom.errors import CaromError
from carom.plotting import style

if TYPE_CHECKING:
    from carom.recorded import Ledger

#: Works below this share of the energy that moved are left out unless asked for [1].
SMALL = 1e-3


def ledger_lines(ledger: Ledger, axes: Axes, lines: Sequence[str] | None = None) -> None:
    """Energies, and works by cause [J], into axes: those asked for, else those above a thousandth.

    Raises
    ------
    CaromError
        When a line is unknown.
    """
    for name in lines or ():
        if name not in ledger.lines:
            remedy = f"choose from {', '.join(ledger.lines)}"
            raise CaromError(
                f"unknown line {name!r} of the ledger; {remedy}", field="lines", value=name, remedy=remedy
            )
    axes.plot(ledger.time, ledger.energy, label="kinetic + potential", **style(0))
    axes.plot(ledger.time, ledger.kinetic, label="kinetic", **style(5))
    gained = float(np.max(np.abs(ledger.energy - ledger.energy[:1]), initial=0.0))
    moved = gained + float(np.max(ledger.kinetic, initial=0.0))
    number = 0
    for name, work in ledger.lines.items():
        wanted = name in lines if lines is not None else np.max(np.abs(work), initial=0.0) > SMALL * moved
        if wanted:
            number += 1 + (number == 4)
            axes.plot(ledger.time, work, label=f"work: {name.replace('_', ' ')}", **style(number))
    axes.set_ylabel("energy [J]")
    axes.grid(True, alpha=0.3)
    title = "lines above 0.1 %" if lines is None else None
    axes.legend(fontsize="small", title=title, title_fontsize="small")


def plot_ledger(ledger: Ledger, lines: Sequence[str] | None = None) -> Figure:
    """A figure of two panels: the ledger's lines, and its closure."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    ledger_lines(ledger, upper, lines)
    worst = float(np.max(np.abs(ledger.closure), initial=0.0))
    upper.set_title(f"energy ledger, closed to {worst:.1e} J", fontsize="medium")
    lower.plot(ledger.time, ledger.closure, **style(4))
    lower.set_xlabel("time [s]")
    lower.set_ylabel("closure [J]")
    lower.grid(True, alpha=0.3)
    return figure
