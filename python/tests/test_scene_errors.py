"""Bad scene files: each error names file, line, body or table, key, value and what to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from carom.errors import SceneError
from carom.scene import load_scene

HEAD = 'schema_version = 1\nspace = "planar"\n'
SPATIAL = 'schema_version = 1\nspace = "spatial"\n'
BOX = 'shape = { type = "box", size = [1, 1] }\n'


@dataclass(frozen=True)
class Bad:
    """A bad scene and what its error must say."""

    text: str
    line: int | None
    key: str | None
    value: Any
    says: str
    remedy: str
    body: str | None = None


BAD = {
    "unknown key in a body": Bad(
        HEAD + f'[[body]]\nname = "crate"\n{BOX}density = 2\nfrction = 0.5\n',
        7, "frction", 0.5, "body 'crate': unknown key 'frction'", "did you mean 'friction'?", "crate"),
    "unknown table": Bad(
        HEAD + f'[wrld]\n[[body]]\nname = "crate"\n{BOX}density = 2\n',
        3, "wrld", {}, "unknown key 'wrld'", "did you mean 'world'?"),
    "negative mass": Bad(
        HEAD + f'[[body]]\nname = "crate3"\n{BOX}mass = -1\n',
        6, "mass", -1, "body 'crate3': mass must be > 0, got -1", "give mass [kg]", "crate3"),
    "not a number": Bad(
        HEAD + '[[body]]\nname = "crate"\nmass = 1\nposition = [0, nan]\n',
        6, "position[1]", None, "position[1] must be a finite number, got nan", "[m]", "crate"),
    "infinite": Bad(
        HEAD + '[world]\ndt = inf\n[[body]]\nname = "crate"\nmass = 1\n',
        4, "dt", float("inf"), "[world]: dt must be a finite number, got inf", "give time step [s]"),
    "text for a number": Bad(
        HEAD + '[[body]]\nname = "crate"\nmass = "heavy"\n',
        5, "mass", "heavy", "mass must be a number, got 'heavy'", "give mass [kg]", "crate"),
    "three numbers in the plane": Bad(
        HEAD + '[[body]]\nname = "crate"\nmass = 1\nposition = [0, 1, 2]\n',
        6, "position", [0, 1, 2], "position needs 2 entries, got 3", "position of the centre of mass",
        "crate"),
    "mistyped shape": Bad(
        HEAD + '[[body]]\nname = "ball"\ndensity = 1\nshape = { type = "circel", radius = 1 }\n',
        6, "shape.type", "circel", "unknown shape.type 'circel'", "did you mean 'circle'?", "ball"),
    "shape without its size": Bad(
        SPATIAL + '[[body]]\nname = "ball"\ndensity = 1\n[body.shape]\ntype = "sphere"\n',
        6, "shape.radius", None, "shape.radius is missing", "give radius [m]", "ball"),
    "shape of the other space": Bad(
        HEAD + '[[body]]\nname = "ball"\ndensity = 1\nshape = { type = "sphere", radius = 1 }\n',
        6, "shape.type", "sphere", "unknown shape.type 'sphere'", "circle", "ball"),
    "mistyped solver": Bad(
        HEAD + '[world]\nsolver = "pqs"\n[[body]]\nname = "crate"\nmass = 1\n',
        4, "solver", "pqs", "[world]: unknown solver 'pqs'", "did you mean 'pgs'?"),
    "restitution above one": Bad(
        HEAD + f'[[body]]\nname = "crate"\n{BOX}density = 2\nrestitution = 1.5\n',
        7, "restitution", 1.5, "restitution must be <= 1, got 1.5", "0 to 1", "crate"),
    "unknown material": Bad(
        HEAD + f'[materials.wood]\ndensity = 600\n[[body]]\nname = "crate"\n{BOX}material = "wod"\n',
        8, "material", "wod", "unknown material 'wod'", "did you mean 'wood'?", "crate"),
    "name taken twice": Bad(
        HEAD + '[[body]]\nname = "a"\nmass = 1\n[[body]]\nmass = 1\nname = "a"\n',
        8, "name", "a", "name 'a' is taken by body 1", "choose another", "a"),
    "dynamic body without mass": Bad(
        HEAD + f'[[body]]\nname = "crate"\n{BOX}',
        3, "", None, "needs its mass or density", "give density [kg/m^2], mass [kg]", "crate"),
    "mass and density": Bad(
        HEAD + f'[[body]]\nname = "crate"\n{BOX}mass = 1\ndensity = 2\n',
        7, "density", 2, "mass and density are both given", "keep one", "crate"),
    "dynamic half-plane": Bad(
        HEAD + '[[body]]\nname = "floor"\nshape = { type = "half_plane", normal = [0, 1] }\ndensity = 1\n',
        5, "shape.type", "half_plane", "has no volume and so no mass", 'set kind = "static"', "floor"),
    "moving static body": Bad(
        HEAD + f'[[body]]\nname = "wall"\nkind = "static"\n{BOX}velocity = [1, 0]\n',
        7, "velocity", [1, 0], "velocity has no meaning for a static body", 'kind = "kinematic"', "wall"),
    "ambiguous rotation": Bad(
        HEAD + f'[[body]]\nname = "crate"\n{BOX}density = 1\nrotation = {{ degrees = 30, angle = 1 }}\n',
        7, "rotation", {"degrees": 30, "angle": 1}, "exactly one of angle, degrees", "degrees = 30", "crate"),
    "zero quaternion": Bad(
        SPATIAL + '[[body]]\nname = "b"\ndensity = 1\nrotation = [0, 0, 0, 0]\n'
        'shape = { type = "sphere", radius = 1 }\n',
        6, "rotation.quaternion", None, "quaternion must not be zero", "give a direction", "b"),
    "mesh in the plane": Bad(
        HEAD + '[[body]]\nname = "gear"\ndensity = 1\nmesh = { file = "gear.obj", as = "hull" }\n',
        6, "mesh", {"file": "gear.obj", "as": "hull"}, "unknown key 'mesh'", "meshes exist in space", "gear"),
    "dynamic static mesh": Bad(
        SPATIAL + '[[body]]\nname = "gear"\ndensity = 1\nmesh = { file = "gear.obj", as = "static" }\n',
        6, "mesh.as", "static", "cannot belong to a dynamic body", 'as = "hull"', "gear"),
    "repeat with too few steps": Bad(
        HEAD + '[[body]]\nname = "a"\nmass = 1\nrepeat = { count = [2, 3], step = [[1, 0]] }\n',
        6, "repeat.step", [[1, 0]], "one step for each count, got 1 for 2", "count = [4, 3]", "a"),
    "repeat without end": Bad(
        HEAD + '[[body]]\nname = "a"\nmass = 1\nrepeat = { count = [9999, 9999], step = [[1, 0], [0, 1]] }\n',
        6, "repeat.count", [9999, 9999], "makes 99980001 bodies", "200000", "a"),
    "later schema": Bad(
        'schema_version = 2\nspace = "planar"\n[[body]]\nname = "a"\nmass = 1\n',
        1, "schema_version", 2, "schema_version 2 is unknown", "write schema_version = 1"),
    "no schema": Bad(
        'space = "planar"\n[[body]]\nname = "a"\nmass = 1\n',
        None, "schema_version", None, "schema_version is missing", "give version of this format"),
    "mistyped space": Bad(
        'schema_version = 1\n\nspace = "planer"\n',
        3, "space", "planer", "unknown space 'planer'", "did you mean 'planar'?"),
    "nothing": Bad("", None, "space", None, "space is missing", "give one of planar, spatial"),
    "no bodies": Bad(HEAD + "body = []\n", 3, "body", [], "must have at least 1 entries", "give bodies"),
    "broken TOML": Bad(HEAD + '[[body]]\nname = "a\n', 4, None, None, "not TOML", "correct the TOML"),
    "key given twice": Bad(HEAD + 'name = "a"\nname = "b"\n', 4, None, None, "not TOML", "correct the TOML"),
    "too deep": Bad(HEAD + "name = " + "[" * 40 + "]" * 40, None, None, None, "deeper than 32", "flatten"),
    "far too deep": Bad(HEAD + "x = " + "[" * 5000 + "]" * 5000, None, None, None, "deeper than", "flatten"),
    "deep dotted key": Bad(HEAD + "a." * 3000 + "b = 1", None, None, None, "deeper than 32", "flatten"),
    "endless number": Bad(HEAD + "duration = " + "9" * 5000, None, None, None, "4300 digits", "correct the"),
    "huge number": Bad(
        HEAD + "duration = " + "9" * 400 + '\n[[body]]\nname = "a"\nmass = 1\n',
        3, "duration", int("9" * 400), "duration must be a number", "simulated time"),
    "too large": Bad("#" * (5 * 2**20), None, None, None, "larger than 4 MiB", "mesh files"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD.values(), ids=BAD.keys())
def test_bad_scene_is_refused_with_file_line_body_key_value_and_remedy(case: Bad, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(case.text)
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    error, text = caught.value, str(caught.value)
    assert text.startswith(f"{path}:{case.line}: " if case.line is not None else f"{path}: "), text
    assert error.path == str(path)
    assert error.line == case.line
    assert case.says in text
    assert case.remedy in text
    assert case.remedy in str(error.remedy)
    assert error.body == case.body
    if case.key is not None:
        assert error.key == case.key
    if case.value is not None:
        assert error.value == case.value
    assert len(text) < 1000
    assert "\n" not in text


def test_all_problems_of_a_file_are_told_in_the_order_of_lines(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(HEAD + 'duration = 0\n[[body]]\nname = "a"\nmass = -1\nfrction = 2\n')
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    lines = str(caught.value).splitlines()
    assert [line.removeprefix(str(path)).split(":")[1] for line in lines] == ["3", "6", "7"]


def test_many_problems_are_counted_not_poured_out(tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(HEAD + "".join(f'[[body]]\nname = "b{i}"\nmass = -1\n' for i in range(100)))
    with pytest.raises(SceneError, match=r"and 92 more problems"):
        load_scene(path)


@pytest.mark.parametrize(
    ("text", "line", "says"),
    [
        (
            '{"schema_version": 1,\n "space": "planar",\n "body": [{"name": "a",\n "mass": NaN}]}',
            4,
            "finite number",
        ),
        (
            '{"schema_version": 1,\n "space": "planar",\n "body": [{"name": "a", "mass": 1, "mass": 2}]}',
            None,
            "twice",
        ),
        ('{"schema_version": 1,\n', 2, "not JSON"),
        ("[" * 100_000, None, "nested deeper"),
        ("[]", None, "must be a table"),
    ],
)
def test_bad_json_is_refused_as_bad_toml_is(text: str, line: int | None, says: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(SceneError, match=says) as caught:
        load_scene(path)
    assert caught.value.line == line


def test_files_that_are_no_scenes_are_refused(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"a = 1\nname = '\xff\xfe'\n")
    (tmp_path / "scene.yaml").write_text("a: 1")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "pile.toml").write_text("")
    for name, says in (
        ("binary.toml", "binary.toml:2: byte 0xff is not UTF-8; save the file as UTF-8"),
        ("scene.yaml", "unknown kind of scene file '.yaml'; give a .toml or .json file"),
        ("folder.toml", "cannot be read"),
        ("pil.toml", "did you mean"),
    ):
        with pytest.raises(SceneError) as caught:
            load_scene(tmp_path / name)
        assert says in str(caught.value)


def test_unknown_scene_name_suggests_the_nearest() -> None:
    with pytest.raises(
        SceneError, match=r"unknown scene 'first_step_planar'; did you mean 'first_steps_planar'\?"
    ):
        load_scene("first_step_planar")
