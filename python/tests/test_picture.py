"""Pictures of worlds: every shape is drawn where it is, in vector in the plane and shaded in space."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Polygon
from matplotlib.text import Annotation

from carom import picture, planar, spatial
from carom._outline import outlines, solids
from carom._render import looking
from carom.errors import BuildError
from carom.plotting import save_figure
from carom.run import Run

PLANAR: list[Any] = [
    planar.Circle(0.5), planar.Capsule(1.0, 0.2), planar.Box(1, 0.5), planar.RoundBox(1, 0.5, radius=0.1),
    planar.ConvexPolygon([(0, 0), (1, 0), (0, 1)]), planar.RoundPolygon([(0, 0), (1, 0), (0, 1)], radius=0.1),
]  # fmt: skip
SPATIAL: list[Any] = [
    spatial.Sphere(0.5), spatial.Capsule(1.0, 0.2), spatial.Box(1, 0.5, 0.2), spatial.Cylinder(1.0, 0.3),
    spatial.RoundBox(1, 0.5, 0.2, radius=0.1), spatial.Cone(1.0, 0.3), spatial.RoundCylinder(1.0, 0.3, 0.1),
    spatial.RoundCone(1.0, 0.3, 0.1), spatial.ConvexHull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]),
    spatial.RoundConvexHull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], radius=0.1),
]  # fmt: skip


def _pixels(figure: Figure) -> Any:
    array = figure.axes[0].get_images()[0].get_array()
    assert array is not None
    return np.asarray(array)


@pytest.mark.parametrize("shape", PLANAR, ids=lambda s: type(s).__name__)
def test_outlines_enclose_the_area_of_the_shape(shape: Any) -> None:
    ((line, how),) = outlines(shape.to_dict(), 1.0)
    x, y = line.T
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    assert how == "area"
    assert area == pytest.approx(planar.mass_properties(shape, density=1.0).mass, rel=2e-3)


@pytest.mark.parametrize("shape", SPATIAL, ids=lambda s: type(s).__name__)
def test_solids_enclose_the_volume_of_the_shape(shape: Any) -> None:
    triangles, balls, seen_from_behind = solids(shape.to_dict())
    volume = np.linalg.det(triangles).sum() / 6 + sum(4 / 3 * np.pi * radius**3 for _, radius, _ in balls)
    assert not seen_from_behind
    assert volume == pytest.approx(spatial.mass_properties(shape, density=1.0).mass, rel=2.5e-2)


def test_parts_of_compounds_are_placed() -> None:
    dumbbell = planar.Compound([(planar.Circle(0.2), (-1, 0)), (planar.Box(0.2, 0.2), (1, 0), np.pi / 4)])
    disc, square = (line for line, _ in outlines(dumbbell.to_dict(), 1.0))
    assert disc.mean(axis=0) == pytest.approx([-1, 0], abs=1e-12)
    assert square[:, 0].max() == pytest.approx(1 + 0.1 * np.sqrt(2))


def test_a_body_is_drawn_where_it_is_and_where_a_run_had_it(tmp_path: Path) -> None:
    w = planar.World()
    w.add_static("floor", planar.HalfPlane())
    w.add_body("box", planar.Box(1, 1), mass=1.0, position=(3, 5), rotation=0.5)
    run = w.run(0.5)

    def middle(figure: Figure) -> Any:
        moving = [p for p in figure.axes[0].patches if isinstance(p, Polygon) and p.get_zorder() == 3.0]
        return moving[0].get_xy()[:-1].mean(axis=0)

    assert middle(picture.draw(w)) == pytest.approx(w["box"].position)
    assert middle(picture.draw(w, run=run, t=0.2)) == pytest.approx(
        run.position[np.argmin(abs(run.time - 0.2)), 1]
    )
    run.save(tmp_path / "fall.h5")
    alone = picture.draw(Run.load(tmp_path / "fall.h5"), t=0.2)
    assert middle(alone) == pytest.approx(middle(picture.draw(w, run=run, t=0.2)), abs=1e-15)
    ghosts = picture.draw(w, run=run, ghosts=4).axes[0].patches
    assert len(ghosts) == 2 + 4


def test_centres_of_mass_away_from_the_shape_s_origin_are_told_apart() -> None:
    w = planar.World(gravity=(0, 0))
    w.add_body("wedge", planar.ConvexPolygon([(0, 0), (3, 0), (0, 3)]), density=1.0, origin=(0, 0))
    drawn = picture.draw(w).axes[0].patches[0]
    assert isinstance(drawn, Polygon)
    assert drawn.get_xy().min(axis=0) == pytest.approx([0, 0], abs=1e-12)


def test_walls_lines_bowls_and_valleys_are_drawn() -> None:
    w = planar.World()
    w.add_static("bowl", planar.Cavity(2.0))
    w.add_static("line", planar.Polyline([(0, 0), (1, 1), (2, 0)], closed=True))
    w.add_static("wall", planar.Segment((0, 0), (0, 1)))
    w.add_static("valley", planar.HeightField([1.0, 0.0, 1.0], 4.0), position=(0, -3))
    axes = picture.draw(w, view=(-3, 3, -3, 3)).axes[0]
    assert sum(isinstance(patch, PathPatch) for patch in axes.patches) == 1
    assert len(axes.get_lines()) == 2
    assert axes.get_xlim() == (-3, 3)


def test_impulses_push_the_upper_body_up() -> None:
    w = planar.World()
    w.add_static("floor", planar.HalfPlane())
    for k in range(2):
        w.add_body(f"box{k}", planar.Box(1, 1), mass=1.0, position=(0, 0.5 + k))
    w.run(0.2)
    texts = picture.draw(w, impulses=True).axes[0].texts
    arrows = [text for text in texts if isinstance(text, Annotation)]
    assert len(arrows) == 4
    assert all(arrow.xy[1] > arrow.xyann[1] for arrow in arrows)


@pytest.mark.parametrize("shape", SPATIAL, ids=lambda s: type(s).__name__)
def test_every_shape_of_space_shows(shape: Any) -> None:
    w = spatial.World()
    w.add_body("thing", shape, density=1.0, position=(5, 5, 5))
    pixels = _pixels(picture.draw(w, colors="#FF0000", dots=30))
    red = (pixels[..., 0] > 0.25) & (pixels[..., 1] < 0.5 * pixels[..., 0])
    assert 0.02 < red.mean() < 0.6
    assert not red[0].any()
    assert not red[-1].any()


def test_a_ball_hides_what_is_behind_it_and_throws_a_shadow() -> None:
    w = spatial.World()
    w.add_static("floor", spatial.HalfSpace())
    w.add_body("front", spatial.Sphere(0.5), mass=1.0, position=(0, -2, 0.5))
    w.add_body("behind", spatial.Sphere(0.3), mass=1.0, position=(0, 2, 0.5))
    colors = {"front": "#FF0000", "behind": "#0000FF", "floor": "#FFFFFF"}
    pixels = _pixels(picture.draw(w, colors=colors, azimuth=-90, elevation=0, dots=40))
    assert not ((pixels[..., 2] > 0.2) & (pixels[..., 0] < 0.1)).any()
    above = _pixels(picture.draw(w, colors=colors, azimuth=-90, elevation=70, dots=40))
    blue = (above[..., 2] > 0.2) & (above[..., 0] < 0.1)
    grey = (np.ptp(above, axis=-1) < 0.05) & (above.mean(axis=-1) < 0.62)
    assert blue.any()
    assert grey.mean() > 0.005


def test_projection_and_rays_are_inverse() -> None:
    camera = looking(np.array([1.0, 2.0, 3.0]), -40.0, 25.0, 8.0, 0.5, (80, 50))
    start, way = camera.rays(slice(0, 50), slice(0, 80))
    seen = camera.project((start + 4.0 * way).reshape(-1, 3))
    columns, rows = np.meshgrid(np.arange(80) + 0.5, np.arange(50) + 0.5)
    assert seen[:, 0] == pytest.approx(columns.ravel(), abs=1e-9)
    assert seen[:, 1] == pytest.approx(rows.ravel(), abs=1e-9)
    assert seen[:, 2] == pytest.approx(np.full(4000, 4.0))


def test_other_bodies_are_refused_and_files_are_vector(tmp_path: Path) -> None:
    w, other = planar.World(), planar.World()
    w.add_body("one", planar.Circle(1.0), mass=1.0)
    other.add_body("another", planar.Circle(1.0), mass=1.0)
    with pytest.raises(BuildError, match="other bodies than the world"):
        picture.draw(w, run=other.run(0.01))
    save_figure(picture.draw(w), tmp_path / "one.pdf")
    assert (tmp_path / "one.pdf").read_bytes().startswith(b"%PDF")
