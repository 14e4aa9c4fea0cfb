"""What the installed package makes of the playground's scenes: reads requests as lines of JSON, each
``{"load": {"text" | "name", "settings"}, "steps": n}``, and writes FNV-1a of the motion's bits, as
`crates/playground/src/fingerprint.rs` has it; of ``{.., "bodies": true}`` what the bodies are instead. Scene
files go through Python's reader.
"""

import json
import sys
from typing import Any

import numpy as np

from carom.scene import load_scene, scene_from_text

BEGIN, FACTOR, ALL = 0xCBF29CE484222325, 0x100000001B3, 2**64 - 1


def fingerprint(world: Any) -> str:
    """One number for the bits of positions, rotations, velocities and angular velocities, in hexadecimal."""
    found = BEGIN
    for name in ("position", "rotation", "velocity", "angular_velocity"):
        values = np.ascontiguousarray(getattr(world, name), dtype=np.float64)
        for bits in values.view(np.uint64).ravel().tolist():
            found = ((found ^ bits) * FACTOR) & ALL
    return f"{found:016x}"


def bodies(world: Any) -> str:
    """Inverse masses [1/kg], centres of mass [m], traces of inverse inertia [1/(kg m^2)], shapes; as JSON."""
    told = []
    for body in world:
        moves = body.kind == "dynamic"
        of = body.mass_properties if moves else None
        told.append(
            {
                "inverse_mass": 1.0 / of.mass if of else 0.0,
                "center": np.asarray(of.center_of_mass).tolist() if of else [0.0, 0.0, 0.0],
                "trace": float(np.trace(np.linalg.inv(of.inertia))) if of else 0.0,
                "shape": json.loads(body.shape_text),
            }
        )
    return json.dumps(told)


def main() -> None:
    """Answers line by line."""
    for line in sys.stdin:
        asked = json.loads(line)
        load, steps = asked["load"], asked.get("steps", 0)
        if "text" in load:
            form: Any = "json" if load["text"].lstrip().startswith("{") else "toml"
            scene = scene_from_text(load["text"], form=form)
        else:
            scene = load_scene(load["name"])
        world = scene.build(**{name: value for name, value in load.get("settings", {}).items() if value})
        for _ in range(steps):
            world.step()
        print(bodies(world) if asked.get("bodies") else fingerprint(world), flush=True)


if __name__ == "__main__":
    main()
