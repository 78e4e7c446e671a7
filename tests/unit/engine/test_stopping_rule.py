"""Enough, hopeless, or neither: the decision of a level, and the deformation that it goes by."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stepload.engine.stopping_rule import SURE, StoppingRule, Verdict, judge, nearest
from stepload.feasibility.until import Need, Until
from stepload.identification.conditions import Conditions, Sources
from stepload.plan.checks import LEAST_LEVELS

K_S = 3e6
UM = 1e-6


def ladder(needed_um: float = 30.0, least_um: float = 20.0, sigma_um: float = 1.0) -> list[Need]:
    return [
        Need(50.0 * (i + 1), needed_um * UM, least_um * UM, sigma_um * UM, 10 * UM, 0.1)
        for i in range(6)
    ]


@pytest.mark.parametrize(
    ("index", "deformation_um", "verdict"),
    [
        (2, 30.0, Verdict.ENOUGH),
        (2, 29.999, Verdict.MORE),
        (LEAST_LEVELS - 1, 500.0, Verdict.ENOUGH),
        (LEAST_LEVELS - 2, 500.0, Verdict.MORE),
        (5, 30.0, Verdict.ENOUGH),
        (5, 0.0, Verdict.MORE),  # nothing is left to spare
        (2, 7.999, Verdict.UNREACHABLE),  # (8 + 2) µm x 300/150 = 20 µm
        (2, 8.001, Verdict.MORE),
        (4, 14.66, Verdict.UNREACHABLE),  # (14.67 + 2) µm x 300/250 = 20 µm
        (4, 14.67, Verdict.MORE),
    ],
)
def test_what_a_level_says(index: int, deformation_um: float, verdict: Verdict) -> None:
    assert SURE == 2.0
    assert judge(ladder(), index, deformation_um * UM) is verdict


def test_one_level_that_may_still_do_is_reason_enough_to_go_on() -> None:
    needs = ladder()
    for index in (3, 5):
        needs[index] = replace(needs[index], least_m=1.0)
    reach = nearest(needs, 2, 10.1 * UM)
    assert reach is not None
    assert reach.need is needs[4]
    assert reach.most_m == pytest.approx(12.1 * UM * 250.0 / 150.0)
    assert judge(needs, 2, 10.1 * UM) is Verdict.MORE
    assert judge(needs, 2, 9.9 * UM) is Verdict.UNREACHABLE


def far_enough(stiffness: float | None = K_S) -> StoppingRule:
    conditions = Conditions(Sources(stiffness), 300.0, 3.0, 1e-6)
    return StoppingRule(Until(0.1, tuple(ladder()), conditions))


def test_the_deformation_is_the_payloads_between_a_tenth_of_the_level_and_the_level() -> None:
    far = far_enough()
    k = 1.7e6  # a straight line: interpolation between the holds is exact
    far.touched(3.0, 5e-3 + 3.0 / k + 3.0 / K_S)
    for level in (50.0, 100.0, 150.0):
        found = far.held(level, 5e-3 + level / k + level / K_S)
        assert found == pytest.approx(0.9 * level / k, rel=1e-9)


def test_a_contact_that_was_opened_and_touched_again_goes_on() -> None:
    far = far_enough(None)
    far.touched(3.0, 3.0 * UM)
    far.held(50.0, 50.0 * UM)
    far.touched(3.0, 4.0 * UM)
    assert far.held(100.0, 100.0 * UM) == pytest.approx(90.0 * UM, rel=0.02)
