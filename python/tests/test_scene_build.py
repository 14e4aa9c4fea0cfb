"""Scenes become worlds: repetition, materials, poses, meshes, and refusals that only building can find."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from carom.errors import SceneError
from carom.meshes import load_mesh
from carom.run import run_world
from carom.scene import Scene, list_scenes, load_scene, scene_from_text
from carom.scene.catalogue import PACKAGED

HEAD = 'schema_version = 1\nspace = "planar"\n'
SPATIAL = 'schema_version = 1\nspace = "spatial"\n'
BOX = 'shape = { type = "box", size = [1, 1] }\n'


def built(text: str) -> Any:
    return scene_from_text(text).build()


def test_grid_puts_copy_ij_at_i_times_the_first_and_j_times_the_second_step() -> None:
    world = built(
        HEAD + '[[body]]\nname = "b{i}_{j}"\nmass = 1\nposition = [1, 2]\n'
        "repeat = { count = [3, 2], step = [[10, 0], [0.5, 1]] }\n"
    )
    assert list(world.names) == ["b0_0", "b0_1", "b1_0", "b1_1", "b2_0", "b2_1"]
    assert np.asarray(world["b2_1"].position) == pytest.approx([21.5, 3.0])


def test_pyramid_has_one_fewer_in_each_layer() -> None:
    world = built(
        HEAD + f'[[body]]\nname = "b{{n}}"\ndensity = 1\n{BOX}position = [0, 0.5]\n'
        'repeat = { count = [4, 4], step = [[1.1, 0], [0.55, 1]], arrangement = "pyramid" }\n'
    )
    heights = [float(world[name].position[1]) for name in world.names]
    assert [heights.count(0.5 + layer) for layer in range(4)] == [4, 3, 2, 1]
    assert float(world[world.names[-1]].position[0]) != float(world[world.names[0]].position[0])


def test_pyramid_of_1275_boxes_takes_ten_lines() -> None:
    text = HEAD + (
        f'[[body]]\nname = "box{{i}}-{{j}}"\ndensity = 1\n{BOX}'
        'repeat = { count = [50, 50], step = [[1.1, 0], [0.55, 1]], arrangement = "pyramid" }\n'
    )
    assert len(built(text).names) == 1275
    assert text.count("\n") <= 10


def test_json_scene_means_the_same_as_toml() -> None:
    text = (PACKAGED / "first_steps_planar.toml").read_text()
    toml = scene_from_text(text)
    json_scene = scene_from_text(json.dumps(tomllib.loads(text)), form="json")
    runs = [run_world(scene.build(), 0.5, every=30) for scene in (toml, json_scene)]
    assert runs[0].names == runs[1].names
    assert np.array_equal(runs[0].position, runs[1].position)


def test_names_without_a_pattern_get_the_numbers_appended() -> None:
    world = built(
        HEAD + '[[body]]\nname = "b"\nmass = 1\nrepeat = { count = [2, 2], step = [[1, 0], [0, 1]] }\n'
    )
    assert list(world.names) == ["b-0-0", "b-0-1", "b-1-0", "b-1-1"]


def test_scatter_is_the_same_every_time_within_its_bounds_and_changes_with_the_seed() -> None:
    def positions(seed: int) -> np.ndarray:
        world = built(
            SPATIAL + '[[body]]\nname = "b{n}"\ndensity = 1\nshape = { type = "box", size = [1, 1, 1] }\n'
            "repeat = { count = [40], step = [[10, 0, 0]] }\n"
            f"scatter = {{ position = [1, 0.5, 0], rotation = 0.2, seed = {seed} }}\n"
        )
        assert all(
            2 * math.acos(min(1.0, abs(world[name].rotation[0]))) <= 0.2 + 1e-9 for name in world.names
        )
        return np.array([world[name].position for name in world.names])

    once, again, other = positions(1), positions(1), positions(2)
    offset = once - np.arange(40)[:, None] * [10.0, 0.0, 0.0]
    assert np.array_equal(once, again)
    assert not np.array_equal(once, other)
    assert np.abs(offset).max(axis=0) == pytest.approx([1.0, 0.5, 0.0], abs=0.1)
    assert np.all(np.abs(offset) <= [1.0, 0.5, 0.0])


def test_material_gives_what_the_body_leaves_out() -> None:
    world = built(
        HEAD + "[materials.wood]\ndensity = 3\nfriction = 0.7\nrestitution = 0.2\n"
        f'[[body]]\nname = "a"\nmaterial = "wood"\n{BOX}'
        f'[[body]]\nname = "b"\nmaterial = "wood"\ndensity = 5\n{BOX}'
        f'[[body]]\nname = "c"\nmaterial = "wood"\nmass = 7\n{BOX}'
    )
    assert [float(world[name].mass) for name in "abc"] == pytest.approx([3.0, 5.0, 7.0])


@pytest.mark.parametrize(
    "form",
    ["[0.7071067811865476, 0, 0, 0.7071067811865476]", "{ axis = [0, 0, 2], degrees = 90 }",
     "{ axis = [0, 0, 1], angle = 1.5707963267948966 }", "{ euler_xyz_degrees = [0, 0, 90] }"],
)  # fmt: skip
def test_every_form_of_a_rotation_in_space_means_the_same(form: str) -> None:
    world = built(
        SPATIAL + f'[[body]]\nname = "a"\ndensity = 1\nrotation = {form}\n'
        'shape = { type = "box", size = [1, 2, 3] }\n'
    )
    assert np.abs(world["a"].rotation) == pytest.approx(np.array([1, 0, 0, 1]) / math.sqrt(2), abs=1e-15)


def test_euler_angles_turn_about_the_fixed_x_then_y_then_z_axis() -> None:
    world = built(
        SPATIAL + '[[body]]\nname = "a"\ndensity = 1\nrotation = { euler_xyz_degrees = [90, 90, 0] }\n'
        'shape = { type = "box", size = [1, 2, 3] }\n'
    )
    assert np.asarray(world["a"].to_world([0.0, 1.0, 0.0])) == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)


@pytest.mark.parametrize("form", ["0.5235987755982988", "{ degrees = 30 }", "{ angle = 0.5235987755982988 }"])
def test_every_form_of_a_turn_in_the_plane_means_the_same(form: str) -> None:
    world = built(HEAD + f'[[body]]\nname = "a"\ndensity = 1\nrotation = {form}\n{BOX}')
    assert float(world["a"].angle) == pytest.approx(math.pi / 6, rel=1e-14)


def test_origin_places_the_shape_and_position_the_centre_of_mass() -> None:
    triangle = 'shape = { type = "convex_polygon", points = [[0, 0], [3, 0], [0, 3]] }\ndensity = 1\n'
    world = built(
        HEAD
        + f'[[body]]\nname = "a"\norigin = [10, 0]\n{triangle}'
        + f'[[body]]\nname = "b"\nposition = [10, 0]\n{triangle}'
    )
    assert np.asarray(world["a"].position) == pytest.approx([11.0, 1.0])
    assert np.asarray(world["b"].position) == pytest.approx([10.0, 0.0])


def test_settings_of_the_file_reach_the_world_and_arguments_replace_them() -> None:
    text = (
        HEAD + '[world]\ngravity = [0, -1.6]\ndt = 0.01\nsolver = "lemke"\n[[body]]\nname = "a"\nmass = 1\n'
    )
    scene = scene_from_text(text)
    settings = scene.build().settings
    assert settings["solver"] == "lemke"
    assert settings["dt"] == 0.01
    assert list(settings["gravity"]) == [0.0, -1.6]
    assert scene.build(solver="pgs", dt=0.5).settings["solver"] == "pgs"


def test_compound_parts_stand_at_their_poses() -> None:
    world = built(
        SPATIAL + '[[body]]\nname = "dumbbell"\ndensity = 1\nshape = { type = "compound", parts = [\n'
        '  { pose = { position = [-1, 0, 0] }, shape = { type = "sphere", radius = 0.2 } },\n'
        "  { pose = { position = [1, 0, 0], rotation = { axis = [0, 1, 0], degrees = 90 } }, "
        'shape = { type = "cylinder", height = 0.4, radius = 0.2 } },\n] }\n'
    )
    ball, rod = 4 / 3 * math.pi * 0.2**3, math.pi * 0.2**2 * 0.4
    assert float(world["dumbbell"].mass) == pytest.approx(ball + rod, rel=1e-12)


def test_closed_mesh_as_hull_weighs_what_the_mesh_weighs() -> None:
    (scene, folder) = _mesh_scene('mesh = { file = "meshes/mug.glb", as = "hull" }')
    world = scene.build()
    solid = load_mesh(folder / "meshes/mug.glb").mass_properties()
    assert float(world["part"].mass) == pytest.approx(100 * solid.volume, rel=1e-12)
    assert np.asarray(world["part"].inertia) == pytest.approx(100 * solid.inertia, rel=1e-9, abs=1e-12)


def test_scale_multiplies_lengths() -> None:
    (small, _) = _mesh_scene('mesh = { file = "meshes/rock.stl", as = "hull" }')
    (large, _) = _mesh_scene('mesh = { file = "meshes/rock.stl", as = "hull", scale = 2 }')
    assert float(large.build()["part"].mass) == pytest.approx(
        8 * float(small.build()["part"].mass), rel=1e-12
    )


def _mesh_scene(mesh: str, folder: Path = PACKAGED) -> tuple[Scene, Path]:
    return scene_from_text(
        SPATIAL + f'[[body]]\nname = "part"\ndensity = 100\n{mesh}\n', folder=folder
    ), folder


@pytest.mark.parametrize(
    "file", ["../secret.obj", "/etc/passwd", "meshes/../../x.stl", "link/part.obj", "a\\u0000b.obj"]
)
def test_mesh_files_outside_the_scenes_folder_are_refused(file: str, tmp_path: Path) -> None:
    inside, outside = tmp_path / "inside", tmp_path / "outside"
    inside.mkdir()
    outside.mkdir()
    (outside / "part.obj").write_bytes((PACKAGED / "meshes/bracket.obj").read_bytes())
    (inside / "link").symlink_to(outside)
    scene, _ = _mesh_scene(f'mesh = {{ file = "{file}", as = "hull" }}', inside)
    with pytest.raises(
        SceneError, match="leaves the scene's folder; put the file beside the scene"
    ) as caught:
        scene.build()
    assert caught.value.line == 6
    assert caught.value.body == "part"


def test_scene_without_a_folder_has_no_meshes() -> None:
    scene = scene_from_text(
        SPATIAL + '[[body]]\nname = "a"\nmass = 1\nmesh = { file = "x.obj", as = "hull" }\n'
    )
    with pytest.raises(SceneError, match="in a scene that has no folder; save the scene as a file"):
        scene.build()


def test_broken_mesh_is_refused_with_line_and_body(tmp_path: Path) -> None:
    (tmp_path / "noise.stl").write_bytes(b"solid\x00\xff" * 30)
    path = tmp_path / "scene.toml"
    path.write_text(
        SPATIAL + '[[body]]\nname = "part"\nmass = 1\nmesh = { file = "noise.stl", as = "hull" }\n'
    )
    with pytest.raises(SceneError) as caught:
        load_scene(path).build()
    assert str(caught.value).startswith(f"{path}:6: body 'part': mesh 'noise.stl': cannot be read as STL")
    assert (caught.value.line, caught.value.key, caught.value.value) == (6, "mesh.file", "noise.stl")


def test_what_mesh_files_hold_besides_triangles_is_noted(tmp_path: Path) -> None:
    text = (PACKAGED / "meshes/bracket.obj").read_text()
    (tmp_path / "bracket.obj").write_text("usemtl steel\n" + text)
    scene, _ = _mesh_scene('mesh = { file = "bracket.obj", as = "hull" }', tmp_path)
    scene.build()
    assert scene.notes == ["bracket.obj: dropped materials (1)"]


def test_names_that_repeat_only_after_repetition_are_refused() -> None:
    text = HEAD + '[[body]]\nname = "b{i}"\nmass = 1\nrepeat = { count = [2, 2], step = [[1, 0], [0, 1]] }\n'
    with pytest.raises(
        SceneError, match=r"<text>:4: body 'b0': name is taken by body 'b\{i\}'; use \{i\}, \{j\}"
    ):
        built(text)


def test_what_the_engine_refuses_comes_back_with_the_line_of_its_key() -> None:
    text = SPATIAL + (
        '[[body]]\nname = "flat"\ndensity = 1\n[body.shape]\ntype = "convex_hull"\n'
        "points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n"
    )
    with pytest.raises(SceneError) as caught:
        built(text)
    assert str(caught.value).startswith("<text>:8: body 'flat': ")
    assert caught.value.remedy


def test_no_two_scenes_share_a_name() -> None:
    names = [scene.name for scene in list_scenes()]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("scene", list_scenes(), ids=lambda scene: scene.name)
def test_every_scene_that_comes_with_carom_takes_a_step(scene: Scene) -> None:
    world = scene.build()
    run = run_world(world, 2 * world.settings["dt"])
    assert len(run.steps) == 2
    assert np.isfinite(run.position).all()
    assert run.space == scene.space
    assert len(run.names) >= 1


def test_meshes_poured_on_the_terrain_come_to_rest_upon_it() -> None:
    world = load_scene("meshes_on_terrain").build()
    assert len(world.names) == 37
    run = run_world(world, 4.0, every=60)
    terrain = load_mesh(PACKAGED / "meshes/terrain.ply").vertices
    columns = np.unique(terrain[:, 0])
    heights = terrain[:, 2].reshape(len(columns), len(columns))  # rows along y, as they were made
    ground = RegularGridInterpolator((columns, columns), heights)
    end = run.position[-1, 1:]
    assert np.all(end[:, 2] > ground(end[:, [1, 0]]))
    assert np.all(np.hypot(end[:, 0], end[:, 1]) < 1.0)
    assert run.steps["kinetic"][-1] < 1e-3 * run.steps["kinetic"].max()
    assert run.deepest_penetration < 0.02
    assert run.energy_closure < 1e-10 * run.steps["kinetic"].max()
