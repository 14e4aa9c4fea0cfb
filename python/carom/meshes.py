"""Triangle meshes from OBJ, STL, PLY and GLB files: as hull, as convex decomposition, or as they are.

Reading is trimesh's; what follows is ours: welding, checks, and the mass properties of the enclosed solid by
signed tetrahedra. With d = det(a, b, c) of a triangle and s = a + b + c:
V = sum d/6, V x_c = sum d s/24, integral of x x^T = sum d (a a^T + b b^T + c c^T + s s^T)/120
(Blow & Binstock 2004; theory chapter 1). Coordinates are taken as they stand in the file, times `scale`: no
axis is swapped (glTF calls y up, carom's default gravity points along -z; rotate the body). Files are read
from bytes and nothing that they refer to (materials, textures, buffers) is opened. Knows no worlds.
"""

from __future__ import annotations

import io
import json
import math
import struct
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from carom.errors import BuildError

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.uint32]
Use = Literal["hull", "decomposition", "static"]

#: Largest mesh file that is read [bytes].
MOST_BYTES = 64 * 1024 * 1024
#: Convex parts of a decomposition when nothing is asked for [1].
DEFAULT_PARTS = 16
#: Vertices closer than this fraction of the mesh's extent are one vertex [1].
WELD = 1e-9

_SUFFIXES = (".obj", ".stl", ".ply", ".glb")


@dataclass(frozen=True)
class MeshMass:
    """Mass properties of the solid that a closed mesh encloses, at density 1.

    Attributes
    ----------
    volume : float [m^3]
    center : (3,) float64 array, centre of mass in mesh axes [m]
    inertia : (3, 3) float64 array about the centre of mass, mesh axes, for a density of 1 kg/m^3 [kg m^2]
    """

    volume: float
    center: Floats
    inertia: Floats


