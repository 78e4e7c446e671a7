"""A record evaluated again says what is wrong with the record itself."""

from __future__ import annotations

from dataclasses import replace

from evaluated_runs import an_envelope, evaluated

from stepload.results.record_evaluation import damage_named

PROBLEM = "the run ended before the first load step: there is nothing to identify"


def test_a_problem_of_a_damaged_record_begins_with_the_damage() -> None:
    run = replace(evaluated(an_envelope(), None), problem=PROBLEM)
    assert damage_named(run).problem == PROBLEM
    damage = "byte 7: the chunk's checksum is wrong"
    broken = replace(run, recording=replace(run.recording, damage=damage))
    assert damage_named(broken).problem == (
        f"run.mcap is damaged: {damage}; what could be read of it: {PROBLEM}"
    )
    assert damage_named(replace(broken, problem="")).problem == ""
