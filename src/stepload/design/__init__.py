"""Which plan gives the narrowest interval, below F_c and within a given time?

`ceiling` says how hard this payload may be pressed on this rig, `grid` which plans are looked at,
`front` which of them are worth their time, `make` identifies simulated runs of each with the map's
room, `atlas`, and chooses; `words` and `tables` say what was found, `picture` draws it, `written`
makes the plan's file.
"""
