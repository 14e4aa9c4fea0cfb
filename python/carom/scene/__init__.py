"""Scene files: TOML or JSON, checked against models with units, built into worlds.

>>> from carom.scene import scene_from_text
>>> scene = scene_from_text('''
... schema_version = 1
... space = "planar"
... [[body]]
... name = "ball"
... shape = { type = "circle", radius = 0.5 }
... density = 10
... ''')
>>> scene.space, scene.duration
('planar', 5.0)
"""

from carom.scene.catalogue import Scene, list_scenes, load_scene, scene_from_text
from carom.scene.document import SCHEMA_VERSION, PlanarScene, SpatialScene
from carom.scene.schema import scene_schema, scene_schema_text

__all__ = [
    "SCHEMA_VERSION",
    "PlanarScene",
    "Scene",
    "SpatialScene",
    "list_scenes",
    "load_scene",
    "scene_from_text",
    "scene_schema",
    "scene_schema_text",
]
