"""The check of recorded runs: sound ones pass, what was changed is caught by the check it concerns."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from checked import failed, tumbling

import carom
from carom import spatial
from carom.check_run import CHECKS, Verdict, check_run
from carom.check_run_file import UnreadableRunError
from carom.check_run_frames import AUDITED
from carom.cli import main
from carom.recording import LAYOUT_VERSION
from carom.run import Run

RULES = ("explicit_euler", "semi_implicit_euler", "trapezoid", "implicit_midpoint", "rk4")
FOLDER = Path(__file__).parents[1] / "carom"


def recorded(world: Any, path: Path, duration: float, **options: Any) -> Verdict:
    world.on_inaccurate = "ignore"
    world.run(duration, out=path, **options)
    return check_run(path)


# --- sound runs ---


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_what_the_engine_records_follows_from_itself(tmp_path: Path, space: str, rule: str) -> None:
    found = recorded(tumbling(space, rule), tmp_path / "run.h5", 1.0)
    assert failed(found) == {}
    assert [c.name for c in found.checks if c.verdict == "not checked"] == []


@pytest.mark.parametrize(
    "scene",
    ["free_top", "dzhanibekov", "pile_small", "sliding_block_planar", "sliding_block_spatial",
     "bouncing_ball_planar", "bouncing_ball_spatial", "conveyor_planar", "seven_objects",
     "card_house", "billiard_break_spatial"],
)  # fmt: skip
def test_scenes_hold(tmp_path: Path, scene: str) -> None:
    found = recorded(carom.build_scene(scene), tmp_path / "run.h5", 0.8)
    assert failed(found) == {}


@pytest.mark.parametrize("rule", RULES)
def test_free_flight_tumbles_by_each_rule(tmp_path: Path, rule: str) -> None:
    w = carom.build_scene("dzhanibekov")
    w.integrator = rule
    found = recorded(w, tmp_path / "run.h5", 1.0)
    assert failed(found) == {}
    checks = {c.name: c for c in found.checks}
    assert checks["rotation"].bound is not None
    assert checks["rotation"].bound < 1e-11


@pytest.mark.parametrize(
    "settings",
    [
        {"impact": "sequential"}, {"position_correction": "nudge"}, {"friction_law": "box"},
        {"solver": "exact"}, {"solver": "auto"}, {"correction_slop": 0.0, "correction_fraction": 0.5},
    ],
)  # fmt: skip
def test_piles_hold_under_other_settings(tmp_path: Path, settings: dict[str, Any]) -> None:
    w = carom.build_scene("pile_small")
    for name, value in settings.items():
        setattr(w, name, value)
    assert failed(recorded(w, tmp_path / "run.h5", 0.6)) == {}


@pytest.mark.parametrize("rule", RULES)
def test_loads_that_change_within_a_step_are_told_by_their_mean(tmp_path: Path, rule: str) -> None:
    w = tumbling("spatial", rule)
    w.add_force(
        "wind", lambda t, x, v: {"force": np.sin(40 * t) - 0.3 * v, "torque": 0.01 * np.cos(30 * t) + 0 * x}
    )
    found = recorded(w, tmp_path / "run.h5", 0.8)
    assert failed(found) == {}
    assert {c.name: c.verdict for c in found.checks}["angular_balance"] == "ok"


@pytest.mark.parametrize("rule", ["semi_implicit_euler", "trapezoid", "implicit_midpoint", "rk4"])
def test_thin_and_fast_bodies_far_away_are_not_judged_too_sharply(tmp_path: Path, rule: str) -> None:
    w = spatial.World(dt=0.005, integrator=rule, gravity=(1, 2, -9))
    w.add_static("floor", spatial.HalfSpace(), friction=0.5)
    w.add_body("rod", spatial.Capsule(length=2, radius=0.001), mass=1, position=(1e4, 0, 1),
               angular_velocity=(3, 1, 1), friction=0.4, restitution=0.6)  # fmt: skip
    w.add_body("plate", spatial.Box(1, 1, 0.001), mass=1, position=(1e4, 3, 1), angular_velocity=(3, 1, 1))
    w.add_body(
        "top", spatial.Box(1, 0.3, 0.05), mass=1e3, position=(0, 0, 90), angular_velocity=(900, 90, 300)
    )
    assert failed(recorded(w, tmp_path / "run.h5", 0.8)) == {}


def test_without_every_step_the_rest_is_checked_and_said(tmp_path: Path) -> None:
    found = recorded(carom.build_scene("seven_objects"), tmp_path / "run.h5", 0.5, every=8)
    verdicts = {c.name: (c.verdict, c.note) for c in found.checks}
    assert failed(found) == {}
    assert verdicts["kinetic"][0] == verdicts["ledger"][0] == verdicts["cone"][0] == "ok"
    assert verdicts["translation"][0] == "not checked"
    assert "every=1" in verdicts["translation"][1]
    assert "not checked" in found.text().splitlines()[-1]


def test_a_run_in_memory_that_is_saved_is_checked_like_one_in_a_file(tmp_path: Path) -> None:
    tumbling("spatial", "trapezoid").run(0.6).save(tmp_path / "saved.h5")
    recorded(tumbling("spatial", "trapezoid"), tmp_path / "run.h5", 0.6)
    saved, run = check_run(tmp_path / "saved.h5"), check_run(tmp_path / "run.h5")
    assert saved.ok
    assert [c.to_dict() for c in saved.checks] == [c.to_dict() for c in run.checks]


def test_a_last_step_that_is_shorter_and_a_run_that_goes_on_are_sound(tmp_path: Path) -> None:
    w = carom.build_scene("bouncing_ball_planar")
    w.run(0.1)
    assert failed(recorded(w, tmp_path / "run.h5", 0.1234)) == {}


def without_the_new(path: Path) -> None:
    """Makes a file of layout version 1 out of one of version 2."""
    with h5py.File(path, "r+") as file:
        file.attrs["schema_version"] = 1
        for name in (
            "frames/action_offsets",
            "actions",
            "bodies/extent",
            "bodies/linear_damping",
            "bodies/angular_damping",
        ):
            del file[name]
        rows = file["contacts"][...]
        kept = [name for name in rows.dtype.names if name not in AUDITED]
        old = np.empty(len(rows), dtype=[(name, rows.dtype[name]) for name in kept])
        for name in kept:
            old[name] = rows[name]
        unit = file["contacts"].attrs["unit"]
        del file["contacts"]
        file.create_dataset("contacts", data=old).attrs["unit"] = unit


@pytest.mark.parametrize("rule", RULES)
def test_files_of_version_1_are_read_and_checked_as_far_as_they_go(tmp_path: Path, rule: str) -> None:
    path = tmp_path / "run.h5"
    recorded(tumbling("spatial", rule), path, 0.6)
    without_the_new(path)
    found = check_run(path)
    verdicts = {c.name: c.verdict for c in found.checks}
    assert failed(found) == {}
    assert verdicts["kinetic"] == verdicts["ledger"] == "ok"
    assert verdicts["linear_balance"] == verdicts["contact_law"] == verdicts["cone"] == "not checked"
    assert verdicts["penetration"] == "not checked"
    old = Run.load(path)
    assert len(old.time) == 121
    old.save(tmp_path / "saved.h5")
    assert failed(check_run(tmp_path / "saved.h5")) == {}


def rewritten(path: Path, name: str, rows: np.ndarray) -> None:
    """Puts other records in a table's place."""
    with h5py.File(path, "r+") as file:
        unit = file[name].attrs["unit"]
        del file[name]
        file.create_dataset(name, data=rows).attrs["unit"] = unit


