"""Checks the built site: links and anchors, that nothing is asked of the network, that all public names are
told.

    python tools/check_site.py site

Pages under `rust/` are rustdoc's own: their links are its business, that they are there is ours.
"""

from __future__ import annotations

import importlib
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

#: Modules whose `__all__`, or public functions and classes, must have an entry.
MODULES = (
    "carom", "carom.planar", "carom.spatial", "carom.impact", "carom.collision", "carom.plotting",
    "carom.picture",
    "carom.gradient", "carom.errors", "carom.run", "carom.comparison", "carom.advice", "carom.scene",
)  # fmt: skip
#: Attributes that make a browser load something as soon as it shows a page.
LOADS = {
    ("script", "src"), ("img", "src"), ("iframe", "src"), ("source", "src"), ("video", "src"),
    ("audio", "src"), ("embed", "src"), ("object", "data"), ("link", "href"), ("use", "href"),
    ("image", "href"), ("input", "src"),
}  # fmt: skip


class Page(HTMLParser):
    """Anchors, links and loads of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.styles: list[str] = []
        self._in_style = False
        self.feed(text)

    def handle_starttag(self, tag: str, given: list[tuple[str, str | None]]) -> None:
        self._in_style = tag == "style"
        for name, value in given:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            if tag == "a" and name == "href" and value:
                self.links.append(value)
            if (tag, name) in LOADS and value:
                self.loads.append(value)
            if name == "srcset" and value:
                self.loads += [part.split()[0] for part in value.split(",")]
            if name == "data-page" and value:
                self.links.append(value)
            if name == "style" and value:
                self.styles.append(value)

    def handle_data(self, data: str) -> None:
        if self._in_style:
            self.styles.append(data)


def outside(address: str) -> bool:
    """Whether an address is of another host."""
    return address.startswith("//") or urlsplit(address).scheme in ("http", "https", "ws", "wss", "ftp")


def check(site: Path) -> list[str]:
    """What is wrong, in words."""
    found: list[str] = []
    pages = {path: Page(path.read_text(errors="replace")) for path in sorted(site.rglob("*.html"))
             if "rust" not in path.relative_to(site).parts[:1] and path.parent.name != "replays"}  # fmt: skip
    for path, page in pages.items():
        name = path.relative_to(site)
        for address in page.loads:
            if outside(address):
                found.append(f"{name}: loads {address}")
        found += [f"{name}: a style loads {one}" for text in page.styles for one in style_loads(text)]
        for address in [*page.links, *page.loads]:
            if outside(address) or urlsplit(address).scheme:
                continue
            parts = urlsplit(address)
            target = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
            if target.is_dir():
                target = target / "index.html"
            if not target.exists():
                found.append(f"{name}: {address} leads nowhere")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                found.append(f"{name}: {address}: no such anchor")
    for path in sorted([*site.rglob("*.css"), *site.rglob("*.js")]):
        if "rust" in path.relative_to(site).parts[:1]:
            continue
        text = path.read_text(errors="replace")
        name = path.relative_to(site)
        if path.suffix == ".css":
            found += [f"{name}: loads {one}" for one in style_loads(text)]
        else:
            calls = re.findall(
                r"(?:fetch|import|open|Worker|WebSocket)\(\s*[\"'`](?:https?:|wss?:)?//[^\"'`]*", text
            )
            found += [f"{name}: {call}" for call in calls]
    return found + missing(site)


def style_loads(text: str) -> list[str]:
    """Addresses outside that a style loads."""
    addresses = re.findall(r"url\(\s*[\"']?([^\"')]+)", text) + re.findall(r"@import\s+[\"']([^\"']+)", text)
    return [address for address in addresses if outside(address)]


def missing(site: Path) -> list[str]:
    """Public names without an entry in the reference."""
    anchors: set[str] = set()
    for path in (site / "reference").glob("*.html"):
        anchors |= Page(path.read_text()).anchors
    found = []
    told = {anchor.rsplit(".", 1)[-1] for anchor in anchors if anchor.startswith("carom")}
    for module in MODULES:
        thing = importlib.import_module(module)
        names = getattr(thing, "__all__", None) or [
            name for name, value in vars(thing).items()
            if not name.startswith("_") and getattr(value, "__module__", None) == module
        ]  # fmt: skip
        for name in names:
            if isinstance(getattr(thing, name, None), type(sys)):
                continue  # a module of its own
            spelled = f"{module}.{name}"
            if spelled not in anchors and name not in told and f"module-{spelled}" not in anchors:
                found.append(f"reference: {spelled} has no entry")
    return found


def main() -> None:
    """Ends with 1 when something is wrong."""
    site = Path(sys.argv[1]).resolve()
    found = check(site)
    print(
        "\n".join(found)
        if found
        else f"site: {len(list(site.rglob('*.html')))} pages, all links lead somewhere"
    )
    if not (site / "rust/carom/index.html").exists():
        found.append("rust")
        print("rust/carom/index.html is missing")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
