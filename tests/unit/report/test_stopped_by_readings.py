"""A stop that says that readings were wrong leaves no figure of the run identified."""

from __future__ import annotations

from dataclasses import replace

import pytest
from evaluated_runs import a_preflight, evaluated, pressed
from recorded_runs import recorded

from stepload.record.reader import Event
from stepload.report.analyse import identify_payload
from stepload.report.press_data import press_data
from stepload.report.reasons import reasons_of
from stepload_verify.trials.honest.measure import record
from stepload_verify.trials.honest.worlds import KNOWN, make

SAID = "the second channel reads 92.99 N, the force sensor 78.03 N"


def doubts_after(rule: str, message: str = SAID) -> tuple[str, ...]:
    run = recorded()
    trip = Event(13.0, "trip", {"rule": rule, "message": message})
    return press_data(replace(run, events=(*run.events, trip))).doubts


@pytest.mark.parametrize("rule", ["R4", "R5", "R9"])
def test_a_stop_that_says_that_a_reading_was_wrong_is_a_doubt_about_the_run(rule: str) -> None:
    (doubt,) = doubts_after(rule)
    assert doubt.startswith(f"the run was stopped by {rule} (")
    assert SAID in doubt


@pytest.mark.parametrize("rule", ["R1", "R7", "R10", "device", "until"])
def test_another_stop_is_none(rule: str) -> None:
    assert doubts_after(rule) == ()
    assert press_data(recorded()).doubts == ()


def test_what_a_record_says_cannot_steer_a_terminal() -> None:
    assert "\x1b" not in doubts_after("R5", "\x1b[2J")[0]


def test_every_figure_of_such_a_run_is_marginal_at_best_and_says_why() -> None:
    data, conditions = record(make(KNOWN, "sphere", 1))
    before = identify_payload(data, conditions)
    doubts = doubts_after("R5")
    found = identify_payload(replace(data, doubts=doubts), conditions)
    assert before.judgement is not None
    assert found.judgement is not None
    assert before.verdict == "identified"
    assert found.verdict == "marginal"
    assert doubts[0] in found.reasons
    for each in (*found.judgement.quantities.values(), found.judgement.exponent):
        assert each is not None
        assert each.verdict != "identified"
        assert doubts[0] in each.why


def test_the_reasons_of_results_and_report_begin_with_it() -> None:
    data, events = pressed(6)
    doubts = doubts_after("R5")
    run = evaluated(a_preflight(), (replace(data, doubts=doubts), events))
    assert reasons_of(run)[0] == doubts[0]
