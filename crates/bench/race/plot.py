"""Quality against time from the race's results: a panel for each scene, a point for each engine.

Across: processor time of a step on one thread, without sleeping. Up: mean overlap of the pairs that overlap
at the end, with a line to the deepest of the run. Left and low is better. Runs that were cut are hollow.

usage: plot.py PEERS.CSV PICTURE
"""

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter

ENGINES = ["carom", "box2d", "box3d", "rapier", "jolt", "mujoco", "pymunk"]
# overlaps of this size [m] and below are drawn at the bottom
FLOOR = 1e-7


def panels(path: Path) -> dict[str, list[dict[str, str]]]:
    """Rows of one thread without sleeping, by scene."""
    found: dict[str, list[dict[str, str]]] = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["threads"] == "1" and row["sleeping"] == "off":
                found.setdefault(f"{row['space']} {row['scene']}", []).append(row)
    return found


def draw(axes: plt.Axes, title: str, rows: list[dict[str, str]]) -> None:
    """One scene."""
    for row in rows:
        colour = f"C{ENGINES.index(row['engine'])}"
        time = float(row["cpu_ms_per_step"])
        mean, deepest = (max(float(row[c]), FLOOR) for c in ("penetration_mean", "penetration_max"))
        whole = row["steps"] == row["steps_asked"]
        axes.plot([time, time], [mean, deepest], color=colour, linewidth=1)
        axes.plot(time, mean, "o", color=colour, fillstyle="full" if whole else "none")
        axes.annotate(row["engine"], (time, mean), fontsize=7, xytext=(4, 3), textcoords="offset points")
    axes.set(xscale="log", yscale="log", title=title)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.title.set_fontsize(9)
    axes.tick_params(labelsize=7)
    axes.margins(0.25)
    axes.grid(alpha=0.3)


def main() -> None:
    """Draw all scenes of a file."""
    source, picture = (Path(word) for word in sys.argv[1:3])
    scenes = panels(source)
    if not scenes:
        sys.exit(f"{source}: no rows of one thread without sleeping")
    across = 4
    down = -(-len(scenes) // across)
    figure, grid = plt.subplots(down, across, figsize=(3.4 * across, 2.8 * down), squeeze=False)
    for axes, (title, rows) in zip(grid.flat, scenes.items(), strict=False):
        draw(axes, title, rows)
    for axes in grid.flat[len(scenes) :]:
        axes.set_visible(False)
    figure.supxlabel("processor time of a step [ms]", fontsize=10)
    figure.supylabel("overlap: mean at the end, up to the deepest [m]", fontsize=10)
    figure.tight_layout()
    picture.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(picture, dpi=110)
    print(picture)


main()