def test_lines_that_later_ledgers_have_are_counted(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(sound) as file:
        old = file["steps"][...]
    form = [(name, old.dtype[name]) for name in old.dtype.names]
    form.insert([name for name, _ in form].index("projection"), ("of_later", "f8"))
    new = np.empty(len(old), dtype=form)
    for name in old.dtype.names:
        new[name] = old[name]
    new["of_later"] = 0.25 * old["friction"]
    new["friction"] = 0.75 * old["friction"]
    rewritten(path, "steps", new)
    assert failed(check_run(path)) == {}
    new["friction"] = old["friction"]
    rewritten(path, "steps", new)
    assert {"ledger", "work_of_contacts"} <= failed(check_run(path)).keys()


def test_a_scheme_that_is_not_known_is_not_judged(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        settings = json.loads(file["settings"][()])
        file["settings"][()] = json.dumps({**settings, "scheme": "of_later"})
    checks = {c.name: c for c in check_run(path).checks}
    assert checks["translation"].verdict == checks["contact_law"].verdict == "not checked"
    assert "of_later" in checks["translation"].note
    assert checks["kinetic"].verdict == checks["ledger"].verdict == checks["cone"].verdict == "ok"


# --- tampering ---


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "sound.h5"
    w = carom.build_scene("pile_small")
    w.solver, w.tolerance = "auto", 1e-8
    assert failed(recorded(w, path, 0.6)) == {}
    return path


def field(table: str, column: str, row: int, change: Callable[[Any], Any]) -> Callable[[Any], None]:
    def tamper(file: Any) -> None:
        record = file[table][row]
        record[column] = change(record[column])
        file[table][row] = record

    return tamper


def entry(name: str, at: tuple[int, ...], change: Callable[[float], float]) -> Callable[[Any], None]:
    def tamper(file: Any) -> None:
        file[f"frames/{name}"][at] = change(file[f"frames/{name}"][at])

    return tamper


def bend(name: str, at: tuple[int, ...], by: float) -> Callable[[Any], None]:
    return entry(name, at, lambda x: x + by)


def shift(column: str, row: int, by: float) -> Callable[[Any], None]:
    return field("steps", column, row, lambda x: x + by)


def weigh(file: Any) -> None:
    file["bodies/mass"][9] = 1.0001 * file["bodies/mass"][9]


def shrink(file: Any) -> None:
    file["bodies/extent"][9] = 1e-9


def pressed(file: Any) -> int:
    """The row of the contact that presses hardest."""
    return int(np.argmax(file["contacts"]["normal_impulse"]))


def on_contact(column: str, change: Callable[[Any], Any]) -> Callable[[Any], None]:
    return lambda file: field("contacts", column, pressed(file), change)(file)


TAMPERING: dict[str, tuple[Callable[[Any], None], set[str]]] = {
    "a velocity": (bend("velocity", (100, 9, 0), 1e-9), {"kinetic", "momentum", "linear_balance"}),
    "a spin": (bend("angular_velocity", (100, 9, 0), 1e-6), {"angular_momentum", "angular_balance"}),
    "a position": (bend("position", (100, 9, 0), 1e-9), {"translation", "angular_momentum"}),
    "a height": (bend("position", (100, 9, 2), 1e-9), {"translation", "potential"}),
    "a rotation": (bend("rotation", (100, 9, 1), 1e-6), {"rotation", "unit_rotations"}),
    "a frame's time": (bend("time", (50,), 1e-12), {"times"}),
    "a nan": (entry("velocity", (60, 9, 1), lambda x: np.nan), {"finite", "linear_balance"}),
    "a nan in a line": (field("steps", "friction", 40, lambda x: np.nan), {"finite", "ledger"}),
    "a step's time": (shift("time", 50, 1e-12), {"times"}),
    "a step's length": (field("steps", "dt", 50, lambda x: x * 1.001), {"times", "step_length"}),
    "an energy": (shift("kinetic", 100, 1e-9), {"kinetic", "ledger"}),
    "a potential": (shift("potential", 100, -1e-9), {"potential", "ledger"}),
    "a momentum": (shift("momentum", 100, 1e-9), {"momentum"}),
    "an angular momentum": (shift("angular_momentum", 100, 1e-9), {"angular_momentum"}),
    "gravity": (shift("gravity", 100, 1e-5), {"work_of_gravity"}),
    "friction": (shift("friction", 100, -1e-5), {"ledger", "work_of_contacts"}),
    "projection": (shift("projection", 100, 1e-5), {"ledger", "work_of_correction"}),
    "applied": (shift("applied", 100, 1e-5), {"ledger", "work_of_loads"}),
    "damping": (shift("damping", 100, 1e-5), {"ledger", "work_of_damping"}),
    "a closure": (shift("closure", 100, 1e-6), {"ledger", "closure"}),
    "a residual": (field("steps", "residual", 100, lambda x: 0.0), {"contact_law"}),
    "a depth": (shift("deepest_gap", 100, 1e-9), {"contact_table"}),
    "a count": (shift("contacts", 100, 1), {"contact_table"}),
    "a push": (on_contact("normal_impulse", lambda x: x * (1 + 1e-9)), {"linear_balance"}),
    "a pull": (on_contact("normal_impulse", lambda x: -x), {"linear_balance", "cone"}),
    "a rub": (on_contact("friction_impulse", lambda x: x + 1e-9), {"linear_balance", "angular_balance"}),
    "a strike": (on_contact("impact_impulse", lambda x: x + 1e-5), {"translation", "rotation"}),
    "a gap": (on_contact("gap", lambda x: x - 1.0), {"contact_table"}),
    "a normal": (on_contact("kick_normal", lambda x: 1.1 * x), {"contact_table"}),
    "a coefficient": (on_contact("friction", lambda x: x * 0.01), {"cone"}),
    "an arm": (on_contact("kick_arm", lambda x: x + 1e-6), {"angular_balance"}),
    "a moment": (on_contact("moment", lambda x: x + 1e-9), {"angular_balance"}),
    "a mass": (weigh, {"kinetic", "momentum"}),
    "an extent": (shrink, {"penetration"}),
    "steps told": (field("progress", "steps", 0, lambda x: x + 5), {"times"}),
}  # fmt: skip


@pytest.mark.parametrize("name", TAMPERING)
def test_what_was_changed_is_caught_by_the_check_it_concerns(sound: Path, tmp_path: Path, name: str) -> None:
    tamper, wanted = TAMPERING[name]
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        tamper(file)
    found = check_run(path)
    assert wanted <= failed(found).keys()
    assert not found.ok
    assert found.text().splitlines()[-1].startswith("FAILED")


def test_a_load_and_a_correction_left_out_are_missed(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    recorded(tumbling("spatial", "trapezoid"), path, 0.8)
    with h5py.File(path, "r+") as file:
        rows = file["actions"][...]
        rows["force"] = 0
        file["actions"][...] = rows
    assert {"linear_balance", "work_of_loads"} <= failed(check_run(path)).keys()


def test_the_worst_step_is_the_one_that_was_changed(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        bend("velocity", (100, 9, 0), 1e-3)(file)
        name = file["bodies/name"].asstr()[9]
    worst = {c.name: c for c in check_run(path).checks}
    assert worst["momentum"].step == 99
    assert worst["linear_balance"].step in (99, 100)
    assert worst["linear_balance"].where == name


def test_bounds_are_arguments(sound: Path) -> None:
    assert "closure" in failed(check_run(sound, closure=1e-30))
    assert "penetration" in failed(check_run(sound, penetration=1e-12))


def test_every_check_can_fail() -> None:
    """What tampering reaches, and the two that a law allows or a run was told to go on with."""
    reached = set[str]().union(*(wanted for _, wanted in TAMPERING.values()))
    assert set(CHECKS) - reached == {"impact_dissipation", "friction_dissipation", "residual"}


def test_energy_from_impacts_fails_and_from_friction_warns(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        shift("impact_normal", 30, 1e3)(file)
        shift("friction", 31, 1e3)(file)
        settings = json.loads(file["settings"][()])
        settings["on_inaccurate"] = "raise"
        file["settings"][()] = json.dumps(settings)
        field("steps", "residual", 32, lambda x: 1.0)(file)
    verdicts = {c.name: c.verdict for c in check_run(path).checks}
    assert verdicts["impact_dissipation"] == verdicts["residual"] == "failed"
    assert verdicts["friction_dissipation"] == "warning"


# --- files that are not trusted ---


def link(file: Any) -> None:
    del file["steps"]
    file["steps"] = h5py.ExternalLink("other.h5", "/steps")


def link_of_all(file: Any) -> None:
    del file["frames"]
    file["frames"] = h5py.ExternalLink("other.h5", "/frames")


def soft_link(file: Any) -> None:
    del file["steps"]
    file["steps"] = h5py.SoftLink("/contacts")


def outside(file: Any) -> None:
    shape = file["frames/time"].shape
    del file["frames/time"]
    file["frames"].create_dataset("time", shape, "f8", external=[("/etc/passwd", 0, 8 * shape[0])])


def bomb(file: Any) -> None:
    del file["frames/time"]
    file["frames"].create_dataset("time", (10**14,), "f8", chunks=(1024,))


def objects(file: Any) -> None:
    del file["steps"]
    file.create_dataset("steps", data=["a"], dtype=h5py.string_dtype())


def shapes(file: Any) -> None:
    del file["frames/velocity"]
    file["frames"].create_dataset("velocity", data=np.zeros((2, 3)))


def offsets(file: Any) -> None:
    file["frames/contact_offsets"][5] = 10**9


def nobody(file: Any) -> None:
    field("contacts", "a", 0, lambda x: 10**6)(file)


def weightless(file: Any) -> None:
    file["bodies/mass"][9] = -1.0


def later(file: Any) -> None:
    file.attrs["schema_version"] = LAYOUT_VERSION + 1


@pytest.mark.parametrize(
    "damage",
    [link, link_of_all, soft_link, outside, bomb, objects, shapes, offsets, nobody, weightless, later],
)
def test_unsafe_and_damaged_files_are_refused(
    sound: Path, tmp_path: Path, damage: Callable[[Any], None]
) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(UnreadableRunError):
        check_run(path)
    assert main(["check", str(path)]) == 2


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("hello")
    h5py.File(tmp_path / "other.h5", "w").close()
    for name in ("text.h5", "other.h5", "absent.h5"):
        with pytest.raises(UnreadableRunError):
            check_run(tmp_path / name)


# --- the command ---


def test_command_tells_and_returns(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(sound)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("OK: ")
    assert main(["check", str(sound), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] is True
    assert [check["name"] for check in found["checks"]] == list(CHECKS)
    assert main(["check", str(sound), "--penetration", "1e-12"]) == 1
    assert "penetration" in capsys.readouterr().out.splitlines()[-1]


def test_progress_goes_to_one_and_an_interrupt_comes_through(sound: Path) -> None:
    told: list[float] = []
    check_run(sound, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0

    def interrupt(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        check_run(sound, progress=interrupt)


def test_check_needs_nothing_of_the_engine(sound: Path, tmp_path: Path) -> None:
    """The files alone, in a folder of their own, in an interpreter where the package cannot be imported."""
    for part in FOLDER.glob("check_run*.py"):
        shutil.copy(part, tmp_path)
    (tmp_path / "carom.py").write_text("raise ImportError('the engine')")
    asked = subprocess.run(
        [sys.executable, str(tmp_path / "check_run.py"), str(sound), "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert asked.returncode == 0, asked.stderr
    assert json.loads(asked.stdout)["ok"] is True


def test_ctrl_c_ends_the_command_with_its_own_code(
    sound: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any, **__: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("carom.cli.check.check_run", interrupted)
    assert main(["check", str(sound)]) == 130
    assert "interrupted" in capsys.readouterr().err


# --- runs that did not come to their end ---


def test_a_run_that_failed_holds_up_to_its_failure(tmp_path: Path) -> None:
    w = carom.build_scene("bouncing_ball_planar")
    w.add_force("end", lambda t, x, v: {"force": 0 * x if t < 0.2 else np.nan * x})
    with pytest.raises(carom.errors.StepError):
        w.run(1.0, out=tmp_path / "run.h5", every=5)
    found = check_run(tmp_path / "run.h5")
    assert found.status == "failed"
    assert failed(found) == {}


def test_a_run_whose_writer_was_killed_holds_as_far_as_it_came(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    code = f"import carom; carom.build_scene('bouncing_ball_planar').run(1e4, out={str(path)!r})"
    environment = {"PYTHONPATH": ":".join(filter(None, [str(FOLDER.parent), *sys.path]))}
    writer = subprocess.Popen([sys.executable, "-c", code], env=environment)
    try:
        end = time.monotonic() + 60
        while not (path.exists() and path.stat().st_size > 3_000_000) and time.monotonic() < end:
            time.sleep(0.05)
    finally:
        writer.kill()
        writer.wait()
    found = check_run(path)
    assert found.status == "running"
    assert found.frames > 10
    assert failed(found) == {}
