"""Which payloads can a rig measure, which plan measures one best, and what would one need for more?

Many runs of a rig are drawn with errors of the sizes that the rig states, pressed in the mind, and
identified with the gates and the budget of `evidence`. `world` draws runs along a `course`,
`reference` and `judge` identify all runs of a cell at once, `whole` one run by the whole pipeline,
`work` does the cells.

A map: `points` says which cells it has, `atlas` makes it, `answers` says it in words,
`atlas_tables` and `atlas_picture` show it.

The plan with the narrowest interval, below F_c and within a given time: `ceiling` says how hard the
payload may be pressed on the rig, `grid` which plans are looked at, `front` which of them are worth
their time, `make` chooses; `words` and `tables` say what was found, `picture` draws it, `written`
makes the plan's file.
"""
