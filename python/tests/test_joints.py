"""Joints in Python: what is added, read, refused, recorded and stated in scene files."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import carom
from carom import planar, spatial
from carom.check_run import check_run
from carom.errors import BuildError, SceneError, StepError
from carom.scene import load_scene

G = 9.81


def beam(space: Any, **settings: Any) -> Any:
    """A beam of 1 m and 3 kg, from the origin along x."""
    w = space.World(dt=1e-2, scheme="events", **settings)
    middle = np.zeros(len(w.gravity))
    middle[0] = 0.5
    shape = space.Box(1.0, 0.1) if space is planar else space.Box(1.0, 0.1, 0.1)
    w.add_body("beam", shape, mass=3.0, position=middle)
    return w


def up(space: Any, value: float) -> list[float]:
    return [0.0] * (1 if space is planar else 2) + [value]


@pytest.mark.parametrize("space", [planar, spatial])
def test_a_cantilever_tells_its_reaction(space: Any) -> None:
    w = beam(space)
    joint = w.add_fixed_joint("wall", "beam", point=up(space, 0.0))
    report = w.step()
    assert joint.kind == "fixed"
    assert joint.bodies == ("beam", None)
    assert joint.length is None
    np.testing.assert_allclose(joint.reaction.force, up(space, 3 * G), atol=1e-9)
    torque = joint.reaction.torque if space is planar else -joint.reaction.torque[1]
    assert torque == pytest.approx(1.5 * G, abs=1e-9)
    np.testing.assert_array_equal(report.joints["wall"].force, joint.reaction.force)
    assert joint.error < 1e-14
    assert report.ledger["constraint"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("space", [planar, spatial])
@pytest.mark.parametrize("scheme", ["events", "fixed_step"])
def test_a_pendulum_keeps_its_length(space: Any, scheme: str) -> None:
    w = space.World(dt=1e-3, scheme=scheme, solver="exact", tolerance=1e-12)
    w.add_body("bob", mass=2.0, position=up(space, 1.0)[::-1])
    rod = w.add_distance_joint("rod", "bob", anchor_b=up(space, 0.0))
    start = w.energy["total"]
    for _ in range(500):
        w.step()
    assert rod.length == 1.0
    assert np.linalg.norm(w.position[0]) == pytest.approx(1.0, abs=1e-13)
    assert w.energy["total"] == pytest.approx(start, abs=1e-4)
    on_a, on_b = rod.places
    np.testing.assert_allclose(on_a, w["bob"].position)
    np.testing.assert_allclose(on_b, 0.0)


def test_joints_come_and_go_by_name() -> None:
    w = beam(planar)
    w.add_body("other", planar.Box(1.0, 0.1), mass=1.0, position=(1.5, 0.0))
    w.add_point_joint("pin", "beam", "other", point=(1.0, 0.0))
    w.add_point_joint("pivot", w["beam"], anchor_a=(-0.5, 0.0), anchor_b=(0.0, 0.0))
    assert list(w.joints) == ["pin", "pivot"]
    assert "point joint 'pin' of 'beam' and 'other'" in repr(w.joints["pin"])
    with pytest.raises(BuildError, match="is held by joint 'pin'; remove the joint first"):
        w.remove("other")
    w.remove_joint(w.joints["pin"])
    w.remove("other")
    assert list(w.joints) == ["pivot"]
    again = copy.deepcopy(w)
    w.step()
    again.step()
    np.testing.assert_array_equal(w.position, again.position)
    with pytest.raises(BuildError, match="did you mean 'pivot'"):
        w.remove_joint("pivo")


@pytest.mark.parametrize(
    ("arguments", "field", "text"),
    [
        ({"a": "bean", "point": (0, 0)}, "a", "did you mean 'beam'"),
        ({"a": 3, "point": (0, 0)}, "a", "must be a name"),
        ({"a": "beam"}, "anchor_a", "is missing; give the place"),
        ({"a": "beam", "point": (0, 0, 0)}, "point", "give"),
        ({"a": "beam", "point": (0, 0), "anchor_a": (0, 0)}, "anchor_a", "must not be given beside point"),
        ({"a": "beam", "point": (math.nan, 0)}, "point", "finite"),
        ({"a": "beam", "anchor_a": (0, 0), "anchor_b": (3, 0)}, "anchor_b", "more than 0.01 of its size"),
        ({"a": "beam", "b": "beam", "point": (0, 0)}, "b", "must be another body"),
    ],
)
def test_wrong_joints_are_refused(arguments: dict[str, Any], field: str, text: str) -> None:
    w = beam(planar)
    with pytest.raises(BuildError, match=text) as caught:
        w.add_point_joint("pivot", **arguments)
    assert caught.value.field == field
    assert not w.joints


def test_a_torn_joint_refuses_the_step() -> None:
    w = beam(planar)
    w.add_point_joint("pivot", "beam", point=(0, 0))
    w.step()
    w.position[0] += 1.0
    with pytest.raises(StepError, match=r"joint 'pivot': its anchors are .* m apart") as caught:
        w.step()
    assert caught.value.joint == "pivot"


def test_a_run_with_joints_is_recorded_and_checked(tmp_path: Path) -> None:
    w = beam(planar)
    w.add_point_joint("pivot", "beam", point=(0, 0))
    path = tmp_path / "run.h5"
    w.run(0.2, out=path)
    report = check_run(path)
    assert not [check.name for check in report.checks if check.verdict == "failed"]
    import h5py

    with h5py.File(path) as file:
        assert '"pivot"' in file["joints"].asstr()[()]


SCENE = """
schema_version = 1
space = "planar"
[world]
scheme = "events"
[[body]]
name = "bar"
shape = { type = "box", size = [1.0, 0.1] }
mass = 1.0
position = [0.5, 0.0]
[[joint]]
name = "pivot"
kind = "point"
a = "bar"
point = [0.0, 0.0]
"""


def test_scene_files_state_joints(tmp_path: Path) -> None:
    path = tmp_path / "bar.toml"
    path.write_text(SCENE)
    w = load_scene(path).build()
    assert w.joints["pivot"].bodies == ("bar", None)


@pytest.mark.parametrize(
    ("old", "new", "line", "text"),
    [
        ('a = "bar"', 'a = "ba"', 13, "did you mean 'bar'"),
        ('kind = "point"', 'kind = "distance"', None, "give anchor_a and anchor_b"),
        ('name = "pivot"', 'name = "pivot"\nlength = 2.0', None, "leave it out"),
        ('kind = "point"', 'kind = "hinge"', 12, "point"),
    ],
)
def test_wrong_joints_of_scene_files_are_told_with_their_line(
    tmp_path: Path, old: str, new: str, line: int | None, text: str
) -> None:
    path = tmp_path / "bar.toml"
    path.write_text(SCENE.replace(old, new))
    with pytest.raises(SceneError, match=text) as caught:
        load_scene(path).build()
    if line is not None:
        assert caught.value.line is not None


@pytest.mark.parametrize("name", ["double_pendulum_planar", "four_bar_linkage_spatial"])
def test_named_scenes_with_joints_run(name: str) -> None:
    w = carom.build_scene(name)
    for _ in range(100):
        w.step()
    assert max(joint.error for joint in w.joints.values()) < 1e-12
