"""Which payloads a rig can measure, which plan measures one best, and what would extend the range.

The result of a cell is the interval that the budget of `evidence` gives a run without error, as
preflight says it of a plan.

A map: `points` lists its cells, `atlas` computes it, `answers` summarises it in words,
`atlas_tables` and `atlas_picture` show it.

The plan with the narrowest interval, below F_c and within a given time: `ceiling` computes the
largest safe top force, `grid` the plans to try, `make` chooses; `words` and `tables` report the
result, `written` writes the plan's file.
"""
