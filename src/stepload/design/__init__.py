"""Which payloads a rig can measure (`map`), and which plan measures one best (`plan_design`).

The result of a cell and of a plan is the interval that the budget of `identification` gives a run
without error, as preflight says it of a plan.
"""
