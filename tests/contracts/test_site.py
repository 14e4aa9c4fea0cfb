"""What the site is made of: its gallery, its check, and that what it bundles asks nothing of the network."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = sorted((ROOT / "examples/gallery").glob("*.py"))
#: Scenes whose runs and pictures take a second or two; all of them run in `make docs`.
QUICK = ("card_house", "overhang", "seven_objects")


def tool(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_gallery_has_a_dozen_scenes_and_shows_all_of_them() -> None:
    assert len(SCRIPTS) >= 12
    assert {path.stem for path in SCRIPTS} == set(tool("make_gallery").ORDER)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda p: p.stem)
def test_a_scene_says_what_to_look_at_and_saves_one_picture(path: Path) -> None:
    text = path.read_text()
    assert text.startswith('"""')
    assert len(text.split('"""')[1].split("\n\n", 1)[1]) > 150
    assert re.findall(rf'save_figure\(figure, "{path.stem}\.(?:svg|png)"\)', text)
    scene, _, drawn = text.split('"""', 2)[2].partition(f"\n{tool('make_gallery').PICTURE}\n")
    assert len([line for line in scene.splitlines() if line.strip()]) <= 15, "the scene"
    assert len([line for line in drawn.splitlines() if line.strip()]) <= 15, "its picture"


@pytest.mark.parametrize("name", QUICK)
def test_a_quick_scene_runs_without_a_warning(name: str, tmp_path: Path) -> None:
    script = ROOT / f"examples/gallery/{name}.py"
    command = [sys.executable, "-W", "error", str(script)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"{name}.svg").stat().st_size > 4000


def test_bundled_styles_and_scripts_load_nothing_from_outside() -> None:
    check = tool("check_site")
    for path in (ROOT / "docs/_static").rglob("*"):
        if path.suffix == ".css":
            assert check.style_loads(path.read_text()) == [], path
            for font in re.findall(r"url\(([^)]+)\)", path.read_text()):
                assert (path.parent / font).exists(), font
        if path.suffix == ".js":
            assert not re.search(
                r"(?:fetch|import|WebSocket)\(\s*[\"'`](?:https?:|wss?:)?//", path.read_text()
            )


def test_the_check_sees_dead_links_missing_anchors_and_requests_to_outside(tmp_path: Path) -> None:
    (tmp_path / "reference").mkdir()
    (tmp_path / "other.html").write_text('<p id="here">text</p>')
    (tmp_path / "index.html").write_text(
        '<a href="other.html#here">fine</a> <a href="gone.html">dead</a> <a href="other.html#there">no</a>'
        '<script src="https://example.org/x.js"></script><img src="//example.org/p.png">'
        '<style>@import "https://example.org/s.css";</style><a href="https://example.org">may be followed</a>'
    )
    (tmp_path / "s.css").write_text("a { background: url(https://example.org/b.png) }")
    (tmp_path / "s.js").write_text('fetch("https://example.org/data")')
    found = [line for line in tool("check_site").check(tmp_path) if not line.startswith("reference:")]
    assert len(found) == 7, found
    for words in ("gone.html leads nowhere", "#there: no such anchor", "x.js", "p.png", "s.css: loads",
                  "a style loads", "s.js: fetch"):  # fmt: skip
        assert any(words in line for line in found), words


def test_tables_of_the_engines_page_are_cells_of_the_benchmarks() -> None:
    tables = tool("make_site_tables")
    race = tables.race("amd-epyc-2-cores")
    assert race.count("\n") > 40
    row = next(row for row in tables.rows(ROOT / "crates/bench/results/amd-epyc-2-cores/peers.csv"))
    assert f"| {float(row['cpu_ms_per_step']):.3g} |" in race
    assert "**carom** `exact`" in tables.contact("amd-epyc-2-cores")
