"""Finds scenes: built into the engine, packaged as TOML with carom, or a file of the user's.

A scene knows how to make its world again and again, which is what runs, comparisons and tests need. Knows
no physics.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Literal

from carom.errors import BuildError, SceneError
from carom.scene.build import Origin, build_document
from carom.scene.document import PlanarScene, SpatialScene
from carom.scene.read import Format, read_file, read_text
from carom.scene.suggest import did_you_mean

#: Folder of the TOML scenes that come with carom.
PACKAGED = Path(__file__).resolve().parent.parent / "scenes"


@dataclass
class Scene:
    """A scene that can be built into a world any number of times.

    Attributes
    ----------
    name : str
    space : "planar" or "spatial"
    description : str
    duration : float
        Simulated time of a run when none is asked for [s].
    kind : "built-in" (made by the engine), "packaged" (TOML inside carom), "file" or "text"
    text : str
        The scene's own text; for built-in scenes their name.
    notes : list of str
        What the last `build` dropped from mesh files.
    """

    name: str
    space: str
    description: str
    duration: float
    kind: Literal["built-in", "packaged", "file", "text"]
    text: str
    document: PlanarScene | SpatialScene | None = None
    origin: Origin | None = None
    notes: list[str] = field(default_factory=list)

    def build(self, **settings: Any) -> Any:
        """A new world of this scene; `settings` replace those of the scene (see ``World``).

        Raises
        ------
        SceneError
            When the scene's bodies or meshes are refused.
        BuildError
            When a setting is refused.
        """
        if self.document is None or self.origin is None:
            return _build_native(self.name, settings)
        world, self.notes = build_document(self.document, self.origin, settings)
        return world

    def __repr__(self) -> str:
        """Name, space, kind and duration."""
        return f"<Scene {self.name!r}, {self.space}, {self.kind}, {self.duration:g} s>"


def list_scenes() -> list[Scene]:
    """All built-in and packaged scenes, by space and name."""
    found = [_native(entry) for entry in _native_scenes().values()]
    found += [_from_file(path, "packaged") for path in sorted(PACKAGED.glob("*.toml"))]
    return sorted(found, key=lambda scene: (scene.space, scene.name))


def load_scene(what: str | Path) -> Scene:
    """The scene of a built-in or packaged name, or of the path of a .toml or .json file.

    Raises
    ------
    SceneError
        When there is no such scene, or its file is refused (with file, line, body, key, value and remedy).
    """
    path = Path(what)
    if path.suffix.lower() in (".toml", ".json") or path.is_file():
        if not path.exists():
            others = [str(other) for other in path.parent.glob("*.toml")] if path.parent.is_dir() else []
            raise _unknown(str(what), f"no such file {str(what)!r}", others)
        return _from_file(path, "file")
    name = str(what)
    if name in _native_scenes():
        return _native(_native_scenes()[name])
    packaged = PACKAGED / f"{name}.toml"
    if packaged.parent == PACKAGED and packaged.is_file():
        return _from_file(packaged, "packaged")
    raise _unknown(name, f"unknown scene {name!r}", _names())


def scene_from_text(
    text: str, *, form: Format = "toml", folder: Path | None = None, source: str = "<text>"
) -> Scene:
    """The scene of a TOML or JSON text; `folder` is where its mesh files may lie.

    Raises
    ------
    SceneError
        When the text is refused.
    """
    document = read_text(text, source, form)
    return _scene(document, Origin(source, text, form, folder), "text", document.name or source)


def _from_file(path: Path, kind: Literal["packaged", "file"]) -> Scene:
    text, document = read_file(path)
    form: Format = "json" if path.suffix.lower() == ".json" else "toml"
    return _scene(document, Origin(str(path), text, form, path.parent), kind, path.stem)


def _scene(
    document: PlanarScene | SpatialScene, origin: Origin, kind: Literal["packaged", "file", "text"], name: str
) -> Scene:
    description = document.description or document.name
    return Scene(name, document.space, description, document.duration, kind, origin.text, document, origin)


@cache
def _native_scenes() -> Mapping[str, tuple[str, str, str, float]]:
    """Scenes that the engine makes: name -> (name, space, description, duration [s])."""
    from carom import _carom

    return {str(entry[0]): entry for entry in _carom.scene_names()}


def _native(entry: tuple[str, str, str, float]) -> Scene:
    name, space, description, duration = entry
    return Scene(name, space, description, float(duration), "built-in", name)


def _build_native(name: str, settings: Mapping[str, Any]) -> Any:
    import carom

    world = carom.build_scene(name)
    for key, value in settings.items():
        if key not in world.settings:
            remedy = did_you_mean(key, world.settings) or f"known: {', '.join(sorted(world.settings))}"
            raise BuildError(f"unknown setting {key!r}; {remedy}", field=key, value=value, remedy=remedy)
        setattr(world, key, value)
    return world


def _names() -> list[str]:
    return [*_native_scenes(), *(path.stem for path in sorted(PACKAGED.glob("*.toml")))]


def _unknown(what: str, problem: str, candidates: list[str]) -> SceneError:
    hint = did_you_mean(what, candidates)
    remedy = f"{hint} " if hint else ""
    remedy += "`carom scenes` lists the built-in ones; a scene file ends in .toml or .json"
    return SceneError(f"{problem}; {remedy}", path=what, value=what, remedy=remedy)
