"""What the controller's words mean, and what cannot be true."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.rig.faults import FaultCode
from stepload_drivers.ur.state import (
    PacketCounter,
    Standstill,
    UrState,
    can_move,
    data_problem,
    pressing_axes,
    pressing_wrench,
    safety_problem,
    target_pose,
    travel_m,
)

SOUND = UrState(12.5, (0.4, -0.1, 0.3, 0.0, 3.1, 0.0), (0.0,) * 6, 7, 1, 2, 1)
UNIT = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["timestamp_s", "pose", "wrench"])
def test_not_finite(field, value):
    old = getattr(SOUND, field)
    broken = SOUND._replace(**{field: (*old[:5], value) if isinstance(old, tuple) else value})
    assert data_problem(broken).code == FaultCode.NOT_FINITE


@pytest.mark.parametrize(
    "change",
    [
        {"pose": (5.1, 0, 0, 0, 0, 0)},
        {"pose": (0, 0, 0, 10, 0, 0)},
        {"wrench": (0, 0, -6000, 0, 0, 0)},
        {"wrench": (0, 0, 0, 0, 6000, 0)},
        {"runtime_state": 9},
        {"robot_mode": 40},
        {"safety_mode": -3},
    ],
)
def test_out_of_range(change):
    assert data_problem(SOUND._replace(**change)).code == FaultCode.OUT_OF_RANGE


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"safety_bits": 1 << 2 | 1 << 10}, FaultCode.PROTECTIVE_STOP),
        ({"safety_mode": 3}, FaultCode.PROTECTIVE_STOP),
        ({"safety_bits": 1 << 4 | 1 << 10}, FaultCode.SAFEGUARD_STOP),
        ({"safety_mode": 5}, FaultCode.SAFEGUARD_STOP),
        ({"safety_bits": 1 << 5 | 1 << 7 | 1 << 10}, FaultCode.EMERGENCY_STOP),
        ({"safety_mode": 6}, FaultCode.EMERGENCY_STOP),
        ({"safety_bits": 1 << 7 | 1 << 2}, FaultCode.EMERGENCY_STOP),
        ({"safety_bits": 1 << 9}, FaultCode.DEVICE_REPORTS),
        ({"robot_mode": 3}, FaultCode.DEVICE_REPORTS),
    ],
)
def test_stops_are_told_apart(change, code):
    state = SOUND._replace(**change)
    assert safety_problem(state).code == code
    assert safety_problem(state).hint
    assert not can_move(state)


@given(UNIT, st.floats(-0.1, 0.1))
def test_target_and_travel_are_inverse(vector, position_m):
    length = math.hypot(*vector)
    approach = tuple(component / length for component in vector)
    pose = target_pose(SOUND.pose, approach, position_m)
    assert travel_m(pose, SOUND.pose, approach) == pytest.approx(position_m, abs=1e-12)
    assert pose[3:] == list(SOUND.pose[3:])


def test_reaction_against_the_approach_is_pressing():
    axes = pressing_axes((0.0, 0.0, -1.0))
    assert pressing_wrench((0, 0, 20, 0, 0, 0), axes, "reaction")[2] == 20
    assert pressing_wrench((0, 0, 20, 0, 0, 0), axes, "applied")[2] == -20


@given(UNIT, st.tuples(*[st.floats(-100, 100)] * 6))
def test_a_wrench_keeps_its_size_in_any_pressing_frame(vector, wrench):
    length = math.hypot(*vector)
    approach = tuple(component / length for component in vector)
    told = pressing_wrench(wrench, pressing_axes(approach), "reaction")
    for part in (slice(0, 3), slice(3, 6)):
        assert math.hypot(*told[part]) == pytest.approx(math.hypot(*wrench[part]), abs=1e-9)
        along = sum(w * a for w, a in zip(wrench[part], approach, strict=True))
        assert told[part][2] == pytest.approx(-along, abs=1e-9)


def test_tally_counts_gaps_from_stamps_and_never_repeats_a_number():
    tally = PacketCounter(0.002)
    stamps = [10.0, 10.002, 10.008, 10.0081, 10.012]
    assert [tally.add(stamp, 5.0) for stamp in stamps] == [0, 1, 4, 5, 6]
    health = tally.health(5.25)
    assert (health.received, health.lost, health.errors["gaps"]) == (5, 2, 1)
    assert health.age_s == 0.25
    assert health.longest_gap_s == pytest.approx(0.006)


def test_standstill_needs_a_full_window_of_rest():
    still = Standstill()
    for tick in range(100):
        x_m = 0.4 + 1e-5 * min(tick, 50)
        still.add(SOUND._replace(timestamp_s=tick * 0.002, pose=(x_m, 0, 0, 0, 0, 0)))
        if tick in (5, 30, 55):
            assert not still.still
    assert still.still
