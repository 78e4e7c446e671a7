"""Where to put the plate and how to hold the arm: a ranking of poses, never a calibration.

`chain` has the joints' geometry, `inverse` the joint angles of a pose, `compliance` the compliance
at the tip, `clear` the collision check, `load` the push that the joints can exert. `search`
evaluates every pose of a grid and takes the best, `doubt` estimates the effect of wrong joint
stiffness, `measured` uses calibrations instead, `gain` computes the benefit for a payload. `make`
combines all; `tables`, `words` and `picture` show the result.
"""
