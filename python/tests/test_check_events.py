"""The check of recorded runs with events: sound ones pass with nothing open, what was changed is caught."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import checked
import h5py
import numpy as np
import pytest
from checked import failed

import carom
from carom import BuildError, planar
from carom.check_run import Verdict, check_run
from carom.check_run_events import EVENT_CHECKS
from carom.run import Run

FLOW, IMPACT = carom.EVENT_KINDS.index("flow"), carom.EVENT_KINDS.index("impact")


def recorded(world: Any, path: Path, duration: float, **options: Any) -> Verdict:
    world.scheme, world.on_inaccurate = "events", "ignore"
    world.run(duration, out=path, **options)
    return check_run(path)


def tumbling(space: str, rule: str) -> Any:
    return checked.tumbling(space, rule, dt=1 / 100, scheme="events")


# --- sound runs ---


@pytest.mark.parametrize("rule", ["trapezoid", "implicit_midpoint"])
@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_what_the_engine_records_follows_from_itself(tmp_path: Path, space: str, rule: str) -> None:
    found = recorded(tumbling(space, rule), tmp_path / "run.h5", 1.0)
    assert failed(found) == {}
    assert [c.name for c in found.checks if c.verdict == "not checked"] == []
    assert {c.name for c in found.checks} >= set(EVENT_CHECKS)


@pytest.mark.parametrize(
    "scene",
    ["free_top", "dzhanibekov", "pile_small", "sliding_block_planar", "sliding_block_spatial",
     "bouncing_ball_planar", "bouncing_ball_spatial", "conveyor_planar", "seven_objects",
     "billiard_break_spatial"],
)  # fmt: skip
def test_scenes_hold(tmp_path: Path, scene: str) -> None:
    found = recorded(carom.build_scene(scene), tmp_path / "run.h5", 0.4)
    assert failed(found) == {}


def test_a_step_of_a_tenth_with_many_bounces_in_it_holds(tmp_path: Path) -> None:
    w = planar.World(scheme="events", dt=0.1)
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.3)
    for k in range(4):
        w.add_body(f"ball{k}", planar.Circle(0.1), density=900.0, position=(0.02 * k, 0.3 + 0.25 * k),
                   restitution=0.6, friction=0.3)  # fmt: skip
    found = recorded(w, tmp_path / "run.h5", 2.0)
    assert failed(found) == {}
    events = Run.load(tmp_path / "run.h5").events
    assert max(len(np.unique(rows["time"])) for rows in events) > 4


def test_loads_that_change_are_told_by_what_acted(tmp_path: Path) -> None:
    w = tumbling("spatial", "trapezoid")
    w.add_force(
        "wind", lambda t, x, v: {"force": np.sin(40 * t) - 0.3 * v, "torque": 0.01 * np.cos(30 * t) + 0 * x}
    )
    found = recorded(w, tmp_path / "run.h5", 0.8)
    assert failed(found) == {}


@pytest.mark.parametrize("law", ["newton", "moreau", "poisson", "sequential"])
def test_other_impact_laws_hold(tmp_path: Path, law: str) -> None:
    w = tumbling("planar", "trapezoid")
    w.impact = law
    assert failed(recorded(w, tmp_path / "run.h5", 0.8)) == {}


def test_overlaps_that_are_given_and_steps_that_are_capped_hold(tmp_path: Path) -> None:
    w = tumbling("spatial", "trapezoid")
    w["ball"].position = (0, 0, 0.15)
    w.events = {"cap": 1}
    found = recorded(w, tmp_path / "run.h5", 0.6)
    assert failed(found) == {}
    pieces = Run.load(tmp_path / "run.h5")._data.table("pieces")
    assert pieces is not None
    assert {0, 1, 2, 3} <= set(pieces["kind"].tolist())


def test_events_are_recorded_where_every_step_is_a_frame_or_on_demand(tmp_path: Path) -> None:
    for every, wanted, there in ((1, None, True), (4, None, False), (4, True, True), (1, False, False)):
        found = recorded(tumbling("planar", "trapezoid"), tmp_path / "run.h5", 0.1, every=every,
                         record_events=wanted)  # fmt: skip
        with h5py.File(tmp_path / "run.h5") as file:
            assert ("events" in file) == there
        notes = {c.name: c.note for c in found.checks if c.verdict == "not checked"}
        assert failed(found) == {}
        if every == 1 and not there:
            assert "record_events" in notes["translation"]
    fixed = tumbling("planar", "trapezoid")
    fixed.scheme = "fixed_step"
    assert check_run(fixed.run(0.1, out=tmp_path / "fixed.h5").path or "").ok
    with pytest.raises(BuildError, match="record_events"):
        _ = Run.load(tmp_path / "fixed.h5").events


def test_a_run_in_memory_that_is_saved_is_checked_like_one_in_a_file(tmp_path: Path) -> None:
    run = tumbling("spatial", "trapezoid").run(0.5)
    run.save(tmp_path / "saved.h5")
    recorded(tumbling("spatial", "trapezoid"), tmp_path / "run.h5", 0.5)
    saved, plain = check_run(tmp_path / "saved.h5"), check_run(tmp_path / "run.h5")
    assert saved.ok
    assert [c.to_dict() for c in saved.checks] == [c.to_dict() for c in plain.checks]
    assert (run.events.all() == Run.load(tmp_path / "saved.h5").events.all()).all()


def test_the_log_of_a_step_has_its_impacts_and_flows_and_contacts_their_sums() -> None:
    w = planar.World(scheme="events", dt=0.1)
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.0)
    w.add_body("ball", planar.Circle(0.1), mass=2.0, position=(0, 0.3), restitution=0.5, friction=0.0)
    assert len(w.event_log) == 0
    fallen = (0.4 / 9.81) ** 0.5  # .2 m
    while w.time < fallen:
        w.step()
    log = w.event_log
    assert log.dtype.names is not None
    hit = log[log["kind"] == IMPACT]
    assert hit["time"] == pytest.approx([fallen], abs=1e-12)
    assert hit["length"].tolist() == [0.0]
    assert hit["impulse"][0, 1] * (1 if hit["a"][0] == 1 else -1) == pytest.approx(
        2.0 * 1.5 * 9.81 * fallen, abs=1e-9
    )
    assert w.contacts["normal_impulse"].sum() == pytest.approx(2.0 * 1.5 * 9.81 * fallen, abs=1e-9)


def test_contact_impulses_are_those_of_the_whole_step() -> None:
    w = planar.World(scheme="events", dt=0.1)
    w.add_static("floor", planar.HalfPlane(normal=(0, 1)), friction=0.5)
    w.add_body("block", planar.Box(0.4, 0.2), mass=3.0, position=(0, 0.1), velocity=(0.3, 0), friction=0.5)
    w.step()  # slides for .061 s, then rests
    assert len(np.unique(w.event_log["time"])) == 2
    contacts = w.contacts
    assert contacts["normal_impulse"].sum() == pytest.approx(3.0 * 9.81 * 0.1, abs=1e-10)
    assert np.abs(contacts["friction_impulse"][:, 0].sum()) == pytest.approx(0.9, abs=1e-9)


# --- tampering ---


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "sound.h5"
    assert failed(recorded(tumbling("spatial", "trapezoid"), path, 1.0)) == {}
    return path


def largest(file: Any, kind: int) -> int:
    """The row of the event of a kind with the largest impulse."""
    rows = file["events"][...]
    return int(np.argmax(np.where(rows["kind"] == kind, np.linalg.norm(rows["impulse"], axis=1), -1)))


def on_event(kind: int, column: str, change: Callable[[Any], Any]) -> Callable[[Any], None]:
    def tamper(file: Any) -> None:
        row = largest(file, kind)
        record = file["events"][row]
        record[column] = change(record[column])
        file["events"][row] = record

    return tamper


def on_row(table: str, row: int, column: str, change: Callable[[Any], Any]) -> Callable[[Any], None]:
    def tamper(file: Any) -> None:
        record = file[table][row]
        record[column] = change(record[column])
        file[table][row] = record

    return tamper


def on_frame(name: str, at: tuple[int, ...], by: float) -> Callable[[Any], None]:
    def tamper(file: Any) -> None:
        file[f"frames/{name}"][at] = file[f"frames/{name}"][at] + by

    return tamper


def later_together(file: Any) -> None:
    """Moves an impact, and the pieces around it, to a later time: all tables agree."""
    events, pieces = file["events"][...], file["pieces"][...]
    row = largest(file, IMPACT)
    when, by = events["time"][row], 1e-4
    for rows in (events, pieces):
        ends = np.abs(rows["time"] + rows["length"] - when) < 1e-12
        begins = np.abs(rows["time"] - when) < 1e-12
        rows["length"][ends & (rows["length"] > 0)] += by
        rows["length"][begins & (rows["length"] > 0)] -= by
        rows["time"][begins] += by
    file["events"][...], file["pieces"][...] = events, pieces


TAMPERING: dict[str, tuple[Callable[[Any], None], set[str]]] = {
    "a velocity": (on_frame("velocity", (60, 2, 0), 1e-9), {"kinetic", "momentum", "linear_balance"}),
    "a spin": (on_frame("angular_velocity", (60, 3, 0), 1e-6), {"angular_momentum", "angular_balance"}),
    "a position": (on_frame("position", (60, 2, 0), 1e-9), {"translation"}),
    "a rotation": (on_frame("rotation", (60, 3, 1), 1e-6), {"rotation", "unit_rotations"}),
    "an obstacle's place": (on_frame("position", (60, 1, 0), 1e-6), {"translation"}),
    "a flow's push": (on_event(FLOW, "impulse", lambda x: x * (1 + 1e-8)), {"linear_balance"}),
    "a flow's pull": (on_event(FLOW, "impulse", lambda x: -x), {"linear_balance", "cone", "contact_law"}),
    "an impact": (on_event(IMPACT, "impulse", lambda x: x * 1.001), {"linear_balance", "translation"}),
    "an arm": (on_event(FLOW, "arm_b", lambda x: x + 1e-6), {"angular_balance"}),
    "a normal": (on_event(IMPACT, "normal", lambda x: 1.1 * x), {"event_table"}),
    "a turned normal": (on_event(FLOW, "normal", lambda x: np.roll(x, 1)), {"cone"}),
    "a moment": (on_event(FLOW, "moment", lambda x: x + 1e-8), {"angular_balance"}),
    "a coefficient": (on_event(FLOW, "friction", lambda x: x * 0.01), {"cone"}),
    "a restitution": (on_event(IMPACT, "restitution", lambda x: x + 0.1), {"impact_law"}),
    "an event's time": (on_event(IMPACT, "time", lambda x: x + 1e-4), {"event_table"}),
    "an event's length": (on_event(FLOW, "length", lambda x: 0.5 * x), {"event_table"}),
    "an event's kind": (on_event(FLOW, "kind", lambda x: IMPACT), {"event_table"}),
    "an event's act": (on_event(IMPACT, "act", lambda x: x + 7), {"event_table"}),
    "a time everywhere": (later_together, {"translation"}),
    "a piece's length": (on_row("pieces", 0, "length", lambda x: x + 1e-6), {"event_table"}),
    "a piece's pull": (on_row("pieces", 0, "impulse", lambda x: x + 1e-6), {"linear_balance"}),
    "gravity's line": (on_row("steps", 60, "gravity", lambda x: x + 1e-6), {"work_of_gravity"}),
    "the line of friction": (
        on_row("steps", 60, "friction", lambda x: x - 1e-6),
        {"ledger", "work_of_contacts"},
    ),
    "two lines that cancel": (
        lambda file: [
            on_row("steps", 60, "friction", lambda x: x - 1e-6)(file),
            on_row("steps", 60, "contact_normal", lambda x: x + 1e-6)(file),
        ][0],
        {"work_of_contacts"},
    ),
    "projection's line": (
        on_row("steps", 60, "projection", lambda x: x + 1e-6),
        {"ledger", "work_of_correction"},
    ),
    "the line of damping": (on_row("steps", 60, "damping", lambda x: x + 1e-6), {"work_of_damping"}),
    "the line of loads": (on_row("steps", 0, "applied", lambda x: x + 1e-6), {"work_of_loads"}),
    "a total": (on_row("steps", 60, "momentum", lambda x: x + 1e-9), {"momentum"}),
}


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


def test_events_that_are_left_out_are_missed(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        rows = file["events"][...]
        step = int(np.searchsorted(file["frames/event_offsets"][...], largest(file, FLOW), side="right")) - 2
        rows["impulse"][largest(file, FLOW)] = 0
        file["events"][...] = rows
    worst = {c.name: c for c in check_run(path).checks}["linear_balance"]
    assert worst.verdict == "failed"
    assert worst.step == step
    assert worst.where in ("ball", "box")


def test_a_point_that_is_not_where_the_arms_end_is_told(sound: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copy(sound, path)
    with h5py.File(path, "r+") as file:
        on_event(FLOW, "point", lambda x: x + 1e-6)(file)
    verdicts = {c.name: c.verdict for c in check_run(path).checks}
    assert verdicts["one_point"] == "warning"


def test_every_event_check_can_fail() -> None:
    """All but the one that warns."""
    assert set(EVENT_CHECKS) - {"one_point"} <= set[str]().union(
        *(wanted for _, wanted in TAMPERING.values())
    )
