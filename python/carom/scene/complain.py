"""Turns refusals of the models into errors that a stranger can act on: file, line, body, key, value, remedy.

Form: ``crates.toml:12: body 'crate3': mass must be > 0, got -1; give mass [kg]``. The allowed keys and the
meaning of each field come from the JSON Schema, which is made from the same models. Knows no worlds.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from pydantic import ValidationError

from carom.errors import SceneError
from carom.scene.document import DOCUMENT
from carom.scene.lines import KeyPath, line_of
from carom.scene.suggest import did_you_mean

_MOST_PROBLEMS_SHOWN = 8
_WORDS = {"greater_than": ">", "greater_than_equal": ">=", "less_than": "<", "less_than_equal": "<="}
_KINDS = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text in quotes",
    "tuple_type": "a list of numbers",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
}


@dataclass(frozen=True)
class Problem:
    """One refusal, ready to be told."""

    line: int | None
    where: str
    key: str
    body: str | None
    value: Any
    problem: str
    remedy: str

    def sentence(self, source: str) -> str:
        """``file:line: where: problem; remedy``."""
        place = f"{source}:{self.line}" if self.line is not None else source
        where = f"{self.where}: " if self.where else ""
        return f"{place}: {where}{self.problem}; {self.remedy}"


def scene_error(error: ValidationError, data: Any, lines: Mapping[KeyPath, int], source: str) -> SceneError:
    """The error to raise for a document that the models refuse; `source` names the file in messages."""
    problems = [_problem(entry, data, lines) for entry in error.errors(include_url=False)]
    problems.sort(key=lambda problem: problem.line if problem.line is not None else 0)
    first = problems[0]
    told = [problem.sentence(source) for problem in problems[:_MOST_PROBLEMS_SHOWN]]
    if len(problems) > _MOST_PROBLEMS_SHOWN:
        told.append(f"... and {len(problems) - _MOST_PROBLEMS_SHOWN} more problems")
    return SceneError(
        "\n".join(told),
        path=source,
        line=first.line,
        key=first.key,
        body=first.body,
        field=first.key,
        value=first.value,
        remedy=first.remedy,
    )


def shown(value: Any) -> str:
    """A value as it is quoted in a message: short, on one line."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints
        return "a value too long to show"
    return text if len(text) <= 60 else text[:57] + "..."


def _problem(entry: Any, data: Any, lines: Mapping[KeyPath, int]) -> Problem:
    location = tuple(entry["loc"])
    context = entry.get("ctx", {})
    path = data_path(location, data, may_be_missing=entry["type"] == "missing")
    if entry["type"] in ("union_tag_invalid", "union_tag_not_found") and isinstance(
        _value_at(data, path), dict
    ):
        path = (*path, _tag_key(entry))
    if entry["type"] == "scene_rule" and context["key"]:
        path = (*path, *(int(part) if part.isdigit() else part for part in context["key"].split(".")))
    problem, remedy = _words(entry, location, path, data)
    where, body, rest = _whereabouts(path, data)
    key = _dotted(rest)
    return Problem(line_of(lines, path), where, key, body, _value_at(data, path), problem, remedy)


def data_path(location: KeyPath, data: Any, may_be_missing: bool) -> KeyPath:
    """The place in the document that a location of pydantic means; tags of unions are left out."""
    path: list[str | int] = []
    for position, part in enumerate(location):
        if position == 0 and isinstance(data, dict) and part == data.get("space"):
            continue
        in_table = isinstance(data, dict) and part in data
        in_list = isinstance(data, list) and isinstance(part, int) and 0 <= part < len(data)
        if in_table or in_list:
            data = data[part]
            path.append(part)
        elif may_be_missing and position == len(location) - 1 and isinstance(part, str):
            path.append(part)
    return tuple(path)


def _value_at(data: Any, path: KeyPath) -> Any:
    for part in path:
        try:
            data = data[part]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _dotted(path: KeyPath) -> str:
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _whereabouts(path: KeyPath, data: Any) -> tuple[str, str | None, KeyPath]:
    """What the path stands in, in words; the body's name if any; the rest of the path."""
    if len(path) >= 2 and path[0] == "body" and isinstance(path[1], int):
        name = _value_at(data, (*path[:2], "name"))
        if isinstance(name, str) and len(name) <= 200:
            return f"body {name!r}", name, path[2:]
        return f"body number {path[1] + 1}", None, path[2:]
    if len(path) >= 2 and path[0] == "materials":
        return f"material {path[1]!r}", None, path[2:]
    if len(path) >= 2 and path[0] == "world":
        return "[world]", None, path[1:]
    return "", None, path


def _words(entry: Any, location: KeyPath, path: KeyPath, data: Any) -> tuple[str, str]:
    """Problem and remedy for one entry of pydantic's list."""
    kind, context, value = entry["type"], entry.get("ctx", {}), entry["input"]
    where, _, rest = _whereabouts(path, data)
    key = _dotted(rest) or ("it" if where else "the document")
    meaning = _meaning(location)
    give = f"give {meaning}" if meaning else "see `carom schema`"
    got = f"got {shown(value)}"
    if kind == "scene_rule":
        return context["problem"], context["remedy"]
    if kind == "extra_forbidden":
        return _unknown_key(location, path)
    if kind == "missing":
        if isinstance(location[-1], int):
            return _wrong_length(location[:-1], path, data)
        choices = _choices(location)
        return f"{key} is missing", f"give one of {', '.join(choices)}" if len(
            choices
        ) > 1 else f"give {meaning or key}"
    if kind in ("too_short", "too_long"):
        if _node(location).get("prefixItems"):
            return _wrong_length(location, path, data)
        bound = context.get("min_length", context.get("max_length"))
        few = "at least" if kind == "too_short" else "at most"
        return f"{key} must have {few} {bound} entries, got {len(value)}", give
    if kind == "finite_number":
        return f"{key} must be a finite number, {got}", give
    if kind in _WORDS:
        bound = next(context[name] for name in ("gt", "ge", "lt", "le") if name in context)
        return f"{key} must be {_WORDS[kind]} {bound:g}, {got}", give
    if kind in _KINDS:
        return f"{key} must be {_KINDS[kind]}, {got}", give
    if kind in ("literal_error", "union_tag_invalid", "union_tag_not_found"):
        return _unknown_choice(entry, location, key, value)
    return f"{key}: {entry['msg'][0].lower()}{entry['msg'][1:]}, {got}", give


