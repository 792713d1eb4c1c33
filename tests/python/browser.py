"""A tab of headless Chromium that tests drive: clicks, sizes, dark mode, no WebGL, screenshots.

Over the browser's own DevTools protocol (https://chromedevtools.github.io/devtools-protocol).
"""

from __future__ import annotations

import base64
import itertools
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from websockets.sync.client import ClientConnection, connect

PHONE = (390, 844)


def chromium() -> str | None:
    """The program, if there is one on PATH."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return next(filter(None, map(shutil.which, names)), None)


class Tab:
    """One page. ``problems``: what its console and its security policy complained about."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self._number = itertools.count(1)
        self.problems: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable")

    def open(self, address: str, ready: str = "true", *, seconds: float = 30.0) -> None:
        """Loads a page and waits until an expression holds on it."""
        self._call("Page.navigate", url=address)
        self.wait(f"document.readyState === 'complete' && ({ready})", seconds)

    def size(self, width: int, height: int, *, dark: bool = False) -> None:
        """The window's size in CSS pixels, and the colours that its owner prefers."""
        self._call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        wish = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._call("Emulation.setEmulatedMedia", features=[wish])

    def js(self, expression: str) -> Any:
        """The value of an expression, awaited."""
        found = self._call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in found:
            raise AssertionError(f"{expression}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def wait(self, expression: str, seconds: float = 30.0) -> None:
        """Until an expression holds; fails with what the page says instead."""
        end = time.monotonic() + seconds
        while not self.js(expression):
            if time.monotonic() > end:
                text = self.js("document.body.innerText.slice(0, 2000)")
                raise AssertionError(f"{expression} never held; {self.problems}; the page: {text}")
            time.sleep(0.05)

    def click(self, selector: str) -> None:
        """A real click in the middle of an element, scrolled into view."""
        box = self.js(
            f"(() => {{ const e = document.querySelector({json.dumps(selector)}); "
            "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect(); "
            "return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self._call(
                "Input.dispatchMouseEvent",
                type=kind,
                x=box[0],
                y=box[1],
                button="left",
                clickCount=1,
            )

    def type(self, text: str) -> None:
        """Text into what has the focus, as a keyboard's."""
        self._call("Input.insertText", text=text)

    def text(self, selector: str) -> str:
        """What an element says."""
        return str(self.js(f"document.querySelector({json.dumps(selector)}).textContent"))

    def wider_than_the_window(self) -> list[str]:
        """Elements that reach over its right edge and cannot be scrolled within themselves."""
        script = """
        [...document.querySelectorAll("body *")].filter((e) => {
          for (let p = e; p; p = p.parentElement) {
            const style = getComputedStyle(p);
            if (style.overflowX !== "visible" || style.position === "fixed") return false;
          }
          const box = e.getBoundingClientRect();
          return box.width > 0 && box.right > document.documentElement.clientWidth + 1;
        }).map((e) => `${e.tagName} ${e.id} ${e.className}`)
        """
        return list(self.js(script))

    def foreign_requests(self) -> list[str]:
        """What the page loaded from anywhere but this computer."""
        names = self.js("performance.getEntriesByType('resource').map((e) => e.name)")
        own = re.compile(r"(http://127\.0\.0\.1:|file:|data:|blob:)")
        return [name for name in names if not own.match(name)]

    def screenshot(self, path: Path, *, whole: bool = True) -> None:
        """A picture of the page, down to its end if ``whole``."""
        shot = self._call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._number)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=60.0))
            if message.get("id") == number:
                if "error" in message:
                    raise AssertionError(f"{method}: {message['error']}")
                return dict(message["result"])
            self._notice(message)

    def _notice(self, event: dict[str, Any]) -> None:
        what = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            self.problems.append(str(what["exceptionDetails"]))
        elif event.get("method") == "Log.entryAdded" and what["entry"]["level"] == "error":
            self.problems.append(what["entry"]["text"])
        elif event.get("method") == "Runtime.consoleAPICalled" and what["type"] == "error":
            self.problems.append(str([a.get("value") for a in what["args"]]))


@contextmanager
def browser_tab(*flags: str) -> Iterator[Tab]:
    """A tab of a browser of its own, with no network but this computer."""
    program = chromium()
    assert program is not None, "no Chromium on PATH: apt-get install chromium"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        running = subprocess.Popen(
            [
                program,
                "--headless=new",
                "--no-sandbox",
                "--disable-dev-shm-usage",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--hide-scrollbars",
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                "--remote-debugging-port=0",
                f"--user-data-dir={profile}",
                *flags,
                "about:blank",
            ],
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            with connect(_address_of_tab(running), max_size=None) as socket:
                yield Tab(socket)
        finally:
            running.terminate()
            running.wait(20)


def _address_of_tab(running: subprocess.Popen[str]) -> str:
    assert running.stderr is not None
    for line in running.stderr:
        if found := re.search(r"DevTools listening on ws://(127\.0\.0\.1:\d+)/", line):
            request = Request(f"http://{found[1]}/json/new?about:blank", method="PUT")
            with urlopen(request, timeout=20) as answer:
                return str(json.load(answer)["webSocketDebuggerUrl"])
    raise AssertionError(f"Chromium ended: {running.wait()}")
