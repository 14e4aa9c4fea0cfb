"""Runs of the plane drawn by matplotlib, where there is no browser to draw them. Knows no page."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from carom.player.shapes import Shapes, shapes_of_run
from carom.recording import Floats, Records

if TYPE_CHECKING:
    from carom.recorded import Run

#: Pixels per inch [1/in].
DPI = 100
#: Corners of a full turn [1].
ROUND = 48
#: Colours by theme: background, bodies that move, obstacles, edges.
_COLOURS = {
    "light": ("#f6f7f8", "#9db8d2", "#d5d9de", "#39424c"),
    "dark": ("#14181c", "#6f93b5", "#39424c", "#9aa6b2"),
}
#: Colours of contacts by status: apart, sticks, slips, strikes.
_STATUS = ("#8a939c", "#0072b2", "#e07b00", "#c2185b")


def draw_planar(run: Run, time: float, size: tuple[int, int], theme: str, contacts: bool) -> bytes:
    """A frame of the plane as PNG; arguments as of `Run.to_png`."""
    figure, axes = _figure(size, theme)
    _Drawing(run, size).draw(axes, _frame_at(run, time), theme, contacts)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, facecolor=figure.get_facecolor())
    return buffer.getvalue()


def film_planar(
    run: Run, path: Path, *, speed: float, fps: int, size: tuple[int, int], theme: str, contacts: bool
) -> Path:
    """A film of the plane by matplotlib and ffmpeg; arguments as of `Run.to_mp4`."""
    from matplotlib.animation import FFMpegWriter

    figure, axes = _figure(size, theme)
    drawing, writer = _Drawing(run, size), FFMpegWriter(fps=fps)
    begin, end = float(run.time[0]), float(run.time[-1])
    with writer.saving(figure, str(path), DPI):
        for picture in range(int((end - begin) / speed * fps) + 1):
            axes.clear()
            drawing.draw(axes, _frame_at(run, begin + picture * speed / fps), theme, contacts)
            writer.grab_frame(facecolor=figure.get_facecolor())
    return path


def _figure(size: tuple[int, int], theme: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), facecolor=_COLOURS[theme][0])
    return figure, figure.add_axes((0.0, 0.0, 1.0, 1.0))


def _frame_at(run: Run, time: float) -> int:
    return int(np.argmin(np.abs(run.time - time)))


class _Drawing:
    """What all frames of a run share: outlines of its shapes, and the part of the plane that is seen."""

    def __init__(self, run: Run, size: tuple[int, int]) -> None:
        self.run = run
        self.shapes: Shapes = shapes_of_run(run)
        moving = np.flatnonzero(run.header.kind != 1)
        position = run.position[:, moving if len(moving) else slice(None)].reshape(-1, 2)
        extent = run.header.extent
        finite = extent[np.isfinite(extent)] if extent is not None else np.zeros(0)
        margin = float(np.median(finite)) if len(finite) else 0.1
        self.low, self.high = position.min(axis=0) - margin, position.max(axis=0) + margin
        # half-planes are drawn about their own place, however far the bodies are from it
        stands = run.position[:, run.header.kind == 1].reshape(-1, 2)
        away = np.linalg.norm(stands - (self.low + self.high) / 2, axis=1).max(initial=0.0)
        self.reach = 4 * float((self.high - self.low).max()) + float(away)
        self.outlines = [outlines_of(table, self.reach) for table in self.shapes.tables]
        self.aspect = size[0] / size[1]

    def draw(self, axes: Axes, frame: int, theme: str, contacts: bool) -> None:
        """Draws a frame."""
        _, moves, stands, edge = _COLOURS[theme]
        fills: list[Polygon] = []
        colours: list[str] = []
        lines: list[Floats] = []
        for body, index in enumerate(self.shapes.index):
            if index < 0:
                continue
            c, s = self.run.rotation[frame, body]
            turn = np.array([[c, -s], [s, c]])
            for outline, is_filled in self.outlines[index]:
                placed = (outline - self.shapes.center[body]) @ turn.T + self.run.position[frame, body]
                lines.append(placed)
                if is_filled:
                    fills.append(Polygon(placed))
                    colours.append(moves if self.run.header.kind[body] == 0 else stands)
        axes.add_collection(PatchCollection(fills, facecolors=colours, edgecolors="none"))
        axes.add_collection(LineCollection(lines, colors=edge, linewidths=0.8))
        if contacts:
            self._contacts(axes, frame)
        self._frame(axes)

    def _contacts(self, axes: Axes, frame: int) -> None:
        rows = self.run.contacts[frame]
        pressing = rows[rows["normal_impulse"] > 0]
        if not len(pressing):
            return
        impulse = pressing["normal"] * pressing["normal_impulse"][:, None] + pressing["friction_impulse"]
        impulse = np.where(self._is_on_b(pressing, impulse)[:, None], -impulse, impulse)
        unit = 0.08 * float((self.high - self.low).max())
        arrows = impulse / np.quantile(np.linalg.norm(impulse, axis=1), 0.98) * unit
        colours = [_STATUS[status] for status in pressing["status"]]
        at = pressing["point"]
        axes.scatter(at[:, 0], at[:, 1], s=10, c=colours, zorder=4)
        axes.quiver(
            at[:, 0], at[:, 1], arrows[:, 0], arrows[:, 1], color=colours, angles="xy", scale_units="xy",
            scale=1, width=0.003, zorder=5,
        )  # fmt: skip

    def _is_on_b(self, pressing: Records, on_a: Floats) -> npt.NDArray[np.bool_]:
        """Contacts whose impulse on b is drawn: on the body that moves, of two on the one it lifts."""
        moves: npt.NDArray[np.bool_] = self.run.header.kind == 0
        gravity = np.asarray(self.run.settings.get("gravity", (0.0, 0.0)), dtype=np.float64)
        sinks = on_a @ gravity > 0
        chosen: npt.NDArray[np.bool_] = ~moves[pressing["a"]] | (moves[pressing["b"]] & sinks)
        return chosen

    def _frame(self, axes: Axes) -> None:
        center, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        half = np.maximum(half, [half[1] * self.aspect, half[0] / self.aspect])
        axes.set_xlim(center[0] - half[0], center[0] + half[0])
        axes.set_ylim(center[1] - half[1], center[1] + half[1])
        axes.set_aspect("equal")
        axes.set_axis_off()


def outlines_of(shape: Mapping[str, Any], reach: float) -> list[tuple[Floats, bool]]:
    """Outlines of a shape of the plane, (k, 2) in its own axes [m], and whether each is filled."""
    kind = shape["type"]
    if kind == "compound":
        return [
            (_moved(outline, part["pose"]), filled)
            for part in shape["parts"]
            for outline, filled in outlines_of(part["shape"], reach)
        ]
    if kind == "circle":
        return [(_arc(np.zeros(2), shape["radius"], 0.0, 2 * math.pi), True)]
    if kind in ("box", "round_box"):
        width, height = np.asarray(shape["size"]) / 2
        corners = np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
        return [(_rounded(corners, shape.get("radius", 0.0)), True)]
    if kind == "capsule":
        ends = np.array([[-shape["length"] / 2, 0.0], [shape["length"] / 2, 0.0]])
        return [(_rounded(ends, shape["radius"]), True)]
    if kind in ("convex_polygon", "round_polygon"):
        return [(_rounded(_hull(np.asarray(shape["points"])), shape.get("radius", 0.0)), True)]
    if kind == "half_plane":
        nx, ny = np.asarray(shape["normal"]) / np.hypot(*shape["normal"]) * reach
        return [(np.array([[-ny, nx], [ny, -nx], [ny - nx, -nx - ny], [-ny - nx, nx - ny]]), True)]
    if kind == "cavity":
        return [(_arc(np.zeros(2), shape["radius"], 0.0, 2 * math.pi), False)]
    return [(_wall(shape), False)]


def _wall(shape: Mapping[str, Any]) -> Floats:
    if shape["type"] == "segment":
        return np.array([shape["a"], shape["b"]])
    if shape["type"] == "height_field":
        heights = np.asarray(shape["heights"])
        across = np.linspace(-shape["width"] / 2, shape["width"] / 2, len(heights))
        return np.stack([across, heights], axis=1)
    points = np.asarray(shape["points"], dtype=np.float64)
    return np.vstack([points, points[:1]]) if shape.get("closed") else points


def _moved(outline: Floats, pose: Mapping[str, Any]) -> Floats:
    c, s = pose["rotation"]
    moved: Floats = outline @ np.array([[c, s], [-s, c]]) + np.asarray(pose["position"])
    return moved


def _arc(center: Floats, radius: float, begin: float, end: float) -> Floats:
    angle = np.linspace(begin, end, max(2, int(ROUND * (end - begin) / (2 * math.pi)) + 1))
    arc: Floats = center + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return arc


def _rounded(points: Floats, radius: float) -> Floats:
    """The outline of a convex polygon (counter-clockwise) swept by a disc, closed."""
    if not radius > 0:
        return np.vstack([points, points[:1]])
    parts = []
    for before, at, after in zip(
        np.roll(points, 1, axis=0), points, np.roll(points, -1, axis=0), strict=True
    ):
        begin = math.atan2(*(at - before)[::-1]) - math.pi / 2
        end = math.atan2(*(after - at)[::-1]) - math.pi / 2
        while end < begin:
            end += 2 * math.pi
        parts.append(_arc(at, radius, begin, end))
    return np.vstack([*parts, parts[0][:1]])


def _hull(points: Floats) -> Floats:
    from scipy.spatial import ConvexHull

    hull: Floats = points[ConvexHull(points).vertices]
    return hull
