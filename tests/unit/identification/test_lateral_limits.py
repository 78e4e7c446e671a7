"""The lateral force: which rule holds for a run, what it leaves and what it blocks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pressed_runs import World, press

from stepload.identification.conditions import Conditions, Sources
from stepload.identification.lateral import (
    GUIDED_COMPLIANCE,
    UNKNOWN_FRICTION,
    LateralForce,
    expected_lateral_force,
    lateral_force,
)
from stepload.identification.lateral_coupling import CROSS_COMPLIANCE, Across
from stepload.identification.quantity import ResultVerdict
from stepload.identification.verdict import judge

K_S = 1e5
KNOWN = Across((2e-6, 0.0), (1e-7, 1e-7), 0.0, (0.1, 0.0), reach=0.1)


def found(across: Across, share: tuple[float, float] | None, **more: Any) -> LateralForce:
    options: dict[str, Any] = {"arm": True} | more
    vector = None if share is None else np.array(share)
    size = None if share is None else float(np.hypot(*share))
    away = 0.0 if share is None else float(np.linalg.norm(across.away(np.array(share))))
    told = conditions(across, options.pop("stiffness", K_S), **options)
    return lateral_force(told, vector, size, away)


def conditions(across: Across, stiffness: float | None = K_S, **arm: Any) -> Conditions:
    return Conditions(Sources(stiffness), 300.0, 3.0, 1e-6, across=across, **arm)


def test_a_guided_axis_is_judged_by_the_size_of_the_share_as_ever() -> None:
    it = found(Across(), (0.04, 0.0), arm=False)
    assert (it.rule, it.relative) == ("guided", pytest.approx(GUIDED_COMPLIANCE * 0.04))
    assert it.size == "4 %"
    assert found(Across(), (0.0, 0.0), arm=False).size == "0 %"
    unknown = found(Across(), None, arm=False)
    assert (unknown.size, unknown.relative) == ("share not known, counted as none", 0.0)


@pytest.mark.parametrize("share", [None, (0.01, 0.0)])
def test_an_arm_whose_friction_nobody_knows_costs_width(share: tuple[float, float] | None) -> None:
    it = found(Across(), share)
    assert (it.rule, it.relative) == ("unknown", UNKNOWN_FRICTION)


def test_one_number_holds_near_the_share_that_it_was_measured_at() -> None:
    measured = Across(at_share=(0.1, 0.0))
    near, far = found(measured, (0.13, 0.0)), found(measured, (0.02, 0.0))
    assert near.rule == "one number"
    assert near.relative == pytest.approx(CROSS_COMPLIANCE * 0.03)
    assert far.relative == pytest.approx(CROSS_COMPLIANCE * 0.08)


def test_three_numbers_leave_their_covariance_and_a_share_of_what_they_take_out() -> None:
    it = found(KNOWN, (0.2, 0.0))
    taken = K_S * 2e-6 * 0.1
    assert it.rule == "three numbers"
    assert it.taken == pytest.approx(taken)
    assert it.relative == pytest.approx(np.hypot(K_S * 1e-8, 0.05 * taken))
    assert found(KNOWN, (0.1, 0.1)).relative == pytest.approx(K_S * 1e-8)


def test_its_errors_point_where_the_share_is_from_that_of_the_calibration() -> None:
    """So runs that are compared share them as far as they do."""
    three = found(KNOWN, (0.2, 0.1))
    assert np.hypot.reduce(three.errors) == pytest.approx(three.relative)
    assert three.errors == pytest.approx((0.001, 0.001, 0.0, 0.0, 0.001), abs=1e-9)
    back = found(KNOWN, (0.05, 0.0))
    assert back.errors[0] == pytest.approx(-0.0005)
    one = found(Across(at_share=(0.1, 0.0)), (0.13, 0.02))
    assert one.errors == pytest.approx((0.03, 0.02))
    assert found(Across(), (0.04, 0.0), arm=False).errors == (0.04, 0.0)
    assert found(Across(), (0.04, 0.0)).errors == ()
    assert found(KNOWN, None).errors == ()


def test_before_a_run_only_what_is_certain_to_be_missing_costs_width() -> None:
    arm: dict[str, Any] = {"arm": True}
    assert expected_lateral_force(conditions(Across(), **arm)).relative == UNKNOWN_FRICTION
    assert expected_lateral_force(conditions(KNOWN, **arm)).relative == 0.0
    assert expected_lateral_force(conditions(Across(at_share=(0.0, 0.0)), **arm)).relative == 0.0
    assert expected_lateral_force(conditions(Across())).relative == 0.0


def test_it_stands_in_the_budget() -> None:
    quiet = judge(press(World()))
    assert quiet.headline.verdict is ResultVerdict.IDENTIFIED
    unknown = LateralForce("unknown", relative=UNKNOWN_FRICTION)
    evidence = judge(press(World(said={"lateral_force": unknown})))
    [line] = [x for x in evidence.headline.lines if x.source == "lateral force"]
    assert line.relative > 0.02
    assert evidence.headline.half_width > quiet.headline.half_width
    assert unknown.note in evidence.notes
