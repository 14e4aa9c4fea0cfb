"""Makes the meshes of the packaged scene meshes_on_terrain: five parts, a mug and a terrain.

Everything is generated from formulas with a fixed seed: an involute spur gear, a hexagon nut with a bore, a
pawn as a surface of revolution, a U bracket, a mug with a handle, a rock of planar facets, and smooth hills
that form a basin. Part meshes are closed and oriented outward. Units: m, except the nut, whose file is in
mm to be read with scale = 0.001. Run it as ``python make_meshes.py [FOLDER]``; the same numpy gives the
same files.

Involute of a circle of radius r_b (Litvin, Gear Geometry): at radius r the flank stands at the polar angle
inv(a) = tan a - a, cos a = r_b / r, from where it left the base circle.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int64]


def ring_faces(lower: Faces, upper: Faces) -> Faces:
    """Triangles of a band between two closed rings, outward when both run counter-clockwise."""
    after_lower, after_upper = np.roll(lower, -1), np.roll(upper, -1)
    first = np.stack([lower, after_lower, after_upper], axis=1)
    second = np.stack([lower, after_upper, upper], axis=1)
    return np.concatenate([first, second])


def extruded_ring(outer: Floats, inner: Floats, height: float) -> tuple[Floats, Faces]:
    """Solid between two counter-clockwise outlines of equal length, extruded along z about 0."""
    count = len(outer)
    levels = [(outer, -height / 2), (outer, height / 2), (inner, height / 2), (inner, -height / 2)]
    vertices = np.vstack([np.column_stack([outline, np.full(count, z)]) for outline, z in levels])
    rings = [np.arange(count) + level * count for level in range(4)]
    return vertices, np.vstack([ring_faces(rings[i], rings[(i + 1) % 4]) for i in range(4)])


def spur_gear(
    teeth: int = 14, module: float = 0.01, bore: float = 0.022, width: float = 0.03
) -> tuple[Floats, Faces]:
    """Gear with involute flanks (pressure angle 20 degrees), addendum 1, dedendum 1.25, and a bore."""
    pressure = np.radians(20.0)
    pitch = module * teeth / 2
    base, tip, root = pitch * np.cos(pressure), pitch + module, pitch - 1.25 * module
    half = np.pi / (2 * teeth) + np.tan(pressure) - pressure  # half tooth on the base circle
    radii = np.linspace(max(base, root), tip, 5)
    slope = np.arccos(np.clip(base / radii, -1.0, 1.0))
    flank = half - (np.tan(slope) - slope)
    valley = 2 * np.pi / teeth - 2 * half
    rising = [(root, -half - 0.15 * valley), *zip(radii, -flank, strict=True)]
    falling = [(radius, -angle) for radius, angle in reversed(rising)]
    profile = [*rising, *falling, (root, half + valley / 2)]
    polar = np.array(
        [(radius, angle + 2 * np.pi * tooth / teeth) for tooth in range(teeth) for radius, angle in profile]
    )
    direction = np.column_stack([np.cos(polar[:, 1]), np.sin(polar[:, 1])])
    return extruded_ring(polar[:, :1] * direction, bore * direction, width)


def hexagon_nut(across: float = 90.0, bore: float = 27.0, height: float = 44.0) -> tuple[Floats, Faces]:
    """Nut with a plain bore [mm]: `across` its flats, `bore` the hole's radius."""
    angles = np.arange(48) * 2 * np.pi / 48
    to_flat = np.mod(angles, np.pi / 3) - np.pi / 6
    direction = np.column_stack([np.cos(angles), np.sin(angles)])
    outline = (across / 2 / np.cos(to_flat))[:, None] * direction
    return extruded_ring(outline, bore * direction, height)


def revolved(profile: Floats, sides: int) -> tuple[Floats, Faces]:
    """Surface of revolution about z; the profile (radius, z) runs from the lower pole to the upper."""
    angles = np.arange(sides) * 2 * np.pi / sides
    rings = [
        np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(sides, z)]) for r, z in profile[1:-1]
    ]
    poles = np.array([[0.0, 0.0, profile[0, 1]], [0.0, 0.0, profile[-1, 1]]])
    vertices = np.vstack([*rings, poles])
    numbers = [np.arange(sides) + sides * level for level in range(len(rings))]
    faces = [ring_faces(low, high) for low, high in itertools.pairwise(numbers)]
    bottom, top = len(vertices) - 2, len(vertices) - 1
    faces.append(np.stack([np.full(sides, bottom), np.roll(numbers[0], -1), numbers[0]], axis=1))
    faces.append(np.stack([np.full(sides, top), numbers[-1], np.roll(numbers[-1], -1)], axis=1))
    return vertices, np.vstack(faces)


def pawn(height: float = 0.16, sides: int = 24) -> tuple[Floats, Faces]:
    """Chess pawn: foot, waist, collar and ball head, as fractions of its height."""
    body = [(0.0, 0.0), (0.30, 0.0), (0.32, 0.05), (0.27, 0.13), (0.19, 0.20), (0.13, 0.35), (0.105, 0.55),
            (0.19, 0.60), (0.20, 0.63), (0.11, 0.67)]  # fmt: skip
    middle, radius = 0.83, 0.17
    turns = np.radians(np.linspace(-60.0, 90.0, 9))
    head = [(radius * np.cos(turn), middle + radius * np.sin(turn)) for turn in turns[:-1]]
    return revolved(height * np.array([*body, *head, (0.0, middle + radius)]), sides)


