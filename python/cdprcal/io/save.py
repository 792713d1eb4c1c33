"""Writing a canonical log, all or nothing."""

from __future__ import annotations

from pathlib import Path

from cdprcal import _core
from cdprcal.extras import need
from cdprcal.io.files import atomic_output


def save_log(log: _core.Log, path: str | Path) -> None:
    """Writes MCAP when the name ends in .mcap, else canonical CSV. Raises InputError."""
    path = Path(path)
    mcap = path.suffix.lower() == ".mcap"
    if mcap:
        need("mcap", of=str(path))
    with atomic_output(path) as temporary:
        if mcap:
            from cdprcal.io.mcap_log import write_mcap_log

            write_mcap_log(log, temporary)
        else:
            temporary.write_bytes(_core.format_log(log).encode())
