"""Writes docs/cases.md: each case with a known answer, its tolerance, and the tests that hold it.

Answers and tolerances stand in tools/cases.toml; the tests are found by their doc comments ("Case C14."),
so that the page cannot name a test that is gone. Run `python tools/make_cases.py`; the contract test says
when the page is out of date.
"""

import re
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]

DATA: dict[str, list[dict[str, Any]]] = tomllib.loads((ROOT / "tools/cases.toml").read_text())
CASES = DATA["case"]
DEMANDS = DATA["demand"]
#: cases in which nothing moves
STILL = {4}
#: cases that need a test by the scheme with events
BY_EVENTS = set(range(1, 34)) - STILL - {8}

#: the tests of the scheme with events
EVENTS = ("tests/cases/", "tests/laws/events.rs", "tests/laws/heaps.rs", "tests/laws/simbenchmark.rs")

TEST_FILES = [
    "tests/laws/*.rs",
    "tests/cases/*.rs",
    "tests/stories/*.rs",
    "tests/scenes/*.rs",
    "crates/*/tests/**/*.rs",
    "python/tests/test_*.py",
]


@dataclass(frozen=True)
class Test:
    """A test function: its file, name, comment, spaces, and whether it is run by `make laws` only."""

    file: str
    name: str
    comment: str
    spaces: str
    long: bool

    @property
    def by_events(self) -> bool:
        return self.file.startswith(EVENTS)

    def shown(self) -> str:
        notes = ", ".join(note for note in (self.spaces, "long" if self.long else "") if note)
        return f"`{self.file}` {self.name}" + (f" ({notes})" if notes else "")


def cases_of(comment: str) -> set[int]:
    """The cases that a doc comment names: "Case C3", "Cases C6 and C7", "cases C1 to C3"."""
    found: set[int] = set()
    for part in re.findall(r"[Cc]ases?\s+((?:C\d+(?:\s*(?:,|and|to)\s*)?)+)", comment):
        for low, high in re.findall(r"C(\d+)\s+to\s+C(\d+)", part):
            found |= set(range(int(low), int(high) + 1))
        found |= {int(n) for n in re.findall(r"C(\d+)", part)}
    return {n for n in found if n <= len(CASES)}


def rust_tests(path: Path) -> list[Test]:
    """Test functions of a Rust file: marked as tests, or made so for the plane and for space."""
    text = path.read_text()
    file = str(path.relative_to(ROOT))
    generic = set(re.findall(r"\w+", " ".join(re.findall(r"in_plane_and_space!\((.*?)\);", text, re.DOTALL))))
    found = []
    pattern = r"((?:^[ \t]*///[^\n]*\n)*)((?:^[ \t]*#\[[^\n]*\]\n)*)^[ \t]*(?:pub )?fn (\w+)(.*?)(?=^\}|\Z)"
    for comment, attributes, name, body in re.findall(pattern, text, re.MULTILINE | re.DOTALL):
        if name not in generic and "#[test]" not in attributes:
            continue
        if name in generic:
            spaces = "plane, space"
        else:
            words = {
                "plane": "Planar" in body or "planar" in file,
                "space": "Spatial" in body or "spatial" in file,
            }
            spaces = ", ".join(space for space, there in words.items() if there)
        found.append(Test(file, name, re.sub(r"\s*///\s*", " ", comment), spaces, "#[ignore" in attributes))
    return found


def all_tests() -> list[Test]:
    """Every test of the repository that may hold a case."""
    found = []
    for pattern in TEST_FILES:
        for path in sorted(ROOT.glob(pattern)):
            if path.suffix == ".py":
                file = str(path.relative_to(ROOT))
                pairs = re.findall(r'def (test_\w+)\(.*?\n    """(.*?)"""', path.read_text(), re.DOTALL)
                found += [Test(file, name, comment, "", long=False) for name, comment in pairs]
            else:
                found += rust_tests(path)
    return found


def tests_by_case() -> dict[int, list[Test]]:
    """Case -> the tests whose comment names it."""
    table: dict[int, list[Test]] = {n: [] for n in range(1, len(CASES) + 1)}
    for test in all_tests():
        for n in sorted(cases_of(test.comment)):
            table[n].append(test)
    return table


def tests_named(name: str) -> list[Test]:
    """The tests of the scheme with events by a name."""
    return [t for t in all_tests() if t.by_events and t.name == name]


def page() -> str:
    """The text of docs/cases.md."""
    lines = [
        "# Case, answer, test",
        "",
        "Cases with known answers, and what the scheme with events is held to. Made by",
        "`tools/make_cases.py` from `tools/cases.toml` and the tests' own comments;",
        "`tests/contracts/test_cases.py` fails when a test is gone or this page is out of date.",
        "Tests marked long are run by `make laws`, the others by `make test`.",
        "Tolerances are those of the scheme `events`; those of fixed steps stand in the tests.",
        "",
        "| case | answer | tolerance | by `events` | otherwise | not held |",
        "|---|---|---|---|---|---|",
    ]
    table = tests_by_case()
    for n, case in enumerate(CASES, 1):
        events = "<br>".join(t.shown() for t in table[n] if t.by_events)
        others = "<br>".join(t.shown() for t in table[n] if not t.by_events)
        cells = [f"C{n}", case["answer"], case["tolerance"], events, others, case.get("lacks", "")]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", "## What the scheme with events is held to", ""]
    lines += ["| test | demand | held by | not held |", "|---|---|---|---|"]
    for demand in DEMANDS:
        held = "<br>".join(t.shown() for name in demand["tests"] for t in tests_named(name))
        cells = [demand["what"], demand["demand"], held, demand.get("lacks", "")]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (ROOT / "docs/cases.md").write_text(page())
    missing = sorted(n for n in BY_EVENTS if not any(t.by_events for t in tests_by_case()[n]))
    if missing:
        print("cases without a test by the scheme with events:", missing)
        sys.exit(1)
