"""The kept corpus of the fuzzed importers: every file of it once more, without atheris."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / "fuzz_python" / "importers.py"


def test_every_kept_input_is_read_or_refused() -> None:
    ran = subprocess.run(
        [sys.executable, str(SCRIPT), "replay"], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr[-2000:]
