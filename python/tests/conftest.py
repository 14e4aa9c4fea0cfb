"""Fixtures that several test files share."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from scripted import ScriptedWorld

# a test run in the background ignores Ctrl-C and would pass that on to what the tests start and interrupt
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def world() -> ScriptedWorld:
    """Three scripted particles of the plane."""
    return ScriptedWorld()
