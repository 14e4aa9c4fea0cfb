"""The JSON Schema: current in the repository, and of one mind with the models."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from carom.scene import scene_schema, scene_schema_text
from carom.scene.catalogue import PACKAGED

SCHEMA = Path(__file__).parents[2] / "schema" / "scene.schema.json"


def test_schema_in_the_repository_is_current() -> None:
    assert SCHEMA.read_text(encoding="utf-8") == scene_schema_text(), (
        "run `carom schema > schema/scene.schema.json`"
    )


def test_every_field_of_the_schema_says_what_it_is_and_quantities_state_their_unit() -> None:
    lacking, without_unit = [], []
    tables = [
        (name, table)
        for name, model in scene_schema()["$defs"].items()
        for table in [model, *model.get("anyOf", [])]
        if "properties" in table
    ]
    assert len(tables) > 30
    for name, model in tables:
        for key, field in model["properties"].items():
            if "const" in field:
                continue
            described = field.get("description", "")
            if not described:
                lacking.append(f"{name}.{key}")
            elif _is_numeric(field) and "[" not in described and key != "schema_version":
                without_unit.append(f"{name}.{key}")
    assert lacking == []
    assert without_unit == []


def _is_numeric(field: dict[str, Any]) -> bool:
    options = [field, *field.get("anyOf", [])]
    return any(option.get("type") in ("number", "integer") for option in options)


@pytest.mark.parametrize("path", sorted(PACKAGED.glob("*.toml")), ids=lambda path: path.stem)
def test_packaged_scenes_satisfy_the_schema(path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator.check_schema(json.loads(SCHEMA.read_text(encoding="utf-8")))
    jsonschema.Draft202012Validator(scene_schema()).validate(tomllib.loads(path.read_text(encoding="utf-8")))


def test_schema_refuses_what_the_models_refuse() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft202012Validator(scene_schema())
    good: dict[str, Any] = {"schema_version": 1, "space": "planar", "body": [{"name": "a", "mass": 1.0}]}
    assert validator.is_valid(good)
    changes: list[dict[str, Any]] = [
        {"schema_version": 2},
        {"space": "planer"},
        {"extra": 1},
        {"body": []},
        {"duration": 0},
        {"body": [{"name": "a", "mass": -1}]},
        {"body": [{"name": "a", "mass": 1, "frction": 1}]},
    ]
    for change in changes:
        assert not validator.is_valid({**good, **change}), change
