"""What shapes look like: outlines in the plane, triangles and balls in space, in the shape's own axes.

Hulls of swept shapes are hulls of samples on their round parts; what is drawn is within a thousandth of a
radius of the shape. Knows no worlds and no pictures.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

Floats = npt.NDArray[np.float64]

#: Half the side of what stands for something endless, in units of the picture's radius.
ENDLESS = 40.0


def outlines(table: dict[str, Any], reach: float) -> list[tuple[Floats, str]]:
    """Outlines of a planar shape as (k, 2) points, each "area", "line" or "hole" (the inside of a cavity)."""
    kind = table["type"]
    if kind == "compound":
        found = []
        for part in table["parts"]:
            turn, place = _placed(part["pose"], 2)
            found += [(line @ turn.T + place, how) for line, how in outlines(part["shape"], reach)]
        return found
    if kind == "segment":
        return [(np.array([table["a"], table["b"]], dtype=np.float64), "line")]
    if kind == "polyline":
        points = np.array(table["points"], dtype=np.float64)
        return [(np.vstack([points, points[:1]]) if table.get("closed") else points, "line")]
    if kind == "height_field":
        heights = np.array(table["heights"], dtype=np.float64)
        x = np.linspace(-0.5, 0.5, len(heights)) * table["width"]
        low = heights.min() - 0.3 * table["width"]
        return [(np.vstack([np.column_stack([x, heights]), [[x[-1], low], [x[0], low]]]), "area")]
    if kind == "half_plane":
        normal = np.array(table["normal"], dtype=np.float64)
        normal /= np.linalg.norm(normal)
        along = np.array([normal[1], -normal[0]]) * ENDLESS * reach
        back = -ENDLESS * reach * normal
        return [(np.array([along, -along, -along + back, along + back]), "area")]
    if kind == "cavity":
        return [(table["radius"] * _circle(180), "hole")]
    core, radius = _core(table, 2)
    if radius == 0 or kind == "circle":
        return [(radius * _circle(96) if kind == "circle" else _hull2(core), "area")]
    return [(_hull2((core[:, None, :] + radius * _circle(96)).reshape(-1, 2)), "area")]


def solids(table: dict[str, Any]) -> tuple[Floats, list[tuple[Floats, float, Floats]], bool]:
    """Triangles (t, 3, 3) of a spatial shape, balls as (centre, radius, axes), and whether backs are seen."""
    kind = table["type"]
    if kind == "compound":
        parts = []
        for part in table["parts"]:
            turn, place = _placed(part["pose"], 3)
            triangles, balls, both = solids(part["shape"])
            moved = [(turn @ center + place, radius, turn @ axes) for center, radius, axes in balls]
            parts.append((triangles @ turn.T + place, moved, both))
        return (
            np.vstack([part[0] for part in parts]),
            [ball for part in parts for ball in part[1]],
            any(part[2] for part in parts),
        )
    if kind == "sphere":
        return np.zeros((0, 3, 3)), [(np.zeros(3), float(table["radius"]), np.eye(3))], False
    if kind == "tri_mesh":
        vertices = np.array(table["vertices"], dtype=np.float64)
        return vertices[np.array(table["triangles"], dtype=np.int64)], [], True
    if kind == "height_field":
        return _terrain(table), [], True
    if kind == "cavity":
        return _wall(float(table["radius"])), [], True
    core, radius = _core(table, 3)
    if radius > 0:
        core = (core[:, None, :] + radius * _sphere()).reshape(-1, 3)
    hull = ConvexHull(core)
    triangles = core[hull.simplices]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles, [], False


def _core(table: dict[str, Any], dimension: int) -> tuple[Floats, float]:
    """Points whose hull, swept by a disc or ball of the radius, is the convex shape."""
    kind, radius = table["type"], float(table.get("radius", 0.0))
    if kind == "circle":
        return np.zeros((1, 2)), radius
    if kind == "capsule":
        half = np.zeros(dimension)
        half[0 if dimension == 2 else 2] = 0.5 * table["length"]
        return np.array([half, -half]), radius
    if kind in ("box", "round_box"):
        corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * dimension)).reshape(dimension, -1).T
        return corners * np.array(table["size"], dtype=np.float64), radius if kind == "round_box" else 0.0
    if kind in ("cylinder", "round_cylinder", "cone", "round_cone"):
        rim = np.column_stack([radius * _circle(64), np.full(64, -0.5 * table["height"])])
        top = [[0.0, 0.0, 0.5 * table["height"]]] if "cone" in kind else rim * [1, 1, -1]
        return np.vstack([rim, top]), float(table.get("rounding", 0.0))
    points = np.array(table["points"], dtype=np.float64)
    return points, radius if kind.startswith("round") else 0.0


def _circle(count: int) -> Floats:
    angle = np.arange(count) * 2 * np.pi / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _sphere() -> Floats:
    """Points on the unit ball, by latitude."""
    rings = [np.array([[0, 0, 1.0], [0, 0, -1.0]])]
    for lift in np.linspace(-np.pi / 2, np.pi / 2, 15)[1:-1]:
        rings.append(np.column_stack([np.cos(lift) * _circle(28), np.full(28, np.sin(lift))]))
    return np.vstack(rings)


def _hull2(points: Floats) -> Floats:
    return np.array(points[ConvexHull(points).vertices])


def _placed(pose: dict[str, Any], dimension: int) -> tuple[Floats, Floats]:
    """Rotation matrix and place of a part."""
    place = np.array(pose.get("position", np.zeros(dimension)), dtype=np.float64)
    given = pose.get("rotation")
    if given is None:
        return np.eye(dimension), place
    turn = np.atleast_1d(np.array(given, dtype=np.float64))
    if dimension == 2 and len(turn) == 1:
        turn = np.array([np.cos(turn[0]), np.sin(turn[0])])
    return matrix_of(turn), place


def matrix_of(turn: Floats) -> Floats:
    """Rotation matrix of [cos, sin] or of a unit quaternion [w, x, y, z]."""
    if len(turn) == 2:
        return np.array([[turn[0], -turn[1]], [turn[1], turn[0]]])
    w, x, y, z = turn
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _terrain(table: dict[str, Any]) -> Floats:
    heights = np.array(table["heights"], dtype=np.float64)
    rows, columns = heights.shape
    x = np.linspace(-0.5, 0.5, columns) * table["size"][0]
    y = np.linspace(-0.5, 0.5, rows) * table["size"][1]
    grid = np.stack([*np.meshgrid(x, y), heights], axis=-1)
    a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]
    return np.concatenate([np.stack([a, b, d], axis=2), np.stack([a, d, c], axis=2)]).reshape(-1, 3, 3)


def _wall(radius: float) -> Floats:
    """The lower half of a cavity's wall."""
    lift = np.linspace(-np.pi / 2, 0.0, 13)
    turn = np.linspace(0.0, 2 * np.pi, 37)
    ring = np.stack(
        [
            np.cos(lift)[:, None] * np.cos(turn),
            np.cos(lift)[:, None] * np.sin(turn),
            np.broadcast_to(np.sin(lift)[:, None], (13, 37)),
        ],
        axis=-1,
    )
    a, b, c, d = ring[:-1, :-1], ring[:-1, 1:], ring[1:, :-1], ring[1:, 1:]
    return radius * np.concatenate([np.stack([a, b, d], axis=2), np.stack([a, d, c], axis=2)]).reshape(
        -1, 3, 3
    )
