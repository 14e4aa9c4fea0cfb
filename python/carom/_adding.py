"""From the arguments of `add_body` to what the engine reads: forms and combinations are checked here, sizes,
masses and coefficients by the engine.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from carom._report import MassProperties
from carom._shapes import shape_table
from carom._space import Floats, Space, frozen, number, whole
from carom.errors import BuildError, CaromError, refused

KINDS = ("dynamic", "static", "kinematic")


def checked_name(name: Any, what: str) -> None:
    """Refuses what scene files refuse as a name, and what no file could hold.

    Raises
    ------
    BuildError
        Naming the field.
    """
    remedy = f"give each {what} a name of its own"
    if not isinstance(name, str):
        raise refused(None, "name", "must be text", name, remedy)
    if _UNPRINTABLE.search(name):
        raise refused(None, "name", "must hold no control characters and no lone surrogates", name, remedy)


_UNPRINTABLE = re.compile("[\x00-\x1f\x7f\ud800-\udfff]")


def body_arguments(given: Mapping[str, Any], space: Space) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """The engine's arguments of a new body, and its shape as a table.

    Raises
    ------
    BuildError
        Naming body and field.
    """
    name = given["name"]
    checked_name(name, "body")
    kind = given["kind"]
    if kind not in KINDS:
        raise refused(
            name, "kind", f"must be one of {', '.join(KINDS)}", kind, f"choose one of {', '.join(KINDS)}"
        )
    shape = given.get("shape")
    table = None if shape is None else shape_table(shape, space, name)
    if kind != "dynamic":
        _check_obstacle(given, kind, table, name)
    place, is_origin = _place(given, space, name)
    rotation = given.get("rotation")
    arguments = {
        "kind": kind,
        "shape": None if table is None else json.dumps(table),
        "position": place,
        "position_is_origin": is_origin,
        "rotation": [1.0] + [0.0] * (space.turns - 1)
        if rotation is None
        else space.rotation(rotation, body=name),
        "velocity": _or_zero(given.get("velocity"), space.vector, "velocity", "m/s", name, space.dimension),
        "angular_velocity": _or_zero(
            given.get("angular_velocity"), space.spin, "angular_velocity", "rad/s", name, space.spins
        ),
        "can_rotate": bool(given.get("can_rotate", True))
        and (table is not None or given.get("inertia") is not None),
        "material": _material(given.get("material"), name),
        "groups": _bits(given["collision_groups"], "collision_groups", name),
        "collides_with": _bits(given["collision_mask"], "collision_mask", name),
        **{key: number(given.get(key, 0.0), key, unit, name) for key, unit in _COEFFICIENTS.items()},
    }
    return {**arguments, **_mass(given, space, table, name)}, table


_COEFFICIENTS = {
    "friction": "1",
    "rolling_friction": "m",
    "spinning_friction": "m",
    "restitution": "1",
    "tangential_restitution": "1",
    "linear_damping": "1/s",
    "angular_damping": "1/s",
}


def _material(value: Any, name: str) -> str | None:
    if value is not None and not isinstance(value, str):
        raise refused(name, "material", "must be a name", value, "give a text, or leave it out")
    return value


def _check_obstacle(given: Mapping[str, Any], kind: str, table: Any, name: str) -> None:
    if table is None:
        raise refused(name, "shape", f"must be given for a {kind} body", None, "give a shape")
    for key in ("density", "mass", "inertia", "center_of_mass"):
        if given.get(key) is not None:
            raise refused(
                name, key, f"has no meaning for a {kind} body", given[key], "leave it out, or make it dynamic"
            )


def _place(given: Mapping[str, Any], space: Space, name: str) -> tuple[list[float], bool]:
    """Position, and whether it is that of the shape's own frame."""
    position, origin = given.get("position"), given.get("origin")
    if position is not None and origin is not None:
        remedy = "give position (of the centre of mass) or origin (of the shape's frame)"
        raise refused(name, "origin", "must not be given beside position", origin, remedy)
    if position is not None:
        return space.vector(position, "position", "m", name), False
    if origin is not None:
        return space.vector(origin, "origin", "m", name), True
    return [0.0] * space.dimension, True


def _or_zero(
    value: Any,
    read: Callable[[Any, str, str, str], list[float]],
    field: str,
    unit: str,
    name: str,
    count: int,
) -> list[float]:
    return [0.0] * count if value is None else read(value, field, unit, name)


def _bits(value: Any, field: str, name: str) -> int:
    bits = whole(value, field, "give groups as bits, e.g. 0b101", name)
    if not 0 <= bits < 2**32:
        raise refused(name, field, "must have at most 32 bits", value, "give groups as bits, e.g. 0b101")
    return bits


