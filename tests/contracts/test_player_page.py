"""The built replay page in the package is made of the sources in the folder player (ADR 14)."""

import hashlib
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLAYER = ROOT / "player"
PAGE = ROOT / "python/carom/player/page.html"


def digest() -> str:
    """The same as in player/vite.config.ts."""
    names = [path.relative_to(PLAYER).as_posix() for path in (PLAYER / "src").rglob("*") if path.is_file()]
    found = hashlib.sha256()
    for name in sorted([*names, "index.html", "package-lock.json", "vite.config.ts"]):
        found.update(name.encode() + b"\0" + (PLAYER / name).read_bytes() + b"\0")
    return found.hexdigest()


def test_the_built_page_is_current() -> None:
    told = re.search(r'<meta name="carom-sources" content="([0-9a-f]+)">', PAGE.read_text())
    assert told is not None
    assert told.group(1) == digest(), "run: make player"


def test_the_page_asks_for_nothing_from_outside() -> None:
    page = PAGE.read_text()
    assert not re.search(r'<(?:script|img|iframe|link)[^>]*(?:src|href)="(?!data:)', page)
    assert "@import" not in page
