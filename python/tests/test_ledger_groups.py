"""Books of groups of bodies from Python: closed forms, sums, closure, and what is refused."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import carom
from carom import BuildError, GroupReport, planar, spatial

G = 9.81


@pytest.mark.parametrize("scheme", ["fixed_step", "events"])
def test_a_block_gives_its_momentum_to_the_floor_and_its_energy_to_friction(scheme: str) -> None:
    w = planar.World(scheme=scheme, dt=1 / 240, tolerance=1e-12, iterations=20_000)
    w.add_static("floor", planar.HalfPlane(), friction=0.5)
    w.add_body("block", planar.Box(0.4, 0.2), mass=2.0, position=(0, 0.1), velocity=(3, 0), friction=0.5)
    w.ledger_groups = {"block": ["block"]}
    for _ in range(240):
        report = w.step()
    books = w.group_ledgers["block"]
    assert isinstance(report.groups["block"], GroupReport)
    assert books.ledger["friction"] == pytest.approx(-9.0, abs=1e-9)
    assert books.momentum_ledger["contact"] == pytest.approx([-6.0, 2.0 * G], abs=1e-9)
    assert books.momentum_ledger["gravity"] == pytest.approx([0.0, -2.0 * G], abs=1e-9)
    given = books.angular_momentum_ledger["contact"] + books.angular_momentum_ledger["gravity"]
    assert given == pytest.approx([0.6], abs=1e-9)
    assert abs(books.ledger["closure"]) < 1e-11
    assert pickle.loads(pickle.dumps(report)).groups == report.groups


@pytest.mark.parametrize("scheme", ["fixed_step", "events"])
def test_groups_that_divide_the_world_add_up_to_it(scheme: str) -> None:
    w: Any = carom.build_scene("seven_objects")
    w.scheme, w.on_inaccurate = scheme, "ignore"
    names = [body.name for body in w if body.kind == "dynamic"]
    w.ledger_groups = {"one": names[::2], "other": names[1::2], "all": None}
    assert w.ledger_groups == {"one": tuple(names[::2]), "other": tuple(names[1::2]), "all": None}
    start = w.ledger
    for _ in range(60):
        w.step()
    books = w.group_ledgers
    scale = max(abs(work) for work in w.ledger.values())
    for name, total in w.ledger.items():
        parts = books["one"].ledger[name] + books["other"].ledger[name]
        assert parts == pytest.approx(total - start[name], abs=1e-10 * scale), name
        assert books["all"].ledger[name] == pytest.approx(total - start[name], abs=1e-10 * scale), name
    assert np.allclose(books["all"].momentum, w.momentum)
    assert books["one"].energy + books["other"].energy == pytest.approx(w.energy["total"])


def test_books_begin_when_groups_are_set_and_end_with_none() -> None:
    w = spatial.World()
    w.add_body("ball", spatial.Sphere(0.1), mass=2.0, position=(0, 0, 1))
    assert w.step().groups == {}
    w.ledger_groups = {"all": None}
    w.step(0.1)
    assert w.group_ledgers["all"].momentum_ledger["gravity"] == pytest.approx([0, 0, -0.2 * G])
    w.ledger_groups = {}
    assert w.step().groups == {}
    assert w.group_ledgers == {}


@pytest.mark.parametrize(
    ("groups", "match"),
    [
        ({"a": ["nobody"]}, "nobody"),
        ({"a": ["floor"]}, "obstacle"),
        ({"a": ["ball", "ball"]}, "twice"),
        ({"": ["ball"]}, "empty"),
        ({"a": "ball"}, "lists"),
        (["ball"], "mapping"),
    ],
)
def test_groups_that_make_no_sense_are_refused(groups: Any, match: str) -> None:
    w = spatial.World()
    w.add_static("floor", spatial.HalfSpace())
    w.add_body("ball", spatial.Sphere(0.1), mass=2.0, position=(0, 0, 1))
    w.ledger_groups = {"all": None}
    with pytest.raises(BuildError, match=match):
        w.ledger_groups = groups
    assert w.ledger_groups == {"all": None}
