"""Shapes of the plane and of space as values; all lengths in metres.

Rounded shapes are a core swept by a disc or ball: the outer size is size + 2 radius. Capsules lie along x in
the plane and along z in space; cylinders and cones stand along z, centred on half their height. Wherever a
shape is taken, a plain table ``{"type": "box", "size": [1, 1]}`` is taken too. The engine judges sizes and
hulls; here only counts and names are checked. Knows no worlds.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from carom._space import PLANAR, SPATIAL, Space, number
from carom.errors import BuildError, refused, shown, unknown


class Shape:
    """Base of all shapes: a value with named fields."""

    type: ClassVar[str]
    label: ClassVar[str] = ""

    def to_dict(self) -> dict[str, Any]:
        """The shape as a plain table, as scene files and the engine have it."""
        fields = {name: getattr(self, name) for name, _ in _fields(self)}
        return {"type": self.type, **{name: _listed(value) for name, value in fields.items()}}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and self.to_dict() == other.to_dict()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        parts = [_brief(name, getattr(self, name)) for name, _ in _fields(self)]
        return f"{self.label or type(self).__name__}({', '.join(parts)})"


def _fields(shape: Any) -> list[tuple[str, Any]]:
    """Names and defaults of a shape's fields; MISSING where there is no default."""
    return [(field.name, field.default) for field in dataclasses.fields(shape)]


