"""Positions, boxes, grids and lists of numbers as options of a command."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import typer

from cdprcal.completion import one_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cdprcal._core import Box, Robot, TensionDistribution

DistributionOption = Annotated[
    str,
    one_of(
        "barycentre|minimum_norm|mid_range|given_lambda",
        "--distribution",
        help="Which of the tensions that carry the weight are meant.",
    ),
]
LambdaOption = Annotated[
    str,
    typer.Option(
        "--lambda",
        metavar="N,…",
        help="The n-3 free tensions [N] for given_lambda (n-6 from six cables on).",
    ),
]
OrientationOption = Annotated[
    str,
    typer.Option(
        "--orientation",
        metavar="ROLL,PITCH,YAW",
        help="In which to hold the platform [deg], by the robot's Euler angles; for six cables and "
        "more (default: the robot file's own, or the turn about the vertical that reaches more).",
    ),
]
ThreadsOption = Annotated[
    int, typer.Option("--threads", min=0, help="Threads to use; 0 is one a core.")
]


def split_numbers(text: str) -> Iterator[tuple[str, float]]:
    """'1,x' → ('1', 1.0), ('x', nan): each part, and NaN where it is no finite number."""
    for part in text.split(",") if text else []:
        try:
            value = float(part)
        except ValueError:
            value = math.nan
        yield part, value if math.isfinite(value) else math.nan


def parse_numbers(option: str, text: str, count: int | None = None) -> list[float]:
    """'1,2.5' → [1.0, 2.5]; '' → []. Raises InputError naming the option."""
    from cdprcal._core import InputError

    numbers = []
    for part, value in split_numbers(text):
        if math.isnan(value):
            raise InputError(f"{option}: {part.strip()!r} in {text!r} must be a number")
        numbers.append(value)
    if count is not None and len(numbers) != count:
        raise InputError(f"{option}: {text!r} has {len(numbers)} numbers; give {count}")
    return numbers


def parse_lambda(distribution: TensionDistribution, text: str) -> list[float]:
    """'50' → [50.0]; '' → []. Raises InputError also where the distribution takes none."""
    from cdprcal._core import InputError, TensionDistribution

    if text and distribution != TensionDistribution.given_lambda:
        raise InputError(
            f"--lambda: {distribution.name} chooses the tensions itself; leave it out, or add "
            "--distribution given_lambda"
        )
    return parse_numbers("--lambda", text)


def parse_position(option: str, text: str) -> list[float]:
    """'0,0,0.9' → [0.0, 0.0, 0.9]. Raises InputError naming the option."""
    return parse_numbers(option, text, 3)


def parse_orientation(robot: Robot, text: str) -> NDArray[np.float64] | None:
    """'0,0,-40' degrees → rotation matrix by the robot's convention; '' → None.

    Raises InputError.
    """
    from cdprcal._core import InputError, holds_orientation, rotation_from_euler

    if not text:
        return None
    angles = parse_numbers("--orientation", text, 3)
    if not holds_orientation(robot):
        raise InputError(
            f"--orientation: the {robot.cable_count} cables of {robot.name} do not hold one, "
            "statics choose it; leave it out"
        )
    return rotation_from_euler([math.radians(angle) for angle in angles], robot.euler_convention)


def parse_box(option: str, text: str) -> Box | None:
    """'-0.4,-0.4,0.6:0.4,0.4,1.2' → Box; '' → None. Raises InputError naming the option."""
    from cdprcal._core import Box, InputError

    if not text:
        return None
    corners = text.split(":")
    if len(corners) != 2:
        raise InputError(
            f"{option}: {text!r} is not two corners (write {option} -0.4,-0.4,0.6:0.4,0.4,1.2)"
        )
    lower, upper = (parse_position(option, corner) for corner in corners)
    return Box(
        [min(a, b) for a, b in zip(lower, upper, strict=True)],
        [max(a, b) for a, b in zip(lower, upper, strict=True)],
    )


#: Positions along each side of a box, where nothing is said.
DEFAULT_GRID = "2x2x2"


def parse_grid(text: str) -> tuple[int, int, int]:
    """'2x2x3' → (2, 2, 3). Raises InputError."""
    from cdprcal._core import InputError

    match = re.fullmatch(r"([1-9]\d?)x([1-9]\d?)x([1-9]\d?)", text.strip().lower())
    if not match:
        raise InputError(f"--grid: {text!r} must be of the form 2x2x3, 1 to 99 in each direction")
    return int(match[1]), int(match[2]), int(match[3])


def parse_sensors(text: str) -> set[str]:
    """'lengths,swivels' → the groups of a Log. Raises InputError."""
    from cdprcal._core import InputError
    from cdprcal.sensors import OPTIONS

    names = [name.strip() for name in text.split(",")]
    for name in names:
        if name not in OPTIONS:
            raise InputError(f"--sensors: {name!r} is not one of {', '.join(OPTIONS)}")
    return {OPTIONS[name] for name in names}
