"""A contact that slips, changes or is askew: what it leaves in a result, and what it blocks."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pressed_runs import World, press

from stepload.identification.contact_quality import (
    BranchShare,
    ContactPoint,
    ContactQuality,
    Slip,
)
from stepload.identification.fit import Missing
from stepload.identification.lateral import (
    ANY_WAY,
    LATERAL_OVER_AXIAL,
    TANGENTIAL_OVER_NORMAL,
    TILT_RAD,
    UNKNOWN_SHARE,
    ContactAlignment,
    coupling_of,
)
from stepload.identification.lateral_coupling import CROSS_COMPLIANCE, Across
from stepload.identification.quantity import ResultVerdict
from stepload.identification.verdict import judge

YIELDS = 1.0 / 3.49e6
SPAN_M = 50e-6


def slip(jump_n: float, force_n: float = 150.0, *, rising: bool = True, cycle: int = 1) -> Slip:
    return Slip(1.0, force_n, jump_n, cycle, rising)


NOWHERE = Missing("no lever")


def quality(
    *slips: Slip, undetected_n: float = 0.0, place: ContactPoint | Missing = NOWHERE
) -> ContactQuality:
    return ContactQuality((BranchShare(1, True, np.array([0.1, 0.0])),), slips, undetected_n, place)


def test_a_slip_moves_the_tip_along_a_plate_that_may_be_tilted() -> None:
    it = ContactAlignment(quality(slip(2.0), undetected_n=3.0), yields_m_per_n=YIELDS)
    across = LATERAL_OVER_AXIAL * YIELDS + 1e-7 / TANGENTIAL_OVER_NORMAL
    seen_m, undetected_m = it.slip_m(30.0, 300.0, lambda _: 1e-7)
    assert seen_m == pytest.approx(2.0 * across * math.tan(TILT_RAD))
    assert undetected_m == 0.0
    assert replace(it, arm=True).slip_m(30.0, 300.0, lambda _: 1e-7)[1] == pytest.approx(
        1.5 * seen_m
    )
    assert replace(it, quality=Missing("")).slip_m(30.0, 300.0, lambda _: 1e-7) == (0.0, 0.0)


@pytest.mark.parametrize("other", [slip(2.0, 20.0), slip(2.0, rising=False), slip(2.0, cycle=2)])
def test_slips_outside_of_the_chord_do_not_count(other: Slip) -> None:
    it = ContactAlignment(quality(other), yields_m_per_n=YIELDS)
    assert it.slip_m(30.0, 300.0, lambda _: 1e-7)[0] == 0.0


def point(off_m: float, sigma_m: float = 1e-5) -> ContactPoint:
    return ContactPoint(300.0, (off_m, 0.0), sigma_m)


def test_misalignment_costs_by_the_share_the_angle_and_how_far_the_tip_goes_sideways() -> None:
    it = ContactAlignment(arm=True, share=0.2, misalignment_rad=0.03, yields_m_per_n=1e-5)
    [line] = it.lines(0.667, 5.0, 50.0, 5e-4)
    angle = math.hypot(0.03, TILT_RAD)
    force = math.hypot(ANY_WAY * 0.2 * math.sin(angle), (1.0 - math.cos(angle)) / math.sqrt(3.0))
    moved = CROSS_COMPLIANCE * 1e-5 * 45.0 * math.tan(TILT_RAD) / math.sqrt(3.0) / 5e-4
    assert line.relative == pytest.approx(math.hypot(0.667 * force, moved))
    [unknown] = replace(it, share=None).lines(0.667, 5.0, 50.0, 5e-4)
    [assumed] = replace(it, share=UNKNOWN_SHARE).lines(0.667, 5.0, 50.0, 5e-4)
    assert unknown.relative == assumed.relative > line.relative


def test_a_guided_axis_costs_nothing_unless_its_sensor_is_said_to_be_askew() -> None:
    assert ContactAlignment(share=0.2).lines(0.667, 30.0, 300.0, SPAN_M) == []
    [line] = ContactAlignment(share=0.2, misalignment_rad=0.03).lines(0.667, 30.0, 300.0, SPAN_M)
    assert line.relative < 0.002


def test_three_numbers_tell_the_coupling() -> None:
    assert coupling_of(Across(), 1e-5) == CROSS_COMPLIANCE
    assert coupling_of(Across((3e-6, 4e-6)), 0.0) == CROSS_COMPLIANCE
    assert coupling_of(Across((3e-6, 4e-6)), 1e-5) == pytest.approx(0.5 / math.sqrt(2.0))


def test_all_of_it_stands_in_the_budget() -> None:
    plain = judge(press(World()))
    assert plain.headline.verdict is ResultVerdict.IDENTIFIED
    assert not any("slip" in line.source and line.relative for line in plain.headline.lines)
    slipped = ContactAlignment(
        quality(slip(30.0), place=point(5e-3), undetected_n=3.0), arm=True,
        misalignment_rad=0.035, yields_m_per_n=YIELDS, gauge_offset_m=0.001,
    )  # fmt: skip
    found = judge(press(World(said={"alignment": slipped})))
    lines = {line.source: line.relative for line in found.headline.lines}
    for source in ("slip on a tilted plate", "misalignment of sensor and plate",
                   "gauge off the axis of an arm that turns"):  # fmt: skip
        assert lines[source] > 1e-3
    whole = math.sqrt(sum(x**2 for x in lines.values()))
    assert found.headline.relative == pytest.approx(whole)
    assert set(slipped.notes) <= set(found.notes)
    assert found.headline.half_width > plain.headline.half_width