Part = Mapping[str, Any] | tuple[Any, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Circle(Shape):
    """Disc about the origin."""

    type: ClassVar[str] = "circle"
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class Sphere(Shape):
    """Ball about the origin."""

    type: ClassVar[str] = "sphere"
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class Capsule(Shape):
    """Segment of `length` along x (plane) or z (space), swept by a disc or ball."""

    type: ClassVar[str] = "capsule"
    length: float
    radius: float


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Box(Shape):
    """Rectangle or cuboid of full side lengths about the origin: ``Box(2, 1)``, ``Box(2, 1, 1)``."""

    type: ClassVar[str] = "box"
    size: tuple[float, ...]

    def __init__(self, *size: Any) -> None:
        object.__setattr__(self, "size", _sizes(size))

    def __repr__(self) -> str:
        return f"Box{self.size}"


@dataclass(frozen=True, eq=False, repr=False, init=False)
class RoundBox(Shape):
    """Rectangle or cuboid swept by a disc or ball: ``RoundBox(2, 1, radius=0.1)``."""

    type: ClassVar[str] = "round_box"
    size: tuple[float, ...]
    radius: float

    def __init__(self, *size: Any, radius: float) -> None:
        object.__setattr__(self, "size", _sizes(size))
        object.__setattr__(self, "radius", radius)

    def __repr__(self) -> str:
        return f"RoundBox({', '.join(map(str, self.size))}, radius={self.radius})"


@dataclass(frozen=True, eq=False, repr=False)
class ConvexPolygon(Shape):
    """Convex hull of (k, 2) points."""

    type: ClassVar[str] = "convex_polygon"
    points: npt.ArrayLike


@dataclass(frozen=True, eq=False, repr=False)
class RoundPolygon(Shape):
    """Convex hull of (k, 2) points, swept by a disc."""

    type: ClassVar[str] = "round_polygon"
    points: npt.ArrayLike
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class Segment(Shape):
    """Straight wall between two points; no mass."""

    type: ClassVar[str] = "segment"
    a: npt.ArrayLike
    b: npt.ArrayLike


@dataclass(frozen=True, eq=False, repr=False)
class Polyline(Shape):
    """Chain of straight walls through (k, 2) points; no mass."""

    type: ClassVar[str] = "polyline"
    points: npt.ArrayLike
    closed: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class HalfPlane(Shape):
    """Everything behind the line through the origin with this outward normal; no mass."""

    type: ClassVar[str] = "half_plane"
    normal: npt.ArrayLike = (0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Cavity(Shape):
    """Everything farther from the origin than `radius` [m]: the inside of a bowl or a drum; no mass."""

    type: ClassVar[str] = "cavity"
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class HeightLine(Shape):
    """(k,) heights over equally spaced abscissae that span `width` about the origin; no mass."""

    type: ClassVar[str] = "height_field"
    label: ClassVar[str] = "HeightField"
    heights: npt.ArrayLike
    width: float


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(Shape):
    """Solid cylinder along z."""

    type: ClassVar[str] = "cylinder"
    height: float
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class Cone(Shape):
    """Solid cone along z, base at -height/2, apex at +height/2."""

    type: ClassVar[str] = "cone"
    height: float
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class RoundCylinder(Shape):
    """Cylinder of core `height` and `radius`, swept by a ball of `rounding`."""

    type: ClassVar[str] = "round_cylinder"
    height: float
    radius: float
    rounding: float


@dataclass(frozen=True, eq=False, repr=False)
class RoundCone(Shape):
    """Cone of core `height` and `radius`, swept by a ball of `rounding`."""

    type: ClassVar[str] = "round_cone"
    height: float
    radius: float
    rounding: float


@dataclass(frozen=True, eq=False, repr=False)
class ConvexHull(Shape):
    """Convex hull of (k, 3) points."""

    type: ClassVar[str] = "convex_hull"
    points: npt.ArrayLike


@dataclass(frozen=True, eq=False, repr=False)
class RoundConvexHull(Shape):
    """Convex hull of (k, 3) points, swept by a ball."""

    type: ClassVar[str] = "round_convex_hull"
    points: npt.ArrayLike
    radius: float


@dataclass(frozen=True, eq=False, repr=False)
class TriMesh(Shape):
    """(t, 3) triangles over (v, 3) vertices: a surface as obstacle; for mass a closed, outward one."""

    type: ClassVar[str] = "tri_mesh"
    vertices: npt.ArrayLike
    triangles: npt.ArrayLike


@dataclass(frozen=True, eq=False, repr=False)
class HalfSpace(Shape):
    """Everything behind the plane through the origin with this outward normal; no mass."""

    type: ClassVar[str] = "half_space"
    normal: npt.ArrayLike = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class HeightField(Shape):
    """(rows, columns) heights (row = y, column = x) over a rectangle `size` about the origin; no mass."""

    type: ClassVar[str] = "height_field"
    heights: npt.ArrayLike
    size: tuple[float, float]


@dataclass(frozen=True, eq=False, repr=False)
class Compound(Shape):
    """Several shapes in one body; parts are (shape, position) or (shape, position, rotation)."""

    type: ClassVar[str] = "compound"
    parts: Sequence[Part]

    def to_dict(self) -> dict[str, Any]:
        """The shape as a plain table."""
        given = self.parts
        parts = given if isinstance(given, (str, Mapping)) else [_plain_part(part) for part in given]
        return {"type": self.type, "parts": parts}


_PLANAR: tuple[type[Shape], ...] = (
    Circle,
    Capsule,
    Box,
    RoundBox,
    ConvexPolygon,
    RoundPolygon,
    Segment,
    Polyline,
    HalfPlane,
    Cavity,
    HeightLine,
    Compound,
)
_SPATIAL: tuple[type[Shape], ...] = (
    Sphere,
    Capsule,
    Box,
    Cylinder,
    Cone,
    ConvexHull,
    RoundBox,
    RoundCylinder,
    RoundCone,
    RoundConvexHull,
    TriMesh,
    HalfSpace,
    Cavity,
    HeightField,
    Compound,
)
#: Shapes by type, for each space.
SHAPES: dict[str, dict[str, type[Shape]]] = {
    PLANAR.name: {shape.type: shape for shape in _PLANAR},
    SPATIAL.name: {shape.type: shape for shape in _SPATIAL},
}

ShapeLike = Shape | Mapping[str, Any]


def shape_table(shape: Any, space: Space, body: str | None = None, path: str = "shape") -> dict[str, Any]:
    """A shape as the table that the engine reads, with counts, names and finiteness checked.

    Raises
    ------
    BuildError
        Naming the field, e.g. ``shape.parts[2].shape.radius``.
    """
    known = SHAPES[space.name]
    if not isinstance(shape, (Shape, Mapping)):
        raise refused(
            body, path, "must be a shape", shape, f"give one of carom.{space.name}: {_names(known)}"
        )
    table = shape.to_dict() if isinstance(shape, Shape) else dict(shape)
    kind = table.pop("type", None)
    if kind not in known:
        remedy = f"choose one of {', '.join(known)}"
        raise refused(body, f"{path}.type", f"must be a shape of the {space.name} world", kind, remedy)
    wanted = dict(_fields(known[kind]))
    for name in table:
        if name not in wanted:
            raise unknown(f"field of {kind}", str(name), list(wanted), body)
    for name, default in wanted.items():
        if name not in table:
            if default is dataclasses.MISSING:
                remedy = f"give {name} of the {kind}"
                raise BuildError(
                    f"{_at(body)}{path}.{name} is missing; {remedy}",
                    body=body,
                    field=f"{path}.{name}",
                    remedy=remedy,
                )
            table[name] = default
    checked = {name: _CHECKS[name](table[name], space, kind, f"{path}.{name}", body) for name in wanted}
    return {"type": kind, **checked}


def shape_from_json(text: str, space: Space) -> Shape:
    """A shape from the engine's text."""
    table = json.loads(text)
    made = SHAPES[space.name][table.pop("type")]
    if made is Box:
        return Box(*table["size"])
    if made is RoundBox:
        return RoundBox(*table["size"], radius=table["radius"])
    return made(**table)


def _plain_part(part: Any) -> Any:
    """A part of a compound as a table; what is none stays as it is and is refused where it is used."""
    if not isinstance(part, (tuple, list)) or len(part) not in (2, 3):
        return part
    shape = part[0].to_dict() if isinstance(part[0], Shape) else part[0]
    pose = {"position": _listed(part[1])} | ({"rotation": _listed(part[2])} if len(part) == 3 else {})
    return {"pose": pose, "shape": shape}


def _at(body: str | None) -> str:
    return f"body {body!r}: " if body is not None else ""


def _names(known: Mapping[str, type[Shape]]) -> str:
    return ", ".join(shape.__name__ for shape in known.values())


def _sizes(size: tuple[Any, ...]) -> tuple[float, ...]:
    """Side lengths, given one by one or as one sequence."""
    if len(size) == 1 and np.ndim(size[0]) == 1:
        size = tuple(size[0])
    return tuple(side.item() if isinstance(side, np.generic) else side for side in size)


def _listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value


def _brief(name: str, value: Any) -> str:
    if name in ("points", "vertices", "triangles", "parts"):
        return f"<{len(value)} {name}>"
    return f"{name}={shown(value)}"


def _array(
    value: Any, space: Space, form: str, path: str, body: str | None, columns: int, least: int = 1
) -> Any:
    """A (k, columns) list of finite numbers; columns 0 means (k,)."""
    wanted = f"({'k, ' + str(columns) if columns else 'k,'}) numbers"
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise refused(body, path, f"must be {wanted}", value, f"give a {form} in m") from None
    if array.ndim != (2 if columns else 1) or (columns and array.shape[1] != columns) or len(array) < least:
        raise refused(body, path, f"must be {wanted}", value, f"give a {form} in m")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        at = "".join(f"[{index}]" for index in bad[0])
        raise refused(body, f"{path}{at}", "must be finite", float(array[tuple(bad[0])]), "give numbers in m")
    return array.tolist()


def _length(value: Any, space: Space, kind: str, path: str, body: str | None) -> float:
    found = number(value, path, "m", body)
    if not np.isfinite(found):
        raise refused(body, path, "must be finite and > 0", found, "give a positive length in m")
    return found


def _vector(value: Any, space: Space, kind: str, path: str, body: str | None) -> list[float]:
    return space.vector(value, path, "m", body)


def _size(value: Any, space: Space, kind: str, path: str, body: str | None) -> Any:
    columns = 2 if kind == "height_field" else space.dimension
    sides = _array(value, space, f"list of {columns} side lengths", path, body, 0)
    if len(sides) != columns:
        raise refused(body, path, f"must be {columns} numbers", value, f"give {columns} side lengths in m")
    return sides


def _points(value: Any, space: Space, kind: str, path: str, body: str | None) -> Any:
    return _array(value, space, f"list of points {space.axes}", path, body, space.dimension)


def _heights(value: Any, space: Space, kind: str, path: str, body: str | None) -> Any:
    if space.is_planar:
        return _array(value, space, "list of heights", path, body, 0)
    is_table = isinstance(value, (list, tuple, np.ndarray)) and len(value) > 0 and np.ndim(value[0]) == 1
    return _array(
        value, space, "table of heights, rows along y", path, body, len(value[0]) if is_table else 1
    )


def _triangles(value: Any, space: Space, kind: str, path: str, body: str | None) -> Any:
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.zeros(0)
    whole = array.ndim == 2 and array.shape[1] == 3 and np.issubdtype(array.dtype, np.integer)
    if not whole or (len(array) and (array.min() < 0 or array.max() >= 2**32)):
        raise refused(body, path, "must be (t, 3) vertex indices", value, "give whole numbers counted from 0")
    return array.tolist()


def _flag(value: Any, space: Space, kind: str, path: str, body: str | None) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise refused(
            body, path, "must be True or False", value, "say whether the last point joins the first"
        )
    return bool(value)


def _parts(value: Any, space: Space, kind: str, path: str, body: str | None) -> list[dict[str, Any]]:
    if isinstance(value, (str, Mapping)) or not isinstance(value, Iterable):
        raise refused(body, path, "must be a list of parts", value, "give (shape, position) for each")
    return [_part(part, space, f"{path}[{index}]", body) for index, part in enumerate(value)]


def _part(part: Any, space: Space, path: str, body: str | None) -> dict[str, Any]:
    if isinstance(part, Mapping):
        pose = part.get("pose", {})
        given = (part.get("shape"), pose.get("position"), pose.get("rotation"))
    elif isinstance(part, (tuple, list)) and len(part) in (2, 3):
        given = (part[0], part[1], part[2] if len(part) == 3 else None)
    else:
        remedy = "give (shape, position) or (shape, position, rotation)"
        raise refused(body, path, "must be a shape and its place", part, remedy)
    shape, position, rotation = given
    stated = position if position is not None else [0.0] * space.dimension
    at = space.vector(stated, f"{path}.pose.position", "m", body)
    still = [1.0] + [0.0] * (space.turns - 1)
    turned = still if rotation is None else space.stored_rotation(rotation, f"{path}.pose.rotation", body)
    return {
        "pose": {"position": at, "rotation": turned},
        "shape": shape_table(shape, space, body, f"{path}.shape"),
    }


_CHECKS: dict[str, Callable[[Any, Space, str, str, str | None], Any]] = {
    "radius": _length,
    "length": _length,
    "height": _length,
    "width": _length,
    "rounding": _length,
    "size": _size,
    "points": _points,
    "vertices": _points,
    "triangles": _triangles,
    "heights": _heights,
    "a": _vector,
    "b": _vector,
    "normal": _vector,
    "closed": _flag,
    "parts": _parts,
}
