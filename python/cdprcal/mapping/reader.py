"""How commands read logs: by a mapping file, or as the kinds that need none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cdprcal import _core
from cdprcal._core import InputError
from cdprcal.io.files import begins_with, is_foreign, is_workbook, shown_path
from cdprcal.io.loaded import LogFile
from cdprcal.io.log_file import load_run, refuse_repeated, require_cable_count
from cdprcal.mapping.apply import load_mapped
from cdprcal.mapping.proposal import PER_CABLE
from cdprcal.mapping.propose import recognised
from cdprcal.mapping.read import read_raw
from cdprcal.mapping.recognise import taken_apart
from cdprcal.terminal import as_typed

_HEAD = 1 << 16  # bytes
_LEAST_LINES = 3  # of a header and two rows


@contextmanager
def map_offered(path: str | Path, robot: _core.Robot | None) -> Iterator[None]:
    """Around reading a log without a map: who has a table of other columns is told of maps."""
    try:
        yield
    except InputError as error:
        if not (_is_foreign(Path(path)) or _is_mapped(Path(path), robot)):
            raise
        proposes = as_typed("check", shown_path(path), "--propose", "map.yaml")
        if "--map" in str(error):
            raise InputError(f"{error}; see: {proposes} writes one") from None
        raise InputError(
            f"{error}; or give a mapping file with --map: {proposes} writes one"
        ) from None


def _is_foreign(path: Path) -> bool:
    """A table whose first line that is no comment names no time_s, as logs do."""
    if is_workbook(path):
        return True
    head = begins_with(path, _HEAD, unpacked=True)
    lines = [] if is_foreign(head) else head.splitlines()
    header = next((line for line in lines if line.strip()[:1] not in (b"", b"#")), b"time_s")
    return b"time_s" not in [cell.strip() for cell in header.split(b",")]


def _is_mapped(path: Path, robot: _core.Robot | None) -> bool:
    """A table of signals; or one whose proposed map reads all that looks like one a cable."""
    if len(begins_with(path, _HEAD, unpacked=True).splitlines()) < _LEAST_LINES:
        return False  # of an endless line nothing is to be proposed
    try:
        raw = read_raw(path)
        if raw.kind == "one a row":
            return True
        proposal = recognised(raw, robot)
    except InputError:
        return False
    return not any(taken_apart(name).kind in PER_CABLE for name in proposal.unused())


@dataclass(frozen=True)
class Reader:
    """How a command reads its logs: by a mapping file, or as the kinds that need none."""

    robot: _core.Robot
    map_path: str = ""

    def load(self, path: str | Path) -> LogFile:
        """Raises InputError, also when the cables do not match the robot's."""
        if not self.map_path:
            with map_offered(path, self.robot):
                return load_run(path, self.robot)
        file = load_mapped(path, self.map_path, self.robot)
        require_cable_count(file, self.robot)
        return file

    def load_all(self, paths: Sequence[str | Path]) -> list[LogFile]:
        """Several logs of one robot. Raises InputError also when two are the same run."""
        files = [self.load(path) for path in paths]
        refuse_repeated(files)
        return files
