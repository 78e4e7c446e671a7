"""The trial of how a contact is made: what it counts, and that slips and shares are seen soon."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
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


def test_r12_sees_a_share_and_is_quiet_below_its_limit() -> None:
    limits = replace(limits_for(stvf_plan()), allowed_n=1e9)
    rng = np.random.default_rng(1)
    late = detection.r12_latency_s(limits, 0.4, 100.0, 0.5, rng)
    assert 0.02 < late < 0.08
    assert detection.r12_latency_s(limits, 0.25, 100.0, 0.5, rng) == np.inf


def test_a_false_identified_is_counted_as_that() -> None:
    true = Found(0.01, 0.05, identified=True, covered=True)
    false = Found(0.2, 0.05, identified=True, covered=False)
    open_one = Found(0.2, 0.05, identified=False, covered=False)
    line = _line("after", [true, true, false, open_one, None])
    assert "true   2 false   1 marginal   2" in line
    assert "coverage  50%" in line
