"""Which impulses, and for how many factorisations: attributes of a world, keys of a scene, arguments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from carom import BuildError, FrictionProblem, StepError, spatial
from carom.scene import scene_from_text

#: Case C25: shares of the weight on the corners (+ +), (- +), (- -), (+ -), the load at (.3, .1).
SHARES = {(1, 1): 0.35, (-1, 1): 0.2, (-1, -1): 0.15, (1, -1): 0.3}


def table(**settings: Any) -> Any:
    w = spatial.World(**{"dt": 1 / 60, "tolerance": 1e-12, **settings})
    w.add_static("floor", spatial.HalfSpace(normal=(0, 0, 1)), friction=0.3)
    w.add_body("table", spatial.Box(2, 2, 0.2), mass=1.0, inertia=np.diag([0.5, 0.5, 0.8]),
               center_of_mass=(0.3, 0.1, 0.0), origin=(0, 0, 0.1), friction=0.3)  # fmt: skip
    return w


def shares(w: Any) -> dict[tuple[int, int], float]:
    contacts = w.contacts
    return {
        (int(np.sign(p[0])), int(np.sign(p[1]))): float(n) / (9.81 * w.dt)
        for p, n in zip(contacts["point"], contacts["normal_impulse"], strict=True)
    }


@pytest.mark.parametrize("solver", ["exact", "auto"])
def test_the_least_forces_on_a_table_are_those_of_statics(solver: str) -> None:
    w = table(solver=solver, impulses="minimum_norm")
    for _ in range(3):
        assert w.step().converged
        assert shares(w) == pytest.approx(SHARES, abs=1e-12)


def test_a_solver_that_finds_any_impulses_refuses_to_be_asked_for_the_least() -> None:
    w = table(solver="pgs", impulses="minimum_norm")
    with pytest.raises(StepError, match=r"minimum_norm.*exact"):
        w.step()


def test_the_settings_are_checked_by_name() -> None:
    w = table()
    assert (w.impulses, w.factorisations) == ("any", 2000)
    with pytest.raises(BuildError, match="impulses"):
        w.impulses = "least"
    with pytest.raises(BuildError, match="factorisations"):
        w.factorisations = -1
    w.factorisations = 10
    assert w.factorisations == 10


def test_a_spent_budget_of_factorisations_is_told() -> None:
    def first_step(factorisations: int) -> Any:
        w = spatial.World(dt=1 / 60, tolerance=1e-10, solver="exact", factorisations=factorisations)
        w.on_inaccurate = "ignore"
        w.add_static("floor", spatial.HalfSpace(normal=(0, 0, 1)), friction=0.5)
        for k in range(8):
            mass = 1e3 if k == 7 else 1.0
            w.add_body(f"box{k}", spatial.Box(1, 1, 1), mass=mass, position=(0, 0, 0.5 + k))
        return w.step()

    report = first_step(2)
    assert report.stop_reason == "out_of_factorisations"
    assert "factorisations" in str(report.explain())
    assert first_step(200).converged


def test_a_problem_takes_both_as_arguments() -> None:
    w = table(solver="exact")
    problem = w.problem()
    found = problem.solve("exact", tolerance=1e-12, impulses="minimum_norm")
    assert found.converged
    assert found.factorisations > 0
    np.testing.assert_allclose(np.sort(found.impulse[:, 0]) * 60 / 9.81, [0.15, 0.2, 0.3, 0.35], atol=1e-12)
    assert problem.solve("pgs", impulses="minimum_norm").status == "refused"
    assert problem.solve("exact", tolerance=1e-30, factorisations=3).status == "out_of_factorisations"
    with pytest.raises(BuildError, match="impulses"):
        problem.solve("exact", impulses="least")
    matrix = FrictionProblem.from_problem(problem)
    least = matrix.solve("exact", impulses="minimum_norm")
    assert least.solved
    np.testing.assert_allclose(least.impulse, found.impulse, atol=1e-12)
    assert "minimum_norm" in matrix.solve("nncg", impulses="minimum_norm").reason


def test_a_scene_file_says_both() -> None:
    scene = scene_from_text(
        'schema_version = 1\nspace = "spatial"\n[world]\nsolver = "exact"\nimpulses = "minimum_norm"\n'
        'factorisations = 50\n[[body]]\nname = "floor"\nkind = "static"\n'
        'shape = { type = "half_space", normal = [0, 0, 1] }\n'
    )
    settings = scene.build().settings
    assert (settings["impulses"], settings["factorisations"]) == ("minimum_norm", 50)
