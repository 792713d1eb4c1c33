"""Same seed, same bytes: again, and on two cores, whatever writes a file or prints JSON."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

import cdprcal
from scripts import executed

#: Run one after the other in one folder; {threads} is 1 or 2. What they print is kept too.
COMMANDS = (
    "template -o template.yaml --cables 3",
    "generate irma4 --grid 2x2x1 --seed 5 -o generated.csv --truth generated.json",
    "generate ring3 --grid 2x1x1 --seed 5 -o generated.mcap",
    "plan irma4 --grid 2x2x1 --order random --seed 3 --threads {threads} -o plan.csv --json",
    "plan irma4 --optimal 3 --threads {threads} -o optimal.csv --json",
    "plan ring3 --threads {threads} --grid 2x1x1 -o ring3.csv --json",
    "acquire irma4 optimal.csv --seed 4 --quick -o acquired.csv --truth truth.json --json",
    "acquire irma4 optimal.csv --seed 4 --quick -o acquired.mcap --json",
    "acquire irma4 optimal.csv --seed 4 --quick --effect mass=0.8 -o heavy.csv --json",
    "acquire irma4 plan.csv --seed 4 --quick --until 5mm,1deg -o short.csv --json",
    "acquire ring3 ring3.csv --seed 4 --quick -o ring3_run.csv --json",
    "import acquired.mcap -o imported.csv --inputs inputs",
    "check irma4 acquired.csv --json",
    "check irma4 --json",
    "calibrate irma4 acquired.csv -o result.json --json",
    "calibrate irma4 acquired.csv --method static --formulation paper --json",
    "calibrate irma4 acquired.csv --method kinematic --json",
    "calibrate irma4 generated.csv --json",
    "diagnose irma4 acquired.csv --result diagnosis.json --json",
    "diagnose irma4 heavy.csv -o corrected.yaml --result heavy.json --json",
    "repeat result.json --json",
    "report irma4 acquired.csv -o report.html",
    "report heavy.json -o heavy.html",
    "export irma4 acquired.csv -o bag",
    "export irma4 acquired.csv -o bag3 --storage sqlite3",
    "import bag --robot irma4 -o from_bag.csv",
    "demo --seed 3 -o demo --json",
    "workspace irma4 --step-m 0.2 --threads {threads} -o mesh.ply --json",
    "workspace ring3 --step-m 0.3 --threads {threads} -o mesh.stl --json",
)
#: What a clock says is no result.
CLOCK = re.compile(
    rb'("duration_s": [0-9.e+-]+,\s*)?"solve_time_s":\s*[0-9.e+-]+|solved in</th><td>[0-9.]+'
    rb"|Made [0-9-]+ [0-9:]+ UTC"
)

PACKAGE = str(Path(cdprcal.__file__).resolve().parents[1])

RUN = """
import contextlib, os, sys
threads = int(sys.argv[1])
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
from cdprcal.cli import app
for number, words in enumerate(sys.argv[2:]):
    with open(f"stdout-{number}", "w") as out, contextlib.redirect_stdout(out):
        try:
            app(words.format(threads=threads).split())
        except SystemExit as stop:
            if stop.code not in (0, None, 1): raise RuntimeError(words) from None
"""


def all_files(folder: Path, threads: int) -> dict[str, bytes]:
    """What the commands leave in a folder, by name."""
    folder.mkdir()
    done = executed(
        [sys.executable, "-c", RUN, str(threads), *COMMANDS],
        cwd=folder,
        env=os.environ | {"OMP_NUM_THREADS": str(threads), "PYTHONPATH": PACKAGE},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return {
        str(path.relative_to(folder)): CLOCK.sub(b"", path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_one_core_or_two_the_same_bytes(tmp_path: Path) -> None:
    cores = min(2, len(os.sched_getaffinity(0)))
    one, again = (
        all_files(tmp_path / name, threads) for name, threads in (("one", 1), ("again", cores))
    )
    assert len(one) >= len(COMMANDS)
    assert again.keys() == one.keys()
    assert not [name for name in one if again[name] != one[name]]


def test_another_seed_is_another_run(tmp_path: Path) -> None:
    """That the comparison sees anything: noise, offsets and order do depend on the seed."""
    from cdprcal.cli import app

    written = []
    for seed in (1, 2):
        path = tmp_path / f"{seed}.csv"
        words = ["generate", "irma4", "--grid", "2x1x1", "--seed", str(seed), "-o", str(path)]
        with pytest.raises(SystemExit):
            app(words)
        written.append(path.read_bytes())
    assert written[0] != written[1]
