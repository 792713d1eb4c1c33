"""The large files, each read in a process of its own with little memory: one JSON line a command.

    python -m malformed.big     # with tests/python on the path

Prints the case, the command, its exit code, CPU time [s], peak memory [bytes] beyond what the
imported program needs, and what it said.
"""

from __future__ import annotations

import io
import json
import os
import resource
import shutil
import sys
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from cdprcal.cli import app
from malformed import CASES, Case, Valid, make, make_valid
from malformed.commands import commands

#: More address space than this, beyond what the program has once it is loaded, is refused.
MOST_BYTES = 1 << 30


def _read(case: Case, words: list[str]) -> None:
    """In a process of its own: what a command makes of a file."""
    with open("/proc/self/statm") as stream:
        pages = int(stream.read().split()[0])
    limit = pages * resource.getpagesize() + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    said, code = io.StringIO(), 0
    begin = time.process_time()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            app(words, prog_name="cdprcal")
        except SystemExit as stop:
            code = stop.code if isinstance(stop.code, int) else 0
        except BaseException as error:
            code = -1
            print(f"Traceback: {type(error).__name__}: {error}", file=sys.stderr)
    line = {
        "case": case.id,
        "command": words[0],
        "code": code,
        "cpu_s": time.process_time() - begin,
        "peak_bytes": 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before),
        "said": said.getvalue()[-2000:],
    }
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


def _every_command(case: Case, folder: Path, valid: Valid) -> None:
    path = make(case, folder, valid)
    before = set(folder.iterdir())
    for words in commands(case, path, folder / "out", valid):
        sys.stdout.flush()
        child = os.fork()
        if not child:
            try:
                _read(case, words)
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        new = set(folder.iterdir()) - before
        assert case.said or not new, (case.id, words, new)
    for left in folder.iterdir():
        if left.is_dir():
            shutil.rmtree(left)
        else:
            left.unlink()


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        valid_folder, folder = Path(place, "valid"), Path(place, "big")
        valid_folder.mkdir()
        folder.mkdir()
        valid = make_valid(valid_folder)
        for case in CASES:
            if case.big:
                _every_command(case, folder, valid)


if __name__ == "__main__":
    main()
