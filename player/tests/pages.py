"""Pages for the tests in a browser: small runs of the plane and of space, two runs side by side, hostile
names, many bodies.

With --large: a run of 1,000 bodies and 600 frames, and the one of 10,000, for the benchmark.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
from nbclient import NotebookClient
from nbconvert import HTMLExporter

from carom import planar, spatial
from carom.cli import main as carom
from carom.run import Run
from carom.scene import load_scene

#: Names that would break a page that read them as HTML or ended a script at them.
HOSTILE = (
    "</script><script>window.broken = 1</script>",
    "<img src=x onerror='window.broken = 2'>",
    "Körper ☃ \u2028",
)


def stack() -> Any:
    """Three boxes on each other, with a disc beside them."""
    world = planar.World(dt=1 / 240)
    world.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.5)
    for i in range(3):
        world.add_body(f"box{i}", planar.Box(1, 1), density=2.0, position=(0, 0.5 + i), friction=0.5)
    world.add_body(
        "disc",
        planar.Circle(0.4),
        density=1.0,
        position=(3, 1.4),
        velocity=(-2, 0),
        friction=0.5,
        restitution=0.5,
    )
    return world


def gallery_planar() -> Any:
    """Every shape of the plane."""
    world = planar.World(gravity=(0, 0), dt=1 / 100)
    shapes = [
        planar.Circle(0.4),
        planar.Box(0.8, 0.5),
        planar.Capsule(0.5, 0.2),
        planar.RoundBox(0.5, 0.4, radius=0.15),
        planar.ConvexPolygon([[-0.4, -0.3], [0.4, -0.3], [0.0, 0.5]]),
        planar.RoundPolygon([[-0.3, -0.2], [0.3, -0.2], [0.0, 0.3]], 0.12),
        planar.Compound([(planar.Box(0.8, 0.2), (0, 0)), (planar.Circle(0.2), (0.3, 0.25))]),
    ]
    for i, shape in enumerate(shapes):
        world.add_body(f"body{i}", shape, density=1.0, position=(1.2 * i, 0), angular_velocity=0.5)
    world.add_static("segment", planar.Segment((-0.5, 0), (0.5, 0.2)), position=(0, -1.2))
    world.add_static("polyline", planar.Polyline([[-0.5, 0], [0, 0.3], [0.5, 0]]), position=(1.5, -1.2))
    world.add_static("terrain", planar.HeightField([0.0, 0.3, 0.1, 0.2], 2.0), position=(3.5, -1.3))
    world.add_static("bowl", planar.Cavity(0.5), position=(6, -1.4))
    world.add_static("ground", planar.HalfPlane(normal=(0, 1)), position=(0, -2.2))
    return world


def gallery_spatial() -> Any:
    """Every shape of space."""
    world = spatial.World(gravity=(0, 0, 0), dt=1 / 100)
    rng = np.random.default_rng(1)
    cloud = rng.normal(size=(20, 3)) * 0.25
    tetrahedron = [[0.4, 0, -0.3], [-0.3, 0.4, -0.3], [-0.3, -0.4, -0.3], [0, 0, 0.5]]
    shapes = [
        spatial.Sphere(0.4),
        spatial.Box(0.8, 0.5, 0.4),
        spatial.Capsule(0.5, 0.2),
        spatial.Cylinder(0.6, 0.3),
        spatial.Cone(0.7, 0.35),
        spatial.ConvexHull(cloud),
        spatial.RoundBox(0.5, 0.4, 0.3, radius=0.1),
        spatial.RoundCylinder(0.4, 0.25, 0.1),
        spatial.RoundCone(0.5, 0.25, 0.1),
        spatial.RoundConvexHull(tetrahedron, 0.08),
        spatial.TriMesh(tetrahedron, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
        spatial.Compound([(spatial.Box(0.8, 0.2, 0.2), (0, 0, 0)), (spatial.Sphere(0.2), (0.3, 0, 0.25))]),
    ]
    for i, shape in enumerate(shapes):
        where = (1.2 * (i % 4), 1.2 * (i // 4), 0.0)
        world.add_body(f"body{i}", shape, density=1.0, position=where, angular_velocity=(0.3, 0.5, 0.2))
    heights = 0.15 * np.sin(np.arange(5))[:, None] * np.cos(np.arange(6))[None, :]
    world.add_static("terrain", spatial.HeightField(heights, (2.0, 1.6)), position=(-2, 0.6, -0.6))
    world.add_static("bowl", spatial.Cavity(0.6), position=(-2, 2.6, 0))
    world.add_static("ground", spatial.HalfSpace(normal=(0, 0, 1)), position=(0, 0, -0.8))
    return world


def drop() -> Any:
    """Balls and boxes of space that fall on the ground."""
    world = spatial.World(dt=1 / 240)
    world.add_static("floor", spatial.HalfSpace(), friction=0.5)
    for i in range(12):
        shape = spatial.Box(0.4, 0.3, 0.2) if i % 2 else spatial.Sphere(0.2)
        where = (0.45 * (i % 3), 0.45 * (i // 3 % 2), 0.35 + 0.4 * (i // 6))
        world.add_body(f"body{i}", shape, density=500.0, position=where, friction=0.4)
    return world


def hostile() -> Any:
    """Bodies with hostile names."""
    world = planar.World(dt=1 / 100)
    world.add_static("floor", planar.HalfPlane(normal=(0, 1)))
    for i, name in enumerate(HOSTILE):
        world.add_body(name, planar.Circle(0.4), density=1.0, position=(i, 0.4))
    return world


def sleepers() -> Any:
    """Boxes at rest, which fall asleep, and a ball that comes later and wakes some of them."""
    world = planar.World(scheme="soft_step", soft={"sleeping": True}, dt=1 / 60)
    world.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.5)
    for i in range(4):
        where = (1.5 * (i // 2), 0.5 + i % 2)
        world.add_body(f"box{i}", planar.Box(1, 1), density=2.0, position=where, friction=0.5)
    world.add_body("ball", planar.Circle(0.4), density=2.0, position=(-8, 0.6), velocity=(5, 0), friction=0)
    return world


def alone() -> Any:
    """One body that nothing touches, turning as it falls."""
    world = planar.World(dt=1 / 100)
    world.add_body("stone", planar.Box(1, 0.5), density=1.0, position=(0, 0), angular_velocity=2.0)
    return world


def bounces() -> Any:
    """A ball that bounces beside a box at rest, on a floor whose own place is far away."""
    world = planar.World(dt=1 / 500)
    world.add_static("floor", planar.HalfPlane(normal=(0, 1)), position=(-700, 0), friction=0.5)
    world.add_body("ball", planar.Circle(0.3), density=3.0, position=(0, 3), restitution=1.0)
    world.add_body("box", planar.Box(1, 1), density=1.0, position=(1.5, 0.5), friction=0.5, restitution=0.0)
    return world


def blows() -> Any:
    """Two boxes that bounce: steps with a residual between steps without a contact."""
    world = planar.World(dt=1 / 200)
    world.add_static("floor", planar.HalfPlane(), friction=0.5)
    for i in range(2):
        world.add_body(f"box{i}", planar.Box(1, 1), density=2.0, position=(0.1 * i, 1 + 1.2 * i), rotation=0.3,
                       angular_velocity=1.0, friction=0.5, restitution=0.8)  # fmt: skip
    return world


def far_in_space() -> Any:
    """A ball that rolls on a slope whose own place is far away."""
    world = spatial.World(dt=1 / 100)
    world.add_static("slope", spatial.HalfSpace(normal=(0.1, 0, 1)), position=(-50, 80, 5), friction=0.5)
    world.add_body("ball", spatial.Sphere(0.3), density=3.0, position=(0, 0, 0.31), friction=0.5)
    return world


def jointed() -> Any:
    """Two boxes on the floor with a joint between them, and one that stands for itself."""
    world = planar.World(dt=1 / 100)
    world.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.5)
    for i in range(3):
        world.add_body(f"box{i}", planar.Box(1, 1), density=2.0, position=(2 * i, 0.5), friction=0.5)
    world.add_distance_joint("rod", "box0", "box1")
    return world


def belted() -> Any:
    """Small boxes on a long belt."""
    world = planar.World(dt=1 / 100)
    world.add_kinematic("belt", planar.Box(40, 1), position=(0, -0.5), velocity=(0.5, 0), friction=0.5)
    for i in range(2):
        world.add_body(f"box{i}", planar.Box(0.5, 0.5), density=2.0, position=(i, 0.25), friction=0.5)
    return world


def rain() -> Any:
    """10,000 balls and boxes over the ground."""
    world = spatial.World(dt=1 / 60)
    world.scheme = "soft_step"
    world.add_static("floor", spatial.HalfSpace(), friction=0.5)
    for i in range(10_000):
        shape = spatial.Box(0.4, 0.3, 0.2) if i % 2 else spatial.Sphere(0.2)
        where = (0.5 * (i % 25), 0.5 * (i // 25 % 20), 0.3 + 0.5 * (i // 500))
        world.add_body(f"body{i}", shape, density=500.0, position=where, friction=0.4)
    return world


def told(path: Path) -> Run:
    """A run that holds its scene, so that its steps can be explained."""
    if carom(["run", "card_house", "--time", "0.5", "--out", str(path), "--quiet"]):
        raise SystemExit("the card house does not run")
    return Run.load(path)


def small(folder: Path) -> None:
    """The pages of the tests."""
    run = stack().run(1.5, every=4)
    run.to_html(folder / "plane.html")
    run.to_html(folder / "two.html", other=stack().run(1.5, every=4, solver="sequential", iterations=3))
    drop().run(1.2, every=4).to_html(folder / "space.html")
    gallery_planar().run(1.0, every=4).to_html(folder / "gallery-plane.html")
    gallery_spatial().run(1.0, every=4).to_html(folder / "gallery-space.html")
    sleepers().run(2.0).to_html(folder / "sleepers.html")
    alone().run(0.5).to_html(folder / "alone.html")
    bounces().run(3.0, every=5).to_html(folder / "bounces.html")
    blows().run(2.0).to_html(folder / "blows.html")
    far_in_space().run(0.5).to_html(folder / "far.html")
    jointed().run(0.3).to_html(folder / "jointed.html")
    belted().run(0.5).to_html(folder / "belt.html")
    stack().run(0.5).to_html(folder / "same.html", other=stack().run(0.5))
    stack().run(0.5).to_html(folder / "tolerances.html", other=stack().run(0.5, tolerance=1e-3))
    hostile().run(0.3).to_html(folder / "hostile.html")
    told(folder / "told.h5").to_html(folder / "told.html", explain_seconds=60.0)
    notebook(folder / "notebook.html")


#: A cell whose value is a run.
CELL = """from carom import planar
world = planar.World(dt=1 / 240)
world.add_static("floor", planar.HalfPlane(), friction=0.5)
world.add_body("box0", planar.Box(1, 1), density=2.0, position=(0, 0.5), friction=0.5)
world.run(0.2)"""


def notebook(path: Path) -> None:
    """A notebook that was run, as nbconvert writes it."""
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    NotebookClient(book, timeout=120).execute()
    exporter = HTMLExporter()
    # its own scripts come from a host that is not asked
    exporter.require_js_url = exporter.mathjax_url = exporter.mermaid_js_url = ""
    path.write_text(exporter.from_notebook_node(book)[0], encoding="utf-8")


def many(folder: Path) -> None:
    """10,000 bodies, 21 frames, for the tests and the benchmark."""
    rain().run(20 / 60).to_html(folder / "many.html", explain_seconds=0.0)


def large(folder: Path) -> None:
    """1,000 bodies, 600 frames, all of them in contact at the end; and a page to warm the browser up."""
    drop().run(0.2, every=4).to_html(folder / "warm.html")
    world = load_scene("pile").build()
    world.scheme = "soft_step"
    run = world.run(10.0, dt=1 / 60)
    path = run.to_html(folder / "large.html", explain_seconds=0.0)
    print(f"{len(run.names)} bodies, {len(run.time)} frames: {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    many(target)
    if "--large" in sys.argv:
        large(target)
    else:
        small(target)
