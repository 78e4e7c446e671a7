"""What a plan that goes sideways is told before it moves."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from run_plans import preflight_for
from tilted_plans import tilted_plan

from stepload.feasibility.aligning import aligning_of
from stepload.feasibility.press import force_budget
from stepload.feasibility.reason import Severity
from stepload.plan.model import Alignment, Plan
from stepload.rig.device import Arm


def codes(plan: Plan) -> dict[str, Severity]:
    return {reason.code: reason.severity for reason in preflight_for(plan).reasons}


def test_an_arm_that_cannot_shift_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Fixed(Arm):
        pass

    monkeypatch.setattr("stepload.feasibility.aligning.load_arm", lambda _name: Fixed)
    assert codes(tilted_plan())["arm_cannot_shift"] is Severity.REFUSE


@pytest.mark.parametrize(("radius_m", "refused"), [(0.01, False), (0.0015, True)])
def test_a_tilt_that_the_touches_cannot_tell_is_refused(radius_m: float, refused: bool) -> None:
    told = codes(tilted_plan(alignment=Alignment(radius_m=radius_m, max_tilt_rad=0.0175)))
    assert ("tilt_unknown" in told) is refused


def test_a_start_pose_without_room_is_refused() -> None:
    near = {"surface_distance_m": 2e-3, "surface_uncertainty_m": 5e-4}
    assert codes(tilted_plan(**near))["alignment_room"] is Severity.REFUSE


def test_the_touch_error_is_at_least_what_resolution_and_speed_say() -> None:
    plan = tilted_plan()
    arm = replace(plan.rig.arm, lost_motion_m=40e-6)
    worse = replace(plan, rig=replace(plan.rig, arm=arm))
    limits = preflight_for(plan).run_limits
    aligning, more = aligning_of(plan, limits), aligning_of(worse, limits)
    assert aligning is not None
    assert more is not None
    assert aligning.touch_error_m == 20e-6
    assert more.touch_error_m > 40e-6
    assert math.degrees(aligning.tilt_error_rad) == pytest.approx(0.094, abs=1e-3)


def test_a_shift_that_hits_something_stays_below_the_force_limit() -> None:
    plan = tilted_plan()
    preflight = preflight_for(plan)
    limits, aligning, press = preflight.run_limits, preflight.aligning, preflight.bounds
    assert aligning is not None
    for stiffness in (1e5, 1e6, 1e8):
        stiff = replace(plan.rig.arm, lateral_stiffness_n_per_m=stiffness)
        found = aligning_of(replace(plan, rig=replace(plan.rig, arm=stiff)), limits)
        assert found is not None
        budget = force_budget(
            replace(press, stiffness_n_per_m=stiffness), speed_m_s=found.speed_m_s,
            threshold_n=found.felt_n, tangent_n_per_m=limits.tangent_n_per_m,
            delay_s=press.reaction_s,
        )  # fmt: skip
        assert sum(term.value for term in budget) <= limits.force_limit_n * 1.0001


def test_the_schedule_has_the_touches() -> None:
    with_them, without = preflight_for(tilted_plan()), preflight_for(tilted_plan(alignment=None))
    assert with_them.duration_s > without.duration_s + 20.0
