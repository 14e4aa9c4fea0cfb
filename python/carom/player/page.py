"""One HTML file that replays runs: the built page with the runs put into it. No request leaves it.

The page is built from the folder `player` of the repository and comes with the package (ADR 14).
"""

from __future__ import annotations

import html
import os
from pathlib import Path
from typing import TYPE_CHECKING

from carom.errors import CaromError
from carom.player.difference import difference
from carom.player.encode import MAX_BYTES, encode_run
from carom.player.words import EXPLAIN_SECONDS, in_words

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
        When the package holds no page, or a run cannot be shown: no frame, a pose that is not finite.
    """
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
        When the path cannot be written.
    """
    return save_whole(path, text.encode())


def save_whole(path: str | Path, content: bytes) -> Path:
    """Writes a file beside its place and moves it there, so that nobody sees half of it; folders are made.

    Raises
    ------
    CaromError
        When the path cannot be written.
    """
    path = Path(path)
    partial = path.with_name(f"{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(content)
        os.replace(partial, path)
    except OSError as error:
        remedy = "choose another path"
        raise CaromError(
            f"{str(path)!r} cannot be written: {error.strerror or error}; {remedy}",
            field="path", value=str(path), remedy=remedy,
        ) from error  # fmt: skip
    return path


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
