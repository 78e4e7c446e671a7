"""Is what is called IDENTIFIED true where the whole engine has pressed it?

Every run is a plan of its own, pressed by the simulated rig as a dry run is, recorded, and read
back from its record. `plans` draws the plan, `worlds` what the rig really is, `press` runs and
judges; mix, score and table are those of `honest`.
"""
