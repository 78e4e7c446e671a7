"""Ordinary plans run: preflight agrees with an expert who judged them before it did."""

from __future__ import annotations

import pytest
from lab_plans import plan_of, rows

from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.reason import Severity

AGREE = 37
"""Of the forty."""
WORDS = {"go": "press", "warn": "care", "refused": "pointless"}
LIMITS = {"top_force_above_safe_limit", "unidentifiable"}
"""The codes of refusals for F_c and for (34)."""


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, Preflight]]:
    folder = tmp_path_factory.mktemp("plans")
    return [(word, preflight_of(plan_of(text, name, folder))) for name, word, _, text in rows()]


def test_preflight_agrees_with_the_expert_and_refuses_for_two_reasons_only(
    judged: list[tuple[str, Preflight]],
) -> None:
    assert len(judged) == 40
    assert sum(WORDS[preflight.verdict] == word for word, preflight in judged) >= AGREE
    refusals = {
        reason.code
        for _, preflight in judged
        for reason in preflight.reasons
        if reason.severity is Severity.REFUSE
    }
    assert refusals == LIMITS


def test_a_doubt_that_the_interval_holds_warns_only_where_it_is_too_wide(
    judged: list[tuple[str, Preflight]],
) -> None:
    told = {
        preflight.plan.name: {reason.code: reason.severity for reason in preflight.reasons}
        for _, preflight in judged
    }
    assert told["gelatine-ur5e"]["stiffness_indicative"] is Severity.NOTE
    assert told["tomato-ur5e"]["stiffness_indicative"] is Severity.WARN
    assert told["apple-ur10e"]["close_to_k_max"] is Severity.WARN
