"""Where to put the plate and how to hold the arm: a ranking of poses, never a calibration.

`chain` has the joints' geometry, `inverse` the joint angles of a pose, `compliance` the compliance
at the tip, `pose_checks` collisions and push. `search` evaluates every pose of a grid and takes the
best, `joint_calibration` scales the joints by calibrations, `gain` computes the benefit for a
payload. `rig_search` combines all; `tables`, `text` and `picture` show the result.
"""
