"""Every path that the pages of the repository name exists, and every internal link leads somewhere."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
#: what looks like a path of the repository inside backticks
PATH = re.compile(
    r"`((?:crates|python|docs|tests|schema|examples|\.ci)/[A-Za-z0-9_./*-]+"
    r"|[A-Za-z0-9_-]+\.(?:toml|md|cff|lock)|Makefile)`"
)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_path_that_a_page_names_exists(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for name in PATH.findall(text):
        found = list(ROOT.glob(name.rstrip("/"))) or list(page.parent.glob(name))
        built_in = list((ROOT / "python/carom/scenes").glob(name))
        assert found or built_in, f"{page.relative_to(ROOT)} names {name}, which does not exist"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_link_inside_the_repository_leads_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target) or target.startswith("#"):
            continue
        path = page.parent / target.split("#")[0]
        assert path.exists(), f"{page.relative_to(ROOT)} links to {target}, which does not exist"


def test_equations_cited_in_the_sources_exist() -> None:
    known = set()
    for page in (ROOT / "docs/theory").glob("[0-9]*.md"):
        known |= set(re.findall(r"\*\*\((\d+\.\d+)\)\*\*", page.read_text()))
    assert len(known) > 100
    for path in sorted((ROOT / "crates").glob("*/src/**/*.rs")):
        for number in re.findall(r"theory eqs?\. (\d+\.\d+)", path.read_text()):
            assert number in known, (
                f"{path.relative_to(ROOT)} cites theory eq. {number}, which does not exist"
            )
