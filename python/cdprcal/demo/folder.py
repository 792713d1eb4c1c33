"""What a demonstration writes into its folder, and whether it may: what is somebody's own stays."""

from __future__ import annotations

from pathlib import Path

from cdprcal._core import InputError
from cdprcal.io import read_inputs
from cdprcal.io.files import shown_path
from cdprcal.io.replacing import Output, refuse_to_replace

#: In the settings of a demonstration's logs, by which the next one knows them.
MARK = {"demo": True}

PLAN, RUN, FAULTY, REPORT = "plan.csv", "run.csv", "faulty.csv", "report.html"
_LOGS = (RUN, FAULTY)
_OTHERS: dict[str, Output] = {PLAN: "plan"}
_PICTURES = "tensions path methods residuals gap ranking held_out formulas"
_PICTURE: Output = "picture"
_DRAWN: dict[str, Output] = {
    REPORT: "page",
    **{f"{name}.png": _PICTURE for name in _PICTURES.split()},
}


def refuse_what_is_no_demonstration(folder: Path, *, draws: bool) -> None:
    """Raises InputError naming a file that would be lost: one of a demonstration's names that no
    earlier demonstration wrote.

    Logs say themselves whose they are. What else is there belongs to the run beside it: where that
    is a demonstration's, a plan, page or picture may be replaced by another; where it is not, or
    where there is none, it is somebody's.
    """
    for name in _LOGS:
        if (folder / name).exists() and not _is_demonstration(folder / name):
            _refuse(folder / name)
    own = (folder / RUN).exists()
    for name, kind in (_OTHERS | (_DRAWN if draws else {})).items():
        if own:
            refuse_to_replace(folder / name, kind)
        elif (folder / name).exists():
            _refuse(folder / name)


def _is_demonstration(log: Path) -> bool:
    try:
        inputs = read_inputs(log)
    except InputError:
        return False
    return inputs is not None and inputs.settings.items() >= MARK.items()


def _refuse(path: Path) -> None:
    raise InputError(
        f"{shown_path(path)}: exists already and is of no earlier demonstration; give another "
        "folder with -o, or --force to replace it"
    )
