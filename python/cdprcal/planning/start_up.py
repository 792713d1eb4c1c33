"""A plan as what the start-up procedure visits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdprcal import _core


def stops_of(plan: _core.Plan) -> tuple[list[NDArray[np.float64]], list[_core.Pose]]:
    """What a plan goes through: tension set-points [N] and poses, its start first."""
    return (
        [plan.start_tension_N, *(stop.tension_N for stop in plan.poses)],
        [plan.start_pose, *(stop.pose for stop in plan.poses)],
    )


def start_up_plan(plan: _core.Plan, *, quick: bool = False) -> _core.StartUpPlan:
    """What StartUp visits: tau_0, then the stops of a plan.

    The way to tau_0 takes what StartUp derives from the tensions it finds; the others take the
    plan's times or, if quick, what the platform's slowest mode and the speed of the winches allow.
    """
    stops = plan.poses
    times = [] if quick else [0.0, *(stop.transition_s for stop in stops)]
    tensions_N, poses = stops_of(plan)
    via = [False, *(not stop.measured for stop in stops)]
    return _core.StartUpPlan(tensions_N, times, via, poses)
