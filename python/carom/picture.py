"""Pictures of worlds, for papers and pages: the plane as vector outlines, space as a shaded picture.

>>> from carom import picture, planar
>>> w = planar.World()
>>> floor = w.add_static("floor", planar.HalfPlane())
>>> box = w.add_body("box", planar.Box(1, 1), mass=2.0, position=(0, 0.5))
>>> figure = picture.draw(w)
>>> [axes.get_xlabel() for axes in figure.axes]
['x [m]']

Bodies are drawn where they are, or where a run had them. Colours are Okabe and Ito's, one after another, or
those that are asked for; obstacles are grey. Needs numpy, scipy and matplotlib, and no graphics card.
Of a run in an old file, which holds no shapes, see `carom.player.shapes`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline

from carom._outline import matrix_of, outlines, solids
from carom._render import Camera, Scene, looking, render
from carom.errors import BuildError
from carom.player.shapes import shapes_of_run
from carom.recorded import Run

Floats = npt.NDArray[np.float64]
Colors = str | Mapping[str, str] | Callable[[str], str] | None

#: Colours of bodies: Okabe and Ito's without black, lightened so that lines can be seen on them.
BODIES = ("#56B4E9", "#E69F00", "#2AB08A", "#E8743B", "#3F8FC9", "#D98FB8", "#E5D93C")
#: Colour of obstacles, of outlines and of impulse arrows.
OBSTACLE, INK, ARROW = "#D5D8DC", "#22272E", "#B00040"


def draw(
    what: Any,
    axes: Axes | None = None,
    *,
    run: Run | None = None,
    t: float | None = None,
    colors: Colors = None,
    impulses: bool = False,
    view: Any = None,
    ghosts: int = 0,
    azimuth: float = -55.0,
    elevation: float = 18.0,
    zoom: float = 1.0,
    size: tuple[float, float] = (7.5, 4.6),
    dots: int = 140,
) -> Figure:
    """Draws a world as it is, or a run at a moment.

    Parameters
    ----------
    what : a world, or a recorded run
    axes : to draw into; a figure of `size` inches when absent
    run : draw a world with its bodies where this run of it had them; its distance joints are drawn too, as
        strings, where it is there still
    t : of a run, the moment [s] whose nearest recorded frame is drawn; the last one when absent
    colors : one colour, or colours by body's name; Okabe and Ito's one after another when absent
    impulses : whether to draw the impulses of that moment's contacts as arrows, the longest a fifth of the
        view: what the upper of the two bodies got, or the one that can move
    view : plane: (left, right, bottom, top) [m]; space: (x, y, z, radius) of what is looked at [m]; all
        movable bodies when absent
    ghosts : plane only: earlier frames of the run to draw faintly, evenly spaced [1]
    azimuth, elevation : space only: from where it is seen [degrees]; z is up
    zoom : larger is nearer [1]
    dots : space only: pixels per inch of the shaded picture

    Raises
    ------
    BuildError
        When the run has other bodies than the world.
    """
    figure = Figure(figsize=size, layout="constrained") if axes is None else None
    target = axes if axes is not None else figure.add_subplot() if figure is not None else None
    assert target is not None
    world, shown = (None, what) if isinstance(what, Run) else (what, run)
    if world is not None and run is not None and run.names != tuple(world.names):
        remedy = "draw it with the world that made it"
        raise BuildError(f"draw: the run has other bodies than the world; {remedy}", field="run", value=run,
                         remedy=remedy)  # fmt: skip
    scene = _Bodies(world, shown, t, colors)
    if scene.dimension == 2:
        _plane(scene, target, view, zoom, ghosts)
    else:
        camera = _camera(scene, target, view, azimuth, elevation, zoom, dots)
        _space(scene, target, camera)
    if impulses:
        _arrows(scene, target, None if scene.dimension == 2 else camera[0])
    return target.figure if isinstance(target.figure, Figure) else target.figure.figure


class _Bodies:
    """Names, shapes, poses and colours of what is drawn: of a world, of a run, or of a run with its world."""

    def __init__(self, world: Any, run: Run | None, t: float | None, colors: Colors) -> None:
        self.world, self.run = world, run
        self.frame = -1
        if run is None:
            self.names = tuple(world.names)
            self.position, self.rotation = np.array(world.position), np.array(world.rotation)
            self.contacts, self.time = world.contacts, float(world.time)
            bodies = [world[name] for name in self.names]
            self.moves = np.array([body.kind == "dynamic" for body in bodies], dtype=bool)
            self.tables = [None if body.shape is None else body.shape.to_dict() for body in bodies]
            centers = [_centre(body) for body in bodies]
        else:
            self.names = run.names
            self.frame = len(run.time) - 1 if t is None else int(np.argmin(np.abs(run.time - t)))
            self.position, self.rotation = run.position[self.frame], run.rotation[self.frame]
            self.contacts, self.time = run.contacts[self.frame], float(run.time[self.frame])
            shapes = shapes_of_run(run)
            self.moves = np.array(run.header.kind == 0, dtype=bool)
            self.tables = [None if row < 0 else dict(shapes.tables[row]) for row in shapes.index]
            centers = [center * moves for center, moves in zip(shapes.center, self.moves, strict=True)]
        self.offset = centers
        self.dimension = self.position.shape[1]
        pairs = zip(self.tables, self.offset, self.moves, strict=True)
        self.spread = np.array([_spread(table, centre) if moves else 0.0 for table, centre, moves in pairs])
        rank = np.cumsum(self.moves) - 1
        self.colors = [
            _color(colors, name, bool(moves), int(number))
            for name, moves, number in zip(self.names, self.moves, rank, strict=True)
        ]

    def reach(self) -> tuple[Floats, float]:
        """Middle and radius of a ball about all movable bodies [m]."""
        places, sizes = self.position[self.moves], self.spread[self.moves]
        if not len(places):
            return np.zeros(self.dimension), 1.0
        low, high = (places - sizes[:, None]).min(axis=0), (places + sizes[:, None]).max(axis=0)
        middle = 0.5 * (low + high)
        return middle, max(float((np.linalg.norm(places - middle, axis=1) + sizes).max()), 1e-6)


def _centre(body: Any) -> Floats:
    """Centre of mass in the axes of the shape: poses of movable bodies are those of that point."""
    if body.kind != "dynamic" or body.shape is None:
        return np.zeros(2 if body.world._space.dimension == 2 else 3)
    return np.array(body.mass_properties.center_of_mass, dtype=np.float64)


def _spread(table: dict[str, Any] | None, centre: Floats) -> float:
    """Radius of the ball about the centre of mass that holds the shape [m]."""
    if table is None:
        return 0.0
    if len(centre) == 2:
        return max(float(np.linalg.norm(line - centre, axis=1).max()) for line, _ in outlines(table, 1.0))
    triangles, balls, _ = solids(table)
    far = [float(np.linalg.norm(at - centre)) + radius for at, radius, _ in balls]
    return max([*far, float(np.linalg.norm(triangles.reshape(-1, 3) - centre, axis=1).max(initial=0.0))])


def _color(colors: Colors, name: str, moves: bool, rank: int) -> str:
    if isinstance(colors, str) and moves:
        return colors
    if isinstance(colors, Mapping) and name in colors:
        return colors[name]
    if callable(colors) and moves:
        return colors(name)
    return BODIES[rank % len(BODIES)] if moves else OBSTACLE


def _plane(scene: _Bodies, axes: Axes, view: Any, zoom: float, ghosts: int) -> None:
    middle, radius = scene.reach()
    if ghosts and scene.run is not None:
        for frame in np.linspace(0, scene.frame, ghosts + 1)[:-1].astype(int):
            _layer(scene, axes, scene.run.position[frame], scene.run.rotation[frame], radius, faint=True)
    _layer(scene, axes, scene.position, scene.rotation, radius, faint=False)
    _strings(scene, axes)
    if view is None:
        half = 1.25 * radius / zoom
        view = (middle[0] - half, middle[0] + half, middle[1] - half, middle[1] + half)
    axes.set_xlim(view[0], view[1])
    axes.set_ylim(view[2], view[3])
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _strings(scene: _Bodies, axes: Axes) -> None:
    """Distance joints as lines, where the world is at the moment that is drawn."""
    if scene.world is None or not np.array_equal(scene.position, np.array(scene.world.position)):
        return
    for joint in getattr(scene.world, "joints", {}).values():
        if joint.kind == "distance":
            ends = np.array(joint.places)
            axes.plot(ends[:, 0], ends[:, 1], color="#7A828C", linewidth=0.9, zorder=2.5)


def _layer(
    scene: _Bodies, axes: Axes, position: Floats, rotation: Floats, radius: float, faint: bool
) -> None:
    for number, table in enumerate(scene.tables):
        if table is None or (faint and not scene.moves[number]):
            continue
        turn = matrix_of(rotation[number])
        moves = bool(scene.moves[number])
        order = (1.5 if faint else 3.0) if moves else 1.0
        for line, how in outlines(table, max(radius, float(np.abs(position[number]).max()))):
            placed = (line - scene.offset[number]) @ turn.T + position[number]
            _outline(axes, placed, how, scene.colors[number], order, moves, faint, radius)
        if table["type"] in ("circle", "capsule") and moves and not faint:
            away = turn @ np.array([table["radius"] * 0.92, 0.0])
            spoke = np.array([position[number], position[number] + away])
            axes.plot(spoke[:, 0], spoke[:, 1], color=INK, linewidth=0.8, zorder=3.1)


def _outline(
    axes: Axes, line: Floats, how: str, color: str, order: float, moves: bool, faint: bool, radius: float
) -> None:
    if how == "line":
        axes.plot(
            line[:, 0], line[:, 1], color="#7A828C", linewidth=2.2, zorder=order, solid_capstyle="round"
        )
    elif how == "hole":
        half = 60.0 * radius
        middle = line.mean(axis=0)
        frame = middle + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        inside = np.vstack([line[::-1], line[-1:]])
        codes = (
            [Outline.MOVETO] + [Outline.LINETO] * 4 + [Outline.MOVETO] + [Outline.LINETO] * (len(inside) - 1)
        )
        axes.add_patch(
            PathPatch(Outline(np.vstack([frame, inside]), codes), facecolor=color, edgecolor="#7A828C",
                      linewidth=1.0, zorder=order)
        )  # fmt: skip
    elif faint:
        axes.add_patch(
            Polygon(line, facecolor=color, edgecolor=color, alpha=0.22, linewidth=0.6, zorder=order)
        )
    else:
        edge = INK if moves else "#7A828C"
        axes.add_patch(Polygon(line, facecolor=color, edgecolor=edge, linewidth=0.9, zorder=order))


def _camera(
    scene: _Bodies, axes: Axes, view: Any, azimuth: float, elevation: float, zoom: float, dots: int
) -> tuple[Camera, tuple[Floats, float]]:
    """A camera that sees all movable bodies, and the ball that it looks at."""
    middle, radius = scene.reach()
    if view is not None:
        middle, radius = np.array(view[:3], dtype=np.float64), float(view[3])
    figure = axes.figure
    box = axes.get_position()
    inches = figure.get_size_inches() if isinstance(figure, Figure) else np.array([7.5, 4.6])
    wide, tall = int(dots * inches[0] * box.width / 0.78), int(dots * inches[1] * box.height / 0.78)
    angle = np.radians(26.0)
    distance = 1.06 * radius / np.sin(0.5 * angle) / zoom * max(1.0, tall / wide)
    camera = looking(
        middle, azimuth, elevation, float(distance), float(angle), (max(wide, 64), max(tall, 64))
    )
    return camera, (middle, 1.15 * radius)


def _space(scene: _Bodies, axes: Axes, camera: tuple[Camera, tuple[Floats, float]]) -> None:
    drawn = Scene()
    for number, table in enumerate(scene.tables):
        if table is None:
            continue
        color = np.array(to_rgb(scene.colors[number]))
        turn, place = matrix_of(scene.rotation[number]), scene.position[number]
        if table["type"] == "half_space":
            normal = np.array(table["normal"], dtype=np.float64)
            drawn.planes.append((place, turn @ (normal / np.linalg.norm(normal)), color, number))
            continue
        triangles, balls, both = solids(table)
        if len(triangles):
            moved = (triangles - scene.offset[number]) @ turn.T + place
            drawn.triangles.append((moved, color, number, both))
        for center, radius, own in balls:
            at = turn @ (center - scene.offset[number]) + place
            drawn.balls.append((at, radius, color, number, turn @ own))
    axes.imshow(render(drawn, camera[0], camera[1]), interpolation="lanczos")
    axes.set_axis_off()


def _arrows(scene: _Bodies, axes: Axes, camera: Camera | None) -> None:
    """Impulses on the upper body of each contact, or the one that moves, from its point, all on one scale."""
    contacts = scene.contacts
    if not len(contacts):
        return
    impulse = contacts["normal_impulse"][:, None] * contacts["normal"] + contacts["friction_impulse"]
    a, b = contacts["a"], contacts["b"]
    lower = scene.position[a][:, -1] < scene.position[b][:, -1]
    flipped = np.where(scene.moves[a] & scene.moves[b], lower, ~scene.moves[a])
    impulse = np.where(flipped[:, None], -impulse, impulse)
    largest = float(np.linalg.norm(impulse, axis=1).max())
    if largest <= 0:
        return
    point = contacts["point"]
    if camera is None:
        span = 0.2 * abs(axes.get_ylim()[1] - axes.get_ylim()[0])
        head = point + impulse * span / largest
        tails, heads = point, head
    else:
        span = 0.2 * camera.pixels[1] / camera.scale * float(np.median(camera.project(point)[:, 2]))
        tails = camera.project(point)[:, :2]
        heads = camera.project(point + impulse * span / largest)[:, :2]
    for tail, end in zip(tails, heads, strict=True):
        if np.linalg.norm(end - tail) > 1e-9:
            style = {"arrowstyle": "-|>", "color": ARROW, "linewidth": 1.3, "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", end, tail, arrowprops=style, zorder=6)
