"""The table of ablations: which runs are done again, and what is said of them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stepload_verify.campaign.ablation import jobs_without, without
from stepload_verify.campaign.result import Job, Result

STOPPED = Result(
    series="one", index=0, rig_class="one axis, two channels", healthy=False, wrong=("force_nan",),
    beside=(), hazard="",
    rule="R4", message="", phase="LOAD", status="stopped", stop_s=1.0, detection_s=0.01,
    end_s=2.0, peak_n=50.0, elastic_limit_n=100.0, top_n=40.0,
)  # fmt: skip
RESULTS = [
    STOPPED,
    replace(STOPPED, index=1, rule="R3"),
    replace(STOPPED, index=2, rule="", status="completed"),
    replace(STOPPED, index=3, healthy=True, wrong=()),
    replace(STOPPED, index=4, hazard="both_channels_alike"),
    replace(STOPPED, index=5),
]


def test_a_rule_is_taken_away_where_it_spoke_and_a_layer_everywhere() -> None:
    assert jobs_without("R4", RESULTS) == [Job("one", 0), Job("one", 3), Job("one", 5)]
    assert jobs_without("R8", RESULTS) == []
    assert jobs_without("R3+R4", RESULTS) == [Job("one", index) for index in (0, 1, 3, 5)]
    assert jobs_without("CAP", RESULTS) == [Job("one", index) for index in (0, 1, 2, 3, 5)]


def test_what_a_rule_had_stopped_goes_on_or_is_stopped_by_another() -> None:
    again = [
        replace(STOPPED, rule="", status="completed", peak_n=130.0),
        replace(RESULTS[3], rule="", status="completed"),
        replace(STOPPED, index=5, rule="R7"),
    ]
    found = without("R4", RESULTS, again)
    assert (found.done_again, found.not_stopped, found.instead) == (3, 1, {"R7": 1})
    assert (found.figures.runs, found.figures.above_elastic_limit) == (5, 1)
    assert found.figures.max_peak_ratio == pytest.approx(1.3)
    assert found.figures.false_trips == 0
