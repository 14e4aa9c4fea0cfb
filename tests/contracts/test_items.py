"""Each of the 47 items of the lecture notes has code and a test, and docs/items.md shows them."""

import importlib.util
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]


def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_items", ROOT / "tools/make_items.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_item_has_code_and_a_test() -> None:
    make = maker()
    assert len(make.ITEMS) == 47
    for n, tests in make.tests_by_item().items():
        assert tests, f"item {n}, {make.ITEMS[n - 1][0]}, has no test that names it"
        assert (ROOT / make.ITEMS[n - 1][1]).exists()


def test_the_table_is_current() -> None:
    make = maker()
    page = (ROOT / "docs/items.md").read_text()
    assert page == make.page(), "run: python tools/make_items.py"
