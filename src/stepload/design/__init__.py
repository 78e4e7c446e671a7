"""Which payloads a rig can measure, which plan measures one best, and what would extend the range.

Many runs of a rig are simulated with errors of the sizes that the rig states, and identified with
the gates and the budget of `evidence`. `world` draws runs along a `course`, `reference` and `judge`
identify all runs of a cell at once, `whole` one run by the whole pipeline, `work` computes the
cells.

A map: `points` lists its cells, `atlas` computes it, `answers` summarises it in words,
`atlas_tables` and `atlas_picture` show it.

The plan with the narrowest interval, below F_c and within a given time: `ceiling` computes the
largest safe top force, `grid` the plans to try, `front` those with the best trade-off of time and
interval, `make` chooses; `words` and `tables` report the result, `picture` draws it, `written`
writes the plan's file.
"""
