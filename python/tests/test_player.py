"""The replay page: what is kept of a run, what that loses, and that nothing in a run can break the page."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import carom
from carom import planar, spatial
from carom.cli import main
from carom.errors import CaromError
from carom.player import chromium, encode, film, page, steps, words
from carom.player.chromium import find_chromium
from carom.player.drawing import _Drawing, draw_planar
from carom.player.quantise import (
    decode_rotation,
    encode_position,
    encode_rotation,
    halves,
    position_error,
    rotation_error,
)
from carom.run import Run

HOSTILE = "</script><script>alert(1)</script><!--carom-runs-->"


def stack(name: str = "box") -> planar.World:
    world = planar.World(dt=1 / 240)
    world.add_static("floor", planar.HalfPlane(), friction=0.5)
    for i in range(3):
        world.add_body(f"{name}{i}", planar.Box(1, 1), density=1.0, position=(0, 0.5 + i), friction=0.5)
    return world


def tables_of(text: str) -> list[dict[str, Any]]:
    """Tables of contents of the runs in a page."""
    found = re.findall(r'<script type="application/carom-run">([A-Za-z0-9+/=.]+)</script>', text)
    blocks = [b"".join(gzip.decompress(base64.b64decode(part)) for part in each.split(".")) for each in found]
    return [json.loads(block[4 : 4 + struct.unpack("<I", block[:4])[0]]) for block in blocks]


def test_positions_err_by_at_most_what_is_told() -> None:
    rng = np.random.default_rng(1)
    position = np.cumsum(rng.normal(size=(200, 7, 3)), axis=0) * [1.0, 10.0, 1e-3]
    codes, low, step = encode_position(position, 1e-9)
    error = position_error(position, codes, low, step)
    assert 0 < error <= np.linalg.norm(step, axis=1).max() / 2 * (1 + 1e-9)
    assert np.abs(low + codes * step - position).max() <= error


def test_a_body_at_rest_is_stored_as_zeros() -> None:
    position = np.full((50, 1, 2), 3.7) + 1e-12 * np.arange(50)[:, None, None]
    codes, _, _ = encode_position(position, 1e-6)
    assert not codes.any()


@pytest.mark.parametrize("width", [2, 4])
def test_rotations_err_by_less_than_two_tenths_of_a_milliradian(width: int) -> None:
    rng = np.random.default_rng(2)
    rotation = rng.normal(size=(300, 5, width))
    rotation /= np.linalg.norm(rotation, axis=2, keepdims=True)
    codes = encode_rotation(rotation)
    assert rotation_error(rotation, codes) < 2e-4
    assert np.allclose(np.linalg.norm(decode_rotation(codes), axis=2), 1, atol=1e-6)


@pytest.mark.parametrize("size", [1e-12, 1e-3, 1.0, 1e9])
def test_halves_keep_eleven_bits_at_every_scale(size: float) -> None:
    values = size * np.linspace(0.1, 1, 100)
    stored, scale = halves(values)
    assert np.allclose(stored.astype(np.float64) * scale, values, rtol=2**-10, atol=0)


def test_a_page_tells_what_it_keeps_and_how_exactly(tmp_path: Path) -> None:
    run = stack().run(1.0, every=4)
    [table] = tables_of(run.to_html(tmp_path / "run.html").read_text(encoding="utf-8"))
    assert table["names"] == list(run.names)
    assert table["kept"] == {"frames": 61, "of_frames": 61, "details": 61, "steps_per_point": 1, "steps": 240}
    assert 0 < table["error"]["position"] < 1e-4
    assert table["error"]["rotation"] < 2e-4
    assert [shape["type"] for shape in table["shapes"]] == ["half_plane", "box"]
    assert table["worst"]["value"] == run.worst_residual


def test_shapes_and_centres_of_mass_are_in_the_run_and_its_file(tmp_path: Path) -> None:
    world = spatial.World(gravity=(0, 0, 0))
    parts = [(spatial.Box(1, 1, 1), (0, 0, 0)), (spatial.Sphere(0.5), (2, 0, 0))]
    body = world.add_body("compound", spatial.Compound(parts), density=1.0)
    world.add_body("particle", mass=1.0)
    run = world.run(0.05, out=tmp_path / "run.h5")
    for each in (run, Run.load(tmp_path / "run.h5")):
        assert each.header.shapes[0]["type"] == "compound"
        assert each.header.shape is not None
        assert each.header.center is not None
        assert each.header.shape.tolist() == [0, -1]
        assert np.array_equal(each.header.center[0], body.mass_properties.center_of_mass)


def test_a_page_tells_whether_bodies_may_sleep(tmp_path: Path) -> None:
    soft: Any = {"scheme": "soft_step", "soft": {"sleeping": True}}
    for settings, told in (({}, False), ({"scheme": "soft_step"}, False), (soft, True)):
        world = planar.World(dt=1 / 60, **settings)
        world.add_body("ball", planar.Circle(0.1), mass=1.0)
        [table] = tables_of(world.run(0.1).to_html(tmp_path / "run.html").read_text(encoding="utf-8"))
        assert table["sleeping"] is told


def test_names_cannot_end_the_script_that_holds_them(tmp_path: Path) -> None:
    plain = stack().run(0.1).to_html(tmp_path / "plain.html").read_text(encoding="utf-8")
    hostile = stack(HOSTILE).run(0.1).to_html(tmp_path / "hostile.html").read_text(encoding="utf-8")
    assert hostile.count("<script") == plain.count("<script")
    assert HOSTILE not in hostile
    assert tables_of(hostile)[0]["names"][1] == f"{HOSTILE}0"


def test_large_runs_are_thinned_to_the_size_asked_for_and_say_so(tmp_path: Path) -> None:
    world = spatial.World(gravity=(0, 0, 0), dt=0.01)
    rng = np.random.default_rng(3)
    for i in range(60):
        world.add_body(f"ball{i}", spatial.Sphere(0.01), mass=1.0, position=rng.normal(size=3) * 10,
                       velocity=rng.normal(size=3), angular_velocity=rng.normal(size=3))  # fmt: skip
    run = world.run(5.0)
    payload, thinning = encode.encode_run(run, 120_000)
    assert thinning.frames > 1 or thinning.details > 1
    assert len(payload.packed()) <= 120_000
    assert payload.table["kept"]["of_frames"] == 501
    assert payload.table["kept"]["details"] < 501


def test_steps_of_long_runs_keep_their_worst(monkeypatch: pytest.MonkeyPatch) -> None:
    run = stack().run(1.0, solver="pgs", iterations=3)
    monkeypatch.setattr(steps, "MOST_POINTS", 50)
    columns, every = steps.columns_of(run.steps)
    assert every == 5
    assert len(columns["time"]) == 48
    assert columns["residual"].max() == np.float32(run.worst_residual)
    assert run.worst.step in columns["number"]
    assert columns["ledger_gravity"][-1] == np.float32(run.ledger["gravity"][-1])


def test_a_pose_that_is_not_finite_is_refused_by_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run = stack().run(0.1)
    broken = run.position.copy()
    broken[3, 2, 0] = np.nan
    monkeypatch.setattr(Run, "position", property(lambda self: broken))
    with pytest.raises(CaromError, match="body 'box1': position is not finite at frame 3"):
        run.to_html(tmp_path / "run.html")
    assert not (tmp_path / "run.html").exists()


def test_without_the_built_page_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    run = stack().run(0.1)
    monkeypatch.setattr(page, "PAGE", tmp_path / "none.html")
    with pytest.raises(CaromError, match="make player"):
        run.to_html(tmp_path / "run.html")
    assert "make player" in run._repr_html_()


def test_two_runs_carry_their_distance(tmp_path: Path) -> None:
    one, other = stack().run(1.0, every=4), stack().run(1.0, every=4, solver="sequential", iterations=2)
    text = one.to_html(tmp_path / "two.html", other=other).read_text(encoding="utf-8")
    first, second = tables_of(text)
    assert "difference_largest" not in first["arrays"]
    assert second["arrays"]["difference_largest"]["shape"] == [61]
    with pytest.raises(CaromError, match="share no body"):
        one.to_html(tmp_path / "no.html", other=_stranger())


def _stranger() -> Run:
    world = planar.World()
    world.add_body("stranger", planar.Circle(1), density=1.0)
    return world.run(0.1)


def test_the_worst_step_of_a_scene_is_explained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "card_house", "--time", "0.1", "--out", "run.h5", "--quiet"]) == 0
    assert main(["view", "run.h5", "--no-browser"]) == 0
    [table] = tables_of(Path("run.html").read_text(encoding="utf-8"))
    assert table["words"]["findings"]
    assert table["words"]["certificate"]
    [brief] = tables_of(page.page_of(Run.load("run.h5"), explain_seconds=0.0))
    assert "explain_seconds" in brief["words"]["note"]


def test_steps_of_frames_are_explained_as_far_as_there_is_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", "card_house", "--time", "0.2", "--out", "run.h5", "--quiet"]) == 0
    run = Run.load("run.h5")
    told = words.in_words(run, 60.0)
    assert told.table["note"] == ""
    ends = {str(round(t / run.header.dt) - 1) for t in run.time[1:]}
    assert ends <= set(told.table["steps"])
    for step in told.table["steps"].values():
        assert step["findings"]
        assert step["certificate"]
    frame = len(run.time) - 1
    touching = run.contacts[frame]
    residual = told.residuals_of(frame, touching["a"], touching["b"])
    assert len(residual) > 0
    assert np.all(residual >= 0)
    assert residual.max() == pytest.approx(run.steps["residual"][-1], rel=1e-9)
    assert np.isnan(words.Told({}).residuals_of(frame, touching["a"], touching["b"])).all()


def test_residuals_of_contacts_are_stored_to_a_twelfth_of_a_digit(tmp_path: Path) -> None:
    run = stack().run(0.5, solver="pgs", iterations=3)
    residual = {(0, 1): 3e-4, (1, 2): 0.0}
    told = words.Told({"steps": {}}, {frame: residual for frame in range(len(run.time))})
    payload, _ = encode.encode_run(run, 10_000_000, told)
    stored = payload._arrays["contact_residual"][0]
    contacts = run.contacts.all()
    pairs = np.sort(np.stack([contacts["a"], contacts["b"]], axis=1), axis=1)
    for pair, code in zip(pairs.tolist(), stored.tolist(), strict=True):
        if tuple(pair) == (0, 1):
            assert 10 ** ((code - 1) / 12 - 18) == pytest.approx(3e-4, rel=0.11)
        else:
            assert code == (1 if tuple(pair) == (1, 2) else 0)


def test_a_notebook_shows_the_page_in_a_frame() -> None:
    shown = stack().run(0.1)._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert shown.count("<script") == 0  # all of it is inside the attribute


def test_the_plane_is_drawn_without_a_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "find_chromium", lambda: None)
    run = stack().run(0.1)
    assert run.to_png(tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")
    assert draw_planar(run, 0.0, (300, 200), "dark", False).startswith(b"\x89PNG")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(CaromError, match="there is no Chromium here"):
        run.to_mp4(tmp_path / "run.mp4")


@pytest.mark.parametrize(
    ("field", "given"), [("fps", {"fps": 0}), ("speed", {"speed": -1.0}), ("size", {"size": (1, 1)})]
)
def test_films_refuse_what_they_cannot_be(tmp_path: Path, field: str, given: dict[str, Any]) -> None:
    with pytest.raises(CaromError) as caught:
        stack().run(0.1).to_mp4(tmp_path / "run.mp4", **given)
    assert caught.value.field == field


@pytest.mark.skipif(find_chromium() is None, reason="there is no Chromium here")
def test_a_picture_is_taken_whatever_closes_itself_at_a_fork(tmp_path: Path) -> None:
    # matplotlib does so with the files of its fonts, which then have the numbers that the browser gets
    script = f"""
