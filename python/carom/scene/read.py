"""Reads scene text (TOML or JSON) into a checked document, within limits of size and depth.

Order: size, characters, grammar, depth, model. The map of lines is made only when there is something to
complain about. Knows no worlds.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from carom.errors import SceneError
from carom.scene.complain import scene_error
from carom.scene.document import DOCUMENT, PlanarScene, SpatialScene
from carom.scene.lines import KeyPath, json_lines, toml_lines

#: Largest scene text that is read [bytes]; larger geometry belongs into mesh files.
MOST_BYTES = 4 * 1024 * 1024
#: Deepest nesting of tables and lists that is read [1]; the format itself needs 9.
DEEPEST = 32

Format = Literal["toml", "json"]


def read_file(path: Path) -> tuple[str, PlanarScene | SpatialScene]:
    """Text and checked document of a scene file.

    Raises
    ------
    SceneError
        When the file cannot be read, is too large, is no TOML or JSON, or says something that the models
        refuse.
    """
    source = str(path)
    suffix = path.suffix.lower()
    if suffix not in (".toml", ".json"):
        raise _plain(source, f"unknown kind of scene file {suffix!r}", "give a .toml or .json file")
    try:
        if path.stat().st_size > MOST_BYTES:
            raise _too_large(source, path.stat().st_size)
        raw = path.read_bytes()
    except OSError as error:
        raise _plain(
            source, f"cannot be read: {error.strerror or error}", "check the path and its rights"
        ) from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise _plain(
            source, f"byte {raw[error.start]:#04x} is not UTF-8", "save the file as UTF-8", line
        ) from error
    return text, read_text(text, source, "json" if suffix == ".json" else "toml")


def read_text(text: str, source: str, form: Format = "toml") -> PlanarScene | SpatialScene:
    """Checked document of a scene text; `source` names it in messages.

    Raises
    ------
    SceneError
        As `read_file`.
    """
    if len(text) > MOST_BYTES:
        raise _too_large(source, len(text))
    data = _parsed(text, source, form)
    if _depth(data) > DEEPEST:
        raise _plain(source, f"tables and lists are nested deeper than {DEEPEST}", "flatten the scene")
    try:
        return DOCUMENT.validate_python(data)
    except ValidationError as error:
        raise scene_error(error, data, line_map(text, form), source) from None


def line_map(text: str, form: Format) -> Mapping[KeyPath, int]:
    """Line of every key of a text that has been read."""
    return json_lines(text) if form == "json" else toml_lines(text)


def _parsed(text: str, source: str, form: Format) -> Any:
    try:
        if form == "json":
            return json.loads(text, object_pairs_hook=_without_doubles)
        return tomllib.loads(text)
    except RecursionError:
        raise _plain(
            source, f"tables and lists are nested deeper than {DEEPEST}", "flatten the scene"
        ) from None
    except json.JSONDecodeError as error:
        raise _plain(source, f"not JSON: {error.msg}", "correct the JSON there", error.lineno) from None
    except ValueError as error:
        message = (
            str(error) if "int_max_str_digits" not in str(error) else "a number of more than 4300 digits"
        )
        found = re.search(r"\(at line (\d+), column (\d+)\)", message)
        line = int(found[1]) if found else (text.count("\n") + 1 if "end of document" in message else None)
        message = re.sub(r" \(at .*\)$", "", message)
        column = f" at column {found[2]}" if found else ""
        raise _plain(
            source, f"not {form.upper()}: {message}{column}", f"correct the {form.upper()} there", line
        ) from None


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) != len(pairs):
        names = [name for name, _ in pairs]
        double = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"key {double!r} is given twice")
    return table


def _depth(data: Any) -> int:
    """Nesting depth, counted level by level so that no document can exhaust the stack."""
    depth, level = 0, [data]
    while level and depth <= DEEPEST:
        depth += 1
        level = [
            item
            for holder in level
            if isinstance(holder, (dict, list))
            for item in (holder.values() if isinstance(holder, dict) else holder)
            if isinstance(item, (dict, list))
        ]
    return depth


def _too_large(source: str, size: int) -> SceneError:
    return _plain(
        source,
        f"scene of {size / 2**20:.1f} MiB is larger than {MOST_BYTES // 2**20} MiB",
        "put geometry into mesh files and copies into repeat",
    )


def _plain(source: str, problem: str, remedy: str, line: int | None = None) -> SceneError:
    place = f"{source}:{line}" if line is not None else source
    return SceneError(f"{place}: {problem}; {remedy}", path=source, line=line, remedy=remedy)
