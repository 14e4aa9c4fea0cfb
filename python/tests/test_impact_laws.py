"""Impact laws, the energy guard and pairs of materials, as Python users meet them."""

import math
import warnings
from pathlib import Path
from typing import Any

import pytest
from spaces import Face, both

from carom import BuildError, EnergyGainError, EnergyGainWarning, SceneError, load_scene, planar
from carom.impact import LAWS


@pytest.mark.parametrize("law", LAWS)
def test_every_law_is_a_setting_and_a_class(law: str) -> None:
    w = planar.World(impact=LAWS[law]())
    assert w.impact == law
    w.impact = None
    assert w.impact is None


def test_an_unknown_law_is_refused_with_those_there_are() -> None:
    with pytest.raises(BuildError, match="impact must be one of 'generalized_reflections', 'newton'"):
        planar.World(impact="euler")


@pytest.mark.parametrize(("law", "passes_on"), [("generalized_reflections", True), ("moreau", False)])
def test_a_cradle_does_what_its_law_says(law: str, passes_on: bool) -> None:
    w = planar.World(gravity=(0, 0), impact=law, tolerance=1e-12, iterations=10_000)
    for k in range(3):
        speed = (1.0 if k == 0 else 0.0, 0.0)
        w.add_body(f"ball {k}", planar.Circle(0.1), mass=1.0, position=(0.2 * k, 0), velocity=speed,
                   friction=0.0, restitution=1.0)  # fmt: skip
    report = w.step()
    wanted = [0, 0, 1] if passes_on else [-1 / 3, 2 / 3, 2 / 3]
    assert [w[f"ball {k}"].velocity[0] for k in range(3)] == pytest.approx(wanted, abs=1e-10)
    assert report.impacts.rounds == (2 if passes_on else 1)
    assert (report.impacts.guarded, report.impacts.ended_plastic) == (0, 0)


def trap(**settings: Any) -> planar.World:
    """A rod at 45 degrees that strikes the floor obliquely: Newton's law with friction gains energy there."""
    w = planar.World(gravity=(0, 0), dt=1e-6, tolerance=1e-12, iterations=10_000, **settings)
    w.add_static("floor", planar.HalfPlane((0, 1)), friction=0.5, restitution=1.0)
    tip, half = 1e-3, math.sqrt(0.5)
    velocity = (0.5, -math.sqrt(0.75))
    w.add_body("rod", planar.Circle(tip), mass=1.0, inertia=1 / 3, center_of_mass=(half, half - tip),
               position=(0, half), velocity=velocity, friction=0.5, restitution=1.0)  # fmt: skip
    return w


GAIN = 0.5 * 0.5 * (1.5 * 2 * math.sqrt(0.75) - 2.5 * 0.5) / 4


def test_a_clamped_impact_gains_nothing_and_is_counted() -> None:
    w = trap()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        report = w.step()
    assert w.energy["total"] <= 0.5 * (1 + 1e-14)
    assert report.impacts[:3] == (1, 1, 0)
    assert report.impacts.gain == pytest.approx(GAIN, abs=1e-10)
    assert report.impacts.gaining_contact == ("floor", "rod")
    assert [f.topic for f in report.findings][-1] == "energy_gain"


@pytest.mark.parametrize("how", ["step", "run"])
def test_warn_keeps_the_gain_and_warns_once(how: str) -> None:
    w = trap(energy_guard="warn")
    go_on = (lambda: w.run(1e-5)) if how == "run" else w.step
    with pytest.warns(EnergyGainWarning, match="'floor' and 'rod'") as caught:
        go_on()
    w.step()
    assert len(caught) == 1
    warning = caught[0].message
    assert isinstance(warning, EnergyGainWarning)
    assert warning.findings[0].value == pytest.approx(GAIN, abs=1e-10)
    assert w.energy["total"] == pytest.approx(0.5 + GAIN, abs=1e-10)


def test_raise_refuses_the_step_and_names_the_bodies() -> None:
    w = trap(energy_guard="raise")
    before = w.snapshot()
    with pytest.raises(
        EnergyGainError, match="bodies 'floor' and 'rod': impact law 'newton' would gain"
    ) as caught:
        w.step()
    assert caught.value.field == "energy_guard"
    assert bytes(w.snapshot()) == bytes(before)


@both
def test_a_pair_of_materials_overrides_the_mix(face: Face) -> None:
    w = face.world()
    w.add_static("floor", face.ground(), friction=0.9, material="ice")
    w.add_body("ball", face.ball(0.1), mass=1.0, friction=0.4, material="steel")
    assert (w["ball"].material, w["floor"].material) == ("steel", "ice")
    w.set_pair("steel", "ice", friction=0.02, restitution=0.1)
    assert w.pairs == {("ice", "steel"): {"friction": 0.02, "restitution": 0.1}}
    snapshot, said = w.snapshot(), w.pairs
    w.remove_pair("steel", "ice")
    w.restore(snapshot)
    assert w.pairs == said
    w.step()
    assert w.last_problem()[0].friction.tolist() == [0.02]
    w.remove_pair("ice", "steel")
    assert w.pairs == {}


@both
def test_impossible_pairs_are_refused(face: Face) -> None:
    w = face.world()
    w.add_static("floor", face.ground(), material="ice")
    with pytest.raises(BuildError, match="material is unknown: 'iec'; did you mean 'ice'"):
        w.set_pair("iec", "ice", friction=0.1)
    with pytest.raises(BuildError, match="friction must be finite and >= 0, got -1"):
        w.set_pair("ice", "ice", friction=-1.0)
    with pytest.raises(BuildError, match="has no coefficient"):
        w.set_pair("ice", "ice")
    with pytest.raises(BuildError, match="material must be a name"):
        w.add_static("wall", face.ground(), material=3)


SCENE = """
schema_version = 1
space = "planar"
[world]
impact = "generalized_reflections"
energy_guard = "raise"
[materials.steel]
friction = 0.4
[materials.ice]
friction = 0.9
[[pair]]
materials = ["steel", "ice"]
friction = 0.02
[[body]]
name = "floor"
kind = "static"
material = "ice"
shape = { type = "half_plane", normal = [0, 1] }
[[body]]
name = "ball"
material = "steel"
mass = 1.0
position = [0, 0.1]
shape = { type = "circle", radius = 0.1 }
"""


def test_a_scene_file_says_law_guard_and_pairs(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(SCENE)
    w = load_scene(file).build()
    assert (w.impact, w.energy_guard) == ("generalized_reflections", "raise")
    assert w.pairs == {("ice", "steel"): {"friction": 0.02}}


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('["steel", "ice"]', '["stele", "ice"]', "unknown material 'stele'; did you mean 'steel'"),
        ("friction = 0.02\n", "", "a pair needs a coefficient"),
        ("friction = 0.02\n", "restitution = 1.5\n", "restitution"),
        ("friction = 0.02\n", 'friction = 0.02\n[[pair]]\nmaterials = ["ice", "steel"]\nfriction = 1.0\n',
         "that of pair 1"),
    ],
)  # fmt: skip
def test_impossible_pairs_of_a_scene_are_refused(tmp_path: Path, old: str, new: str, match: str) -> None:
    file = tmp_path / "scene.toml"
    file.write_text(SCENE.replace(old, new))
    with pytest.raises(SceneError, match=match):
        load_scene(file).build()
