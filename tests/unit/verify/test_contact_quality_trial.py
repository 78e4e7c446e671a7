"""The trial of how a contact is made: what it counts, and that slips and shares are seen soon."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from run_plans import limits_for, stvf_plan

from stepload_verify.trials.contact_quality import detection
from stepload_verify.trials.contact_quality.__main__ import _line
from stepload_verify.trials.coupling.__main__ import Found


def test_jumps_are_seen_within_tens_of_milliseconds_and_none_where_there_is_none() -> None:
    found = {(seen.jump_n, seen.noise_n): seen for seen in detection.slips_seen(10, 3)}
    for noise_n in (0.03, 0.1):
        large, small = found[1.9, noise_n], found[0.5, noise_n]
        assert (large.missed, small.missed) == (0, 0)
        assert max(large.latency_s) < 0.02
        assert max(small.latency_s) < 0.04
        assert np.mean(large.sizes_n) < 2.2
    assert found[0.5, 0.3].missed == 10
    assert sum(seen.false for seen in found.values()) == 0


LIMITS = detection.alone(limits_for(stvf_plan()))


@pytest.mark.parametrize("step", detection.steps_of(LIMITS), ids=lambda step: step.name)
def test_the_rules_on_the_whole_wrench_tell_soon_and_nothing_else(step: detection.Step) -> None:
    found = detection.told(LIMITS, step, 4, (0.05, 0.001), 1)
    assert (found.missed, found.false) == (0, 0)
    assert len(found.latency_s) == (0 if step.quiet else 4)
    assert all(0.0 < late_s < 0.08 for late_s in found.latency_s)


def test_what_no_rule_tells_is_counted_as_missed_and_what_another_tells_as_false() -> None:
    step = detection.steps_of(LIMITS)[1]
    off = detection.told(replace(LIMITS, lateral_share=0.0), step, 2, (0.05, 0.001), 1)
    assert (off.latency_s, off.missed, off.false) == ((), 2, 0)
    other = detection.told(LIMITS, replace(step, rule="R14"), 2, (0.05, 0.001), 1)
    assert (other.latency_s, other.missed, other.false) == ((), 0, 2)


def test_a_false_identified_is_counted_as_that() -> None:
    true = Found(0.01, 0.05, identified=True, covered=True)
    false = Found(0.2, 0.05, identified=True, covered=False)
    open_one = Found(0.2, 0.05, identified=False, covered=False)
    line = _line("after", [true, true, false, open_one, None])
    assert "true   2 false   1 marginal   2" in line
    assert "covered 2 of 4" in line
