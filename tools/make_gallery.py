"""The gallery's pages: runs `examples/gallery/*.py` and writes a page for each to `docs/gallery/made`.

A script saves one picture beside itself (in the folder it is run in) and leaves `runs`, recorded runs by
label, and `w`, the world of the last of them. Its page holds the picture, what its docstring says to look
at, its text as it stands, and figures and words that are read off the runs here. A page is made again only
when its script, this file or the package has changed. Run by `make docs`; `--only NAME` makes one.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import html
import os
import runpy
import subprocess
import sys
import time
import warnings
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = ROOT / "examples/gallery"
MADE = ROOT / "docs/gallery/made"
#: A replay takes about this much beside the page itself; longer runs are thinned [bytes].
MOST_BYTES = 2_500_000
#: Parts a scene from the lines that draw it, where both together are more than the fifteen promised.
PICTURE = "# the picture"
#: Scenes in the order in which they are shown.
ORDER = (
    "newtons_cradle", "brick", "seven_objects", "heavy_top", "dzhanibekov", "card_house", "arch",
    "break_shot", "rocks",
    "force_chains", "dominoes", "four_legs", "superball", "overhang", "double_pendulum",
)  # fmt: skip


def stamp_of(script: Path) -> str:
    """Changes when the script, this file, or what the package is made of does."""
    digest = hashlib.sha256()
    sources = sorted((ROOT / "python/carom").glob("*.py")) + sorted((ROOT / "crates").glob("*/src/**/*.rs"))
    for path in [script, Path(__file__), *sources]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def replay(run: Any, stem: str) -> str:
    """The replay of a run as a page beside the gallery's, loaded on a click; none without `Run.to_html`."""
    if not hasattr(run, "to_html"):
        return ""
    target = MADE / "replays" / f"{stem}.html"
    target.parent.mkdir(exist_ok=True)
    run.to_html(target, max_bytes=MOST_BYTES, explain_seconds=1.0)
    size = target.stat().st_size / 1e6
    return (
        f'<button class="replay" data-page="replays/{target.name}">Show the replay ({size:.1f} MB)</button>'
    )


def figures(runs: dict[str, Any]) -> str:
    """The table of the runs' certificates."""
    lines = [
        "| run | steps [1] | of [s] | worst residual [m/s] | where | mean iterations [1] | "
        "energy closure [J] | deepest overlap [m] |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for label, run in runs.items():
        told = run.summary()
        lines.append(
            f"| {label} | {len(run)} | {told['dt']:.4g} | {run.worst.value:.1e} | {run.worst.where() or '–'} "
            f"| {told['mean_iterations']:.1f} | {run.energy_closure:.0e} | {run.deepest.value:.1e} |"
        )
    return "\n".join(lines)


def words(world: Any) -> str:
    """What the next step of the last world says of itself; nothing where runs made worlds of their own."""
    if world is None:
        return ""
    world.on_inaccurate = "ignore"
    report = world.step()
    explained = "\n".join(f"> {line}" if line else ">" for line in str(report.explain()).splitlines())
    certificate = f"> `{world.certificate()!r}`"
    return f"The step after the last one of the last run, in words:\n\n{explained}\n>\n{certificate}"


def lines_of(code: str) -> int:
    """Lines with something on them."""
    return sum(1 for line in code.splitlines() if line.strip())


def page(name: str, space: dict[str, Any], picture: str, replays: str) -> str:
    """The page of a scene."""
    text = (SCRIPTS / f"{name}.py").read_text()
    tree = ast.parse(text)
    title, _, told = (ast.get_docstring(tree) or name).partition("\n")
    first = tree.body[1].lineno
    scene, _, drawn = "\n".join(text.splitlines()[first - 1 :]).partition(f"\n{PICTURE}\n")
    then = f"\n\nAnd {lines_of(drawn)} lines for the picture:\n\n```python\n{drawn}\n```" if drawn else ""
    runs: dict[str, Any] = space["runs"]
    return f"""# {title}

![{title}]({picture})

{told.strip()}

{replays}

## What made it

`examples/gallery/{name}.py`, {lines_of(scene)} lines:

```python
{scene.rstrip()}
```{then}

## Certificate

Read off the runs when this page was built.

{figures(runs)}

{words(space.get("w"))}
"""


def make(name: str) -> None:
    """Runs a script and writes its page."""
    script = SCRIPTS / f"{name}.py"
    before = Path.cwd()
    os.chdir(MADE)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            space = runpy.run_path(str(script))
    finally:
        os.chdir(before)
    picture = next(f"{name}{suffix}" for suffix in (".svg", ".png") if (MADE / f"{name}{suffix}").exists())
    replays = []
    for number, (label, run) in enumerate(space["runs"].items()):
        button = replay(run, f"{name}-{number}")
        if button:
            replays.append(f"<p>{html.escape(label)}: {button}</p>")
    (MADE / f"{name}.md").write_text(page(name, space, picture, "\n".join(replays)))


def cards() -> str:
    """The pictures of all scenes, each a link to its page."""
    lines = ['<div class="cards">']
    for name in ORDER:
        title = (MADE / f"{name}.md").read_text().split("\n", 1)[0].removeprefix("# ")
        picture = next(
            f"{name}{suffix}" for suffix in (".svg", ".png") if (MADE / f"{name}{suffix}").exists()
        )
        lines.append(f'<a href="made/{name}.html"><img src="../_images/{picture}" alt="" loading="lazy">'
                     f"<span>{html.escape(title)}</span></a>")  # fmt: skip
    return "\n".join([*lines, "</div>"]) + "\n"


def main() -> None:
    """All pages that are out of date, each in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", help="make this page, here and now")
    only = parser.parse_args().only
    MADE.mkdir(parents=True, exist_ok=True)
    if only is not None:
        make(only)
        return
    known = {path.stem for path in SCRIPTS.glob("*.py")}
    if known != set(ORDER):
        sys.exit(f"examples/gallery and ORDER of {__file__} differ: {sorted(known ^ set(ORDER))}")
    for name in ORDER:
        stamp, wanted = MADE / f"{name}.stamp", stamp_of(SCRIPTS / f"{name}.py")
        if stamp.exists() and stamp.read_text() == wanted and (MADE / f"{name}.md").exists():
            continue
        begun = time.perf_counter()
        subprocess.run([sys.executable, __file__, "--only", name], check=True)
        stamp.write_text(wanted)
        print(f"gallery: {name}, {time.perf_counter() - begun:.1f} s", flush=True)
    (MADE / "cards.md").write_text(cards())


if __name__ == "__main__":
    main()
