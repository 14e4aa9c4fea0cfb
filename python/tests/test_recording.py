"""Run files: what they hold, that they can be read while being written, and what is refused."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from scripted import ScriptedWorld

from carom import planar
from carom.errors import RunFileError, StepError
from carom.recording import solver_of
from carom.run import Run, run_world

ARRAYS = ("time", "position", "rotation", "velocity", "angular_velocity", "steps")


@pytest.mark.parametrize("dimension", [2, 3])
def test_run_in_a_file_equals_the_run_in_memory(tmp_path: Path, dimension: int) -> None:
    memory = run_world(ScriptedWorld(dimension=dimension), 1.5, every=4)
    file = run_world(ScriptedWorld(dimension=dimension), 1.5, every=4, out=tmp_path / "run.h5")
    loaded = Run.load(tmp_path / "run.h5")
    for name in ARRAYS:
        assert np.array_equal(getattr(memory, name), getattr(file, name))
        assert np.array_equal(getattr(memory, name), getattr(loaded, name))
    for frame in range(len(memory.time)):
        assert np.array_equal(memory.contacts[frame], loaded.contacts[frame])
    assert loaded.names == memory.names
    assert loaded.space == ("planar" if dimension == 2 else "spatial")


def test_saving_a_run_keeps_everything(tmp_path: Path) -> None:
    run = run_world(ScriptedWorld(), 1.5, every=4, scene="text of the scene", scene_name="drop")
    run.save(tmp_path / "saved.h5")
    loaded = Run.load(tmp_path / "saved.h5")
    for name in ARRAYS:
        assert np.array_equal(getattr(run, name), getattr(loaded, name))
    assert np.array_equal(run.contacts.all(), loaded.contacts.all())
    assert loaded.header.scene == "text of the scene"
    assert loaded.header.scene_name == "drop"
    assert loaded.status == "complete"
    assert repr(loaded) == repr(run)
    assert loaded.summary()["ms_per_step"] == pytest.approx(run.summary()["ms_per_step"])


def test_saving_a_run_onto_its_own_file_changes_nothing(tmp_path: Path) -> None:
    run = run_world(ScriptedWorld(), 0.2, out=tmp_path / "run.h5")
    before = (tmp_path / "run.h5").read_bytes()
    run.save(tmp_path / "run.h5")
    assert (tmp_path / "run.h5").read_bytes() == before


def test_every_dataset_states_its_unit_and_the_file_its_versions(tmp_path: Path) -> None:
    run_world(ScriptedWorld(), 0.5, out=tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        lacking: list[str] = []
        file.visititems(
            lambda name, item: (
                lacking.append(name) if isinstance(item, h5py.Dataset) and "unit" not in item.attrs else None
            )
        )
        assert lacking == []
        assert file["frames/velocity"].attrs["unit"] == "m/s"
        units = json.loads(file["steps"].attrs["unit"])
        assert units["residual"] == "m/s"
        assert units["gravity"] == "J"
        assert units["contacts"] == "1"
        assert json.loads(file["contacts"].attrs["unit"])["normal_impulse"] == "N s"
        assert file.attrs["schema_version"] == 3
        assert "carom_version" in file.attrs
        assert "created" in file.attrs
        assert json.loads(file["settings"].asstr()[()])["solver"] == "pgs"
        assert file["frames/position"].chunks is not None


def test_file_can_be_read_while_it_is_written_and_after_its_writer_is_killed(tmp_path: Path) -> None:
    path = tmp_path / "growing.h5"
    code = (
        "from scripted import ScriptedWorld; from carom.run import run_world;"
        f"run_world(ScriptedWorld(delay=0.005), 1000.0, out={str(path)!r})"
    )
    environment = {"PYTHONPATH": ":".join([str(Path(__file__).parent), *sys.path])}
    writer = subprocess.Popen([sys.executable, "-c", code], env=environment)
    try:
        first = _wait_for_frames(path, 20)
        second = _wait_for_frames(path, len(first.time) + 20)
        assert second.status == "running"
        assert np.array_equal(second.position[: len(first.time)], first.position)
        assert len(second.contacts) == len(second.time) == len(second.position)
    finally:
        writer.kill()
        writer.wait()
    killed = Run.load(path)
    assert killed.status == "running"
    assert len(killed.time) >= len(second.time)
    assert np.isfinite(killed.position).all()
    assert len(killed.steps) + 1 >= len(killed.time)
    assert len(killed.contacts.all()) == killed.contacts.offsets[-1]


def _wait_for_frames(path: Path, count: int) -> Run:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            run = Run.load(path)
            if len(run.time) >= count:
                return run
        except RunFileError:
            pass
        time.sleep(0.05)
    raise AssertionError(f"no {count} frames in a minute")


def test_failed_run_leaves_a_valid_file(tmp_path: Path) -> None:
    with pytest.raises(StepError):
        run_world(ScriptedWorld(fails_at=25), 1.0, out=tmp_path / "run.h5")
    run = Run.load(tmp_path / "run.h5")
    assert run.status == "failed"
    assert len(run.steps) == 25
    assert len(run.time) == 26
    assert "(failed)" in repr(run)


def test_file_that_is_no_run_is_never_overwritten(tmp_path: Path) -> None:
    (tmp_path / "notes.h5").write_text("my notes")
    h5py.File(tmp_path / "other.h5", "w").close()
    (tmp_path / "folder").mkdir()
    for name in ("notes.h5", "other.h5", "folder"):
        path = tmp_path / name
        with pytest.raises(RunFileError, match="choose another path"):
            run_world(ScriptedWorld(), 0.1, out=path)
    assert (tmp_path / "notes.h5").read_text() == "my notes"


def test_run_file_is_replaced_by_a_new_run(tmp_path: Path) -> None:
    run_world(ScriptedWorld(), 1.0, out=tmp_path / "run.h5")
    run_world(ScriptedWorld(), 0.1, out=tmp_path / "run.h5")
    assert len(Run.load(tmp_path / "run.h5").steps) == 10


def test_unreadable_files_are_refused_with_reason_and_remedy(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("hello")
    h5py.File(tmp_path / "other.h5", "w").close()
    with h5py.File(tmp_path / "later.h5", "w") as file:
        file.attrs["format"], file.attrs["schema_version"] = "carom-run", 99
    for name, reason in (
        ("missing.h5", "no such file"),
        ("text.h5", "cannot be read as HDF5"),
        ("other.h5", "no run of carom"),
        ("later.h5", "version 99"),
    ):
        with pytest.raises(RunFileError, match=reason) as caught:
            Run.load(tmp_path / name)
        assert name in str(caught.value)
        assert caught.value.remedy


def test_a_file_names_the_solver_that_its_scheme_chose_whatever_today_s_default_is(tmp_path: Path) -> None:
    out = tmp_path / "run.h5"
    world = planar.World()
    world.add_body("box", planar.Box(1, 1), mass=1.0)
    assert world.solver is None
    run = run_world(world, 0.1, out=out)
    assert run.header.solver == run.summary()["solver"] == solver_of({"scheme": world.scheme}) != ""
    assert f"solver {run.header.solver}" in repr(world)
    with h5py.File(out, "r+") as file:
        file.attrs["solver"] = "former"
    assert Run.load(out).summary()["solver"] == "former"
    with h5py.File(out, "r+") as file:
        del file.attrs["solver"]
    assert Run.load(out).summary()["solver"] == run.summary()["solver"]


def test_dataframe_has_a_row_per_frame_and_body() -> None:
    pandas = pytest.importorskip("pandas")
    run = run_world(ScriptedWorld(), 0.2)
    frame = run.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert len(frame) == 21 * 4
    assert frame["y"].to_numpy() == pytest.approx(run.position[:, :, 1].reshape(-1))
