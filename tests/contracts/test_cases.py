"""Each case with a known answer has a test by the scheme that is meant to hold it, and docs/cases.md
shows them."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]


def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_cases", ROOT / "tools/make_cases.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_cases"] = module  # dataclasses look their module up by name
    spec.loader.exec_module(module)
    return module


def test_every_case_has_a_test_by_the_scheme_with_events() -> None:
    make = maker()
    for n, tests in make.tests_by_case().items():
        if n in make.BY_EVENTS:
            assert any(t.by_events for t in tests), f"case C{n} has no test by the scheme with events"
        elif n in make.STILL:
            assert tests, f"case C{n} has no test"


def test_every_demand_names_tests_that_exist() -> None:
    make = maker()
    for demand in make.DEMANDS:
        assert demand["tests"], f"nothing holds: {demand['what']}"
        for name in demand["tests"]:
            assert make.tests_named(name), f"{demand['what']}: there is no test {name}"


def test_every_long_law_has_a_twin_that_is_always_run() -> None:
    make = maker()
    short = {t.name for t in make.all_tests() if not t.long}
    long = [t for t in make.all_tests() if t.long and t.by_events]
    assert long
    for test in long:
        # the comment's end: "Twin: `name`." or "Twins: `name`, `name`."
        told = re.search(r"Twins?: (.*)", test.comment, re.DOTALL)
        assert told is not None, f"{test.name} names no twin"
        twins = re.findall(r"`(\w+)`", told.group(1))
        assert twins, f"{test.name} names no twin"
        assert set(twins) <= short, f"{test.name}: no test is always run by the name of its twin, {twins}"


def test_the_page_is_current() -> None:
    make = maker()
    page = (ROOT / "docs/cases.md").read_text()
    assert page == make.page(), "run: python tools/make_cases.py"
