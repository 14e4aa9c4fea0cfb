"""Laws over drawn worlds: whatever is given, an error names it or the world goes on as promised."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from carom import CaromError
from spaces import PLANE, SPACE, Face

NUMBERS = st.one_of(
    st.floats(-3, 3),
    st.sampled_from([0.0, -0.0, 1e-300, 5e-324, 1e-9, 1e9, 1e150, -1e308, np.inf, np.nan]),
)
FACES = st.sampled_from([PLANE, SPACE])


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
    try:
        w.add_body("drawn", face.ball(data.draw(NUMBERS)), **arguments)
    except CaromError as error:
        assert error.body == "drawn"
        assert error.field is not None
        assert error.field in str(error)
        assert error.remedy
        assert w.snapshot() == before
        return
    added = w.snapshot()
    try:
        w.step()
    except CaromError as error:
        assert error.remedy
        assert w.snapshot() == added
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
