"""Fuzzing of what Python reads, with atheris: anything but an InputError of one line is a finding.

    pip install atheris
    python tests/fuzz_python/importers.py raw --seconds 600      # one target; see TARGETS
    python tests/fuzz_python/importers.py replay                 # the kept corpus, without atheris

It begins from the valid files of the malformed-input corpus and what earlier runs kept in
tests/fuzz_python/corpus/TARGET. A finding is written to the working directory by libFuzzer; put it
into the corpus, which tests/python/test_fuzz_corpus.py replays, and fix it.
"""

from __future__ import annotations

import argparse
import inspect
import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

HERE = Path(__file__).resolve().parent
CORPUS = HERE / "corpus"
MAGIC = b"\x89MCAP0\r\n"
sys.path.insert(0, str(HERE.parent / "python"))

Target = Callable[[bytes], None]


def log_of(data: bytes, name: str) -> None:
    """Any log: whatever is read has finite times that increase, and is written and read again."""
    import cdprcal
    from cdprcal.io.log_file import parse_log_bytes

    file = parse_log_bytes(data, Path(name))
    times = file.log.time_s.tolist()
    assert times
    assert all(map(math.isfinite, times))
    text = cdprcal.format_log(file.log)
    assert cdprcal.format_log(cdprcal.parse_log(text, "again")) == text
    if file.line is not None:
        assert len(file.line) == len(times)
    for finding in file.findings:
        assert finding.message
        assert finding.remedy


def raw(data: bytes) -> None:
    """A robot's own log."""
    log_of(data if data[:2] == b"3," else b"3,1.0," + data, "fuzz.log")


def csv(data: bytes) -> None:
    """A canonical log, also as check reads a damaged one."""
    from cdprcal.io.damaged_csv import _repair

    _repair(data)
    log_of(data, "fuzz.csv")


def acquired(data: bytes) -> None:
    """A log that acquire wrote, its inputs and its events."""
    from cdprcal.io import read_inputs
    from cdprcal.io.events import read_events

    with tempfile.NamedTemporaryFile(suffix=".csv") as stream:
        stream.write(b"# cdprcal acquisition\n" + data)
        stream.flush()
        times = [event["time_s"] for event in read_events(stream.name)]
        assert times == sorted(times)
        read_inputs(stream.name)
    log_of(b"# cdprcal acquisition\n" + data, "fuzz.csv")


def mcap(data: bytes) -> None:
    """MCAP with JSON inside."""
    log_of(MAGIC + data.removeprefix(MAGIC), "fuzz.mcap")


def mcap_json(data: bytes) -> None:
    """A whole MCAP file whose messages are the lines of the input: past the container."""
    import io

    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream, use_chunking=False)
    writer.start(profile="", library="fuzz")
    channel = writer.register_channel("/s", "json", writer.register_schema("s", "jsonschema", b""))
    for number, line in enumerate(data.split(b"\n")[:50]):
        writer.add_message(channel, number, line, number, number)
    writer.finish()  # type: ignore[no-untyped-call]
    log_of(stream.getvalue(), "fuzz.mcap")


def bag(data: bytes) -> None:
    """One file of a ROS 2 bag."""
    import cdprcal
    from cdprcal.ros2 import load_bag

    suffix = ".db3" if data.startswith(b"SQLite") else ".mcap"
    with tempfile.NamedTemporaryFile(suffix=suffix) as stream:
        stream.write(data)
        stream.flush()
        load_bag(stream.name, None, cdprcal.EulerConvention.XYZ)


def session(data: bytes) -> None:
    """A session file."""
    from cdprcal.hardware.session import parse_session

    parse_session(data.decode("utf-8", "replace")[:4000], "fuzz.yaml")


def result(data: bytes) -> None:
    """A result file: its JSON, and its fields."""
    from cdprcal.io.result_file import calibrate_options, load_result

    with tempfile.NamedTemporaryFile(suffix=".json") as stream:
        stream.write(data)
        stream.flush()
        read = load_result(stream.name)
        if read.command == "calibrate":
            calibrate_options(read.options)


TARGETS: dict[str, tuple[Target, tuple[str, ...]]] = {
    "raw": (raw, ("raw",)),
    "csv": (csv, ("csv",)),
    "acquired": (acquired, ("acquired",)),
    "mcap": (mcap, ("mcap", "acquired mcap")),
    "mcap_json": (mcap_json, ()),
    "bag": (bag, ("bag", "sqlite")),
    "session": (session, ("session",)),
    "result": (result, ("result", "diagnosis")),
}


def guarded(target: Target, data: bytes) -> None:
    """Runs a target; an InputError must be one line of text, anything else passes through."""
    from cdprcal import InputError

    said = "something"
    try:
        target(data)
    except InputError as error:
        said = str(error)
    assert said, "a message without words"
    assert "\n" not in said, "a message of several lines"


def seeds(name: str) -> list[bytes]:
    """Valid files, short, and the kept corpus of a target."""
    from malformed.case import make_valid

    _, kinds = TARGETS[name]
    with tempfile.TemporaryDirectory() as folder:
        files = make_valid(Path(folder)).files
    found = [files[kind][:20_000] for kind in kinds]
    if name == "raw":
        found = [data[:4000] for data in found]
    if name == "mcap_json":
        found = [b'{"time_s": 0.0, "length_1_m": 1.5, "roll_rad": null}\n{"time_s": 1}']
    return found + kept(name)


def kept(name: str) -> list[bytes]:
    """What earlier runs found worth keeping."""
    return [path.read_bytes() for path in sorted((CORPUS / name).glob("*")) if path.is_file()]


def fuzz(name: str, seconds: int) -> None:
    """Ends the process: 0 when nothing was found."""
    import atheris

    target, _ = TARGETS[name]
    begin = seeds(name)
    for data in begin:
        guarded(target, data)  # imports what it needs
    readers = ("cdprcal.io", "cdprcal.ros2", "cdprcal.hardware.session", "mcap.", "rosbags.rosbag2")
    for module in [m for key, m in sys.modules.items() if key.startswith(readers)]:
        for key, function in list(vars(module).items()):
            if inspect.isfunction(function) and function.__module__ == module.__name__:
                setattr(module, key, atheris.instrument_func(function))
    with tempfile.TemporaryDirectory() as corpus:
        for number, data in enumerate(begin):
            (Path(corpus) / str(number)).write_bytes(data)
        atheris.Setup(
            [sys.argv[0], corpus, f"-max_total_time={seconds}", "-print_final_stats=1",
             "-max_len=20000", "-timeout=10", "-rss_limit_mb=2048"],
            lambda data: guarded(target, data),
        )  # fmt: skip
        atheris.Fuzz()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("target", choices=[*TARGETS, "replay"])
    parser.add_argument("--seconds", type=int, default=600)
    chosen = parser.parse_args()
    if chosen.target != "replay":
        fuzz(chosen.target, chosen.seconds)
    for name, (target, _) in TARGETS.items():
        for data in kept(name):
            guarded(target, data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
