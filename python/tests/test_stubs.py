"""The stubs of the native module say what it has: mypy's stubtest compares them with the module itself."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def test_the_stubs_are_those_of_the_module() -> None:
    command = [sys.executable, "-m", "mypy.stubtest", "carom._carom", "--ignore-disjoint-bases"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parent)
    assert done.returncode == 0, done.stdout + done.stderr
