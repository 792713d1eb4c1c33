"""tools/instructions: counts of fixed workloads against those on record; tools/flops: which
instructions count, and how callgrind's file is read."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from scripts import executed, load_script

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools" / "instructions"


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    return load_script(SCRIPT)


@pytest.fixture(scope="module")
def flops() -> ModuleType:
    return load_script(SCRIPT.with_name("flops"))


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return executed([sys.executable, SCRIPT, *arguments], timeout=300)


@pytest.fixture
def bin_folder() -> str:
    folder = os.environ.get("CDPRCAL_BIN", "")
    if shutil.which("valgrind") is None:
        pytest.skip("no valgrind on PATH")
    if not folder or not (Path(folder) / "cdprcal_workloads").is_file():
        pytest.skip("no cdprcal_workloads in CDPRCAL_BIN")
    return folder


def test_no_workload_needs_more_instructions_than_on_record(bin_folder: str) -> None:
    done = run("--bin", bin_folder)
    print(done.stdout, done.stderr)
    assert done.returncode == 0, done.stdout + done.stderr


def test_growth_is_named_and_ends_with_1(bin_folder: str, tmp_path: Path) -> None:
    """Against a record that claims half of what direct_equilibria needs."""
    path = tmp_path / "counts.json"
    assert run("--bin", bin_folder, "--record", path, "--update", "direct").returncode == 0
    record = json.loads(path.read_text())
    assert run("--bin", bin_folder, "--record", path, "direct").returncode == 0
    record["counts"]["direct_equilibria"] //= 2
    path.write_text(json.dumps(record))
    done = run("--bin", bin_folder, "--record", path, "direct")
    assert done.returncode == 1
    assert "GREW" in done.stdout
    assert "direct_equilibria" in done.stderr

    record["toolchain"]["compiler"] = "another"
    path.write_text(json.dumps(record))
    done = run("--bin", bin_folder, "--record", path, "direct")
    assert done.returncode == 0
    assert "on record another" in done.stderr


def test_limits_of_the_comparison(tool: ModuleType) -> None:
    before = {"a": 1000, "b": 1000}
    assert tool.compare({"a": 1049, "b": 900}, before, True) == tool.DONE
    assert tool.compare({"a": 1051, "b": 900}, before, True) == tool.GREW
    assert tool.compare({"a": 2000}, before, False) == tool.DONE
    assert tool.compare({"new": 2000}, before, True) == tool.DONE


def test_a_workload_that_is_not_there(bin_folder: str) -> None:
    done = run("--bin", bin_folder, "nonsense")
    assert done.returncode == 2
    assert "direct_equilibria" in done.stderr


def test_the_record_holds_every_workload(bin_folder: str) -> None:
    listed = executed([Path(bin_folder) / "cdprcal_workloads"], check=True)
    record = json.loads((ROOT / "tests" / "instructions" / "counts.json").read_text())
    assert listed.stdout.split() == list(record["counts"])


#: As callgrind writes it.
DUMP = """\
positions: instr line
events: Ir

ob=(1) /bin/a
fn=(1) main
0x1000 5 10
+4 +1 10
cob=(2) /lib/b
cfn=(2) f
calls=3 0x2000 1
* * 999
+6 * 7

ob=(2)
fn=(2)
0x2000 1 3
-8 +2 4
ob=(1)
0x1004 9 5
"""


def test_callgrinds_file(flops: ModuleType) -> None:
    """Relative addresses, compressed names, and the cost of callees left out."""
    assert flops.parse(DUMP.splitlines()) == {
        "/bin/a": {0x1000: 10, 0x1004: 10 + 5, 0x100A: 7},
        "/lib/b": {0x2000: 3, 0x1FF8: 4},
    }


@pytest.mark.parametrize("name", ["addsd", "vmulpd", "vfmadd231pd", "vfnmsub132sd", "sqrtsd"])
def test_what_is_arithmetic(flops: ModuleType, name: str) -> None:
    assert flops.ARITHMETIC.match(name)


@pytest.mark.parametrize("name", ["movapd", "cvtsi2sd", "addss", "add", "xorpd", "ucomisd"])
def test_what_is_not(flops: ModuleType, name: str) -> None:
    assert not flops.ARITHMETIC.match(name)
