"""Looks at the built site in a headless Chromium: formulas, requests, widths, replays; and takes screenshots.

    python tools/look_at_site.py site [FOLDER]

Each page is opened from its file, wide and narrow. It fails when a formula does not typeset, anything is
asked of another host, a page is wider than its window, a script fails, or a click does not bring a replay.
With FOLDER it writes pictures of some pages there, light and dark, wide and narrow. Without a Chromium it
says so and ends well.
"""

from __future__ import annotations

import base64
import io
import json
import sys
import time
from pathlib import Path
from typing import Any

from PIL import Image

from carom.player.chromium import Chromium, find_chromium

WIDE, NARROW = (1280, 900), (420, 900)
#: Pages whose screenshots are taken: name, address, size, theme.
SHOWN = (
    ("front", "index.html", WIDE, "light"),
    ("front-narrow", "index.html", NARROW, "dark"),
    ("gallery", "gallery/index.html", WIDE, "dark"),
    ("gallery-narrow", "gallery/index.html", NARROW, "light"),
    ("scene", "gallery/made/heavy_top.html", WIDE, "light"),
    ("scene-narrow", "gallery/made/heavy_top.html", NARROW, "dark"),
    ("theory", "theory/05-matrix.html", WIDE, "dark"),
    ("theory-narrow", "theory/05-matrix.html", NARROW, "light"),
    ("playground", "playground.html", WIDE, "light"),
    ("playground-narrow", "playground.html", NARROW, "dark"),
)
#: What a page tells of itself when its fonts and pictures are there, those too that wait to be scrolled to.
ASK = """Promise.all([document.fonts.ready, ...[...document.images].map(i => {
  i.loading = "eager";
  return i.decode().catch(() => 0);
})]).then(() => ({
  bad: [...document.querySelectorAll(".katex-error")].map(e => e.textContent).slice(0, 3),
  raw: [...document.querySelectorAll(".tex")].filter(e => !e.querySelector(".katex")).length,
  outside: performance.getEntriesByType("resource").map(e => e.name).filter(n => /^(https?|wss?):/.test(n)),
  over: document.documentElement.scrollWidth - window.innerWidth,
  broken: [...document.images].filter(i => !i.naturalWidth).map(i => i.src),
  errors: window.siteErrors || [],
}))"""
#: Chooses a scene whose pictures tell something, and lets it run.
SOME_SECONDS = """new Promise((done, fail) => {
  const asked = Date.now();
  const look = () => {
    if (window.caromError) fail(new Error(window.caromError));
    else if (Date.now() - asked > 30000) fail(new Error("the playground does not begin"));
    else if (!window.playground) setTimeout(look, 100);
    else {
      const scenes = document.querySelector("header select");
      scenes.value = "pile_500";
      scenes.dispatchEvent(new Event("change"));
      dispatchEvent(new KeyboardEvent("keydown", {key: " "}));
      [...document.querySelectorAll("button")].find(b => b.textContent === "Plots").click();
      setTimeout(() => playground.session ? done(true) : fail(new Error("no scene runs")), 5000);
    }
  };
  look();
})"""
CLICK = """new Promise(done => {
  const button = document.querySelector("button.replay");
  if (!button) { done("there is no replay"); return; }
  const host = button.parentElement;
  new MutationObserver(() => {
    const frame = host.querySelector("iframe");
    if (frame) frame.addEventListener("load", () => done("loaded"));
  }).observe(host, {childList: true});
  button.click();
  setTimeout(() => done("the replay did not load"), 30000);
})"""


def go(browser: Any, path: Path, size: tuple[int, int], theme: str) -> None:
    """Opens a page and waits until it has loaded."""
    browser._call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1,
                  mobile=False)  # fmt: skip
    features = [{"name": "prefers-color-scheme", "value": theme}]
    browser._call("Emulation.setEmulatedMedia", features=features)
    browser._call("Page.navigate", url=path.resolve().as_uri())
    for _ in range(600):
        if browser.evaluate(
            f"document.readyState === 'complete' && location.href === {json.dumps(path.as_uri())}"
        ):
            return
        time.sleep(0.05)
    sys.exit(f"{path} did not load")


def wrong(told: dict[str, Any], size: tuple[int, int]) -> list[str]:
    """What is wrong with a page, in words."""
    found = [f"formula {text!r}" for text in told["bad"]]
    found += [f"asks {address}" for address in told["outside"]]
    found += [f"picture {address} is missing" for address in told["broken"]]
    found += [f"script: {text}" for text in told["errors"]]
    if told["raw"]:
        found.append(f"{told['raw']} formulas are not typeset")
    if told["over"] > 1:
        found.append(f"is {told['over']} pixels wider than {size[0]}")
    return found


def main() -> None:
    """Ends with 1 when something is wrong."""
    if find_chromium() is None:
        print("=== SKIPPED: looking at the site needs a Chromium, which is not here ===", file=sys.stderr)
        return
    site = Path(sys.argv[1]).resolve()
    pages = [path for path in sorted(site.rglob("*.html"))
             if path.relative_to(site).parts[0] != "rust" and path.parent.name != "replays"]  # fmt: skip
    found = []
    with Chromium(WIDE) as browser:
        watch = "window.siteErrors = []; addEventListener('error', e => siteErrors.push(e.message));"
        browser._call("Page.addScriptToEvaluateOnNewDocument", source=watch)
        for path in pages:
            for size in (WIDE, NARROW):
                go(browser, path, size, "light")
                name = path.relative_to(site)
                found += [f"{name}, {size[0]} wide: {text}" for text in wrong(browser.evaluate(ASK), size)]
        replays = [path for path in pages if 'class="replay"' in path.read_text()]
        for path in replays[:2]:
            go(browser, path, WIDE, "light")
            told = browser.evaluate(CLICK)
            found += [] if told == "loaded" else [f"{path.relative_to(site)}: {told}"]
        if len(sys.argv) > 2:
            folder = Path(sys.argv[2])
            folder.mkdir(parents=True, exist_ok=True)
            for name, address, size, theme in SHOWN:
                go(browser, site / address, size, theme)
                browser.evaluate(ASK)
                if address == "playground.html":
                    browser.evaluate(SOME_SECONDS)
                data = base64.b64decode(browser._call("Page.captureScreenshot", format="png")["data"])
                Image.open(io.BytesIO(data)).convert("RGB").quantize(96).save(
                    folder / f"{name}.png", optimize=True
                )
    print("\n".join(found) if found else f"site: {len(pages)} pages looked at, {len(replays)} with replays")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