def _mass(given: Mapping[str, Any], space: Space, table: Any, name: str) -> dict[str, Any]:
    """Where the mass comes from: a density, a mass, given values, or a density function's quadrature."""
    density, mass = given.get("density"), given.get("mass")
    inertia, center = given.get("inertia"), given.get("center_of_mass")
    found: dict[str, Any] = dict.fromkeys(("density", "mass", "inertia", "center_of_mass")) | {
        "quadrature_error": 0.0
    }
    if given["kind"] != "dynamic":
        return found
    unit = f"kg/m^{space.dimension}"
    if density is None and mass is None:
        what = "mass" if table is None else f"density in {unit} or mass"
        raise BuildError(f"body {name!r}: mass is missing; give {what} in kg", body=name, field="mass",
                         remedy=f"give {what} in kg")  # fmt: skip
    if density is not None and mass is not None:
        raise refused(name, "density", "must not be given beside mass", density, "give one of them")
    for key, value in (("inertia", inertia), ("center_of_mass", center)):
        if value is not None and mass is None:
            raise refused(name, key, "needs mass beside it", value, "give mass in kg too")
    if center is not None and inertia is None:
        raise refused(
            name, "center_of_mass", "needs inertia beside it", center, "give the inertia about it too"
        )
    if density is not None and table is None:
        raise refused(name, "density", "needs a shape", density, "give mass in kg for a particle, or a shape")
    if callable(density):
        tolerance = number(given["density_tolerance"], "density_tolerance", "parts of 1", name)
        properties = plain_mass_of(table, density, tolerance, space, name)
        keys = ("mass", "center_of_mass", "inertia", "quadrature_error")
        return found | dict(zip(keys, properties, strict=True))
    found["density"] = None if density is None else number(density, "density", unit, name)
    found["mass"] = None if mass is None else number(mass, "mass", "kg", name)
    found["inertia"] = None if inertia is None else space.inertia(inertia, "inertia", name)
    found["center_of_mass"] = None if center is None else space.vector(center, "center_of_mass", "m", name)
    return found


def plain_mass_of(
    table: dict[str, Any],
    density: Callable[[Floats], Any],
    tolerance: float,
    space: Space,
    name: str | None = None,
) -> tuple[float, list[float], list[float], float]:
    """Mass, centre, inertia entries and relative error of a density function over a shape."""

    def batch(points: Floats) -> Floats:
        answer = density(frozen(points))
        try:
            array = np.asarray(answer, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.zeros(())
        if array.shape != (len(points),):
            remedy = "take (n, d) points and return (n,) densities"
            raise refused(name, "density", f"must return ({len(points)},) numbers", answer, remedy)
        return np.ascontiguousarray(array)

    with attributed({"shape": table, "density": density, "relative_tolerance": tolerance}, name):
        return space.pieces.mass_properties_of(json.dumps(table), batch, tolerance)


def mass_properties(
    space: Space, shape: Any, density: Any, mass: float | None, tolerance: float
) -> MassProperties:
    """Mass properties of a shape from a density, a density function or a mass."""
    table = shape_table(shape, space)
    if (density is None) == (mass is None):
        raise refused(
            None, "density", "or mass must be given, and only one of them", density, "give one of them"
        )
    if callable(density):
        plain = plain_mass_of(table, density, tolerance, space)
    else:
        with attributed({"shape": table, "density": density}):
            unit = f"kg/m^{space.dimension}"
            constant = 1.0 if density is None else number(density, "density", unit)
            plain = space.pieces.mass_properties(json.dumps(table), constant)
    total, center, entries, error = plain
    if mass is not None:
        wanted = number(mass, "mass", "kg")
        if not (wanted > 0 and np.isfinite(wanted)):
            raise refused(None, "mass", "must be > 0", wanted, "give mass in kg")
        entries = [entry * (wanted / total) for entry in entries]
        total = wanted
    return MassProperties(total, frozen(np.array(center)), space.full_inertia(entries), error)


@contextmanager
def attributed(given: Mapping[str, Any], body: str | None = None) -> Iterator[None]:
    """Adds to an error of the engine the value given for its field, and the body where it names none."""
    try:
        yield
    except CaromError as error:
        if error.value is None and error.field:
            error.value = _value_at(given, error.field)
        if error.body is None and body is not None:
            error.body = body
            error.args = (f"body {body!r}: {error}",)
        raise


def _value_at(given: Any, path: str) -> Any:
    """The value at a path such as ``shape.parts[2].shape.radius``, None where the path leads nowhere."""
    for word in re.findall(r"[^.\[\]]+", path):
        try:
            given = given[int(word)] if word.isdigit() else given[word]
        except (KeyError, IndexError, TypeError):
            return None
    return given
