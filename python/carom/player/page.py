"""One HTML file that replays runs: the built page with the runs put into it. No request leaves it.

The page is built from the folder `player` of the repository and comes with the package (ADR 14).
"""

from __future__ import annotations

import html
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING

from carom.errors import CaromError, refused
from carom.player.difference import difference
from carom.player.encode import MAX_BYTES, encode_run
from carom.player.words import EXPLAIN_SECONDS, in_words
from carom.recording import is_run_file

if TYPE_CHECKING:
    from carom.recorded import Run

#: The built page.
PAGE = Path(__file__).with_name("page.html")
#: Where the runs go, and the page's title; both stand once in the built page.
_PLACE = "<!--carom-runs-->"
_TITLE = "<title>carom</title>"


def page_of(
    run: Run,
    other: Run | None = None,
    *,
    max_bytes: int = MAX_BYTES,
    explain_seconds: float = EXPLAIN_SECONDS,
) -> str:
    """The text of a page that replays a run, or two runs beside each other.

    Parameters
    ----------
    other : a run of the same scene to compare with
    max_bytes : the runs take about this much of the page at most; long and large ones are thinned [bytes]
    explain_seconds : steps are explained when running up to the worst again takes no longer [s]

    Raises
    ------
    CaromError
        When the package holds no page, or a run cannot be shown: no frame or body, a pose that is not finite.
    BuildError
        For sizes and times that are none.
    """
    if not max_bytes > 0:
        raise refused(None, "max_bytes", "must be > 0", max_bytes, "2e7 are the default [bytes]")
    if not 0 <= explain_seconds < math.inf:
        problem, remedy = "must be finite and >= 0", "0 explains nothing, 5 is the default [s]"
        raise refused(None, "explain_seconds", problem, explain_seconds, remedy)
    page = _built_page()
    runs = [run] if other is None else [run, other]
    blocks = []
    for number, each in enumerate(runs):
        payload, _ = encode_run(each, max_bytes // len(runs), in_words(each, explain_seconds))
        if number == 1:
            apart = difference(run, each)
            payload.add("difference_time", apart.time)
            payload.add("difference_largest", apart.largest)
            payload.add("difference_mean", apart.mean)
            payload.add("difference_body", apart.body)
        blocks.append(f'<script type="application/carom-run">{payload.packed()}</script>')
    title = html.escape(" and ".join(dict.fromkeys(each.header.scene_name or "run" for each in runs)))
    page = page.replace(_TITLE, f"<title>{title} · carom</title>", 1)
    return page.replace(_PLACE, "".join(blocks), 1)


def write_page(path: str | Path, text: str) -> Path:
    """Writes a page; one that stands there already is replaced only when it is whole.

    Raises
    ------
    CaromError
        When the path cannot be written, or holds something that is no page.
    """
    path = Path(path)
    if path.is_file() and path.stat().st_size and not _is_page(path):
        raise _unwritable(path, "exists and is no page")
    return save_whole(path, text.encode())


def _is_page(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(200).lstrip().lower().startswith((b"<!doctype html", b"<html"))
    except OSError:
        return False


def save_whole(path: str | Path, content: bytes) -> Path:
    """Writes a file beside its place and moves it there, so that nobody sees half of it; folders are made.

    Raises
    ------
    CaromError
        When the path cannot be written, or holds a recorded run, which would be lost.
    """
    path = Path(path)
    if path.is_file() and is_run_file(path):
        raise _unwritable(path, "is a recorded run, which would be lost")
    partial = path.with_name(f"{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content)
        os.replace(partial, path)
    except OSError as error:
        raise _unwritable(path, f"cannot be written: {error.strerror or error}") from error
    return path


def _unwritable(path: Path, problem: str) -> CaromError:
    remedy = "choose another path"
    return CaromError(f"{str(path)!r} {problem}; {remedy}", field="path", value=str(path), remedy=remedy)


def notebook_frame(text: str, height: int = 560) -> str:
    """A page as a frame for notebooks: an iframe with the page inside, `height` in pixels."""
    inside = html.escape(text, quote=True)
    return (
        f'<iframe srcdoc="{inside}" style="width:100%;height:{height}px;border:0" '
        'title="replay of a carom run" allowfullscreen></iframe>'
    )


def _built_page() -> str:
    try:
        page = PAGE.read_text(encoding="utf-8")
    except FileNotFoundError:
        remedy = "build it with `make player` (needs Node.js) and install again"
        raise CaromError(
            f"replay: this installation of carom holds no page; {remedy}", field="page", remedy=remedy
        ) from None
    if page.count(_PLACE) != 1 or page.count(_TITLE) != 1:
        remedy = "build it again with `make player`"
        raise CaromError(f"replay: the page {str(PAGE)!r} is damaged; {remedy}", field="page", remedy=remedy)
    return page
