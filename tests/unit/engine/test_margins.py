"""Margins never say that a rule has room where it has none."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from stepload.engine.margins import margins
from stepload.record.rows import Phase


def limits(**other: Any) -> Any:
    told = {
        "stale_force_s": 0.012, "stale_arm_s": 0.012, "stale_second_s": 0.02,
        "identical_counts": 0, "second_identical_counts": 0, "second_stands_n": 5.0,
        "model_tolerance_m": 1e-4, "model_lag_s": 0.0, "search_end_m": 0.01,
        "touch_force_n": 3.0, "noise_n": 0.5, "force_limit_n": 375.0, "cross_check": "",
        "cross_tolerance_n": 0.0, "cross_relative": 0.0, "contact_n_s_per_m": 1e4,
        "stiffness_n_per_m": 3e6,
    }  # fmt: skip
    return SimpleNamespace(**{**told, **other})


def stream(**other: Any) -> Any:
    told = {"receive_s": 1.0, "same": 5, "across_n": 0.0, "smooth_across_n": 0.0, "position_m": 0.0}
    return SimpleNamespace(**{**told, **other})


def supervisor(**other: Any) -> Any:
    told = {
        "force": stream(), "arm": stream(), "second": None, "tared": True, "force_n": 100.0,
        "second_n": math.nan, "smooth_n": 100.0, "predicted_n": 110.0, "difference_n": 0.0,
        "standing_n": 0.0, "answer_n": 0.0, "travel_m": 0.0,
        "motion": SimpleNamespace(model_m=0.0, recent_m_s=0.0, speed_m_s=0.0),
    }  # fmt: skip
    return SimpleNamespace(**{**told, **other})


def test_a_rule_without_room_is_all_used() -> None:
    moving = SimpleNamespace(model_m=0.0, recent_m_s=1e-3, speed_m_s=1e-3)
    near = supervisor(smooth_n=374.0, answer_n=374.0, travel_m=1e-7, motion=moving)
    found = margins(near, limits(), 1.0, Phase.LOAD)
    assert found["CAP"] == found["R6"] == 1.0
    still = margins(supervisor(smooth_n=374.0, answer_n=374.0), limits(), 1.0, Phase.LOAD)
    assert still["CAP"] == still["R6"] == 0.0


def test_channels_that_may_not_differ_at_all() -> None:
    found = margins(supervisor(difference_n=0.1), limits(cross_check="arm"), 1.0, Phase.HOLD)
    assert found["R5"] == 1.0


def test_a_count_of_zero_means_that_nothing_is_counted() -> None:
    assert margins(supervisor(), limits(), 1.0, Phase.HOLD)["R4"] == 0.0
    assert margins(supervisor(), limits(identical_counts=10), 1.0, Phase.HOLD)["R4"] == 0.5


def test_a_second_sensor_that_feels_the_force_alone_counts() -> None:
    dead = supervisor(force_n=0.0, second=stream(across_n=300.0), second_n=0.0)
    found = margins(dead, limits(), 1.0, Phase.HOLD)
    assert found["R1"] == pytest.approx(0.8)


def test_sideways_noise_counts_by_the_limit_that_stops_for_it() -> None:
    noisy = supervisor(force=stream(smooth_across_n=6.0), force_n=0.0)
    found = margins(noisy, limits(noise_n=1.0), 1.0, Phase.GUARDED_APPROACH)
    assert found["R11"] == pytest.approx(6.0 / 8.0)