def _unknown_key(location: KeyPath, path: KeyPath) -> tuple[str, str]:
    allowed = sorted(_node(location[:-1]).get("properties", {}))
    word = str(path[-1]) if path else str(location[-1])
    problem = f"unknown key {word!r}"
    if word == "mesh" and location[0] == "planar":
        return problem, 'meshes exist in space only; in the plane use shape = { type = "convex_polygon", .. }'
    return problem, did_you_mean(word, allowed) or f"allowed here: {', '.join(allowed)}"


def _wrong_length(location: KeyPath, path: KeyPath, data: Any) -> tuple[str, str]:
    needed = len(_node(location).get("prefixItems", []))
    value = _value_at(data, path)
    count = len(value) if isinstance(value, list) else 0
    key = _dotted(_whereabouts(path, data)[2])
    meaning = _meaning(location)
    give = f"give {meaning}" if meaning else f"give {needed} numbers"
    return f"{key} needs {needed} entries, got {count}: {shown(value)}", give


def _tag_key(entry: Any) -> str:
    """The key that decides between the members of a union: type or space."""
    return str(entry.get("ctx", {}).get("discriminator", "type")).strip("'")


def _unknown_choice(entry: Any, location: KeyPath, key: str, value: Any) -> tuple[str, str]:
    """A word that is none of the allowed ones, or the lack of one that decides what the rest means."""
    choices = _choices(location)
    if entry["type"] == "union_tag_not_found":
        if not isinstance(value, dict):
            return f"{key} must be a table, got {shown(value)}", 'write e.g. { type = "box", size = [..] }'
        return f"{key} is missing", f"give one of {', '.join(choices)}"
    if entry["type"] == "union_tag_invalid":
        value = value.get(_tag_key(entry))
    if key == "schema_version":
        return (
            f"schema_version {shown(value)} is unknown",
            "write schema_version = 1, or install the carom that wrote it",
        )
    known = f"known: {', '.join(choices)}"
    hint = did_you_mean(value, choices) if isinstance(value, str) else ""
    return f"unknown {key} {shown(value)}", f"{hint} {known}".strip()


def _choices(location: KeyPath) -> list[str]:
    """The words that are allowed at a location."""
    found: list[str] = []
    for branch in _branches(_at(location)):
        found += branch.get("enum", []) + list(branch.get("discriminator", {}).get("mapping", {}))
        found += [branch["const"]] if "const" in branch else []
    return list(dict.fromkeys(str(word) for word in found))


def _meaning(location: KeyPath) -> str:
    """First clause of the field's description, ready to follow "give"; inside a vector, the vector's."""
    node = _node(location)
    while location and not node.get("description"):
        location = location[:-1]
        node = _node(location)
    if not location:
        return ""
    clause = re.split(r"[.;:]( |$)", str(node.get("description", "")))[0]
    return clause[:1].lower() + clause[1:]


@cache
def _schema() -> dict[str, Any]:
    return DOCUMENT.json_schema()


def _resolved(node: dict[str, Any]) -> dict[str, Any]:
    """The node with its reference followed; the field's own description wins."""
    while "$ref" in node:
        target = _schema()["$defs"][node["$ref"].rsplit("/", 1)[-1]]
        node = {**target, **{key: value for key, value in node.items() if key != "$ref"}}
    return node


def _branches(node: dict[str, Any]) -> list[dict[str, Any]]:
    """The node and, for unions, everything that it may be."""
    node = _resolved(node)
    found = [node]
    for option in [*node.get("anyOf", []), *node.get("oneOf", []), *node.get("allOf", [])]:
        found.extend(_branches(option))
    return found


def _at(location: KeyPath) -> dict[str, Any]:
    """The schema node that a location of pydantic (tags included) means; empty when there is none."""
    node: dict[str, Any] = _schema()
    for part in location:
        following = None
        for branch in _branches(node):
            following = _child(branch, part)
            if following is not None:
                break
        if following is None:
            return {}
        node = following
    return node


def _node(location: KeyPath) -> dict[str, Any]:
    """The same with the members of unions merged into one table."""
    merged: dict[str, Any] = {}
    for branch in _branches(_at(location)):
        for key, value in branch.items():
            merged.setdefault(key, value)
    return merged


def _child(node: dict[str, Any], part: str | int) -> dict[str, Any] | None:
    if isinstance(part, int):
        items = node.get("prefixItems", [])
        found = items[part] if part < len(items) else node.get("items")
        return found if isinstance(found, dict) else None
    mapping = node.get("discriminator", {}).get("mapping", {})
    if part in mapping:
        return {"$ref": mapping[part]}
    found = node.get("properties", {}).get(part, node.get("additionalProperties"))
    return found if isinstance(found, dict) else None
