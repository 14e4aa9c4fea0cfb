"""A headless Chromium that is driven over pipes by the DevTools protocol; needs no library.

Messages are JSON that ends in a zero byte, on file descriptor 3 to the browser and 4 from it
(``--remote-debugging-pipe``): no port is opened and nothing but this process can talk to it. A browser takes
a folder of its own and is ended with it. Knows no runs.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from carom.errors import CaromError

#: Names of the browsers that are looked for, in order; the environment variable CAROM_CHROMIUM comes first.
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
_FLAGS = (
    "--headless",
    "--no-first-run",
    "--hide-scrollbars",
    "--mute-audio",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe",
)
_REMEDY = "install Chromium (Debian: apt install chromium), or name one in CAROM_CHROMIUM"


def find_chromium() -> str | None:
    """The path of a Chromium or Chrome, or None."""
    named = os.environ.get("CAROM_CHROMIUM")
    if named:
        return shutil.which(named)
    return next((found for name in NAMES if (found := shutil.which(name))), None)


class Chromium:
    """A browser with one page of a given size.

    Raises
    ------
    CaromError
        When there is no browser, it does not start, or does not answer in time.
    """

    def __init__(self, size: tuple[int, int], *, patience: float = 120.0) -> None:
        """Starts the browser; `size` is the page's [pixels], `patience` how long an answer may take [s]."""
        path = find_chromium()
        if path is None:
            raise CaromError(f"there is no Chromium here; {_REMEDY}", field="chromium", remedy=_REMEDY)
        if sys.platform == "win32":
            remedy = "write the page with to_html and record it there"
            raise CaromError(f"Chromium is not driven on Windows yet; {remedy}", field="chromium")
        self._patience = patience
        self._folder = tempfile.TemporaryDirectory(prefix="carom-chromium-", ignore_cleanup_errors=True)
        self._number = 0
        self._read = b""
        self._start(path, size)
        try:
            target = self._call("Target.createTarget", url="about:blank")["targetId"]
            session = self._call("Target.attachToTarget", targetId=target, flatten=True)
            self._session: str | None = session["sessionId"]
            self._call("Page.enable")
            width, height = size
            self._call(
                "Emulation.setDeviceMetricsOverride",
                width=width, height=height, deviceScaleFactor=1, mobile=False,
            )  # fmt: skip
        except BaseException:
            self.close()
            raise

    def _start(self, path: str, size: tuple[int, int]) -> None:
        inner_in, self._to = os.pipe()
        self._from, inner_out = os.pipe()
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        flags = [*_FLAGS, f"--window-size={size[0]},{size[1]}", f"--user-data-dir={self._folder.name}"]
        flags += ["--no-sandbox"] if root else []  # Chromium refuses its sandbox to root
        self._session = None

        def wire() -> None:
            # the pipes' own numbers may be 3 and 4 themselves, so they are moved out of the way first
            to_browser, from_browser = os.dup(inner_in), os.dup(inner_out)
            high_in = os.dup2(to_browser, 60, inheritable=False)
            high_out = os.dup2(from_browser, 61, inheritable=False)
            os.dup2(high_in, 3)
            os.dup2(high_out, 4)

        try:
            self._process = subprocess.Popen(
                [path, *flags],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                # 3 and 4 are made after the fork: to pass them on would ask for them to be open before, and
                # what has these numbers may close itself at a fork. The kernel closes all other files.
                close_fds=False,
                preexec_fn=wire,
            )
        except (OSError, subprocess.SubprocessError) as error:
            for pipe in (self._to, self._from):
                os.close(pipe)
            self._folder.cleanup()
            raise CaromError(
                f"{path!r} cannot be started: {error}; {_REMEDY}",
                field="chromium",
                value=path,
                remedy=_REMEDY,
            ) from error
        finally:
            os.close(inner_in)
            os.close(inner_out)

    def open(self, page: Path) -> None:
        """Opens a page from a file and waits until it is ready."""
        self._call("Page.navigate", url=page.resolve().as_uri())
        end = time.monotonic() + self._patience
        while time.monotonic() < end:
            if self.evaluate("Boolean(window.carom || window.caromError)"):
                failure = self.evaluate("window.caromError || ''")
                if failure:
                    raise CaromError(f"the page does not start: {failure}", field="page")
                return
            time.sleep(0.05)
        raise self._lost(f"the page was not ready within {self._patience:.0f} s")

    def evaluate(self, code: str) -> Any:
        """The value of an expression in the page; promises are waited for."""
        answer = self._call("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            told = details.get("exception", {}).get("description", details.get("text", ""))
            raise CaromError(f"the page failed: {str(told).splitlines()[0]}", field="page")
        return answer["result"].get("value")

    def screenshot(self) -> bytes:
        """The page as PNG."""
        return base64.b64decode(self._call("Page.captureScreenshot", format="png")["data"])

    def close(self) -> None:
        """Ends the browser."""
        for pipe in (self._to, self._from):
            os.close(pipe)
        try:
            self._process.wait(timeout=3)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        """The browser itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        """Ends the browser."""
        self.close()

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The answer to a command."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        self._send(json.dumps(message).encode() + b"\0")
        end = time.monotonic() + self._patience
        while True:
            answer = json.loads(self._message(end))
            if answer.get("id") != self._number:
                continue  # an event
            if "error" in answer:
                raise CaromError(f"Chromium refused {method}: {answer['error']['message']}", field="chromium")
            result: dict[str, Any] = answer["result"]
            return result

    def _send(self, message: bytes) -> None:
        try:
            while message:
                message = message[os.write(self._to, message) :]
        except OSError as error:
            raise self._lost("Chromium has ended") from error

    def _message(self, end: float) -> bytes:
        """The next message, up to its zero byte."""
        parts = [self._read]
        while b"\0" not in parts[-1]:
            ready, _, _ = select.select([self._from], [], [], max(0.0, end - time.monotonic()))
            if not ready:
                raise self._lost(f"Chromium did not answer within {self._patience:.0f} s")
            part = os.read(self._from, 1 << 20)
            if not part:
                raise self._lost("Chromium has ended")
            parts.append(part)
        message, _, self._read = b"".join(parts).partition(b"\0")
        return message

    def _lost(self, problem: str) -> CaromError:
        return CaromError(f"{problem}; {_REMEDY}", field="chromium", remedy=_REMEDY)