@dataclass(frozen=True)
class Mesh:
    """A checked triangle mesh.

    Attributes
    ----------
    vertices : (v, 3) float64 array [m]
    triangles : (t, 3) uint32 array, counter-clockwise seen from outside
    closed : whether every edge is shared by exactly two triangles of opposite direction
    dropped : what the file held and the mesh does not, in words
    """

    source: str
    vertices: Floats
    triangles: Indices
    closed: bool
    dropped: tuple[str, ...] = field(default=())

    @property
    def extent(self) -> float:
        """Diagonal of the bounding box [m]."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def mass_properties(self) -> MeshMass:
        """Volume, centre of mass and inertia of the enclosed solid at density 1.

        Raises
        ------
        BuildError
            When the mesh is not closed.
        """
        if not self.closed:
            raise _refused(self.source, *_open_reason(self.triangles))
        return _solid(self.vertices, self.triangles)

    def __repr__(self) -> str:
        """Source, counts, and whether it is closed."""
        state = "closed" if self.closed else "open"
        return (
            f"<Mesh {self.source!r}: {len(self.vertices)} vertices, {len(self.triangles)} triangles, {state}>"
        )


def load_mesh(path: str | Path, *, scale: float = 1.0) -> Mesh:
    """Reads, welds and checks a mesh file.

    Parameters
    ----------
    path : OBJ, STL, PLY or GLB file
    scale : metres per unit of length in the file [m]

    Raises
    ------
    BuildError
        When the file cannot be read as its format, is larger than 64 MiB, or holds no usable triangles.
    """
    path = Path(path)
    if not (isinstance(scale, (int, float)) and math.isfinite(scale) and scale > 0):
        raise BuildError(
            f"mesh {path.name!r}: scale must be > 0, got {scale!r}; give metres per unit of the file",
            field="scale",
            value=scale,
            remedy="give metres per unit of the file",
        )
    suffix = path.suffix.lower()
    if suffix not in _SUFFIXES:
        raise _refused(
            str(path), f"unknown kind of mesh file {suffix!r}", f"give one of {', '.join(_SUFFIXES)}"
        )
    try:
        size = path.stat().st_size
        raw = path.read_bytes() if size <= MOST_BYTES else b""
    except OSError as error:
        raise _refused(str(path), f"cannot be read: {error.strerror or error}", "check the path") from error
    if size > MOST_BYTES:
        raise _refused(
            str(path), f"file of {size / 2**20:.0f} MiB is larger than 64 MiB", "simplify the mesh"
        )
    vertices, triangles = _read(raw, suffix, str(path))
    return clean_mesh(vertices * scale, triangles, source=str(path), dropped=_foreign(raw, suffix))


def clean_mesh(
    vertices: npt.ArrayLike, triangles: npt.ArrayLike, *, source: str, dropped: tuple[str, ...] = ()
) -> Mesh:
    """Welds and checks triangles, and turns a closed surface outward.

    Parameters
    ----------
    vertices : (v, 3) array [m]
    triangles : (t, 3) array of vertex indices
    source : name used in messages

    Raises
    ------
    BuildError
        For coordinates that are not finite, indices out of range, and meshes without extent or triangles.
    """
    points = np.ascontiguousarray(vertices, dtype=np.float64).reshape(-1, 3)
    faces = np.ascontiguousarray(triangles, dtype=np.int64).reshape(-1, 3)
    notes = list(dropped)
    if len(faces) == 0 or len(points) < 3:
        raise _refused(
            source, "holds no triangles", "export the mesh as triangles (not points or lines only)"
        )
    if not np.isfinite(points).all():
        vertex = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise _refused(source, f"vertex {vertex} is not finite: {points[vertex].tolist()}", "repair the mesh")
    if faces.min() < 0 or faces.max() >= len(points):
        raise _refused(source, f"a triangle names vertex {faces.max()} of {len(points)}", "repair the mesh")
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    if extent == 0.0:
        raise _refused(source, "all vertices lie in one point", "repair the mesh")
    points, faces = _welded(points, faces, extent, notes)
    if len(faces) == 0:
        raise _refused(source, "holds no triangles with an area", "repair the mesh")
    closed = _is_closed(faces)
    if closed and _signed_volume(points, faces) < 0:
        faces = faces[:, ::-1]
        notes.append("the surface was inside out and has been turned")
    triangles_out = np.ascontiguousarray(faces, dtype=np.uint32)
    return Mesh(source, np.ascontiguousarray(points), triangles_out, closed, tuple(notes))


def as_shape(mesh: Mesh, use: Use, *, max_parts: int = DEFAULT_PARTS) -> dict[str, Any]:
    """The mesh as the plain table of a shape of space.

    Parameters
    ----------
    use : "hull" (one convex hull), "decomposition" (convex parts that follow the enclosed solid) or
        "static" (the triangles themselves, for obstacles)
    max_parts : most parts of a decomposition

    Raises
    ------
    BuildError
        When the mesh is flat (hull), open (decomposition) or without area (static).
    """
    if use == "hull":
        _refuse_flat(mesh)
        corners = _hull_corners(mesh.vertices)
        return {"type": "convex_hull", "points": corners.tolist()}
    if use == "static":
        area = _areas(mesh.vertices, mesh.triangles)
        faces = mesh.triangles[area > (1e-9 * mesh.extent) ** 2]
        if len(faces) == 0:
            raise _refused(mesh.source, "holds no triangles with an area", "repair the mesh")
        return {"type": "tri_mesh", "vertices": mesh.vertices.tolist(), "triangles": faces.tolist()}
    if not mesh.closed:
        problem, _ = _open_reason(mesh.triangles)
        raise _refused(mesh.source, problem, 'close the mesh or use as = "hull"')
    _refuse_flat(mesh)
    from carom import _carom

    parts = _carom.decompose(mesh.vertices, mesh.triangles, max_parts)
    frame = {"position": [0.0, 0.0, 0.0], "rotation": [1.0, 0.0, 0.0, 0.0]}
    hulls = [{"type": "convex_hull", "points": np.asarray(points).tolist()} for points in parts]
    if len(hulls) == 1:
        return hulls[0]
    return {"type": "compound", "parts": [{"pose": dict(frame), "shape": hull} for hull in hulls]}


def _refused(source: str, problem: str, remedy: str) -> BuildError:
    return BuildError(
        f"mesh {Path(source).name!r}: {problem}; {remedy}", field="mesh", value=source, remedy=remedy
    )


def _read(raw: bytes, suffix: str, source: str) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Vertices and triangles of all parts of a file, placed where its scene graph puts them."""
    import trimesh

    if not raw:
        raise _refused(source, "the file is empty", "export the mesh again")
    if suffix == ".stl" and not _is_stl(raw):
        # the reader would guess an encoding, where a package that guesses is installed, and find no triangles
        problem = "cannot be read as STL: neither binary of the size that its header says, nor text"
        raise _refused(source, problem, "export it again")
    try:
        loaded = trimesh.load_scene(
            io.BytesIO(raw), file_type=suffix[1:], resolver=None, process=False, skip_materials=True
        )
        parts = [part for part in loaded.dump() if isinstance(part, trimesh.Trimesh) and len(part.faces)]
    except Exception as error:  # the readers raise whatever broken bytes lead them to
        reason = str(error).strip().splitlines()[0][:200] if str(error).strip() else type(error).__name__
        raise _refused(
            source, f"cannot be read as {suffix[1:].upper()}: {reason}", "export it again"
        ) from error
    if not parts:
        raise _refused(
            source, "holds no triangles", "export the mesh as triangles (not points or lines only)"
        )
    counts = np.cumsum([0] + [len(part.vertices) for part in parts])
    vertices = np.vstack([np.asarray(part.vertices, dtype=np.float64) for part in parts])
    triangles = np.vstack(
        [np.asarray(part.faces, dtype=np.int64) + counts[i] for i, part in enumerate(parts)]
    )
    return vertices, triangles


