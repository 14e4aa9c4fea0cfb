"""Pictures: every kind and format, the right matrix, and colours that colour-blind readers tell apart."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from scripted import ScriptedWorld

from carom import planar
from carom.errors import CaromError
from carom.plotting import KINDS, PALETTE, normal_matrix, plot, save_figure
from carom.recording import Header, MemoryRecorder
from carom.run import Run, run_world
from carom.scene import load_scene


@pytest.mark.parametrize("kind", [*KINDS, "all"])
@pytest.mark.parametrize("dimension", [2, 3])
def test_every_kind_is_drawn_with_units_on_its_axes(kind: str, dimension: int) -> None:
    run = run_world(ScriptedWorld(dimension=dimension), 1.5, every=3)
    figure = plot(run, kind)
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    assert len(panels) >= (len(KINDS) if kind == "all" else 1)
    for axes in panels:
        labels = [axes.get_ylabel()] if not axes.get_xlabel() else [axes.get_xlabel(), axes.get_ylabel()]
        assert all("[" in label and "]" in label for label in labels), labels


@pytest.mark.parametrize(("suffix", "magic"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")])
def test_suffix_chooses_the_format(suffix: str, magic: bytes, tmp_path: Path) -> None:
    path = tmp_path / "deeper" / f"picture{suffix}"
    save_figure(plot(run_world(ScriptedWorld(), 0.2), "energy"), path)
    assert path.read_bytes().startswith(magic)
    assert path.stat().st_size > 4000


def test_pictures_without_steps_or_contacts_are_drawn_all_the_same() -> None:
    world = ScriptedWorld(fails_at=0)
    with pytest.raises(CaromError):
        run_world(world, 1.0)
    assert len(plot(world.last_run, "all").axes) >= len(KINDS)


def test_unknown_kinds_steps_and_formats_are_refused(tmp_path: Path) -> None:
    run = run_world(ScriptedWorld(), 0.2)
    with pytest.raises(CaromError, match="unknown plot 'enrgy'; choose one of energy"):
        plot(run, "enrgy")
    with pytest.raises(CaromError, match="step 20 is outside the run of 20 steps; give 0 to 19"):
        plot(run, "matrix", step=20)
    with pytest.raises(CaromError, match=r"unknown kind of picture '.bmp'"):
        save_figure(plot(run, "energy"), tmp_path / "x.bmp")


def _two_discs_on_a_floor() -> Run:
    """Discs 1 and 2 of masses 2 and 5 kg side by side on body 0; contacts 1-0, 2-0, 1-2."""
    world = ScriptedWorld(bodies=2)
    frame = world._frame()
    rows = np.zeros(3, dtype=world.contacts().dtype)
    rows["a"], rows["b"] = [1, 2, 1], [0, 0, 2]
    rows["normal"] = [[0, 1], [0, 1], [-1, 0]]
    rows["point"] = [[0, 0], [2, 0], [1, 1]]
    frame.position[0] = [[0, 0], [0, 1], [2, 1]]
    frame.contacts, frame.contact_offsets = rows, np.array([0, 3])
    inertia = np.array([np.nan, 1.0, 2.5])
    header = Header(
        "planar", world.names, np.array([1, 0, 0], np.uint8), np.array([np.inf, 2.0, 5.0]), inertia, {}
    )
    recorder = MemoryRecorder(header)
    recorder.append(frame)
    return Run(recorder.close())


def test_matrix_of_two_discs_is_the_closed_form() -> None:
    matrix = normal_matrix(_two_discs_on_a_floor(), 0)
    assert matrix.toarray() == pytest.approx(np.array([[0.5, 0, 0], [0, 0.2, 0], [0, 0, 0.7]]), abs=1e-15)
    assert matrix.nnz <= 9


def test_off_centre_contacts_couple_through_the_inertia() -> None:
    run = _two_discs_on_a_floor()
    run.contacts.all()["point"][:] = [[0.3, 0], [2, 0], [1, 1.2]]
    wanted = np.array([
        [1 / 2 + 0.3 * 0.3 / 1.0, 0, 0.3 * 0.2 / 1.0],
        [0, 1 / 5, 0],
        [0.3 * 0.2 / 1.0, 0, 1 / 2 + 1 / 5 + 0.2**2 / 1.0 + 0.2**2 / 2.5],
    ])  # fmt: skip
    assert normal_matrix(run, 0).toarray() == pytest.approx(wanted, abs=1e-14)


def test_matrix_of_a_frame_is_that_of_the_engines_contact_problem() -> None:
    world = load_scene("stack_spatial").build()
    run = run_world(world, 0.25)
    problem = world.problem()
    engine = problem.A.toarray()[::3, ::3]  # the normal row of each contact comes before its two tangents
    mine = normal_matrix(run, len(run.time) - 1).toarray()
    assert engine.shape == mine.shape
    assert len(engine) >= 40
    # where edges lie exactly on each other the order of the corners may change from step to step: one matrix
    # up to the order of its rows has the same eigenvalues
    wanted = np.linalg.eigvalsh(engine)
    assert np.linalg.eigvalsh(mine) == pytest.approx(wanted, abs=1e-3 * wanted.max())


#: Machado, Oliveira & Fernandes (2009), severity 1, linear RGB: protanopia and deuteranopia.
_BLINDNESS = (
    np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
)


def test_the_first_seven_colours_stay_apart_for_colour_blind_readers() -> None:
    rgb = np.array([to_rgb(colour) for colour in PALETTE[:7]])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    for blindness in (np.eye(3), *_BLINDNESS):
        seen = np.clip(linear @ blindness.T, 0, 1)
        for one, other in itertools.combinations(seen, 2):
            assert np.linalg.norm(one ** (1 / 2.4) - other ** (1 / 2.4)) > 0.1


def test_a_residual_that_stands_alone_is_drawn_and_the_solver_named() -> None:
    world = planar.World(iterations=2)
    world.add_static("floor", planar.HalfPlane(), restitution=0.9)
    world.add_body("box", planar.Box(1, 0.4), mass=1.0, position=(0, 1.1), restitution=0.9)
    world.add_body("other", planar.Box(1, 0.4), mass=1.0, position=(0.3, 1.9), restitution=0.9)
    world.on_inaccurate = "ignore"
    run = world.run(1.5)
    residual = run.steps["residual"]
    figure = plot(run, "residual")
    axes = figure.axes[0]
    alone = residual > 0
    alone[1:] &= residual[:-1] == 0
    alone[:-1] &= residual[1:] == 0
    points = [np.size(line.get_xdata()) for line in axes.get_lines() if line.get_marker() == "o"]
    assert alone.sum() > 3
    assert sorted(points) == [1, alone.sum()]  # the worst, and all that are alone
    assert axes.get_xlim() == (run.steps["time"][0], run.steps["time"][-1])
    assert "nncg" in figure.get_suptitle()
