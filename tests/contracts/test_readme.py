"""The README's commands and examples run as they stand."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs/guide").glob("*.md")),
    *sorted((ROOT / "docs/reference").glob("*.md")),
]


def blocks(language: str) -> list[tuple[str, str]]:
    """Code blocks of a language with a name to show."""
    found = []
    for page in PAGES:
        for k, code in enumerate(re.findall(rf"```{language}\n(.*?)```", page.read_text(), re.DOTALL)):
            found.append((f"{page.relative_to(ROOT)}[{k}]", code))
    return found


@pytest.mark.parametrize(("name", "code"), blocks("python"), ids=lambda v: v if "\n" not in v else "")
def test_python_examples_run(name: str, code: str, tmp_path: Path) -> None:
    script = tmp_path / "example.py"
    script.write_text(code)
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"{name}:\n{done.stderr}"


def commands() -> list[tuple[str, str]]:
    return [
        (name, line.split("  #")[0].strip())
        for name, code in blocks("sh")
        for line in code.splitlines()
        if line.strip() and not line.startswith("#")
    ]


@pytest.mark.parametrize(("name", "command"), commands())
def test_shell_commands_run(name: str, command: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    """`make` targets exist (the tests are one of them); carom's commands run, in one folder per page."""
    words = shlex.split(command)
    if words[0] == "make":
        assert re.search(rf"^{re.escape(words[1])}:", (ROOT / "Makefile").read_text(), re.MULTILINE), command
        return
    if words[0] in {"git", "cd", "pip"}:
        pytest.skip("about obtaining the sources")
    program = ["-m", "carom.cli", *words[1:]] if words[0] == "carom" else words[1:]
    is_known = words[0] == "carom" or (words[:2] == ["python", "-m"] and words[2].startswith("carom."))
    assert is_known, f"{name}: {command}: a command this test does not know"
    folder = FOLDERS.setdefault(name.split("[")[0], tmp_path_factory.mktemp("page"))
    for example in (ROOT / "examples").glob("*.toml"):
        (folder / example.name).write_text(example.read_text())
    done = subprocess.run(
        [sys.executable, *program],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, f"{name}: {command}\n{done.stdout}\n{done.stderr}"


FOLDERS: dict[str, Path] = {}


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.name)
def test_examples_run(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, example], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
