"""A plan that is changed in memory is the plan that its file would be read as."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepload.plan.checks import can_be
from stepload.plan.derived import rederived
from stepload.plan.load import load_plan
from stepload.plan.model import Plan

WritePlan = Callable[..., Path]
LINE = "{step: 50 N, top_force: 300 N, surface_distance: 5 mm}"


def changed(plan: Plan, **values: Any) -> Plan:
    return rederived(plan, replace(plan, procedure=replace(plan.procedure, **values)))


@pytest.mark.parametrize(
    ("before", "after", "values"),
    [
        (LINE, LINE.replace("300", "170"), {"top_force_n": 170.0}),
        (LINE, LINE.replace("300", "999"), {"top_force_n": 999.0}),
        (LINE, LINE.replace("50 N, top_force: 300", "7 N, top_force: 20"),
         {"step_n": 7.0, "top_force_n": 20.0}),
        (LINE[:-1] + ", touch_force: 7 N, retract: 2 mm, load_rate: 20 N/s, max_drift: 8 N}",
         LINE.replace("300", "200")[:-1]
         + ", touch_force: 7 N, retract: 2 mm, load_rate: 20 N/s, max_drift: 8 N}",
         {"top_force_n": 200.0}),
        (LINE, LINE[:-1] + ", surface_uncertainty: 2 mm}", {"surface_uncertainty_m": 2e-3}),
        (LINE, LINE[:-1] + ", touch_force: 6.5 N}", {"touch_force_n": 6.5}),
    ],
)  # fmt: skip
def test_what_followed_follows_anew_and_what_was_given_stays(
    write_plan: WritePlan, before: str, after: str, values: dict[str, float]
) -> None:
    old = load_plan(write_plan((LINE, before)))
    new = load_plan(write_plan((LINE, after)))
    made = changed(old, **values)
    assert made.procedure == new.procedure
    assert made.identify == new.identify
    assert made.rig == new.rig


@pytest.mark.parametrize(
    ("values", "good"),
    [
        ({}, True),
        ({"touch_force_n": 60.0}, False),
        ({"touch_force_n": 0.1}, False),
        ({"surface_uncertainty_m": 6e-3}, False),
        ({"search_distance_m": 1e-3}, False),
        ({"step_n": 400.0, "levels_n": (300.0,), "load_rate_n_per_s": 50.0}, False),
        ({"retract_m": 1e-6}, False),
    ],
)
def test_a_plan_that_no_file_could_be_cannot_be(
    write_plan: WritePlan, values: dict[str, Any], good: bool
) -> None:
    plan = load_plan(write_plan())
    assert can_be(replace(plan, procedure=replace(plan.procedure, **values))) is good