import os, carom
from carom import planar
held = [os.open(os.devnull, os.O_RDONLY) for _ in range(8)]
os.register_at_fork(after_in_child=lambda: [os.close(number) for number in held])
world = planar.World()
world.add_body("ball", planar.Circle(0.5), density=1.0, position=(0, 1))
before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
world.run(0.1).to_png({str(tmp_path / "run.png")!r}, size=(320, 200))
after = len(os.listdir("/proc/self/fd")) if before else 0
assert after == before, (before, after)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_a_browser_that_cannot_be_started_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "chromium"
    broken.write_bytes(b"no program")
    broken.chmod(0o755)
    monkeypatch.setattr(chromium, "find_chromium", lambda: str(broken))
    with pytest.raises(CaromError, match="cannot be started") as caught:
        chromium.Chromium((320, 200))
    assert caught.value.field == "chromium"


def test_the_floor_is_drawn_far_from_its_own_place(tmp_path: Path) -> None:
    world = planar.World()
    world.add_static("floor", planar.HalfPlane())
    world.add_body("ball", planar.Circle(0.5), density=1.0, position=(300, 0.5))
    with_floor = drawn(world.run(0.1))
    without = planar.World(gravity=(0, 0))
    without.add_body("ball", planar.Circle(0.5), density=1.0, position=(300, 0.5))
    corner = (-2, 2)  # below, to the left
    assert with_floor[corner] != drawn(without.run(0.1))[corner]


