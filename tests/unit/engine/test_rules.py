"""The table of rules: page and thresholds; margins show no room where there is none."""

from __future__ import annotations

import math
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from stepload.engine.motion import MotionWatch
from stepload.engine.rules import RULES, margins, with_table
from stepload.feasibility.limits import RunLimits
from stepload.record.rows import Phase

PAGE = Path(__file__).parents[3] / "docs" / "safety.md"


class Told(SimpleNamespace):
    room_n, cap_n, cross_limit_n = RunLimits.room_n, RunLimits.cap_n, RunLimits.cross_limit_n


def limits(**other: Any) -> Any:
    told = {
        "stale_force_s": 0.012, "stale_arm_s": 0.012, "stale_second_s": 0.02,
        "identical_counts": 0, "second_identical_counts": 0, "second_limit_n": 400.0,
        "second_noise_n": 0.5, "model_tolerance_m": 1e-4, "model_lag_s": 0.0, "search_end_m": 0.01,
        "touch_force_n": 3.0, "noise_n": 0.5, "force_limit_n": 375.0, "cross_check": "",
        "cross_tolerance_n": 0.0, "cross_relative": 0.0, "contact_n_s_per_m": 1e4,
        "stiffness_n_per_m": 3e6, "lateral_share": 0.3, "eccentricity_m": 0.01,
        "overload_named": True,
    }  # fmt: skip
    return Told(**{**told, **other})


def stream(**other: Any) -> Any:
    told = {"receive_s": 1.0, "same": 5, "across_n": 0.0, "smooth_across_n": 0.0, "position_m": 0.0}
    return SimpleNamespace(**{**told, **other})


def motion(**other: Any) -> Any:
    told = {
        "model_m": 0.0, "recent_m_s": 0.0, "speed_m_s": 0.0,
        "still_share": lambda _: 0.0, "waited_share": lambda _: math.nan,
    }  # fmt: skip
    return SimpleNamespace(**{**told, **other})


def supervisor(**other: Any) -> Any:
    told = {
        "force": stream(), "arm": stream(), "second": None, "tared": True, "force_n": 100.0,
        "second_n": math.nan, "smooth_n": 100.0, "predicted_n": 110.0, "difference_n": 0.0,
        "second_predicted_n": 0.0, "travel_m": 0.0,
        "answers": SimpleNamespace(limit_m=lambda: 1e-4),
        "motion": motion(),
        "wrench": SimpleNamespace(share=0.0, off_m=0.0), "arm_across_n": 0.0,
        "arm_wrench": SimpleNamespace(share=0.0),
        "overload": SimpleNamespace(used=0.0), "second_overload": SimpleNamespace(used=0.0),
    }  # fmt: skip
    return SimpleNamespace(**{**told, **other})


def test_the_page_holds_the_table() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert "| CAP | target |" in text
    assert with_table(text) == text, "python -m stepload.engine.rules"


def test_every_rule_has_its_thresholds_and_every_threshold_its_rule() -> None:
    assert all(rule.thresholds for rule in RULES.values())
    named = {
        code for each in fields(RunLimits) for code in each.metadata.get("rule", "").split(", ")
    }
    assert named - {""} == set(RULES)


def test_a_rule_without_room_is_all_used() -> None:
    moving = motion(recent_m_s=1e-3, speed_m_s=1e-3)
    spent = SimpleNamespace(limit_m=lambda: -1.0)
    near = supervisor(smooth_n=374.0, answers=spent, travel_m=1e-7, motion=moving)
    found = margins(near, limits(), 1.0, Phase.LOAD)
    assert found["CAP"] == found["R6"] == 1.0
    still = margins(supervisor(smooth_n=374.0, answers=spent), limits(), 1.0, Phase.LOAD)
    assert still["CAP"] == still["R6"] == 0.0


def test_what_the_arm_feels_across_counts() -> None:
    pushed = supervisor(
        force_n=300.0, predicted_n=300.0, arm_across_n=225.0,
        arm_wrench=SimpleNamespace(share=0.15),
    )  # fmt: skip
    found = margins(pushed, limits(), 1.0, Phase.HOLD)
    assert (found["R1"], found["R2"], found["R12"]) == (1.0, 1.0, 0.5)


def test_a_count_of_zero_means_that_nothing_is_counted() -> None:
    assert margins(supervisor(), limits(), 1.0, Phase.HOLD)["R4"] == 0.0
    assert margins(supervisor(), limits(identical_counts=10), 1.0, Phase.HOLD)["R4"] == 0.5


def test_travel_counts_by_the_limit_from_which_r6_waits() -> None:
    halfway = supervisor(travel_m=5e-5)
    assert margins(halfway, limits(), 1.0, Phase.LOAD)["R6"] == pytest.approx(0.5)


def test_the_second_channel_counts_by_its_own_limit() -> None:
    told = {"cross_check": "arm", "cross_tolerance_n": 11.0}
    near = supervisor(second_n=380.0, second_predicted_n=390.0)
    found = margins(near, limits(**told), 1.0, Phase.HOLD)
    assert (found["R1"], found["R2"]) == (380.0 / 400.0, 390.0 / 400.0)


def watched(**other: Any) -> MotionWatch:
    """A watch whose arm has been told to go 50 µm, within what its model tolerates."""
    told = {
        "period_s": 0.002, "arm_lag_s": 0.0, "command_delay_s": 0.002,
        "position_resolution_m": 1e-7, "guarded_speed_m_s": 1e-3, "still_m": 6e-5,
        "model_tolerance_m": 1e-3, "model_lag_s": 0.0, "search_end_m": 0.01,
    }  # fmt: skip
    watch = MotionWatch(limits(**told), lambda *trip: trip)
    for tick in range(40):
        position_m = 0.0 if other["frozen"] else tick * 2e-6
        watch.judge(tick * 0.002, min(tick * 2e-6, 5e-5), min(position_m, 5e-5), other["phase"])
    return watch


def test_a_frozen_position_has_no_room_though_its_model_is_near() -> None:
    told = {"model_tolerance_m": 1e-3}
    still = supervisor(motion=watched(frozen=True, phase=Phase.LOAD))
    assert margins(still, limits(**told), 1.0, Phase.LOAD)["R7"] == pytest.approx(5.0 / 6.0)
    still.arm.position_m, still.motion = 5e-5, watched(frozen=False, phase=Phase.LOAD)
    assert margins(still, limits(**told), 1.0, Phase.LOAD)["R7"] == 0.0


def test_an_approach_without_progress_uses_up_its_time() -> None:
    watch = watched(frozen=True, phase=Phase.GUARDED_APPROACH)
    assert watch.waited_share(0.002 + 0.75) == pytest.approx(0.5)
    assert math.isnan(watched(frozen=True, phase=Phase.LOAD).waited_share(1.0))
