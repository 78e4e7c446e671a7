"""Where to put the plate and how to hold the arm: a ranking of poses, never a calibration.

`chain` has the joints' geometry, `inverse` the joint angles of a pose, `compliance` how an arm
gives way at its tip, `clear` what stands in its way, `load` what its joints can push. `search`
looks at every pose of a grid and takes the best, `doubt` says what assumed joint stiffness leaves
of that, `measured` puts calibrations in its place, `gain` what it means for a payload. `make` is
the whole; `tables`, `words` and `picture` show it.
"""
