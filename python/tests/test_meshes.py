"""Meshes: the four formats, exact mass properties, what is dropped, and what is refused."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from carom.errors import BuildError
from carom.meshes import Mesh, as_shape, clean_mesh, load_mesh
from carom.scene.catalogue import PACKAGED

MESHES = PACKAGED / "meshes"
PARTS = ("gear.obj", "nut.stl", "pawn.ply", "bracket.obj", "mug.glb", "rock.stl")

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                  [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip


_ENDLESS_PLY = b"""ply
format binary_little_endian 1.0
element vertex 900000000000
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
"""


def cube(size: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    return clean_mesh(CUBE * size, FACES, source="cube")


def test_box_mesh_has_the_closed_form_mass_properties() -> None:
    a, b, c = 0.3, 0.5, 0.7
    found = cube((a, b, c)).mass_properties()
    mass = a * b * c
    assert found.volume == pytest.approx(mass, rel=1e-14)
    assert found.center == pytest.approx([a / 2, b / 2, c / 2], rel=1e-14)
    wanted = mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert found.inertia == pytest.approx(wanted, rel=1e-13, abs=1e-16)


def test_mass_properties_do_not_depend_on_where_the_mesh_lies() -> None:
    near = cube((0.3, 0.5, 0.7)).mass_properties()
    far = clean_mesh(CUBE * (0.3, 0.5, 0.7) + [100.0, -50.0, 30.0], FACES, source="far").mass_properties()
    assert far.volume == pytest.approx(near.volume, rel=1e-10)
    assert far.inertia == pytest.approx(near.inertia, rel=1e-9, abs=1e-12)


def test_revolved_solid_approaches_the_cylinder_from_below() -> None:
    make = _maker()
    vertices, faces = make.revolved(np.array([(0.0, 0.0), (0.5, 0.0), (0.5, 2.0), (0.0, 2.0)]), 200)
    volume = clean_mesh(vertices, faces, source="cylinder").mass_properties().volume
    polygon = 0.5 * 200 * 0.25 * np.sin(2 * np.pi / 200)  # area of the regular 200-gon of radius 0.5
    assert volume == pytest.approx(2.0 * polygon, rel=1e-12)


@pytest.mark.parametrize("name", PARTS)
def test_packaged_parts_are_closed_solids_of_sensible_size(name: str) -> None:
    mesh = load_mesh(MESHES / name, scale=0.001 if name == "nut.stl" else 1.0)
    solid = mesh.mass_properties()
    principal = np.linalg.eigvalsh(solid.inertia)
    assert mesh.closed
    assert mesh.dropped == ()
    assert 0.1 < mesh.extent < 0.3
    assert 0.0 < solid.volume < mesh.extent**3
    assert principal[0] > 0
    assert principal[0] + principal[1] >= principal[2] * (1 - 1e-12)
    assert (MESHES / name).stat().st_size < 200_000


def test_gear_and_nut_have_a_hole_and_the_mug_a_handle() -> None:
    for name, genus in (("gear.obj", 1), ("nut.stl", 1), ("mug.glb", 1), ("pawn.ply", 0), ("bracket.obj", 0)):
        mesh = load_mesh(MESHES / name)
        edges = 3 * len(mesh.triangles) // 2
        assert len(mesh.vertices) - edges + len(mesh.triangles) == 2 - 2 * genus, name


def test_terrain_is_an_open_surface_whose_middle_is_lower_than_its_border() -> None:
    mesh = load_mesh(MESHES / "terrain.ply")
    radius = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
    assert not mesh.closed
    assert len(mesh.triangles) == 3200
    assert mesh.vertices[radius < 0.3, 2].max() < mesh.vertices[radius > 1.5, 2].min()
    with pytest.raises(BuildError, match="is not closed: 160 edges belong to one triangle only"):
        mesh.mass_properties()


def test_packaged_meshes_are_what_their_maker_makes(tmp_path: Path) -> None:
    for path in _maker().write(tmp_path):
        made, kept = load_mesh(path), load_mesh(MESHES / path.name)
        assert made.vertices == pytest.approx(kept.vertices, abs=1e-6 * kept.extent), path.name
        assert np.array_equal(made.triangles, kept.triangles), path.name


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb"])
def test_a_cube_comes_back_from_each_format(suffix: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    trimesh.Trimesh(CUBE, FACES, process=False).export(tmp_path / f"cube.{suffix}")
    mesh = load_mesh(tmp_path / f"cube.{suffix}", scale=2.0)
    assert mesh.closed
    assert len(mesh.vertices) == 8
    assert len(mesh.triangles) == 12
    assert mesh.mass_properties().volume == pytest.approx(8.0, rel=1e-6)


def test_parts_of_a_glb_stand_where_its_nodes_put_them(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    part = trimesh.Trimesh(CUBE, FACES, process=False)
    scene.add_geometry(part)
    scene.add_geometry(part, transform=trimesh.transformations.translation_matrix([5.0, 0.0, 0.0]))
    (tmp_path / "two.glb").write_bytes(scene.export(file_type="glb"))
    mesh = load_mesh(tmp_path / "two.glb")
    assert mesh.closed
    assert len(mesh.triangles) == 24
    assert mesh.vertices[:, 0].max() == pytest.approx(6.0)


def test_what_a_file_holds_besides_triangles_is_reported(tmp_path: Path) -> None:
    lines = ["mtllib ../secret.mtl", "usemtl red"]
    lines += [f"v {x} {y} {z}" for x, y, z in CUBE] + ["vt 0 0", "vn 0 0 1"]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in FACES] + ["f 1 2 2", "f 1 2 4"]
    (tmp_path / "cube.obj").write_text("\n".join(lines))
    mesh = load_mesh(tmp_path / "cube.obj")
    told = ", ".join(mesh.dropped)
    for words in ("materials (1)", "normals (1)", "texture coordinates (1)", "1 triangle without area",
                  "1 triangle given twice"):  # fmt: skip
        assert words in told
    assert mesh.closed
    assert len(mesh.triangles) == 12
    unused = clean_mesh(np.vstack([CUBE, [[9.0, 9.0, 9.0]]]), FACES, source="cube")
    assert unused.dropped == ("1 vertex that no triangle uses",)
    assert len(unused.vertices) == 8


def test_inside_out_surface_is_turned_and_said_so() -> None:
    mesh = clean_mesh(CUBE, FACES[:, ::-1], source="cube")
    assert mesh.mass_properties().volume == pytest.approx(1.0)
    assert "inside out" in mesh.dropped[0]


def test_corners_that_almost_meet_are_welded() -> None:
    generator = np.random.default_rng(1)
    soup = CUBE[FACES.reshape(-1)] + generator.uniform(-1e-12, 1e-12, (36, 3))
    mesh = clean_mesh(soup, np.arange(36).reshape(-1, 3), source="soup")
    assert mesh.closed
    assert len(mesh.vertices) == 8


def _write(path: Path, data: Any) -> Path:
    path.write_bytes(data if isinstance(data, bytes) else str(data).encode())
    return path


def test_broken_files_are_refused_with_reason_and_remedy(tmp_path: Path) -> None:
    whole = (MESHES / "mug.glb").read_bytes()
    cases = {
        "empty.obj": (b"", "the file is empty"),
        "points.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "holds no triangles"),
        "nan.obj": ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "vertex 0 is not finite"),
        "point.obj": ("v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "all vertices lie in one point"),
        "sliver.obj": ("v 0 0 0\nv 1 1 1\nf 1 2 2\n", "holds no triangles"),
        "beyond.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "mesh 'beyond.obj'"),
        "noise.stl": (b"solid\x00\xff" * 30, "cannot be read as STL"),
        "short.stl": ((MESHES / "nut.stl").read_bytes()[:1000], "cannot be read as STL"),
        "short.glb": (whole[: len(whole) // 2], "cannot be read as GLB"),
        "short.ply": ((MESHES / "pawn.ply").read_bytes()[:2000], "cannot be read as PLY"),
        "wrong.ply": (whole, "cannot be read as PLY"),
        "endless.ply": (_ENDLESS_PLY, "cannot be read as PLY"),
        "model.dae": ("<xml/>", "unknown kind of mesh file '.dae'; give one of .obj, .stl, .ply, .glb"),
    }
    for name, (data, reason) in cases.items():
        with pytest.raises(BuildError) as caught:
            load_mesh(_write(tmp_path / name, data))
        assert f"mesh '{name}': " in str(caught.value)
        assert reason in str(caught.value)
        assert caught.value.remedy, name
    with pytest.raises(BuildError, match="cannot be read: No such file"):
        load_mesh(tmp_path / "missing.obj")


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_scale_is_refused(scale: float) -> None:
    with pytest.raises(BuildError, match="scale must be > 0"):
        load_mesh(MESHES / "rock.stl", scale=scale)


def test_hull_keeps_the_corners_alone() -> None:
    inner = clean_mesh(np.vstack([CUBE, CUBE * 0.5 + 0.2]), np.vstack([FACES, FACES + 8]), source="two")
    shape = as_shape(inner, "hull")
    assert shape["type"] == "convex_hull"
    assert sorted(map(tuple, shape["points"])) == sorted(map(tuple, CUBE))


def test_static_use_drops_slivers_only() -> None:
    vertices = np.vstack([CUBE, [[0.5, 0.0, 0.0]]])
    mesh = clean_mesh(vertices, np.vstack([FACES, [[0, 8, 4]]]), source="cube with sliver")
    shape = as_shape(mesh, "static")
    assert shape["type"] == "tri_mesh"
    assert len(shape["triangles"]) == 12


def test_flat_and_open_meshes_are_refused_where_a_solid_is_needed() -> None:
    flat = clean_mesh(CUBE[[0, 1, 2, 3]], np.array([[0, 1, 3], [0, 3, 2]]), source="flat.obj")
    with pytest.raises(BuildError, match="is flat and encloses no volume"):
        as_shape(flat, "hull")
    opened = clean_mesh(CUBE, FACES[1:], source="open.obj")
    with pytest.raises(
        BuildError, match=r"3 edges belong to one triangle only; close the mesh or use as = \"hull\""
    ):
        as_shape(opened, "decomposition")
    crowded = clean_mesh(
        np.vstack([CUBE, [[0.5, 0.5, -1.0]]]), np.vstack([FACES, [[0, 2, 8]]]), source="fin.obj"
    )
    with pytest.raises(BuildError, match=r"is not closed|is not a surface"):
        as_shape(crowded, "decomposition")
    twisted = clean_mesh(CUBE, np.vstack([FACES[:1, ::-1], FACES[1:]]), source="twisted.obj")
    with pytest.raises(BuildError, match="face opposite ways"):
        twisted.mass_properties()


def _maker() -> Any:
    """The script that makes the packaged meshes."""
    spec = importlib.util.spec_from_file_location("make_meshes", PACKAGED / "make_meshes.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
