"""Laws over drawn worlds: whatever is given, an error names it or the world goes on as promised."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from spaces import PLANE, SPACE, Face

from carom import CaromError

NUMBERS = st.one_of(
    st.floats(-3, 3),
    st.sampled_from([0.0, -0.0, 1e-300, 5e-324, 1e-9, 1e9, 1e150, -1e308, np.inf, np.nan]),
)
FACES = st.sampled_from([PLANE, SPACE])


def error_of(action: Callable[[], Any]) -> CaromError | None:
    """The error of carom's that an action ends in; any other comes through."""
    try:
        action()
    except CaromError as error:
        return error
    return None


@settings(max_examples=150, deadline=None)
@given(face=FACES, data=st.data())
def test_any_numbers_make_a_body_or_an_error_that_names_it(face: Face, data: Any) -> None:
    w = face.stack(1)
    vector = st.lists(NUMBERS, min_size=face.dimension, max_size=face.dimension)
    arguments = {
        "mass": data.draw(NUMBERS),
        "position": data.draw(vector),
        "velocity": data.draw(vector),
        "friction": data.draw(NUMBERS),
        "restitution": data.draw(NUMBERS),
        "linear_damping": data.draw(NUMBERS),
    }
    before = w.snapshot()
    radius = data.draw(NUMBERS)
    refusal = error_of(lambda: w.add_body("drawn", face.ball(radius), **arguments))
    if refusal is not None:
        assert refusal.body == "drawn"
        assert refusal.field is not None
        assert refusal.field in str(refusal)
        assert refusal.remedy
        assert w.snapshot() == before
        return
    added = w.snapshot()
    failure = error_of(w.step)
    assert failure is None or (failure.remedy and w.snapshot() == added)
    assert all(np.isfinite(array).all() for array in (w.position, w.rotation, w.velocity, w.angular_velocity))


@settings(max_examples=30, deadline=None)
@given(face=FACES, seed=st.integers(0, 2**32 - 1), steps=st.integers(0, 60), iterations=st.integers(1, 8))
def test_a_copy_at_any_moment_takes_the_same_way(face: Face, seed: int, steps: int, iterations: int) -> None:
    w = face.pile(5, seed=seed, iterations=iterations)
    for _ in range(steps):
        w.step()
    other = copy.deepcopy(w)
    for _ in range(10):
        assert w.step() == other.step()
    assert w.snapshot() == other.snapshot()
