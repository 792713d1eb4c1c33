"""Where to measure: a plan whose every transition was followed, and the accuracy to expect."""

import cdprcal

robot = cdprcal.load_robot("irma4")
made = cdprcal.make_plan(robot, grid=[2, 2, 1])
assert made.status == cdprcal.PlanStatus.planned, made.reason
plan = made.plan
print("stops:", len(plan.poses), plan.measured_count)
print("duration_s:", f"{plan.duration_s:.2f}")
for stop in plan.poses:
    place = " ".join(f"{x:.3f}" for x in stop.pose.position_m)
    tensions = " ".join(f"{tension:.2f}" for tension in stop.tension_N)
    print("stop:", place, tensions, f"{stop.transition_s:.2f}")
print("sigma_mm:", *(f"{1e3 * s:.3f}" for s in plan.predicted_standard_deviation[:3]))

cdprcal.write_plan(plan, "plan.csv")  # what `cdprcal acquire` runs
