"""The command line: what it prints where, its exit codes, and what Ctrl-C leaves."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from carom.cli import main
from carom.run import Run
from carom.scene import scene_schema_text

SCENE = """
schema_version = 1
space = "planar"
name = "drop"
description = "a ball falls on a floor"
duration = 0.5
[[body]]
name = "floor"
kind = "static"
shape = { type = "half_plane", normal = [0, 1] }
[[body]]
name = "ball"
shape = { type = "circle", radius = 0.1 }
density = 100
position = [0, 0.3]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with a scene file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drop.toml").write_text(SCENE)
    return tmp_path


def test_run_records_and_prints_the_closing_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "drop.toml"]) == 0
    printed = capsys.readouterr()
    for words in ("steps", "120", "wall time", "ms per step", "worst residual", "m/s", "energy closure",
                  "deepest penetration", "drop.h5"):  # fmt: skip
        assert words in printed.out
    run = Run.load(folder / "drop.h5")
    assert run.status == "complete"
    assert len(run.steps) == 120
    assert len(run.time) == 31
    assert run.header.scene == SCENE
    assert run.header.scene_name == "drop"
    assert run.names == ("floor", "ball")


def test_second_run_does_not_overwrite_the_first(folder: Path) -> None:
    assert main(["run", "drop.toml", "--quiet"]) == 0
    assert main(["run", "drop.toml", "--quiet", "--time", "0.1"]) == 0
    assert len(Run.load(folder / "drop.h5").steps) == 120
    assert len(Run.load(folder / "drop-2.h5").steps) == 24


def test_options_reach_the_world(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = {"--time": "0.2", "--dt": "0.01", "--solver": "sequential", "--iterations": "7",
               "--tolerance": "1e-9",
               "--scheme": "fixed_step", "--impact": "sequential", "--integrator": "rk4", "--every": "5",
               "--out": "here.h5"}  # fmt: skip
    words = [word for pair in options.items() for word in pair]
    assert main(["run", "drop.toml", "--json", *words]) == 0
    told = json.loads(capsys.readouterr().out)
    settings = told["settings"]
    assert (told["steps"], told["frames"], told["out"]) == (20, 5, "here.h5")
    assert settings["dt"] == 0.01
    assert settings["solver"] == "sequential"
    assert settings["iterations"] == 7
    assert settings["tolerance"] == 1e-9
    assert settings["impact"] == "sequential"
    assert settings["integrator"] == "rk4"


def test_json_is_all_that_json_prints(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "drop.toml", "--json", "--out", "none"]) == 0
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert told["status"] == "complete"
    assert told["out"] is None
    assert told["space"] == "planar"
    assert set(told["worst_residual"]) == {"value", "step", "time", "between"}
    assert not list(folder.glob("*.h5"))


def test_closing_table_names_the_solver_that_the_scheme_chose(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for scheme, solver in [("fixed_step", "nncg"), ("events", "exact"), ("soft_step", "soft_step's own")]:
        assert main(["run", "drop.toml", "--out", "none", "--time", "0.1", "--scheme", scheme]) == 0
        assert f" {solver} " in capsys.readouterr().out


def test_quiet_prints_nothing(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "drop.toml", "--quiet"]) == 0
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err == ""


@pytest.mark.parametrize("kind", ["energy", "momentum", "residual", "contacts", "matrix", "all"])
def test_plot_writes_the_picture_and_prints_its_path(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["run", "drop.toml", "--quiet"])
    assert main(["plot", "drop.h5", "--kind", kind]) == 0
    assert capsys.readouterr().out.strip() == f"drop-{kind}.png"
    assert (folder / f"drop-{kind}.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", "drop.h5", "--kind", kind, "--step", "60", "--out", "picture.svg"]) == 0
    assert (folder / "picture.svg").read_bytes().startswith(b"<?xml")


