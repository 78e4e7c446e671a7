"""Friction: what of F_c an arm may press, so that drawing back keeps what a share across leaves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from run_plans import stvf_plan

from stepload.contact.lateral import left_of_limit, weakening
from stepload.feasibility.lateral import (
    LEAST_N,
    back_left,
    counted_left,
    dragged_left,
    expected_tilt_rad,
    lateral_limits,
    left_at,
    misaligned_share,
    share_from_n,
)
from stepload.feasibility.preflight import derive
from stepload.feasibility.pressing import largest_top_force
from stepload.plan.model import Alignment, Plan, Structure

PLAN = stvf_plan()
NU = PLAN.payload.material.poisson_ratio


def arm(
    friction: float | None = None,
    *,
    components: str = "six",
    structure: Structure = Structure.ARM,
    **procedure: Any,
) -> Plan:
    """A serial arm that presses the paper's sphere."""
    rig = replace(
        PLAN.rig,
        arm=replace(PLAN.rig.arm, structure=structure),
        force=replace(PLAN.rig.force, components=components),
    )
    return replace(
        PLAN, rig=rig, payload=replace(PLAN.payload, friction=friction),
        procedure=replace(PLAN.procedure, **procedure),
    )  # fmt: skip


def test_of_any_plate_friction_leaves_what_it_leaves_when_it_slides() -> None:
    assert back_left(arm(0.6)) == pytest.approx(left_of_limit(NU, 0.6))
    assert back_left(arm(0.1)) == pytest.approx(left_of_limit(NU, 0.1))
    assert back_left(arm(0.7)) == 0.0
    assert counted_left(arm(0.6)) == back_left(arm(0.6))


def test_friction_that_nobody_states_and_a_guided_axis_change_nothing() -> None:
    assert back_left(arm()) == counted_left(arm()) == 1.0
    assert counted_left(arm(0.6, structure=Structure.MACHINE)) == 1.0


@pytest.mark.parametrize("friction", [0.2, 0.45, 0.6])
def test_no_share_that_friction_makes_leaves_less(friction: float) -> None:
    """From F_allowed on down, however the force across goes meanwhile, at most at the friction."""
    top = back_left(arm(friction))
    for share in np.linspace(0.0, friction, 61):
        assert top <= left_of_limit(NU, float(share)) + 1e-12


def test_a_load_cell_counts_with_friction_and_never_allows_more_for_it() -> None:
    cell = {"components": "one"}
    unstated = dragged_left(arm(**cell))
    for friction in (0.0, 0.1, 0.3, 0.45, 0.6):
        left = dragged_left(arm(friction, **cell))
        assert left == min(unstated, left_of_limit(NU, friction) / math.hypot(1.0, friction))
        assert counted_left(arm(friction, **cell)) == left
    assert dragged_left(arm(0.1, **cell)) == unstated


def test_a_top_force_that_friction_does_not_leave_is_refused() -> None:
    found = derive(arm(0.6))
    assert found.limits is None
    assert found.largest_safe_force_n < PLAN.procedure.top_force_n
    counted_n = found.theory.counted.lower_n
    assert largest_top_force(arm(0.0), counted_n) == largest_top_force(arm(), counted_n)


def test_f_lim_is_below_what_friction_leaves() -> None:
    plan = arm(0.3, top_force_n=100.0, levels_n=(50.0, 100.0), step_n=50.0)
    found = derive(plan)
    left_n = left_of_limit(NU, 0.3) * found.theory.counted.lower_n
    assert 100.0 < found.run_limits.force_limit_n <= found.run_limits.allowed_n < left_n


def test_r12_judges_from_where_friction_may_take_too_much() -> None:
    """F_allowed of 7 N: at a friction of 0.6 some 1.2 N are left, and 5 N are too many."""
    quiet_n = 0.01
    assert share_from_n(arm(), quiet_n, 400.0) == max(LEAST_N, 2.0 * PLAN.procedure.touch_force_n)
    foot_n = share_from_n(arm(), quiet_n, 7.0)
    assert foot_n == pytest.approx(7.0 * left_of_limit(NU, 0.6))
    for share in np.linspace(0.0, 0.6, 61):
        assert foot_n <= 7.0 * left_of_limit(NU, float(share)) * (1.0 + 1e-9)


