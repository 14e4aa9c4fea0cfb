"""The JSON Schema of scene files, made from the models that check them (draft 2020-12)."""

from __future__ import annotations

import json
from typing import Any

from carom.scene.document import DOCUMENT


def scene_schema() -> dict[str, Any]:
    """The schema as a plain table; units stand in the descriptions."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "carom scene, version 1",
        **DOCUMENT.json_schema(),
    }


def scene_schema_text() -> str:
    """The schema as it is kept in the repository and printed by ``carom schema``."""
    return json.dumps(scene_schema(), indent=2, ensure_ascii=False) + "\n"