def drawn(run: Run) -> Any:
    from PIL import Image

    picture = Image.open(io.BytesIO(draw_planar(run, 0.0, (300, 200), "light", False))).convert("RGB")
    return {(-2, 2): picture.getpixel((2, picture.height - 3))}


def test_the_impulse_between_two_bodies_is_drawn_on_the_one_it_lifts() -> None:
    world = planar.World(solver="exact")
    world.add_static("floor", planar.HalfPlane(), friction=0.5)
    for name, height in (("upper", 1.5), ("lower", 0.5)):  # the upper one is a of the pair, then b
        world.add_body(name, planar.Box(1, 1), density=1.0, position=(0, height), friction=0.5)
    run = world.run(0.1)
    rows = run.contacts[-1]
    impulse = rows["normal"] * rows["normal_impulse"][:, None] + rows["friction_impulse"]
    drawing = _Drawing(run, (300, 200))
    shown = np.where(drawing._is_on_b(rows, impulse)[:, None], -impulse, impulse)
    assert len(shown) == 4
    assert (shown[:, 1] > 0).all()


@pytest.mark.skipif(find_chromium() is None, reason="there is no Chromium here")
def test_pictures_and_films_of_space_come_from_a_browser(tmp_path: Path) -> None:
    world = spatial.World()
    world.add_static("floor", spatial.HalfSpace())
    world.add_body("ball", spatial.Sphere(0.5), density=1.0, position=(0, 0, 1))
    run = world.run(0.2, every=4)
    assert run.to_png(tmp_path / "run.png", 0.1, size=(320, 200)).read_bytes().startswith(b"\x89PNG")
    assert run.to_mp4(tmp_path / "run.mp4", fps=10, size=(320, 200)).read_bytes()[4:8] == b"ftyp"


def test_shapes_of_older_runs_come_from_their_scene(tmp_path: Path) -> None:
    import h5py

    scene = carom.load_scene("card_house")
    from carom.run import run_world

    run_world(scene.build(), 0.02, out=tmp_path / "run.h5", scene=scene.text, scene_name=scene.name)
    with h5py.File(tmp_path / "run.h5", "a") as file:
        for name in ("shapes", "bodies/shape", "bodies/center"):
            del file[name]
    [table] = tables_of(page.page_of(Run.load(tmp_path / "run.h5")))
    assert {shape["type"] for shape in table["shapes"]} >= {"half_plane"}
    assert "note" not in table
