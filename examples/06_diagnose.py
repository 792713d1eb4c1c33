"""A fault that nobody knows of: named, measured, and put into the robot file."""

import numpy as np

import cdprcal

robot = cdprcal.load_robot("irma4")
plan = cdprcal.make_plan(robot).plan
setpoints = cdprcal.StartUpPlan([plan.start_tension_N, *(stop.tension_N for stop in plan.poses)])

# The platform's centre of mass is 12, -8 and 4 mm off, and the model does not know it.
hidden = cdprcal.parse_injected_effect("centre_of_mass=0.012,-0.008,0.004")
simulator = cdprcal.SimulatorOptions(seed=2, effects=[hidden])
run = cdprcal.simulate_startup(robot, setpoints, simulator=simulator)
assert run.state == cdprcal.StartUpState.done, run.reason

diagnosis = cdprcal.diagnose(robot, [run.log])
print("verdict:", diagnosis.verdict.value)
for effect in diagnosis.effects:
    print("found:", effect.info.name)
    print("values_mm:", *(f"{1e3 * value:.2f}" for value in effect.values))
    print("sigma_mm:", *(f"{1e3 * sigma:.3f}" for sigma in effect.standard_deviation))

# What it does to the initial pose.
truth = run.poses[0]
for when in ("before", "after"):
    pose = getattr(diagnosis, f"initial_pose_{when}")
    print(f"{when}_mm:", f"{1e3 * np.linalg.norm(pose.position_m - truth.position_m):.2f}")

# The robot file with it: every command honours it from now on.
corrected = cdprcal.to_yaml(diagnosis.corrected)
print("effects_in_file:", len(cdprcal.parse_robot(corrected, "corrected").effects))
