"""What restricts a calibration that converged: the caveats that go with its pose."""

from __future__ import annotations

from cdprcal import _core
from cdprcal.findings import Finding

#: What the core says of a fit that it believes; what it adds behind this restricts it.
CLAIM = "minimum found; residuals are within what the sensors' sigma allow"
#: Caveats that say of which pose the answer is, not that it is off.
ABOUT_RUN = ("gap", "short_run")


def caveats_of(calibration: _core.Calibration) -> tuple[Finding, ...]:
    """What is to be known before the pose is used; empty for one that did not converge.

    ``misfit``: an effect of the catalogue is far more probable than that the robot is as its file
    says, or poses misfit by more than its sensors may; ``reservation``: what the core adds to its
    claim.
    """
    result = calibration.result
    if result.status != _core.CalibrationStatus.converged:
        return ()
    found = []
    added = result.reason.removeprefix(CLAIM).lstrip("; ").removeprefix("yet ")
    if added:
        found.append(
            Finding(
                severity="warning",
                code="reservation",
                message=f"{added}",
                remedy="use the pose with care, or let cdprcal diagnose find what the model lacks",
            )
        )
    if result.lacks_something:
        found.append(
            Finding(
                severity="warning",
                code="misfit",
                message="the readings speak against the model: it more probably lacks something "
                "than that its sensors err so",
                remedy="the pose may be off by more than its σ: let cdprcal diagnose find what is "
                "missing, or correct the robot file",
            )
        )
    return tuple(found)
