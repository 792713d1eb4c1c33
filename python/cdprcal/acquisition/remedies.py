"""Why a start-up was stopped, and what to do before the next one."""

from __future__ import annotations

import re

#: Words of a reason, and what to do; the first that fits is meant. docs/errors.md shows them all.
REMEDIES: tuple[tuple[str, str], ...] = (
    ("stopped by the operator", "acquire again when the robot may move"),
    (
        "leaves the plan's corridor",
        "check the load cells' zeros, the signs and scales of the encoders, the AHRS's mounting "
        "and what hangs at the cables; where there is room, acquire with a wider --corridor-m",
    ),
    ("too close to the floor", "plan higher, or check --floor-m and the load cells' zeros"),
    (
        "in the platform's way",
        "check keep_out and length_limits_m of the robot file, and the load cells' zeros; then "
        "plan again",
    ),
    ("the log cannot be written", "free some space, or give another folder with -o"),
    (
        "TPDO",
        "check the drive's PDO mapping (0x1A00 to 0x1A03): another program or its own set-up has "
        "changed it; restart the drive, then acquire again",
    ),
    ("look it up in its manual", "clear the drive's error as its manual says, then acquire again"),
    (
        "clock of the samples does not run forward",
        "look for a busy or adjusted clock; acquire again",
    ),
    ("over-tension", "lower the plan's tensions or its speed, and look for a caught cable"),
    (
        "slack at power-on",
        "tighten that cable, or let the platform hang freely, and check its load cell: plug, zero "
        "and sign; then acquire again",
    ),
    ("slack", "raise the least tension: plan again with a higher --margin-n"),
    ("does not follow its set-point", "check the load cell's sign and scale, and the winch's gain"),
    (
        "does not come to rest in time",
        "look for a draught or a loose cable; else plan again: with a lower --damping it waits "
        "longer, with a higher --margin-n it keeps off poses where the platform swings slowly",
    ),
    ("beyond the limits", "check the load cell's zero, scale and sign, then the session's limits"),
    ("beyond the limit", "check counts_per_m and the session's limits.velocity_m_s"),
    (
        "torque would hold",
        "weigh what hangs there: load cell against a known weight, then the drum and the gear",
    ),
    ("load cell", "check the load cell, its plug and its amplifier"),
    ("swivel encoder", "check the swivel encoder and its plug"),
    ("encoder", "check the winch: brake, coupling, encoder and its plug"),
    (
        "mm were commanded",
        "look for a loose brake or coupling; check counts_per_m, velocity_units_per_m_s and the "
        "drive's own scaling and mode",
    ),
    ("AHRS", "check the AHRS: power, cable, ahrs.port and its output rate"),
    ("readings are stale", "check the bus: wiring, termination, load; or lower the rate"),
    ("heartbeat is lost", "check the drive's power and the bus"),
    ("does not answer", "check the drive's power and the bus"),
    ("left operation enabled", "see what the drive says, clear it, and acquire again"),
    ("mode of operation", "set the drive to the mode that the session names"),
    ("drive error", "clear the drive's error as its manual says, then acquire again"),
)


def remedy_for(reason: str) -> str:
    """What to do about a reason to stop; empty if none is known."""
    for words, remedy in REMEDIES:
        if re.search(rf"\b{re.escape(words)}\b", reason):
            return remedy
    return ""


__all__ = ["REMEDIES", "remedy_for"]