def test_what_f_allowed_leaves_out_already_is_not_taken_off_again() -> None:
    def taken(plan: Plan) -> float:
        return lateral_limits(plan, 0.1, 100.0)["lateral_weakening"]

    for plan in (arm(), arm(structure=Structure.MACHINE)):
        assert taken(plan) == weakening(NU, 0.3 + misaligned_share(plan))
    for plan in (arm(0.1), arm(0.3), arm(0.45), arm(components="one")):
        askew = misaligned_share(plan)
        a, largest = weakening(NU, 0.3 + askew), 0.3 * (0.3 + 2.0 * askew)
        left, found = counted_left(plan), taken(plan)
        for part in np.linspace(0.0, largest, 20):
            assert left * (1.0 - found * part) <= 1.0 - a * part + 1e-12
        kept = left * (1.0 - found * largest) == pytest.approx(1.0 - a * largest)
        assert found == 0.0 or kept
    assert 0.0 < taken(arm(0.1)) < weakening(NU, 0.3 + misaligned_share(arm(0.1)))
    assert taken(arm(0.6)) == 0.0


def test_a_plate_that_is_said_to_be_steep_takes_its_part_of_f_c() -> None:
    """F_allowed and R12 together leave no more than 1 - a (s + e)², less what 3° are believed to
    take, at every share s that the sensor shows; e hidden by tilt and mounting."""
    for structure in (Structure.ARM, Structure.MACHINE):
        base = arm(structure=structure)
        usual = replace(base, rig=replace(base.rig, plate_tilt_rad=math.radians(3.0)))
        assert (misaligned_share(usual), counted_left(usual)) == (misaligned_share(base), 1.0)
        level = replace(base, rig=replace(base.rig, plate_tilt_rad=0.0))
        assert misaligned_share(level) < misaligned_share(base)
        assert counted_left(level) == 1.0
        for tilt_deg in (4.0, 7.0, 10.0):
            steep = replace(base, rig=replace(base.rig, plate_tilt_rad=math.radians(tilt_deg)))
            found = lateral_limits(steep, 0.1, 100.0)
            e, e0 = found["lateral_askew"], misaligned_share(base)
            assert e == pytest.approx(math.tan(math.radians(tilt_deg + 2.0)) + 0.01)
            a, left = weakening(NU, 0.3 + e), counted_left(steep)
            assert 0.5 < left < 1.0
            for s in np.linspace(0.0, 0.3, 20):
                most = left * (1.0 - found["lateral_weakening"] * s * (s + 2.0 * e))
                assert most <= 1.0 - a * ((s + e) ** 2 - e0**2) + 1e-12
                assert most <= left_of_limit(NU, s + e) + a * e0**2 + 2e-5


def test_what_the_touches_measure_counts_and_not_what_is_said() -> None:
    plan = arm()
    said = replace(plan, rig=replace(plan.rig, plate_tilt_rad=math.radians(10.0)))
    measured = replace(said, procedure=replace(said.procedure, alignment=Alignment()))
    assert expected_tilt_rad(measured) == Alignment().max_tilt_rad
    assert counted_left(measured) == 1.0


def test_a_steep_plate_under_a_load_cell_counts_too() -> None:
    for structure, share in ((Structure.ARM, 0.3), (Structure.MACHINE, 0.0)):
        plan = arm(structure=structure, components="one")
        steep = replace(plan, rig=replace(plan.rig, plate_tilt_rad=math.radians(8.0)))
        more = math.tan(math.radians(8.0)) - math.tan(math.radians(3.0))
        assert dragged_left(steep) == pytest.approx(left_at(plan.payload, share + more))
        assert dragged_left(steep) < dragged_left(plan)
