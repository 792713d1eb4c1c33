"""Makes the pictures of pages in docs: the demonstration's report, a replay, explore (it moves).

    python docs/tools/screenshots.py -o docs

Needs Chromium (apt-get install chromium). They are taken in the browser that the tests drive.
"""

from __future__ import annotations

import argparse
import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from cdprcal import _core
from cdprcal.explore import Exploration, ExploreServer
from cdprcal.io import load_log
from cdprcal.live import LiveServer, replay_messages

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "python"))
from browser import Tab, browser_tab

_PATIENCE_S = 300.0
_REPORT_READY = "document.documentElement.dataset.report === 'drawn'"
_EXPLORE_READY = "document.documentElement.dataset.explore === 'ready'"
_LIVE_READY = "document.documentElement.dataset.live === 'ended'"
#: Draws a pointer where the next click will be, since a browser's own is in no picture.
_POINTER = """
(([x, y]) => {
  let p = document.getElementById('pointer');
  if (!p) {
    p = document.createElement('div');
    p.id = 'pointer';
    p.innerHTML = '<svg width="22" height="30" viewBox="0 0 12 17">'
      + '<path d="M1 1v13l3-3 2.2 5 2-.9L6 10.3h4.4z" fill="#000" stroke="#fff"/></svg>';
    p.style = 'position: fixed; z-index: 9; pointer-events: none';
    document.body.append(p);
  }
  p.style.left = `${x}px`; p.style.top = `${y}px`;
})
"""


class MovingPicture:
    """Frames of a page, each shown for a while; written as an animated WebP that repeats."""

    def __init__(self, tab: Tab) -> None:
        self._tab = tab
        self._at = (470.0, 460.0)
        self._frames: list[Image.Image] = []
        self._durations_ms: list[int] = []

    def show(self, seconds: float) -> None:
        """The page as it is now."""
        with tempfile.TemporaryDirectory() as folder:
            shot = Path(folder) / "frame.png"
            self._tab.screenshot(shot, whole=False)
            self._frames.append(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB"))
        self._durations_ms.append(round(1000.0 * seconds))

    def click(self, selector: str, until: str) -> None:
        """Moves the pointer to an element, clicks it, and shows what came of it."""
        box = self._tab.js(
            f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect(); "
            "return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        steps = 6
        x, y = self._at
        for i in range(1, steps + 1):
            part = i / steps
            place = [x + part * (box[0] - x), y + part * (box[1] - y)]
            self._tab.js(f"{_POINTER}({place})")
            self.show(0.06 if i < steps else 0.4)
        self._at = (box[0], box[1])
        self._tab.click(selector)
        self._tab.wait(f"{_EXPLORE_READY} && ({until})", _PATIENCE_S)

    def save(self, path: Path, width: int) -> None:
        """Writes it, ``width`` pixels wide."""
        size = (width, round(width * self._frames[0].height / self._frames[0].width))
        frames = [frame.resize(size, Image.Resampling.LANCZOS) for frame in self._frames]
        frames[0].save(
            path,
            save_all=True,
            append_images=frames[1:],
            duration=self._durations_ms,
            loop=0,
            quality=80,
            method=6,
        )


def explored(tab: Tab, address: str, picture: Path) -> None:
    """The model as given, the effect ticked that a scan expects most of, and a pose left out."""
    tab.size(960, 960)
    tab.open(address, _EXPLORE_READY, seconds=_PATIENCE_S)
    said = "document.querySelector('#said').textContent"
    moving = MovingPicture(tab)
    moving.show(2.0)
    moving.click("#none", f"{said}.startsWith('0 effects')")
    moving.show(2.5)
    moving.click(".effect input", f"{said}.startsWith('1 effect')")
    moving.show(3.0)
    moving.click("#find", f"!{said}.startsWith('1 effect')")
    moving.show(3.0)
    moving.save(picture, 960)


def photograph(tab: Tab, address: str, ready: str, picture: Path, size: tuple[int, int]) -> None:
    """A picture of a page's top."""
    tab.size(*size)
    tab.open(address, ready, seconds=_PATIENCE_S)
    tab.screenshot(picture, whole=False)


def main() -> None:
    """Runs the demonstration and takes the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"), metavar="DIR")
    folder = parser.parse_args().output
    with tempfile.TemporaryDirectory() as name, browser_tab() as tab:
        demo = Path(name)
        command = [sys.executable, "-m", "cdprcal", "demo", "-o", str(demo)]
        subprocess.run(command, check=True, capture_output=True)
        report = (demo / "report.html").as_uri()
        photograph(tab, report, _REPORT_READY, folder / "report.png", (880, 1240))
        file, robot = load_log(demo / "run.csv"), _core.load_robot("irma4")
        with LiveServer(lambda: replay_messages(file, robot, 9, speed=0.0)) as server:
            photograph(tab, server.address, _LIVE_READY, folder / "live.png", (1160, 860))
        hidden = load_log(demo / "faulty.csv")
        with ExploreServer(Exploration(robot, [hidden.log]), [hidden.path.name]) as page:
            photograph(tab, page.address, _EXPLORE_READY, folder / "explore.png", (1160, 1180))
            explored(tab, page.address, folder / "explore.webp")


if __name__ == "__main__":
    main()
