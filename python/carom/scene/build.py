"""Makes a world from a checked scene document.

Mesh bodies with a closed mesh get the exact mass properties of the mesh's own solid, not of its hull or of
the overlapping parts of its decomposition; an open mesh as hull gets those of the hull. Errors of the
engine come back as scene errors with file and line. Knows no physics.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from carom.errors import CaromError, SceneError
from carom.meshes import DEFAULT_PARTS, Mesh, as_shape, load_mesh
from carom.scene.bodies import COEFFICIENTS, MOST_BODIES, MeshFile, PlanarBody, SpatialBody
from carom.scene.document import PlanarScene, SpatialScene
from carom.scene.expand import Copy, copies
from carom.scene.lines import KeyPath, line_of
from carom.scene.read import Format, line_map
from carom.scene.shapes import as_plain

_GROUP_KEYS = ("collision_groups", "collision_mask")
_MASS_KEYS = ("mass", "inertia", "center_of_mass", "linear_damping", "angular_damping")


@dataclass(frozen=True)
class Origin:
    """Where a document came from: name for messages, text, format, the folder that meshes may lie in."""

    source: str
    text: str
    form: Format
    folder: Path | None

    def lines(self) -> Mapping[KeyPath, int]:
        """Line of every key."""
        return line_map(self.text, self.form)

    def error(
        self, path: KeyPath, body: str | None, problem: str, remedy: str, value: Any = None
    ) -> SceneError:
        """A scene error at a key of the document."""
        line = line_of(self.lines(), path)
        place = f"{self.source}:{line}" if line is not None else self.source
        where = f"body {body!r}: " if body is not None else ""
        key = ".".join(str(part) for part in path[2:])
        message = f"{place}: {where}{problem}; {remedy}"
        return SceneError(
            message, path=self.source, line=line, key=key, body=body, field=key, value=value, remedy=remedy
        )


def build_document(
    document: PlanarScene | SpatialScene, origin: Origin, settings: Mapping[str, Any]
) -> tuple[Any, list[str]]:
    """The world of a document, and notes on what mesh files held that is not used.

    Parameters
    ----------
    settings : settings of the world that replace the document's

    Raises
    ------
    SceneError
        Naming file, line and body, when a mesh or a body is refused or names repeat.
    """
    from carom import planar, spatial

    space: Any = planar if isinstance(document, PlanarScene) else spatial
    given = document.world.model_dump(exclude_none=True)
    world = space.World(**{**given, **settings})
    meshes = _Meshes(origin)
    taken: dict[str, int] = {}
    bodies: list[PlanarBody | SpatialBody] = list(document.body)
    for index, body in enumerate(bodies):
        solid = meshes.solid(index, body) if isinstance(body, SpatialBody) and body.mesh is not None else None
        for copy in copies(body):
            if copy.name in taken:
                other = bodies[taken[copy.name]].name
                remedy = (
                    "use {i}, {j}, {k} or {n} in the pattern" if other == body.name else "choose another name"
                )
                raise origin.error(
                    ("body", index, "name"), copy.name, f"name is taken by body {other!r}", remedy
                )
            if len(taken) >= MOST_BODIES:
                raise origin.error(
                    ("body", index),
                    None,
                    f"scene of more than {MOST_BODIES} bodies",
                    "lower the counts of repeat",
                )
            taken[copy.name] = index
            try:
                _add(world, document, body, copy, solid)
            except CaromError as error:
                raise _located(origin, index, copy.name, error) from error
    for index, joint in enumerate(document.joint):
        given_joint = joint.model_dump(exclude={"name", "kind"}, exclude_none=True)
        add: Any = getattr(world, f"add_{joint.kind}_joint")
        try:
            add(joint.name, **given_joint)
        except CaromError as error:
            raise _located(origin, index, None, error, "joint") from error
    used = {body.material for body in bodies}
    for pair in document.pair:
        one, other = pair.materials
        if one in used and other in used:  # no contact has the others
            world.set_pair(one, other, **pair.coefficients())
    return world, meshes.notes


def _located(
    origin: Origin, index: int, name: str | None, error: CaromError, part: str = "body"
) -> SceneError:
    """The engine's refusal with the file and the line of the key of a body or of a joint."""
    key = str(error.field) if getattr(error, "field", None) else ""
    parts = [part for part in re.split(r"[.\[\]]+", key) if part]
    path: KeyPath = (part, index, *(int(part) if part.isdigit() else part for part in parts))
    line = line_of(origin.lines(), path)
    place = f"{origin.source}:{line}" if line is not None else origin.source
    return SceneError(
        f"{place}: {error}",
        path=origin.source,
        line=line,
        key=key,
        body=name,
        field=key,
        value=getattr(error, "value", None),
        remedy=getattr(error, "remedy", None),
    )


