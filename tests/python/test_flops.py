"""tools/flops: which instructions count, and how callgrind's file is read."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest

from scripts import load_script

SCRIPT = Path(__file__).resolve().parents[2] / "tools" / "flops"

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


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    return load_script(SCRIPT)


def test_callgrinds_file(tool: ModuleType) -> None:
    """Relative addresses, compressed names, and the cost of callees left out."""
    assert tool.parse(DUMP.splitlines()) == {
        "/bin/a": {0x1000: 10, 0x1004: 10 + 5, 0x100A: 7},
        "/lib/b": {0x2000: 3, 0x1FF8: 4},
    }


@pytest.mark.parametrize("name", ["addsd", "vmulpd", "vfmadd231pd", "vfnmsub132sd", "sqrtsd"])
def test_what_is_arithmetic(tool: ModuleType, name: str) -> None:
    assert tool.ARITHMETIC.match(name)


@pytest.mark.parametrize("name", ["movapd", "cvtsi2sd", "addss", "add", "xorpd", "ucomisd"])
def test_what_is_not(tool: ModuleType, name: str) -> None:
    assert not tool.ARITHMETIC.match(name)
