"""No `use` climbs a layer, and only geometry names its library.

The order of the crates is that of ARCHITECTURE.md: imports point down.
"""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

MAY_USE: dict[str, set[str]] = {
    "math": set(),
    "geometry": {"carom_math"},
    "solver": {"carom_math"},
    "world": {"carom_math", "carom_geometry", "carom_solver"},
    "scenes": {"carom"},
    "python": {"carom", "carom_scenes"},
    "playground": {"carom", "carom_scenes"},
    "bench": {"carom", "carom_scenes"},
}
OURS = {"carom", "carom_math", "carom_geometry", "carom_solver", "carom_scenes"}
#: libraries that one crate alone may name
ONLY_IN = {"parry2d_f64": "geometry", "parry3d_f64": "geometry", "faer": "solver", "pyo3": "python"}


def sources(crate: str) -> list[Path]:
    return sorted((ROOT / "crates" / crate / "src").rglob("*.rs"))


def named_crates(text: str) -> set[str]:
    code = re.sub(r"//.*", "", text)
    return set(re.findall(r"\b([a-z][a-z0-9_]*)::", code)) | set(
        re.findall(r"\buse\s+([a-z][a-z0-9_]*)\b", code)
    )


@pytest.mark.parametrize("crate", MAY_USE)
def test_no_use_climbs_a_layer(crate: str) -> None:
    files = sources(crate)
    assert files, f"crates/{crate} has no sources"
    own = "carom" if crate == "world" else f"carom_{crate}"
    for path in files:
        used = named_crates(path.read_text()) & OURS
        climbed = used - MAY_USE[crate] - {own}
        assert not climbed, f"{path.relative_to(ROOT)} uses {sorted(climbed)}, which is not below {crate}"


@pytest.mark.parametrize("crate", MAY_USE)
def test_the_manifest_names_only_lower_crates(crate: str) -> None:
    manifest = tomllib.loads((ROOT / "crates" / crate / "Cargo.toml").read_text())
    named = {name.replace("-", "_") for name in manifest.get("dependencies", {})} & OURS
    assert named <= MAY_USE[crate], f"crates/{crate}/Cargo.toml depends on {sorted(named - MAY_USE[crate])}"


@pytest.mark.parametrize("library", ONLY_IN)
def test_a_wrapped_library_is_named_in_one_crate_only(library: str) -> None:
    for crate in MAY_USE:
        if crate == ONLY_IN[library]:
            continue
        for path in sources(crate):
            assert library not in named_crates(path.read_text()), f"{path.relative_to(ROOT)} names {library}"


def test_physics_has_no_cfg_on_the_dimension() -> None:
    for crate in MAY_USE:
        for path in sources(crate):
            hit = re.search(r"cfg\(.*dim[23]", path.read_text())
            assert hit is None, f"{path.relative_to(ROOT)}: {hit and hit.group()}"


def test_unsafe_stays_in_its_named_places() -> None:
    allowed = {
        "crates/python/src/views.rs",
        "crates/playground/src/door.rs",
        "crates/solver/src/soft/shared.rs",
    }
    for crate in MAY_USE:
        for path in sources(crate):
            code = re.sub(r"//.*", "", path.read_text())
            name = str(path.relative_to(ROOT))
            if re.search(r"\bunsafe\s*(\{|\(|impl|fn)", code):
                assert name in allowed, f"{name} has unsafe code; ARCHITECTURE.md names where it may live"


def test_the_step_is_a_table_of_contents() -> None:
    """The stage names in ARCHITECTURE.md are methods of the world's step or its scheme."""
    text = (ROOT / "ARCHITECTURE.md").read_text()
    stages = re.findall(r"^\| `([a-z_]+)` \|", text, re.MULTILINE)
    assert len(stages) >= 8, "ARCHITECTURE.md lists the stages of a step in a table"
    code = (ROOT / "crates/world/src/world.rs").read_text()
    code += (ROOT / "crates/world/src/world/checks.rs").read_text()
    code += (ROOT / "crates/world/src/stepping/fixed_step.rs").read_text()
    for stage in stages:
        assert re.search(rf"\bfn {stage}\b", code), (
            f"ARCHITECTURE.md names the stage {stage}, the code does not"
        )