def test_compare_tabulates_solvers(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "drop.toml", "--solvers", "pgs, sequential", "--time", "0.2"]) == 0
    printed = capsys.readouterr()
    assert "pgs" in printed.out
    assert "sequential" in printed.out
    assert "trajectory error [m]" in printed.out
    assert main(["compare", "drop.toml", "--solvers", "pgs,lemke", "--time", "0.2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["solver"] for row in told["rows"]] == ["pgs", "lemke"]
    assert told["rows"][0]["steps"] == 48


def test_scenes_lists_names_that_run_accepts(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes", "--json"]) == 0
    scenes = {scene["name"]: scene for scene in json.loads(capsys.readouterr().out)}
    assert {
        "seven_objects_from_file",
        "meshes_on_terrain",
        "first_steps_planar",
        "first_steps_spatial",
    } <= set(scenes)
    assert {scene["space"] for scene in scenes.values()} == {"planar", "spatial"}
    assert all(scene["duration"] > 0 and scene["description"] for scene in scenes.values())
    assert main(["scenes"]) == 0
    assert "meshes_on_terrain" in capsys.readouterr().out


def test_schema_prints_the_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert capsys.readouterr().out == scene_schema_text()


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    import carom

    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"carom {carom.__version__}\n"


BAD_INPUT = {
    "unknown scene": (["run", "first_step_planar"], "did you mean 'first_steps_planar'?"),
    "missing file": (["run", "drop2.toml"], "no such file 'drop2.toml'; did you mean 'drop.toml'?"),
    "bad file": (
        ["run", "bad.toml"],
        "bad.toml:6: body 'a': unknown key 'frction'; did you mean 'friction'?",
    ),
    "unknown solver": (["run", "drop.toml", "--solver", "pqs"], "pgs"),
    "negative time": (["run", "drop.toml", "--time", "-1"], "duration must be > 0, got -1.0"),
    "text for a number": (["run", "drop.toml", "--dt", "small"], "--dt"),
    "negative step": (["run", "drop.toml", "--dt", "-0.1"], "dt must be > 0, got -0.1"),
    "no frames": (["run", "drop.toml", "--every", "0"], "every must be a whole number >= 1, got 0"),
    "foreign output": (["run", "drop.toml", "--out", "drop.toml"], "exists and is no run of carom"),
    "no scene": (["run"], "SCENE"),
    "unknown command": (["rnu", "drop.toml"], "rnu"),
    "missing run": (["plot", "drop.h5"], "no such file"),
    "no run": (["plot", "drop.toml"], "cannot be read as HDF5"),
    "unknown kind": (["plot", "drop.toml", "--kind", "enrgy"], "energy"),
    "no solvers": (["compare", "drop.toml", "--solvers", ","], "distinct names"),
    "unknown solver to compare": (["compare", "drop.toml", "--solvers", "pqs"], "pqs"),
}


@pytest.mark.parametrize("case", BAD_INPUT.values(), ids=BAD_INPUT.keys())
def test_bad_input_ends_with_one_message_and_code_two(
    case: tuple[list[str], str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "bad.toml").write_text(
        'schema_version = 1\nspace = "planar"\n[[body]]\nname = "a"\nmass = 1\nfrction = 2\n'
    )
    words, says = case
    assert main(words) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert says in printed.err
    assert "Traceback" not in printed.err
    assert len(printed.err.strip().splitlines()) == 1
    assert not list(folder.glob("*.h5"))


def test_failed_run_keeps_its_steps_prints_the_table_and_ends_with_one(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", "seven_objects", "--solver", "direct", "--out", "failed.h5"]) == 1
    printed = capsys.readouterr()
    assert "failed" in printed.out
    assert "solver 'direct' refused" in printed.err.splitlines()[-1]
    run = Run.load(folder / "failed.h5")
    assert run.status == "failed"
    assert 0 < len(run.steps) < 960


def test_debug_shows_the_traceback_wherever_it_stands(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for words in (["--debug", "run", "drop2.toml"], ["run", "drop2.toml", "--debug"]):
        assert main(words) == 2
        assert "Traceback" in capsys.readouterr().err


def test_internal_error_is_one_message_and_code_one(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("carom.cli.run.run_world", lambda *_, **__: 1 / 0)
    assert main(["run", "drop.toml"]) == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("internal error: ZeroDivisionError")
    assert "--debug" in error


def test_interrupt_keeps_what_is_done_prints_the_table_and_ends_with_130(folder: Path) -> None:
    command = [sys.executable, "-c", "import sys; from carom.cli import main; sys.exit(main())",
               "run", "drop.toml", "--time", "100000", "--out", "long.h5"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    end = time.monotonic() + 60
    while not (folder / "long.h5").exists() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "interrupted" in out
    assert "worst residual" in out
    assert "interrupted" in err
    assert "Traceback" not in err
    run = Run.load(folder / "long.h5")
    assert run.status == "interrupted"
    assert len(run.steps) > 0
    assert run.time[-1] == pytest.approx(run.steps["time"][-1])
