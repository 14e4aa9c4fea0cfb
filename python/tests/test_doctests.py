"""The examples in the docstrings run, in both spaces."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest

MODULES = (
    "carom",
    "carom.planar",
    "carom.spatial",
    "carom.impact",
    "carom.collision",
    "carom.gradient",
    "carom.scene",
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of(name: str) -> None:
    failed, tried = doctest.testmod(import_module(name))
    assert tried > 0
    assert failed == 0
