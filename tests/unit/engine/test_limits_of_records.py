"""Thresholds as a record keeps them, also a record from before F_c had an uncertainty."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from run_plans import limits_for, stvf_plan

from stepload.engine.replay import FILE, _others, limits_from, limits_to_bytes
from stepload.errors import BadInputError

LIMITS = limits_for(stvf_plan())


def test_limits_come_back_as_they_were() -> None:
    counted = replace(LIMITS, counted_limit_n=500.0)
    assert limits_from({FILE: limits_to_bytes(counted)}) == counted


def test_an_old_record_counted_on_all_of_f_c() -> None:
    data = json.loads(limits_to_bytes(LIMITS))
    del data["counted_limit_n"]
    assert limits_from({FILE: json.dumps(data).encode()}) == LIMITS
    del data["elastic_limit_n"]
    with pytest.raises(BadInputError, match="damaged"):
        limits_from({FILE: json.dumps(data).encode()})


def test_a_record_from_before_zeros_were_taken_anew_is_read() -> None:
    data = json.loads(limits_to_bytes(LIMITS))
    del data["moved_zero_n"], data["shown_noise_n"]
    limits = limits_from({FILE: json.dumps(data).encode()})
    assert (limits.moved_zero_n, limits.shown_noise_n) == (LIMITS.touch_force_n, LIMITS.noise_n)


@pytest.mark.parametrize("name", ["command_delay_s", "channel_skew_s"])
def test_more_ticks_than_can_be_kept_are_refused(name: str) -> None:
    """Of a record, and of a wish: the supervisor keeps one number for each of them."""
    far = replace(LIMITS, **{name: 1e6})
    with pytest.raises(BadInputError, match=f"{name} is 1e\\+06 s, more than 100000 ticks"):
        limits_from({FILE: limits_to_bytes(far)})
    with pytest.raises(BadInputError, match=f"{name} is 1e\\+06 s, more than 100000 ticks"):
        _others(LIMITS, {name: "1e6 s"})
    assert _others(LIMITS, {name: "0.01 s"}) == {name: 0.01}
