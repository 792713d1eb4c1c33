"""The corpus of malformed files: each is refused with one clear message, quickly, and no trace.

What a reader takes nevertheless, because logs in the field are like that, it says (``Case.said``).
"""

from __future__ import annotations

import json
import os
import re
import sys
import time
from pathlib import Path

import pytest

from conftest import Cli
from malformed import CASES, Case, Valid, make, make_valid
from malformed.big import MOST_BYTES
from malformed.commands import commands
from scripts import executed

MOST_CPU_S = 1.0
SMALL = [case for case in CASES if not case.big]


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> Valid:
    return make_valid(tmp_path_factory.mktemp("valid"))


def test_there_are_more_than_300_and_each_has_its_name() -> None:
    assert len(CASES) >= 300
    assert len({case.id for case in CASES}) == len(CASES)


def shown_name(path: Path) -> str:
    """The part of a path that a message can be searched for."""
    return re.split(r"[\0\n]", path.name)[0].encode("utf-8", "ignore").decode()[:100]


@pytest.mark.parametrize("case", SMALL, ids=[case.id for case in SMALL])
def test_is_refused(cli: Cli, valid: Valid, tmp_path: Path, case: Case) -> None:
    if case.name == "no permission" and os.geteuid() == 0:
        pytest.skip("root may read everything")
    path = make(case, tmp_path, valid)
    before = set(tmp_path.rglob("*"))
    for words in commands(case, path, tmp_path / "out", valid):
        begin = time.process_time()
        ran = cli(*words)
        took_s = time.process_time() - begin
        assert "internal error" not in ran.stderr, ran
        assert "Traceback" not in ran.stderr, ran
        said = ran.stdout + ran.stderr if case.said else ran.stderr  # check's findings are answers
        assert shown_name(path) in said, ran
        assert took_s < MOST_CPU_S, (words, took_s)
        if case.said:
            assert re.search(case.words, said), (case.words, said)
            continue
        assert ran.code == 2, ran
        assert ran.stdout == ""
        assert ran.stderr.startswith("cdprcal: "), ran
        assert ran.stderr.count("\n") == 1, "one message on one line"
        name = shown_name(path)
        after = ran.stderr.split(name, 1)[1] if name else ran.stderr
        assert re.search(case.words, after), (case.words, ran.stderr)
        assert set(tmp_path.rglob("*")) == before, "nothing is written"


@pytest.mark.alone
def test_large_ones_are_refused_with_little_memory(tmp_path: Path) -> None:
    here = str(Path(__file__).resolve().parent)
    paths = os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH", "")]))
    done = executed(
        [sys.executable, "-m", "malformed.big"],
        env=os.environ | {"PYTHONPATH": paths, "TMPDIR": str(tmp_path)},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    by_id = {case.id: case for case in CASES if case.big}
    assert {line["case"] for line in lines} == by_id.keys(), "each one was read to its end"
    for line in lines:
        case = by_id[line["case"]]
        assert "internal error" not in line["said"], line
        assert "Traceback" not in line["said"], line
        assert re.search(case.words, line["said"]), (case.words, line)
        assert case.said or line["code"] in (1, 2), line
        assert line["cpu_s"] < MOST_CPU_S, line
        assert line["peak_bytes"] < MOST_BYTES, line
