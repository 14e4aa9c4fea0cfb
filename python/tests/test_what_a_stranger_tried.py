"""What somebody who had never seen the package tried, and what was lost or told badly."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from carom import planar, spatial
from carom.cli import main as carom
from carom.errors import BuildError, CaromError, RunFileError
from carom.run import Run


def pushed(speed: float) -> Any:
    """A box that slides."""
    world = planar.World(dt=1 / 120)
    world.add_static("floor", planar.HalfPlane(), friction=0.5)
    world.add_body("box", planar.Box(1, 1), mass=1, position=(0, 0.5), velocity=(speed, 0), friction=0.4)
    return world


def test_a_page_does_not_replace_the_recording_it_is_made_of(tmp_path: Path) -> None:
    file = tmp_path / "run.h5"
    run = pushed(1).run(0.1, out=file)
    before = file.read_bytes()
    assert carom(["view", str(file), "--no-browser", "--html", str(file)]) == 2
    with pytest.raises(CaromError, match=r"is no page|recorded run"):
        run.to_html(file)
    assert file.read_bytes() == before
    scene = tmp_path / "scene.toml"
    scene.write_text("schema_version = 1")
    with pytest.raises(CaromError, match="exists and is no page"):
        run.to_html(scene)
    page = run.to_html(tmp_path / "run.html")
    assert run.to_html(page) == page, "a page is replaced"


def test_a_run_whose_file_holds_another_one_says_so(tmp_path: Path) -> None:
    first = pushed(1).run(0.5, out=tmp_path / "run.h5")
    second = pushed(3).run(1.0, out=tmp_path / "run.h5")
    with pytest.raises(RunFileError, match="holds another run"):
        _ = first.position
    assert len(second.time) == 121
    assert len(second.steps) == 120


def test_a_run_is_read_wherever_the_program_is_then(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run = pushed(1).run(0.1, out="run.h5")
    os.chdir("/")
    assert run.position.shape == (13, 2, 2)


def test_a_world_without_bodies_is_recorded_and_has_no_page(tmp_path: Path) -> None:
    for world in (planar.World(dt=0.01), spatial.World(dt=0.01)):
        run = world.run(0.1, out=tmp_path / "empty.h5")
        assert Run.load(tmp_path / "empty.h5").position.shape == (11, 0, len(world.gravity))
        with pytest.raises(CaromError, match="holds no body"):
            run.to_html(tmp_path / "empty.html")


@pytest.mark.parametrize("name", ["a\0b", "a\nb", "\x7f", "a\ud800"])
def test_names_that_no_file_can_hold_are_refused(name: str) -> None:
    world = pushed(1)
    with pytest.raises(BuildError, match="control characters"):
        world.add_body(name, planar.Circle(1), mass=1)
    with pytest.raises(BuildError, match="control characters"):
        world.add_point_joint(name, "box")
    assert world.names == ("floor", "box")


@pytest.mark.parametrize(
    "wrong",
    [
        ["--megabytes", "0"],
        ["--megabytes", "nan"],
        ["--megabytes", "-1"],
        ["--explain", "nan"],
        ["--explain", "-1"],
    ],
)
def test_view_refuses_sizes_and_times_that_are_none(tmp_path: Path, wrong: list[str]) -> None:
    file = tmp_path / "run.h5"
    pushed(1).run(0.1, out=file)
    assert carom(["view", str(file), "--no-browser", *wrong]) == 2
    assert not (tmp_path / "run.html").exists()


@pytest.mark.parametrize("option", ["--closure", "--penetration"])
@pytest.mark.parametrize("bound", ["nan", "-1", "inf"])
def test_check_refuses_bounds_that_check_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: str, bound: str
) -> None:
    file = tmp_path / "run.h5"
    pushed(1).run(0.1, out=file)
    assert carom(["check", str(file), option, bound]) == 2
    assert f"{option[2:]} must be finite and >= 0" in capsys.readouterr().err


def test_check_tells_in_words_what_is_no_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "text.h5"
    text.write_text("no")
    for path, words in (
        (tmp_path / "none.h5", "no such file"),
        (tmp_path, "is a folder"),
        (text, "no HDF5 file"),
    ):
        assert carom(["check", str(path)]) == 2
        told = capsys.readouterr().err
        assert words in told
        assert "o_flags" not in told
        assert "buf =" not in told


def test_settings_with_names_are_not_taken_by_their_place() -> None:
    with pytest.raises(BuildError, match="dict of named choices"):
        spatial.World(soft=[7, 50.0])
    with pytest.raises(BuildError, match=r"events\.cap must be at least 1"):
        spatial.World(events={"cap": 0})


@pytest.mark.parametrize("out", ["a" * 300 + ".h5", "a\0b.h5", 3])
def test_places_that_cannot_be_written_are_refused_before_the_first_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, out: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    world = pushed(1)
    with pytest.raises(RunFileError, match="path"):
        world.run(0.1, out=out)
    assert world.time == 0
    assert not list(tmp_path.iterdir())


def test_contacts_are_asked_for_by_whole_frames_and_moments() -> None:
    contacts = pushed(1).run(0.1).contacts
    with pytest.raises(BuildError, match="t must be finite"):
        contacts.at(np.nan)
    with pytest.raises(TypeError, match="whole"):
        contacts[1:3]
    with pytest.raises(IndexError, match="the run has 13"):
        contacts[10**9]
    assert len(contacts[-1]) == len(contacts[12])
