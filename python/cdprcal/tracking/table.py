"""A track for people."""

from __future__ import annotations

from typing import Any

from rich.text import Text

from cdprcal.tables import pose_line
from cdprcal.terminal import Table, answers, counted, degrees, fixed, say, scaled, summed_up

#: What lasts longer is no spike: as long as the filter takes to doubt the pose instead.
_MOMENT_S = 0.1


def print_track(document: dict[str, Any], *, verbose: bool = False) -> None:
    """Where the platform is at the end, how well that is known, and where it was not."""
    out = answers()
    last = document["last"]
    good = last["trusted"]
    here = f"at {last['time_s']:.3f} s: {pose_line(_as_initial(last))}"
    say(out, Text(here if good else f"{here}; not to be trusted", style="bold" if good else "red"))
    share = document["trusted_samples"] / document["samples"]
    say(
        out,
        f"{counted(document['samples'], 'sample')} from {document['begin_s']:.3f} to "
        f"{document['end_s']:.3f} s, {100 * share:.4g} % of them to be trusted",
    )
    for line in summed_up(map(_stretch, document["untrusted"]), verbose=verbose):
        say(out, line)
    if document["left_out_readings"]:
        say(out, _left_out(document))
    out.print(_table(document))
    per_sample_us = 1e6 * document["solve_time_s"] / document["samples"]
    say(
        out,
        f"fastest: {fixed(document['largest_speed_m_s'], 3)} m/s, "
        f"{fixed(degrees(document['largest_angular_speed_rad_s']), 2)} deg/s; "
        f"{per_sample_us:.1f} microseconds a sample",
    )


def _left_out(document: dict[str, Any]) -> str:
    longest_s = document["longest_left_out_s"]
    why = (
        "spikes"
        if longest_s <= _MOMENT_S
        else f"they contradict the others, for up to {longest_s:.1f} s on end"
    )
    return f"{counted(document['left_out_readings'], 'reading')} left out: {why}"


def _as_initial(sample: dict[str, Any]) -> dict[str, Any]:
    """As ``pose_line`` has a calibration."""
    return {
        "initial_pose": sample["pose"],
        "covariance": sample["covariance"],
    }


def _stretch(stretch: dict[str, Any]) -> str:
    return (
        f"not to be trusted from {stretch['begin_s']:.3f} to {stretch['end_s']:.3f} s: "
        f"{stretch['reason']}"
    )


def _table(document: dict[str, Any]) -> Table:
    last, worst = document["last"], document["largest_standard_deviation"]
    table = Table("", "at the end", "± σ", "largest σ", "rate", "± σ", text=(0,))
    position = last["pose"]["position_m"]
    turns = last["pose"]["euler_rad"]
    for i, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
        shift = i < 3
        value = f"{fixed(position[i], 4)} m" if shift else f"{fixed(degrees(turns[i - 3]), 3)}°"
        to_unit = (lambda v: scaled(v, 1e3)) if shift else degrees
        unit, rate = (" mm", " mm/s") if shift else ("°", "°/s")
        table.add_row(
            name,
            value,
            fixed(to_unit(last["standard_deviation"][i]), 2 if shift else 3) + unit,
            fixed(to_unit(worst[i]), 2 if shift else 3) + unit,
            fixed(to_unit(last["twist"][i]), 2) + rate,
            fixed(to_unit(last["twist_standard_deviation"][i]), 2) + rate,
        )
    return table
