"""``carom scenes`` and ``carom schema``: what there is to run, and how to write more."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from carom.cli.tables import scenes_table
from carom.scene import list_scenes, scene_schema_text


def scenes_command(
    as_json: Annotated[bool, typer.Option("--json", help="Print the list as JSON.")] = False,
) -> None:
    """List the scenes that come with carom."""
    scenes = list_scenes()
    if as_json:
        keys = ("name", "space", "duration", "kind", "description")
        typer.echo(json.dumps([{key: getattr(scene, key) for key in keys} for scene in scenes], indent=2))
    else:
        scenes_table(scenes)


def schema_command() -> None:
    """Print the JSON Schema of scene files."""
    typer.echo(scene_schema_text(), nl=False)
