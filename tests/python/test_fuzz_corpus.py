"""The kept corpora of the fuzzers: those of the importers once more, and how they are packed."""

from __future__ import annotations

import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from scripts import executed

TESTS = Path(__file__).resolve().parents[1]
SCRIPT = TESTS / "fuzz_python" / "importers.py"
PACK = TESTS / "corpus.py"
ARCHIVES = sorted(TESTS.glob("fuzz*/corpus/*.tar.xz"))


def corpus(*words: str | Path) -> None:
    subprocess.run([sys.executable, str(PACK), *map(str, words)], check=True)


def test_every_kept_input_is_read_or_refused() -> None:
    ran = executed([sys.executable, str(SCRIPT), "replay"])
    assert ran.returncode == 0, ran.stderr[-2000:]
    replayed = dict(line.split(": ") for line in ran.stdout.splitlines())
    for archive in SCRIPT.parent.glob("corpus/*.tar.xz"):
        with tarfile.open(archive) as packed:
            assert int(replayed.pop(archive.name.removesuffix(".tar.xz"))) == len(packed.getnames())
    assert not replayed


@pytest.mark.parametrize("archive", ARCHIVES, ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_an_archive_is_unpacked_and_packed_to_the_same_files(archive: Path, tmp_path: Path) -> None:
    """Whatever the files' dates, owners and order: only their names and contents count."""
    corpus("unpack", archive, tmp_path / "files")
    for path in sorted((tmp_path / "files").iterdir(), reverse=True):
        path.chmod(0o600)
        path.touch()
    corpus("pack", tmp_path / "files", tmp_path / "again.tar.xz")
    corpus("pack", tmp_path / "files", tmp_path / "twice.tar.xz")
    assert (tmp_path / "again.tar.xz").read_bytes() == (tmp_path / "twice.tar.xz").read_bytes()
    found = []
    for path in (archive, tmp_path / "again.tar.xz"):
        with tarfile.open(path) as packed:
            members = packed.getmembers()
        assert members
        assert [m.name for m in members] == sorted(m.name for m in members)
        assert all(
            (m.mtime, m.uid, m.gid, m.uname, m.mode) == (0, 0, 0, "", 0o644) for m in members
        )
        found.append([(m.name, m.size) for m in members])
    assert found[0] == found[1]


def test_every_fuzzed_parser_has_a_corpus() -> None:
    parsers = {path.stem for path in (TESTS / "fuzz").glob("*.cpp")} - {"replay"}
    assert parsers == {path.name.removesuffix(".tar.xz") for path in TESTS.glob("fuzz/corpus/*")}


def test_a_finding_is_added_beside_what_was_there(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "a").write_bytes(b"1")
    (tmp_path / "b").write_bytes(b"\0\r\n")
    corpus("pack", tmp_path / "kept", tmp_path / "x.tar.xz")
    corpus("add", tmp_path / "x.tar.xz", tmp_path / "b")
    corpus("unpack", tmp_path / "x.tar.xz", tmp_path / "out")
    assert {p.name: p.read_bytes() for p in (tmp_path / "out").iterdir()} == {
        "a": b"1",
        "b": b"\0\r\n",
    }