def u_bracket(
    width: float = 0.12, height: float = 0.10, depth: float = 0.05, wall: float = 0.02
) -> tuple[Floats, Faces]:
    """U of square section: a floor and two walls, open towards +z; one closed surface of 8 + 8 corners."""
    w, t = width / 2, width / 2 - wall
    outline = np.array(
        [(-w, 0), (w, 0), (w, height), (t, height), (t, wall), (-t, wall), (-t, height), (-w, height)]
    )
    front = np.column_stack([outline[:, 0], np.full(8, -depth / 2), outline[:, 1] - height / 2])
    back = front + np.array([0.0, depth, 0.0])
    caps = np.array([(0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4), (0, 5, 6), (0, 6, 7)])
    sides = ring_faces(np.arange(8) + 8, np.arange(8))
    return np.vstack([front, back]), np.vstack([caps, caps[:, ::-1] + 8, sides])


def mug(
    radius: float = 0.05, height: float = 0.11, wall: float = 0.008, sides: int = 24
) -> tuple[Floats, Faces]:
    """Mug with a handle: a revolved cup, two patches of whose outer wall are joined by a bent tube."""
    levels = np.linspace(0.0, height, 9)
    outer = [(radius, z) for z in levels]
    inner = [(radius - wall, z) for z in (height, height * 0.5, wall)]
    vertices, faces = revolved(np.array([(0.0, 0.0), *outer, *inner, (0.0, wall)]), sides)
    column = 0

    def patch(level: int) -> Faces:
        """Corners of a patch of the outer wall, counter-clockwise seen from outside."""
        low, high = level * sides, (level + 1) * sides
        return np.array([low + column, low + column + 1, high + column + 1, high + column])

    upper, lower = patch(6), patch(1)
    gone = {
        tuple(sorted(face)) for corners in (upper, lower) for face in (corners[[0, 1, 2]], corners[[0, 2, 3]])
    }
    faces = np.array([face for face in faces if tuple(sorted(face)) not in gone])
    middle = (vertices[upper].mean(axis=0) + vertices[lower].mean(axis=0)) / 2
    outward = np.array([middle[0], middle[1], 0.0]) / np.hypot(middle[0], middle[1])
    reach = (levels[6] + levels[7] - levels[1] - levels[2]) / 4
    rings = [upper]
    for turn in np.linspace(0.0, np.pi, 9)[1:-1]:
        center = middle + outward * (0.9 * reach * np.sin(turn)) + np.array([0.0, 0.0, reach * np.cos(turn)])
        along = np.array([0.0, 0.0, np.cos(turn)]) + outward * np.sin(
            turn
        )  # across the tube, away from its bend
        side = np.array([-outward[1], outward[0], 0.0])
        half_side, half = 0.0065, 0.0055
        corners = np.array([-half_side * side - half * along, half_side * side - half * along,
                            half_side * side + half * along, -half_side * side + half * along])  # fmt: skip
        rings.append(np.arange(4) + len(vertices))
        vertices = np.vstack([vertices, center + corners])
    rings.append(lower[[3, 2, 1, 0]])
    tube = np.vstack([ring_faces(first, second) for first, second in itertools.pairwise(rings)])
    return vertices - np.array([0.0, 0.0, height / 2]), np.vstack([faces, tube])


def rock(radius: float = 0.07, corners: int = 26, seed: int = 7) -> tuple[Floats, Faces]:
    """Convex rock: hull of points near an ellipsoid, drawn evenly with a fixed seed."""
    from scipy.spatial import ConvexHull

    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(corners, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = directions * generator.uniform(0.85, 1.1, (corners, 1)) * radius * np.array([1.0, 0.8, 0.65])
    hull = ConvexHull(points)
    faces = hull.simplices.astype(np.int64)
    normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
    is_inward = np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0
    faces[is_inward] = faces[is_inward][:, ::-1]
    used = np.unique(faces)
    return points[used], np.searchsorted(used, faces)


def terrain(cells: int = 40, width: float = 3.0) -> tuple[Floats, Faces]:
    """Smooth hills that rise towards the border, so that what falls on them collects in the middle."""
    line = np.linspace(-width / 2, width / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    bowl = 0.22 * (x * x + y * y)
    hills = 0.05 * np.sin(4.1 * x + 0.7) * np.cos(3.7 * y - 0.4) + 0.02 * np.sin(7.3 * x - 5.9 * y)
    vertices = np.column_stack([x.ravel(), y.ravel(), (bowl + hills).ravel()])
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, above = corner + 1, corner + cells + 1
    lower = np.stack([corner, right, above + 1], axis=1)
    upper = np.stack([corner, above + 1, above], axis=1)
    return vertices, np.vstack([lower, upper])


def write(folder: Path) -> list[Path]:
    """Writes all meshes into a folder; returns their paths."""
    import trimesh

    parts: dict[str, tuple[Floats, Faces]] = {
        "gear.obj": spur_gear(),
        "nut.stl": hexagon_nut(),
        "pawn.ply": pawn(),
        "bracket.obj": u_bracket(),
        "mug.glb": mug(),
        "rock.stl": rock(),
        "terrain.ply": terrain(),
    }
    folder.mkdir(parents=True, exist_ok=True)
    for name, (vertices, faces) in parts.items():
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        options: dict[str, Any] = {"obj": {"header": None, "digits": 6}, "ply": {"encoding": "binary"}}
        exported = mesh.export(file_type=name.rsplit(".", 1)[1], **options.get(name.rsplit(".", 1)[1], {}))
        (folder / name).write_bytes(exported.encode() if isinstance(exported, str) else bytes(exported))
    return [folder / name for name in parts]


if __name__ == "__main__":
    for path in write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "meshes"):
        print(path, path.stat().st_size)
