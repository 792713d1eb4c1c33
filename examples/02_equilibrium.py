"""Where the platform hangs: from a position to tensions, and from tensions back to the pose."""

import numpy as np

import cdprcal

robot = cdprcal.load_robot("irma4")

# Inverse problem (eqs A1-A3): orientation and tensions that hold the platform at a position.
held = cdprcal.inverse(robot, [0.3, -0.2, 0.8])
assert held.pose is not None, held.reason
angles = held.pose.euler_rad(robot.euler_convention)
print("angles_deg:", *(f"{angle:.4f}" for angle in np.rad2deg(angles)))
print("tensions_N:", *(f"{tension:.4f}" for tension in held.tension_N))

# Direct problem: command these tensions, and the platform settles there again, from anywhere.
settled = cdprcal.direct_from_tensions(robot, held.tension_N)
assert settled.pose is not None, settled.reason
print("position_m:", *(f"{x:.5f}" for x in settled.pose.position_m))

# How firmly: with locked winches (eq. A4), and under force control.
print(
    "stiffness_N_m:",
    f"{held.stability.locked_lengths_N_m:.2f}",
    f"{held.stability.constant_tensions_N_m:.2f}",
)
