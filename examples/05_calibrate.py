"""A simulated start-up from power-on, and the initial pose found from what its sensors read."""

import numpy as np

import cdprcal

robot = cdprcal.load_robot("irma4")
plan = cdprcal.make_plan(robot).plan

# The procedure of the real robot against a simulated plant, with the noise of real sensors.
setpoints = cdprcal.StartUpPlan([plan.start_tension_N, *(stop.tension_N for stop in plan.poses)])
run = cdprcal.simulate_startup(robot, setpoints, simulator=cdprcal.SimulatorOptions(seed=7))
assert run.state == cdprcal.StartUpState.done, run.reason
print("rests:", len(run.rests), len(run.log))

calibration = cdprcal.calibrate(robot, run.log)
result = calibration.result
assert result.status == cdprcal.CalibrationStatus.converged, result.reason
print("poses:", calibration.static_poses)
print("position_m:", *(f"{x:.4f}" for x in result.poses[0].position_m))
print("sigma_mm:", *(f"{1e3 * s:.3f}" for s in result.standard_deviation[:3]))

error_m = np.linalg.norm(result.poses[0].position_m - run.poses[0].position_m)
assert error_m < 1e-3
angle_rad = cdprcal.rotation_distance_rad(result.poses[0], run.poses[0])
print("error_mm_deg:", f"{1e3 * error_m:.2f}", f"{np.rad2deg(angle_rad):.3f}")
