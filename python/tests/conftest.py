"""Fixtures that several test files share."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from scripted import ScriptedWorld


@pytest.fixture
def world() -> ScriptedWorld:
    """Three scripted particles of the plane."""
    return ScriptedWorld()
