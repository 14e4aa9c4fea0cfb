"""What tests of `carom check` share: a scene with all that a run can have, and its failed checks."""

from __future__ import annotations

from typing import Any

from carom import planar, spatial
from carom.check_run import Verdict


def failed(found: Verdict) -> dict[str, str]:
    """The failed checks, each with its worst place."""
    return {
        c.name: f"{c.value} > {c.bound} at step {c.step}, {c.where}"
        for c in found.checks
        if c.verdict == "failed"
    }


def tumbling(space: str, rule: str, dt: float = 1 / 200, **settings: Any) -> Any:
    """A box tumbles onto a floor beside a ball that rolls, with damping, a load and a moving obstacle."""
    if space == "planar":
        w: Any = planar.World(dt=dt, integrator=rule, **settings)
        w.add_static("floor", planar.HalfPlane(), friction=0.5)
        w.add_kinematic(
            "paddle", planar.Box(0.2, 1), position=(1.4, 0.6), velocity=(0.3, 0), angular_velocity=2
        )
        w.add_body("ball", planar.Circle(0.2), mass=1, position=(0, 0.5), velocity=(1, 0), angular_velocity=3,
                   friction=0.5, rolling_friction=0.01, restitution=0.3)  # fmt: skip
        w.add_body("box", planar.Box(0.4, 0.1), mass=2, position=(2.5, 0.6), velocity=(-1, 0),
                   angular_velocity=3, friction=0.5, linear_damping=0.3, angular_damping=0.2)  # fmt: skip
    else:
        w = spatial.World(dt=dt, integrator=rule, **settings)
        w.add_static("floor", spatial.HalfSpace(), friction=0.5)
        w.add_kinematic("paddle", spatial.Box(0.2, 1, 0.3), position=(1.4, 0, 0.6), velocity=(0.3, 0, 0),
                        angular_velocity=(1, 2, 0))  # fmt: skip
        w.add_body("ball", spatial.Sphere(0.2), mass=1, position=(0, 0, 0.5), velocity=(1, 0, 0),
                   angular_velocity=(1, 3, 0), friction=0.5, rolling_friction=0.01,
                   restitution=0.3)  # fmt: skip
        w.add_body("box", spatial.Box(0.4, 0.1, 0.2), mass=2, position=(2.5, 0, 0.6),
                   velocity=(-1, 0, 0), angular_velocity=(3, 5, 1), friction=0.5, linear_damping=0.3,
                   angular_damping=0.2)  # fmt: skip
    w["box"].apply_force((5.0,) + (1.0,) * (w.position.shape[1] - 1))
    return w
