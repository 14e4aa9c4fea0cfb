"""Arrays over the engine's memory: they are the state, they cannot dangle, they cannot race a step."""

from __future__ import annotations

import gc
import threading
import time

import numpy as np
import pytest
from spaces import PLANE, Face, both

from carom import BuildError, BusyError, StepError, ViewError


@both
def test_views_are_the_state(face: Face) -> None:
    w = face.stack(2)
    d = face.dimension
    assert w.position.shape == w.velocity.shape == (3, d)
    assert w.rotation.shape == (3, 2 if d == 2 else 4)
    assert w.angular_velocity.shape == ((3,) if d == 2 else (3, 3))
    w.velocity[1:, 0] = [3.0, 4.0]
    assert w["box1"].velocity[0] == 4.0
    w["box0"].position = face.at(7, 8)
    assert w.position[1].tolist() == list(face.at(7, 8))
    w.position = w.position + 1.0
    assert w["box0"].position == pytest.approx(np.array(face.at(7, 8)) + 1.0)
    with pytest.raises(BuildError, match=r"velocity must be a .* array"):
        w.velocity = np.zeros(d + 5)


@both
def test_a_view_follows_the_steps_without_moving(face: Face) -> None:
    w = face.stack(2)
    position, velocity = w.position, w.velocity
    addresses = position.ctypes.data, velocity.ctypes.data
    for _ in range(20):
        w.step()
    assert (w.position.ctypes.data, w.velocity.ctypes.data) == addresses
    assert position.tolist() == w.position.tolist()
    velocity[1, 0] = 2.0
    w.step()
    assert w["box0"].velocity[0] != 0.0


@both
def test_viewed_and_unviewed_worlds_take_the_same_steps(face: Face) -> None:
    plain, viewed = face.pile(6), face.pile(6)
    views = [viewed.position, viewed.rotation, viewed.velocity, viewed.angular_velocity]
    for _ in range(100):
        plain.step()
        viewed.step()
    assert plain.snapshot() == viewed.snapshot()
    assert len(views) == 4


@both
def test_structural_changes_are_refused_while_views_live(face: Face) -> None:
    w = face.stack(1)
    snapshot = w.snapshot()
    position, slice_of_velocity = w.position, w.velocity[:, 0]
    wanted = r"arrays of the world are still in use \(position, velocity\); drop them with del, or keep"
    with pytest.raises(ViewError, match="cannot add body 'x': " + wanted):
        w.add_body("x", mass=1.0)
    with pytest.raises(ViewError, match="cannot remove body 'box0': " + wanted):
        w.remove("box0")
    with pytest.raises(ViewError, match="cannot restore a snapshot: " + wanted):
        w.restore(snapshot)
    del position
    with pytest.raises(ViewError, match=r"\(velocity\)"):
        w.add_body("x", mass=1.0)
    kept = slice_of_velocity.copy()
    del slice_of_velocity
    w.add_body("x", mass=1.0)
    w.remove("x")
    w.restore(snapshot)
    assert len(kept) == 2


@both
def test_a_view_outlives_the_name_of_its_world(face: Face) -> None:
    w = face.stack(2)
    height = w.position[:, -1]
    del w
    gc.collect()
    assert height.tolist() == [0.0, 0.5, 1.5]
    height[1] = 9.0
    assert height[1] == 9.0


def test_a_view_of_no_bodies() -> None:
    w = PLANE.world()
    assert w.position.shape == (0, 2)
    assert w.angular_velocity.shape == (0,)
    w.step()


@both
def test_copies_of_bodies_cannot_be_mistaken_for_views(face: Face) -> None:
    w = face.stack(1)
    with pytest.raises(ValueError, match="read-only"):
        w["box0"].position[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        w.mass[0] = 1.0


@both
def test_numbers_that_are_not_finite_are_found_by_the_next_step(face: Face) -> None:
    w = face.stack(2)
    before = w.snapshot()
    w.velocity[2, 0] = np.nan
    with pytest.raises(StepError, match="body 'box1': velocity is not finite") as caught:
        w.step()
    assert (caught.value.body, caught.value.field) == ("box1", "velocity")
    with pytest.raises(BuildError, match="body 'box1': motion is not finite"):
        w.snapshot()
    w.velocity[2, 0] = 0.0
    assert w.snapshot() == before
    w.velocity[:] = 1.0
    with pytest.raises(StepError, match="body 'floor': velocity must be 0 for a static body"):
        w.step()


@both
def test_views_rest_while_another_thread_steps(face: Face) -> None:
    """Of a run in another thread, a view shows the state before or after, and everything else is refused."""
    w = face.pile(12)
    height = w.position[:, -1]
    before = height.copy()
    steps = 4000 if face.dimension == 2 else 1000
    failures: list[BaseException] = []

    def work() -> None:
        try:
            w._advance(steps, w.dt, 0)
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    refused = resting = 0
    while thread.is_alive():
        try:
            _ = w.time
        except BusyError:
            refused += 1
            resting += bool((height == before).all())
        time.sleep(0.001)
    thread.join()
    assert not failures
    assert refused > 3
    assert resting == refused
    assert not (height == before).all()
    assert w.time == pytest.approx(steps * w.dt)


def test_everything_is_refused_during_a_step() -> None:
    w = PLANE.stack(1)
    seen: list[str] = []

    def reenters(t: float, position: object, velocity: object) -> object:
        for action in (lambda: w.position, w.step, lambda: w["box0"], lambda: w.remove("box0"), w.snapshot):
            with pytest.raises(BusyError, match="world is busy with a step; wait until the other thread"):
                action()
            seen.append("refused")
        return np.zeros((2, 2))

    w.add_force("reenters", reenters)
    w.step()
    assert len(seen) >= 5


def test_a_view_costs_the_same_for_many_bodies_as_for_few() -> None:
    def cost(bodies: int) -> float:
        w = PLANE.world()
        for i in range(bodies):
            w.add_body(f"p{i}", mass=1.0)
        rounds = []
        for _ in range(20):
            begun = time.perf_counter()
            for _ in range(50):
                w.position  # noqa: B018
            rounds.append(time.perf_counter() - begun)
        return min(rounds) / 50

    few, many = cost(10), cost(5000)
    assert many < 3 * few, f"{few * 1e6:.2f} us for 10 bodies, {many * 1e6:.2f} us for 5000"
