"""A robot, a pose, and what its sensors read there (paper eqs 1-6)."""

import cdprcal

robot = cdprcal.load_robot("irma4")  # built in; else the path of a robot file
pose = cdprcal.Pose.from_euler([0.4, 0.4, 1.2], [0.084023, -0.090510, 0.004690])  # Table II, row 1

state = cdprcal.platform_state(robot, pose)
assert state.valid, cdprcal.describe_invalid(state)
print("lengths_m:", *(f"{length:.6f}" for length in state.length_m))
print("swivels_rad:", *(f"{angle:.6f}" for angle in state.swivel_rad))

# Tensions that carry the weight here, by all six equations of the balance.
tensions = cdprcal.tensions_least_squares(robot, state)
print("tensions_N:", *(f"{tension:.4f}" for tension in tensions.tension_N))
