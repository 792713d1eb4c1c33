"""A plan as what the start-up procedure visits."""

from __future__ import annotations

from cdprcal import _core


def start_up_plan(plan: _core.Plan, *, quick: bool = False) -> _core.StartUpPlan:
    """What StartUp visits: tau_0, then the stops of a plan.

    The way to tau_0 takes what StartUp derives from the tensions it finds; the others take the
    plan's times or, if quick, what the platform's slowest mode and the speed of the winches allow.
    """
    stops = plan.poses
    times = [] if quick else [0.0, *(stop.transition_s for stop in stops)]
    return _core.StartUpPlan(
        [plan.start_tension_N, *(stop.tension_N for stop in stops)],
        times,
        [False, *(not stop.measured for stop in stops)],
        [plan.start_pose, *(stop.pose for stop in stops)],
    )
