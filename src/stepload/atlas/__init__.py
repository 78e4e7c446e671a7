"""Which payloads can a rig measure, and what would it need to measure more?

Many runs of a rig are drawn with errors of the sizes that the rig states, pressed in the mind, and
identified with the gates and the budget of `evidence`. `plans` reads plans that nobody has written,
`rigs` a rig and its payloads from them, `points` says which cells a map has, `world` draws runs
along a `course`, `reference` and `judge` identify all runs of a cell at once, `whole` one run by
the whole pipeline, `work` does the cells, `make` a map, `answers` says it in words.
"""
