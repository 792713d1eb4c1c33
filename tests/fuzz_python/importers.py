"""Fuzzing of what Python reads, with atheris: anything but an InputError of one line is a finding.

    pip install atheris
    python tests/fuzz_python/importers.py raw --seconds 600 --found /tmp/raw   # see TARGETS
    python tests/fuzz_python/importers.py raw --keep /tmp/raw    # its smallest part, to the corpus
    python tests/fuzz_python/importers.py replay                 # the corpus, without atheris

It begins from short valid files and what earlier runs kept in tests/fuzz_python/corpus. A finding
is written to the working directory by libFuzzer; put it into the corpus, which
tests/python/test_fuzz_corpus.py replays (tests/corpus.py add ARCHIVE FILE), and fix it.
"""

from __future__ import annotations

import argparse
import hashlib
import inspect
import json
import math
import sys
import tempfile
import unicodedata
from collections.abc import Callable
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
CORPUS = HERE / "corpus"
MAGIC = b"\x89MCAP0\r\n"
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "python")]

import corpus  # noqa: E402

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
    kinds = {unicodedata.category(character) for character in said}
    assert not kinds & {"Cc", "Zl", "Zp"}, "a message of several lines, or with control characters"


def seeds(name: str) -> list[bytes]:
    """Valid files, short, and the kept corpus of a target."""
    from malformed.case import make_valid

    _, kinds = TARGETS[name]
    if name == "mcap_json":
        begin = [b'{"time_s": 0.0, "length_1_m": 1.5, "roll_rad": null}\n{"time_s": 1}']
    else:
        with tempfile.TemporaryDirectory() as folder:
            make_valid(Path(folder))
            begin = [shortened(kind, Path(folder)) for kind in kinds]
    return begin + kept(name)


def shortened(kind: str, folder: Path) -> bytes:
    """A whole file of a few samples: what is cut already never comes past its end."""
    import cdprcal
    from cdprcal.io import load_log, save_log
    from cdprcal.io.result_file import _packed
    from cdprcal.ros2 import save_bag
    from malformed.case import EXAMPLES

    if kind == "session":
        return (EXAMPLES / "canopen-simulated.yaml").read_bytes()
    if kind == "acquired mcap":
        return (folder / "acquired.mcap").read_bytes()[:20_000]
    lines = (folder / {"raw": "run.log", "csv": "run.csv"}.get(kind, "acquired.csv")).read_bytes()
    cut = lines[: lines.rindex(b"\n", 0, 4000) + 1]
    if kind in ("raw", "csv", "acquired"):
        return cut
    (folder / "short.csv").write_bytes(cut)
    log = load_log(folder / "short.csv").log
    if kind == "mcap":
        save_log(log, folder / "short.mcap")
        return (folder / "short.mcap").read_bytes()
    if kind in ("bag", "sqlite"):
        storage: Any = {"bag": "mcap", "sqlite": "sqlite3"}[kind]
        save_bag(log, folder / f"short_{kind}", cdprcal.EulerConvention.XYZ, storage=storage)
        return next(
            p for p in (folder / f"short_{kind}").iterdir() if p.suffix != ".yaml"
        ).read_bytes()
    document = json.loads((folder / f"{kind}.json").read_bytes())
    document["inputs"]["logs"] = [_packed(log)]
    return json.dumps(document, separators=(",", ":")).encode()


def kept(name: str) -> list[bytes]:
    """What earlier runs found worth keeping."""
    return list(kept_files(name).values())


def kept_files(name: str) -> dict[str, bytes]:
    """The same with their names; none for a new target."""
    return corpus.read(archive(name)) if archive(name).exists() else {}


def archive(name: str) -> Path:
    """Where the kept corpus of a target is."""
    return CORPUS / f"{name}.tar.xz"


def readers() -> list[ModuleType]:
    """The modules that read, as far as they are imported."""
    prefixes = (
        "cdprcal.io",
        "cdprcal.ros2",
        "cdprcal.hardware.session",
        "mcap.",
        "rosbags.rosbag2",
    )
    return [module for key, module in sys.modules.items() if key.startswith(prefixes)]


def fuzz(name: str, seconds: int, found: Path) -> None:
    """Ends the process: 0 when nothing was found."""
    import atheris

    target, _ = TARGETS[name]
    begin = seeds(name)
    for data in begin:
        guarded(target, data)  # imports what it needs
    for module in readers():
        classes = [c for c in vars(module).values() if inspect.isclass(c)]
        for holder in [module, *classes]:
            for function in list(vars(holder).values()):
                if inspect.isfunction(function) and function.__module__ == module.__name__:
                    atheris.instrument_func(function)
    found.mkdir(parents=True, exist_ok=True)
    for number, data in enumerate(begin):
        (found / f"seed{number}").write_bytes(data)
    atheris.Setup(
        [sys.argv[0], str(found), f"-max_total_time={seconds}", "-print_final_stats=1",
         "-max_len=65536", "-timeout=10", "-rss_limit_mb=8192"],
        lambda data: guarded(target, data),
    )  # fmt: skip
    atheris.Fuzz()


def arcs(target: Target, data: bytes) -> set[tuple[str, int, int]]:
    """The steps from line to line that an input takes in what reads it."""
    files = {str(module.__file__) for module in readers()}
    taken: set[tuple[str, int, int]] = set()

    def call(frame: FrameType, event: str, argument: object) -> Any:
        name = frame.f_code.co_filename
        if name not in files:
            return None
        last = -1

        def line(frame: FrameType, event: str, argument: object) -> Any:
            nonlocal last
            taken.add((name, last, frame.f_lineno))
            last = frame.f_lineno
            return line

        return line

    guarded(target, data)  # imports what it needs
    sys.settrace(call)
    try:
        guarded(target, data)
    finally:
        sys.settrace(None)
    return taken


def keep(name: str, found: Path) -> None:
    """Puts the smallest inputs that together go every way into the corpus."""
    target, _ = TARGETS[name]
    files = kept_files(name)
    seen: set[tuple[str, int, int]] = set()
    for data in files.values():
        seen |= arcs(target, data)
    for data in sorted(corpus.contents(found).values(), key=lambda data: (len(data), data)):
        new = arcs(target, data) - seen
        if new:
            seen |= new
            files[hashlib.sha256(data).hexdigest()[:16]] = data
    corpus.write(archive(name), files)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("target", choices=[*TARGETS, "replay"])
    parser.add_argument("--seconds", type=int, default=600)
    parser.add_argument("--found", type=Path, help="folder for what takes new ways")
    parser.add_argument("--keep", type=Path, metavar="FOUND", help="minimise it into the corpus")
    chosen = parser.parse_args()
    if chosen.target != "replay" and chosen.keep:
        keep(chosen.target, chosen.keep)
        return 0
    if chosen.target != "replay":
        fuzz(chosen.target, chosen.seconds, chosen.found or Path(tempfile.mkdtemp()))
    for name, (target, _) in TARGETS.items():
        inputs = kept(name)
        for data in inputs:
            guarded(target, data)
        print(f"{name}: {len(inputs)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
