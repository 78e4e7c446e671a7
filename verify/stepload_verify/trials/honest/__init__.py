"""Test that answers called IDENTIFIED are true, on runs of many worlds, most not of the model.

The adversary of identification: contacts, rigs and errors that are drawn without a look at what
the program assumes, with the truth kept beside every run. `worlds` draws, `course` and `contact`
press, `measure` records what a user would have, `answer` asks the program, `score` counts.
"""
