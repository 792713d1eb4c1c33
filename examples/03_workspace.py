"""Everywhere the platform can hang: the static workspace, its boundary, the largest box inside."""

import cdprcal

robot = cdprcal.load_robot("irma4")
workspace = cdprcal.compute_workspace(robot, step_m=0.1)
assert workspace.points_inside, cdprcal.explain_empty(workspace)
print("points:", workspace.points_inside, workspace.points_tested)

shape = cdprcal.workspace_shape(workspace)  # the alpha shape around the points, watertight
print("volume_m3:", f"{shape.volume_m3:.4f}")

box = cdprcal.largest_inscribed_box(workspace)
assert box is not None
print("box_m:", *(f"{x:.3f}" for x in (*box.lower_m, *box.upper_m)))
