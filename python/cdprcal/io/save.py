"""Writing a canonical log, all or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cdprcal import _core
from cdprcal.io.acquisition_inputs import AcquisitionInputs, as_comments, attach
from cdprcal.io.events import Event, add_events, as_comment
from cdprcal.io.files import atomic_output
from cdprcal.io.log_file import is_mcap_name

if TYPE_CHECKING:
    from mcap.writer import Writer


def save_log(
    log: _core.Log,
    path: str | Path,
    inputs: AcquisitionInputs | None = None,
    events: Sequence[Event] = (),
) -> None:
    """Writes MCAP when the name ends in .mcap, canonical CSV for .csv. Raises InputError.

    ``inputs`` and ``events``: of a log that was acquired, what it was acquired with and what
    happened on the way; each has its ``time_s``.
    """
    path = Path(path)
    mcap = is_mcap_name(path)
    with atomic_output(path) as temporary:
        if mcap:
            from cdprcal.io.mcap_log import write_mcap_log

            def also(writer: Writer) -> None:
                if inputs is not None:
                    attach(writer, inputs)
                if events:
                    add_events(writer, events)

            write_mcap_log(log, temporary, also)
        else:
            before = b"" if inputs is None else as_comments(inputs)
            after = b"".join(map(as_comment, events))
            temporary.write_bytes(before + _core.format_log(log).encode() + after)
