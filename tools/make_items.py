"""Writes docs/items.md: each item of the lecture notes, the code that does it, the tests that show it.

The code is named here; the tests are found by their doc comments ("Item 23."), so that the table cannot
name a test that is gone. Run `python tools/make_items.py`; the contract test says when it is out of date.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

ITEMS: list[tuple[str, str]] = [
    ("pose in the plane, q = [c, s]", "crates/math/src/rotation.rs"),
    ("pose in space, unit quaternion and R(q)", "crates/math/src/rotation.rs"),
    ("world and body coordinates, r = x + R r_b", "crates/math/src/pose.rs"),
    ("velocity of a point, v + w x r", "crates/solver/src/problem.rs"),
    ("skew map in both dimensions", "crates/math/src/skew.rs"),
    ("explicit Euler with renormalisation in the plane", "crates/world/src/integrate/mod.rs"),
    ("the same in space", "crates/world/src/integrate/mod.rs"),
    ("state (x, q, v, w) and (p, L)", "crates/world/src/bodies.rs"),
    ("kinetic energy: translational, rotational, total", "crates/world/src/observe/energy.rs"),
    ("linear and angular momentum", "crates/world/src/observe/energy.rs"),
    ("moment of inertia in the plane from a density", "crates/geometry/src/mass_planar.rs"),
    ("inertia tensor in space from a density", "crates/geometry/src/mass_spatial.rs"),
    ("inertia about any axis", "crates/geometry/src/mass.rs"),
    ("force and acceleration", "crates/world/src/force.rs"),
    ("torque r x f", "crates/world/src/force.rs"),
    ("impulse at a point", "crates/solver/src/collision.rs"),
    ("body against a fixed obstacle", "crates/solver/src/collision.rs"),
    ("body against body", "crates/solver/src/collision.rs"),
    ("the five steps as callable pieces", "crates/solver/src/collision.rs"),
    ("sequential resolution", "crates/solver/src/methods/sequential.rs"),
    ("response of two particles", "crates/solver/src/collision.rs"),
    ("resting contact", "crates/world/src/stepping/fixed_step.rs"),
    ("coupling of two collisions", "crates/solver/src/prepared.rs"),
    ("the general gamma_i with its signs", "crates/solver/src/methods/pgs.rs"),
    ("the iterative algorithm", "crates/solver/src/methods/pgs.rs"),
    ("the nudge", "crates/world/src/correction.rs"),
    ("its convergence", "crates/solver/src/methods/pgs.rs"),
    ("J for N objects and k contacts", "crates/solver/src/delassus.rs"),
    ("v+ = v- + M^-1 J^T gamma", "crates/solver/src/problem.rs"),
    ("A and b", "crates/solver/src/delassus.rs"),
    ("direct solution when A is regular", "crates/solver/src/methods/direct.rs"),
    ("sparse A and a picture of its pattern", "crates/solver/src/delassus.rs"),
    ("complementarity (LCP)", "crates/solver/src/lcp.rs"),
    ("boxed LCP", "crates/solver/src/methods/lemke.rs"),
    ("projected Gauss-Seidel", "crates/solver/src/methods/pgs.rs"),
    ("friction by projection", "crates/solver/src/cone.rs"),
    ("convergence theory at work", "crates/solver/src/methods/pgs.rs"),
    ("velocity changes by oneself and by others", "crates/solver/src/prepared.rs"),
    ("the iterative gamma_i of rigid bodies", "crates/solver/src/methods/pgs.rs"),
    ("generalized u and impulses", "crates/solver/src/problem.rs"),
    ("rows J_i, J u >= 0", "crates/solver/src/delassus.rs"),
    ("M and J M^-1 J^T lambda = -(1 + c_r) J u-", "crates/solver/src/delassus.rs"),
    ("virtual work and multipliers", "crates/solver/src/delassus.rs"),
    ("complementarity of lambda", "crates/solver/src/residual.rs"),
    ("matrix form and iterative form agree", "crates/solver/src/methods/pgs_matrix.rs"),
    ("plane and space", "crates/math/src/space.rs"),
    ("particles and rigid bodies", "crates/world/src/body.rs"),
]

TEST_FILES = [
    "tests/laws/*.rs",
    "tests/stories/*.rs",
    "tests/scenes/*.rs",
    "crates/*/tests/*.rs",
    "python/tests/test_*.py",
]


def numbers(text: str) -> set[int]:
    """The items that a doc comment names: "Item 3", "Items 33, 44", "Items 1 to 5", "Items 6 and 7"."""
    found: set[int] = set()
    for part in re.findall(r"[Ii]tems?\s+((?:\d+(?:\s*(?:,|and|to)\s*)?)+)", text):
        for low, high in re.findall(r"(\d+)\s+to\s+(\d+)", part):
            found |= set(range(int(low), int(high) + 1))
        found |= {int(n) for n in re.findall(r"\d+", part)}
    return {n for n in found if 1 <= n <= len(ITEMS)}


def tests_by_item() -> dict[int, list[tuple[str, str]]]:
    """Item -> (file, test) for every test function whose comment names the item."""
    table: dict[int, list[tuple[str, str]]] = {n: [] for n in range(1, len(ITEMS) + 1)}
    for pattern in TEST_FILES:
        for path in sorted(ROOT.glob(pattern)):
            name = str(path.relative_to(ROOT))
            for test, comment in commented_tests(path):
                for n in sorted(numbers(comment)):
                    table[n].append((name, test))
    return table


def commented_tests(path: Path) -> list[tuple[str, str]]:
    """Functions of a test file with the comment or docstring that belongs to them."""
    text = path.read_text()
    if path.suffix == ".py":
        return re.findall(r'def (test_\w+)\(.*?\n    """(.*?)"""', text, re.DOTALL)
    found = []
    for comment, name in re.findall(
        r"((?:^\s*///.*\n)+)(?:\s*#\[.*\]\n)*\s*(?:pub )?fn (\w+)", text, re.MULTILINE
    ):
        found.append((name, re.sub(r"\s*\n\s*///\s*", " ", comment)))
    return [(name, comment) for name, comment in found]


def page() -> str:
    """The text of docs/items.md."""
    lines = [
        "# Item, code, test",
        "",
        "The 47 items of the lecture notes. Made by `tools/make_items.py` from the tests' own comments;",
        "`tests/contracts/test_items.py` fails when an item has no test or this page is out of date.",
        "",
        "| item | what | code | tests |",
        "|---|---|---|---|",
    ]
    tests = tests_by_item()
    for n, (what, code) in enumerate(ITEMS, 1):
        shown = "<br>".join(f"`{file}` {test}" for file, test in tests[n][:4])
        more = f"<br>and {len(tests[n]) - 4} more" if len(tests[n]) > 4 else ""
        lines.append(f"| {n} | {what} | `{code}` | {shown}{more} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    (ROOT / "docs/items.md").write_text(page())
    missing = [n for n, tests in tests_by_item().items() if not tests]
    if missing:
        print("items without a test:", missing)
        sys.exit(1)
