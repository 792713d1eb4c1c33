#!/usr/bin/env python3
"""The kept inputs of a fuzz target: one archive, to the byte the same for the same files.

tests/corpus.py add ARCHIVE FILE…        puts findings in, under their names
tests/corpus.py unpack ARCHIVE FOLDER    to look at them, or to take some out
tests/corpus.py pack FOLDER ARCHIVE      the files of a folder, and no others
"""

from __future__ import annotations

import io
import sys
import tarfile
from pathlib import Path


def read(archive: Path) -> dict[str, bytes]:
    """The contents of every file by its name, sorted."""
    with tarfile.open(archive) as packed:
        streams = {member.name: packed.extractfile(member) for member in packed if member.isfile()}
        return {name: stream.read() for name, stream in sorted(streams.items()) if stream}


def write(archive: Path, files: dict[str, bytes]) -> None:
    """All of these, without dates and owners."""
    archive.parent.mkdir(parents=True, exist_ok=True)
    with tarfile.open(archive, "w:xz", format=tarfile.USTAR_FORMAT) as packed:
        for name, data in sorted(files.items()):
            member = tarfile.TarInfo(name)
            member.size = len(data)
            packed.addfile(member, io.BytesIO(data))


def contents(folder: Path) -> dict[str, bytes]:
    """Of every file in a folder by its name, sorted."""
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()}


def main(words: list[str]) -> int:
    match words:
        case ["add", archive, *files] if files:
            new = {Path(file).name: Path(file).read_bytes() for file in files}
            write(Path(archive), read(Path(archive)) | new)
        case ["unpack", archive, folder]:
            Path(folder).mkdir(parents=True, exist_ok=True)
            for name, data in read(Path(archive)).items():
                (Path(folder) / Path(name).name).write_bytes(data)
        case ["pack", folder, archive]:
            write(Path(archive), contents(Path(folder)))
        case ["-h" | "--help"]:
            print(__doc__)
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
