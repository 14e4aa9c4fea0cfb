"""Pictures and films of a run, drawn by the replay page in a headless Chromium; the plane also by matplotlib.

Chromium encodes the film itself (H.264, else VP9), frame by frame, so no other program is needed and a slow
machine makes the same film as a fast one. Where there is no Chromium, runs of the plane are drawn by
matplotlib, films of them if ffmpeg is there; space is refused with the remedy.
"""

from __future__ import annotations

import base64
import json
import math
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from carom.errors import CaromError
from carom.player.chromium import Chromium, find_chromium
from carom.player.page import page_of, save_whole, write_page

if TYPE_CHECKING:
    from carom.recorded import Run

#: Most pictures of a film [1].
MOST_PICTURES = 36_000
#: Films take longer to make than other answers of the browser [s].
_PATIENCE = 3600.0


def write_png(
    run: Run, path: str | Path, time: float | None, size: tuple[int, int], theme: str, contacts: bool
) -> Path:
    """See `Run.to_png`."""
    path = _checked(path, ".png", size, theme)
    moment = float(run.time[-1]) if time is None else float(time)
    if not math.isfinite(moment):
        raise _refused("t", time, "must be a moment of the run", "give seconds")
    if find_chromium() is None and run.space == "planar":
        from carom.player.drawing import draw_planar

        return save_whole(path, draw_planar(run, moment, size, theme, contacts))
    with tempfile.TemporaryDirectory() as folder, Chromium(size) as browser:
        _open(browser, run, Path(folder), theme, contacts)
        browser.evaluate(f"carom.seek({json.dumps(moment)})")
        return save_whole(path, browser.screenshot())


def write_mp4(
    run: Run,
    path: str | Path,
    *,
    speed: float,
    fps: int,
    size: tuple[int, int],
    theme: str,
    contacts: bool,
) -> Path:
    """See `Run.to_mp4`."""
    path = _checked(path, ".mp4", size, theme)
    if not (math.isfinite(speed) and speed > 0):
        raise _refused("speed", speed, "must be > 0", "give simulated seconds per second of film")
    if isinstance(fps, bool) or not isinstance(fps, int) or not 1 <= fps <= 240:
        raise _refused("fps", fps, "must be from 1 to 240", "give pictures per second")
    begin, end = float(run.time[0]), float(run.time[-1])
    pictures = (end - begin) / speed * fps
    if pictures > MOST_PICTURES:
        raise _refused("speed", speed, f"makes {pictures:.0f} pictures", "give a larger one")
    if find_chromium() is None and run.space == "planar" and shutil.which("ffmpeg"):
        from carom.player.drawing import film_planar

        return film_planar(run, path, speed=speed, fps=fps, size=size, theme=theme, contacts=contacts)
    with tempfile.TemporaryDirectory() as folder, Chromium(size, patience=_PATIENCE) as browser:
        _open(browser, run, Path(folder), theme, contacts)
        settings = json.dumps({"fps": fps, "speed": speed, "from": begin, "to": end})
        return save_whole(path, base64.b64decode(browser.evaluate(f"carom.film({settings})")))


def _open(browser: Chromium, run: Run, folder: Path, theme: str, contacts: bool) -> None:
    page = write_page(folder / "run.html", page_of(run, max_bytes=200_000_000, explain_seconds=0.0))
    browser.open(page)
    browser.evaluate(f"carom.showSceneOnly(true, {json.dumps(theme)})")
    if not contacts:
        browser.evaluate("carom.view.setArrows({points: false, normals: false, impulses: false})")


def _checked(path: str | Path, suffix: str, size: tuple[int, int], theme: str) -> Path:
    path = Path(path)
    if path.suffix.lower() != suffix:
        raise _refused("path", str(path), f"must end in {suffix}", f"give a name that ends in {suffix}")
    if len(size) != 2 or not all(isinstance(n, int) and 64 <= n <= 8192 for n in size):
        raise _refused("size", size, "must be two whole numbers from 64 to 8192", "give (width, height)")
    if theme not in ("light", "dark"):
        raise _refused("theme", theme, "must be 'light' or 'dark'", "give one of them")
    return path


def _refused(field: str, value: Any, problem: str, remedy: str) -> CaromError:
    return CaromError(f"{field} {problem}, got {value!r}; {remedy}", field=field, value=value, remedy=remedy)
