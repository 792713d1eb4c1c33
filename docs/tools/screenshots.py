"""Makes the pictures of pages in docs: the demonstration's report, a replay, and explore.

    python docs/tools/screenshots.py -o docs

Needs Chromium (apt-get install chromium).
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from cdprcal import _core
from cdprcal.explore import Exploration, ExploreServer
from cdprcal.io import load_log
from cdprcal.live import LiveServer, replay_messages


def photograph(address: str, picture: Path, width: int, height: int) -> None:
    """A picture of a page after its scripts."""
    browser = shutil.which("chromium")
    if browser is None:
        sys.exit("no Chromium on PATH: apt-get install chromium")
    with tempfile.TemporaryDirectory() as profile:
        flags = [
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--hide-scrollbars",
            "--virtual-time-budget=30000",
            f"--user-data-dir={profile}",
            f"--window-size={width},{height}",
            f"--screenshot={picture.resolve()}",
        ]
        subprocess.run([browser, *flags, address], check=True, capture_output=True, timeout=120)


def main() -> None:
    """Runs the demonstration and takes the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"), metavar="DIR")
    folder = parser.parse_args().output
    with tempfile.TemporaryDirectory() as name:
        demo = Path(name)
        command = [sys.executable, "-m", "cdprcal", "demo", "-o", str(demo)]
        subprocess.run(command, check=True, capture_output=True)
        photograph((demo / "report.html").as_uri(), folder / "report.png", 880, 1240)
        file, robot = load_log(demo / "run.csv"), _core.load_robot("irma4")
        with LiveServer(lambda: replay_messages(file, robot, 9, speed=0.0)) as server:
            photograph(server.address, folder / "live.png", 1160, 860)
        hidden = load_log(demo / "faulty.csv")
        with ExploreServer(Exploration(robot, [hidden.log]), [hidden.path.name]) as page:
            photograph(page.address, folder / "explore.png", 1160, 1180)


if __name__ == "__main__":
    main()
