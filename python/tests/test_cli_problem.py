"""``carom problem``: what it prints, what it writes, its exit codes, and what Ctrl-C leaves."""

from __future__ import annotations

import io
import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from friction_files import ARCH, ROCKS, bodies, problem_of, write_fclib
from test_cli import SCENE

from carom import FRICTION_SOLVERS, FrictionProblem, check_certificate, planar
from carom._friction_problem_certificate import FrictionCertificate
from carom.cli import main
from carom.cli.problem_progress import SolveLine


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with two problems."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROCKS, tmp_path / "rocks.npz")
    shutil.copy(ARCH, tmp_path / "arch.npz")
    return tmp_path


def told(capsys: pytest.CaptureFixture[str]) -> Any:
    """What was printed on stdout, as JSON that has no infinite number."""

    def refuse(word: str) -> float:
        raise AssertionError(word)

    return json.loads(capsys.readouterr().out, parse_constant=refuse)


def test_solve_writes_impulses_that_check_accepts(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", "solve", "rocks.npz", "--repeat", "3", "--out", "r.npy", "--json"]) == 0
    table = told(capsys)
    assert table["solver"] == "exact"
    assert table["solved"] is True
    assert table["repeat"] == 3
    assert 0 < table["seconds"] <= table["seconds_median"] < 10
    assert table["contacts"] == 44
    assert sum(stage["iterations"] for stage in table["stages"]) == table["iterations"]
    assert table["err_nat"] <= 1e-8
    assert table["reason"] == ""
    r = np.load("r.npy")
    assert r.shape == (132,)
    assert FrictionProblem.load("rocks.npz").measure(r).err_nat == table["err_nat"]
    assert main(["problem", "check", "rocks.npz", "r.npy", "--json"]) == 0
    checked = told(capsys)
    assert checked["err_nat"] == table["err_nat"]
    assert checked["take_off"] + checked["stick"] + checked["slip"] == 44
    assert main(["problem", "check", "rocks.npz", "r.npy", "--tolerance", "1e-16"]) == 1
    assert "not solved at 1e-16" in capsys.readouterr().out


def test_solve_prints_a_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", "solve", "rocks.npz", "--tolerance", "1e-4", "--repeat", "2"]) == 0
    printed = capsys.readouterr().out
    for words in ("gen_rocks-s1-i00120-44", "exact", "solved at 0.0001", "iterations", "factorisations",
                  "best of 2, median", " ms", "err_nat", "err_scaled", "cone", "take off"):  # fmt: skip
        assert words in printed


def test_what_is_not_solved_has_exit_code_one_and_a_reason(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["problem", "solve", "arch.npz", "--solver", "pgs", "--iterations", "3", "--out", "r.npy"]
    assert main(words) == 1
    assert "not solved" in capsys.readouterr().out
    assert main([*words, "--json"]) == 1
    table = told(capsys)
    assert table["solved"] is False
    assert table["reason"]
    assert np.load("r.npy").shape == (165,)
    assert main(["problem", "solve", "arch.npz", "--start", "r.npy", "--json"]) == 0
    assert told(capsys)["solved"] is True


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["solve", "none.npz"], "none.npz': cannot be read: No such file"),
        (["solve", "rocks.npz", "--solver", "exakt"], "unknown solver 'exakt'; did you mean 'exact'"),
        (["solve", "rocks.npz", "--tolerance", "nan"], "tolerance must be finite"),
        (["solve", "rocks.npz", "--tolerance", "x"], "--tolerance"),
        (["solve", "rocks.npz", "--repeat", "0"], "repeat"),
        (["solve", "rocks.npz", "--out", "r.txt"], "r.txt': has no known suffix"),
        (["solve", "rocks.npz", "--start", "rocks.npz"], "give impulses as .npy"),
        (["check", "rocks.npz", "none.npy"], "No such file"),
        (["check", "rocks.npz", "short.npy"], "must be 132 finite numbers"),
        (["check", "rocks.npz", "words.npy"], "holds a <U1 array"),
        (["check", "rocks.npz", "bad.npy"], "holds no impulses"),
        (["check", "rocks.npz", "nan.npy"], "must be 132 finite numbers"),
        (["check", "bad.npy", "bad.npy"], "has no known suffix"),
        (["certify", "rocks.npz", "short.npy", "--out", "c.json"], "must be 132 finite numbers"),
        (["convert", "rocks.npz", "out.txt"], "no known suffix"),
        (["convert", "rocks.npz", "out.hdf5", "--global"], "body_form must be known"),
        (["convert", "rocks.npz", "out.npz", "--global"], "has no global form"),
        (["extract", "rocks.npz", "--step", "1", "--out", "p.npz"], "rocks.npz"),
        ([], "Usage"),
    ],
)
def test_bad_input_has_exit_code_two_and_a_remedy(
    words: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("short.npy", np.zeros(3))
    np.save("nan.npy", np.full(132, np.nan))
    np.save("words.npy", np.array(["a"]))
    Path("bad.npy").write_bytes(b"nothing")
    assert main(["problem", *words]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.out == ""


def test_certificates_from_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", "solve", "rocks.npz", "--out", "r.npy"]) == 0
    for suffix in ("json", "h5"):
        words = ["problem", "certify", "rocks.npz", "r.npy", "--out", f"c.{suffix}", "--islands"]
        assert main(words) == 0
        assert "44 contacts solved at 1e-08" in capsys.readouterr().out
        assert FrictionCertificate.load(f"c.{suffix}").islands
        assert check_certificate.main(["rocks.npz", "r.npy", f"c.{suffix}"]) == 0


def test_convert_there_and_back(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", "convert", "rocks.npz", "rocks.hdf5"]) == 0
    assert main(["problem", "convert", "rocks.hdf5", "back.npz"]) == 0
    first, back = FrictionProblem.load("rocks.npz"), FrictionProblem.load("back.npz")
    assert back.data.tobytes() == first.data.tobytes()
    assert back.q.tobytes() == first.q.tobytes()
    assert "44 contacts" in capsys.readouterr().out
    assert main(["problem", "solve", "rocks.hdf5", "--out", "solved.hdf5"]) == 0
    capsys.readouterr()
    assert main(["problem", "check", "solved.hdf5", "solved.hdf5", "--json"]) == 0
    assert told(capsys)["solved"] is True
    mass, h, _, f, w = bodies(1, 4)
    parts = {"M": mass, "H": h, "f": f, "w": w, "mu": np.full(4, 0.4)}
    write_fclib(Path("global.hdf5"), "fclib_global", 3, parts, "coo")
    assert main(["problem", "convert", "global.hdf5", "same.hdf5", "--global"]) == 0
    same = FrictionProblem.load("same.hdf5")
    assert same.data == pytest.approx(FrictionProblem.load("global.hdf5").data)
    assert same.body_form is not None


def test_show_tells_what_a_problem_is(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["problem", "show", "rocks.npz", "--json"]) == 0
    facts = told(capsys)
    w = FrictionProblem.load("rocks.npz").matrix.toarray()
    assert facts["contacts"] == 44
    assert facts["rows"] == 132
    assert facts["rank"] == np.linalg.matrix_rank(w, tol=1e-10 * np.linalg.norm(w, 2))
    assert facts["asymmetry"] == pytest.approx(np.abs(w - w.T).max() / np.abs(w).max())
    norms = [np.linalg.norm(w[i : i + 3, i : i + 3], 2) for i in range(0, 132, 3)]
    assert facts["block_ratio"] == pytest.approx(max(norms) / min(norms))
    assert facts["mass_ratio"] is None
    assert main(["problem", "show", "rocks.npz"]) == 0
    printed = capsys.readouterr().out
    for words in ("44", "islands", "redundant rows", "asymmetry", "block ratio", "friction", "speed"):
        assert words in printed
    monkeypatch.setattr("carom.cli.problem_tables.MOST_FOR_RANK", 10)
    assert main(["problem", "show", "rocks.npz"]) == 0
    assert "found with --rank" in capsys.readouterr().out
    assert main(["problem", "show", "rocks.npz", "--rank", "--json"]) == 0
    assert told(capsys)["rank"] == facts["rank"]
    w = planar.World()
    w.add_static("floor", planar.HalfPlane())
    for i, mass in enumerate((1.0, 1000.0)):
        w.add_body(f"box{i}", planar.Box(1, 1), mass=mass, position=(0, 0.5 + i))
    FrictionProblem.from_problem(w.problem()).save("stack.npz")
    assert main(["problem", "show", "stack.npz", "--json"]) == 0
    assert told(capsys)["mass_ratio"] == pytest.approx(1000)
    problem_of(np.diag([1.0, 0.0]), [-1.0, 1.0], [0.0, 0.0], 1).save("lcp.npz")
    assert main(["problem", "show", "lcp.npz", "--json"]) == 0
    facts = told(capsys)
    assert facts["kind"] == "lcp"
    assert facts["contacts_between_obstacles"] == 1
    assert facts["rank"] == 1


def test_extract_the_problem_of_a_step(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("drop.toml").write_text(SCENE)
    assert main(["run", "drop.toml", "--quiet"]) == 0
    for name in ("p.npz", "p.hdf5"):
        assert main(["problem", "extract", "drop.h5", "--step", "110", "--out", name]) == 0
        assert "drop-step110" in capsys.readouterr().out
        p = FrictionProblem.load(name)
        assert len(p) == 1
        assert p.dimension == 2
        assert main(["problem", "solve", name, "--json"]) == 0
        assert told(capsys)["solved"] is True
    assert main(["problem", "extract", "drop.h5", "--step", "120", "--out", "p.npz"]) == 2
    assert "has no step 120; choose a step from 0 to 119" in capsys.readouterr().err


def test_solvers_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["problem", "solvers"]) == 0
    assert capsys.readouterr().out.split() == list(FRICTION_SOLVERS)
    assert "exact" in FRICTION_SOLVERS


def test_a_terminal_is_shown_what_a_solve_is_doing() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    shown, piped = Terminal(), io.StringIO()
    for stream in (shown, piped):
        with SolveLine(stream) as line:
            line("interior point", 12, 1e-3)
            line("newton", 1, 1e-9)
    assert "interior point: 12 iterations, residual 1.0e-03" in shown.getvalue()
    last = shown.getvalue().split("\r")[-2:]
    assert [part.strip() for part in last] == ["", ""]
    assert piped.getvalue() == ""


def test_ctrl_c_keeps_the_best_impulses(folder: Path) -> None:
    words = [
        "problem",
        "solve",
        "arch.npz",
        "--solver",
        "pgs",
        "--tolerance",
        "0",
        "--iterations",
        "2000000000",
    ]
    code = "import sys; from carom.cli import main; print('ready', file=sys.stderr, flush=True); "
    command = [sys.executable, "-c", f"{code} sys.exit(main({[*words, '--out', 'r.npy', '--json']!r}))"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    assert process.stderr.readline() == "ready\n"
    time.sleep(1.5)
    assert process.poll() is None, process.communicate()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, (out, err)
    assert "interrupted" in err
    assert json.loads(out)["solved"] is False
    assert np.load("r.npy").shape == (165,)