@dataclass(frozen=True)
class _Solid:
    """A mesh as a shape and, when it is closed, its mass properties at density 1."""

    shape: dict[str, Any]
    mesh: Mesh
    is_solid: bool


class _Meshes:
    """Meshes of one scene, each read once."""

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        self.notes: list[str] = []
        self._made: dict[tuple[Any, ...], _Solid] = {}

    def solid(self, index: int, body: SpatialBody) -> _Solid:
        """The mesh of a body, made ready; refused with the line of its key."""
        assert body.mesh is not None
        reference = body.mesh
        path = self.path(index, body.name, reference)
        parts = reference.max_parts or DEFAULT_PARTS
        key = (path, reference.as_, reference.scale, parts)
        if key not in self._made:
            try:
                mesh = load_mesh(path, scale=reference.scale)
                shape = as_shape(mesh, reference.as_, max_parts=parts)
            except CaromError as error:
                at = self.origin.error(("body", index, "mesh", "file"), body.name, "", "")
                raise SceneError(
                    f"{self.origin.source}:{at.line}: body {body.name!r}: {error}",
                    path=self.origin.source, line=at.line, key="mesh.file", body=body.name, field="mesh.file",
                    value=reference.file, remedy=error.remedy,
                ) from error  # fmt: skip
            self.notes += [f"{reference.file}: dropped {what}" for what in mesh.dropped]
            self._made[key] = _Solid(shape, mesh, mesh.closed and reference.as_ != "static")
        return self._made[key]

    def path(self, index: int, name: str, reference: MeshFile) -> Path:
        """The file that a reference means; it must lie in the scene's folder, links followed."""
        key: KeyPath = ("body", index, "mesh", "file")
        if self.origin.folder is None:
            raise self.origin.error(
                key,
                name,
                f"mesh file {reference.file!r} in a scene that has no folder",
                "save the scene as a file",
            )
        folder = self.origin.folder.resolve()
        try:
            path = (folder / reference.file).resolve()
            inside = path.is_relative_to(folder) and not Path(reference.file).is_absolute()
        except (OSError, ValueError, RuntimeError):  # null characters, loops of links
            path, inside = folder, False
        if not inside:
            raise self.origin.error(
                key,
                name,
                f"mesh file {reference.file!r} leaves the scene's folder",
                "put the file beside the scene and give a relative path",
                reference.file,
            )
        return path


def _add(
    world: Any,
    document: PlanarScene | SpatialScene,
    body: PlanarBody | SpatialBody,
    copy: Copy,
    solid: _Solid | None,
) -> None:
    """Adds one copy of a body to the world."""
    material = document.materials.get(body.material) if body.material is not None else None
    given: dict[str, Any] = _given(body, (*COEFFICIENTS, *_GROUP_KEYS))
    if body.material is not None:
        given["material"] = body.material
    for key in COEFFICIENTS:
        if key not in given and material is not None and getattr(material, key) is not None:
            given[key] = getattr(material, key)
    place = "position" if body.position is not None or (body.shape is None and solid is None) else "origin"
    stated = getattr(body, place)
    given[place] = copy.displacement + (
        np.zeros(len(copy.displacement)) if stated is None else np.asarray(stated)
    )
    if copy.rotation is not None:
        given["rotation"] = copy.rotation
    shape = solid.shape if solid is not None else None if body.shape is None else as_plain(body.shape)
    if body.kind == "static":
        world.add_static(copy.name, shape, **given)
        return
    given |= _given(body, ("velocity", "angular_velocity"))
    if body.kind == "kinematic":
        world.add_kinematic(copy.name, shape, **given)
        return
    given |= _given(body, _MASS_KEYS)
    density = body.density if body.density is not None else material.density if material is not None else None
    if body.mass is None and density is not None:
        given["density"] = density
    if solid is not None and solid.is_solid and body.inertia is None and body.center_of_mass is None:
        given |= _mesh_mass(solid.mesh, body.mass, density)
        given.pop("density", None)
    world.add_body(copy.name, shape, **given)


def _given(body: PlanarBody | SpatialBody, keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: getattr(body, key) for key in keys if getattr(body, key) is not None}


def _mesh_mass(mesh: Mesh, mass: float | None, density: float | None) -> dict[str, Any]:
    """Mass, inertia and centre of mass of the mesh's own solid, from its mass or its density."""
    solid = mesh.mass_properties()
    weight = density if density is not None else (mass or 0.0) / solid.volume
    if mass is not None:
        weight = mass / solid.volume
    return {"mass": weight * solid.volume, "inertia": weight * solid.inertia, "center_of_mass": solid.center}