def _is_stl(raw: bytes) -> bool:
    """Whether bytes are a binary STL file of the right size, or text."""
    if len(raw) >= 84 and len(raw) == 84 + 50 * struct.unpack_from("<I", raw, 80)[0]:
        return True
    try:
        raw.decode()
    except UnicodeDecodeError:
        return False
    return True


def _welded(
    points: Floats, faces: npt.NDArray[np.int64], extent: float, notes: list[str]
) -> tuple[Floats, npt.NDArray[np.int64]]:
    """One vertex per place, no triangle twice, no triangle on fewer than three vertices, no vertex unused."""
    grid = np.round((points - points.min(axis=0)) / (WELD * extent)).astype(np.int64)
    _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")  # keep the file's order of vertices
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    points, faces = points[first[order]], rank[inverse.reshape(-1)][faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    if not whole.all():
        notes.append(f"{_counted(int((~whole).sum()), 'triangle')} without area")
        faces = faces[whole]
    start = np.argmin(faces, axis=1) if len(faces) else np.zeros(0, dtype=np.int64)
    turned = np.take_along_axis(faces, (start[:, None] + np.arange(3)) % 3, axis=1)
    _, kept = np.unique(turned, axis=0, return_index=True)
    if len(kept) < len(faces):
        notes.append(f"{_counted(len(faces) - len(kept), 'triangle')} given twice")
        faces = faces[np.sort(kept)]
    used = np.unique(faces)
    if len(used) < len(points):
        notes.append(f"{_counted(len(points) - len(used), 'vertex')} that no triangle uses")
        renumbered = np.full(len(points), -1, dtype=np.int64)
        renumbered[used] = np.arange(len(used))
        points, faces = points[used], renumbered[faces]
    return points, faces


def _counted(number: int, noun: str) -> str:
    plural = {"vertex": "vertices"}.get(noun, noun + "s")
    return f"{number} {noun if number == 1 else plural}"


def _edges(faces: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    whole = faces.astype(np.int64)
    return np.vstack([whole[:, [0, 1]], whole[:, [1, 2]], whole[:, [2, 0]]])


def _is_closed(faces: npt.NDArray[Any]) -> bool:
    """Every directed edge occurs once, and its reverse once."""
    edges = _edges(faces)
    codes = edges[:, 0] * (edges.max() + 1) + edges[:, 1]
    reverse = edges[:, 1] * (edges.max() + 1) + edges[:, 0]
    unique = np.unique(codes)
    return len(unique) == len(codes) and bool(np.array_equal(unique, np.unique(reverse)))


def _open_reason(faces: npt.NDArray[Any]) -> tuple[str, str]:
    """Why a mesh is not closed, and what to do about it."""
    edges = np.sort(_edges(faces), axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    border, crowded = int((uses == 1).sum()), int((uses > 2).sum())
    if border:
        return f"is not closed: {border} edges belong to one triangle only", "close the holes"
    if crowded:
        return f"is not a surface: {crowded} edges belong to more than two triangles", "split the mesh there"
    return "has triangles that face opposite ways", "make the orientation of its triangles consistent"


def _areas(points: Floats, faces: npt.NDArray[Any]) -> Floats:
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), dtype=np.float64)


def _signed_volume(points: Floats, faces: npt.NDArray[Any]) -> float:
    a, b, c = (points[faces[:, corner]] - points.mean(axis=0) for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def _solid(points: Floats, faces: npt.NDArray[Any]) -> MeshMass:
    """Volume, centre and inertia by signed tetrahedra from the mean of the vertices."""
    middle = points.mean(axis=0)
    a, b, c = (points[faces[:, corner]] - middle for corner in range(3))
    weight = np.einsum("ij,ij->i", a, np.cross(b, c))
    total = a + b + c
    volume = float(weight.sum() / 6)
    center = np.asarray((weight @ total) / (24 * volume), dtype=np.float64)
    second = sum(np.einsum("i,ij,ik->jk", weight, x, x) for x in (a, b, c, total)) / 120
    second = second - volume * np.outer(center, center)
    inertia = np.trace(second) * np.eye(3) - second
    return MeshMass(volume, center + middle, np.asarray(inertia, dtype=np.float64))


def _refuse_flat(mesh: Mesh) -> None:
    spread = np.linalg.svd(mesh.vertices - mesh.vertices.mean(axis=0), compute_uv=False)
    if len(mesh.vertices) < 4 or spread[2] <= 1e-6 * spread[0]:
        raise _refused(
            mesh.source, "is flat and encloses no volume", 'use as = "static" or give it thickness'
        )


def _hull_corners(points: Floats) -> Floats:
    """The points that are corners of the convex hull, in the file's order."""
    from scipy.spatial import ConvexHull

    return np.asarray(points[np.sort(ConvexHull(points).vertices)], dtype=np.float64)


def _foreign(raw: bytes, suffix: str) -> tuple[str, ...]:
    """What a file holds besides triangles, in words; an unreadable file has been refused before."""
    if suffix == ".obj":
        words = Counter(line.split(maxsplit=1)[0] for line in raw.splitlines() if line.strip())
        named = {
            b"usemtl": "materials",
            b"vn": "normals",
            b"vt": "texture coordinates",
            b"l": "lines",
            b"p": "points",
        }
        return tuple(f"{text} ({words[word]})" for word, text in named.items() if words[word])
    if suffix == ".ply":
        header = raw[: raw.find(b"end_header")].decode("ascii", "replace").splitlines()
        names = [line.split()[-1] for line in header if line.startswith("property")]
        extra = [name for name in names if name not in ("x", "y", "z", "vertex_indices", "vertex_index")]
        return (f"properties {', '.join(extra)}",) if extra else ()
    if suffix == ".glb" and len(raw) >= 20:
        (length,) = struct.unpack_from("<I", raw, 12)
        tree = json.loads(raw[20 : 20 + length])
        kinds = ("materials", "textures", "animations", "skins", "cameras")
        found = [f"{key} ({len(tree[key])})" for key in kinds if tree.get(key)]
        primitives = [item for part in tree.get("meshes", []) for item in part.get("primitives", [])]
        attributes = {name for item in primitives for name in item.get("attributes", {})}
        extra = sorted(attributes - {"POSITION"})
        return tuple(found + ([f"attributes {', '.join(extra)}"] if extra else []))
    return ()
