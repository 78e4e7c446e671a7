"""The periods of an emulated controller on a host that comes late."""

from __future__ import annotations

from itertools import pairwise

import pytest

from stepload_verify.emulators.ur_server import APART, CATCH_UP_PERIODS, Pace

PERIOD_S = 0.002


def begun_s(pace: Pace, until_s: float, awake_s: float = 0.0) -> list[float]:
    """When the periods begin on a host that sleeps until `awake_s`."""
    found = []
    while (now_s := max(pace.due_s, awake_s)) < until_s:
        pace.begin(now_s)
        found.append(now_s)
    return found


def test_in_time_every_period_begins_when_it_is_due():
    pace = Pace(PERIOD_S, 0.0)
    assert begun_s(pace, 0.021) == pytest.approx([PERIOD_S * n for n in range(1, 11)])
    assert (pace.late, pace.skipped) == (0, 0)


def test_after_a_short_stall_all_are_made_up_for_apart():
    pace = Pace(PERIOD_S, 0.0)
    begun = begun_s(pace, 0.0401, awake_s=0.0101)
    gaps = [b - a for a, b in pairwise(begun)]
    assert len(begun) == 20
    assert min(gaps) == pytest.approx(APART * PERIOD_S)
    assert begun[-1] == pytest.approx(0.040)
    assert pace.late > 0
    assert pace.skipped == 0


def test_after_a_long_stall_the_rest_is_skipped_and_counted():
    pace = Pace(PERIOD_S, 0.0)
    begun = begun_s(pace, 0.2401, awake_s=0.2001)
    assert pace.skipped == 100 - CATCH_UP_PERIODS - 1
    assert len(begun) + pace.skipped == 120
