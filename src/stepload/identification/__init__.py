"""From force and travel of a run to a law and stiffnesses with intervals and a verdict.

The fits are those of the paper and others; the verdict rests on the budget of every error.
"""
