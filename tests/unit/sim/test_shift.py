"""What a shift of a simulated arm must be, and where it takes the arm."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from six_rigs import rub

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.world import DEFAULT_SPEC, load_world

SIX = replace(DEFAULT_SPEC, mount=rub(0.3), command_delay_s=0.0, system_stiffness_n_per_m=9e4)


@pytest.mark.parametrize(
    ("shift_m", "code"),
    [
        ((math.nan, 0.0), FaultCode.NOT_FINITE),
        ((0.0, -math.inf), FaultCode.NOT_FINITE),
        ((0.0, 0.0011), FaultCode.OUT_OF_RANGE),
    ],
)
def test_a_shift_that_no_arm_may_do_is_refused(
    shift_m: tuple[float, float], code: FaultCode
) -> None:
    rig = load_world()(SIX)
    rig.arm.open(1.0)
    with pytest.raises(DeviceError, match="shift") as caught:
        rig.arm.command(0.0, shift_m)
    assert caught.value.code == code


def test_a_shift_is_gone_to_and_seen_in_the_pose_and_a_retract_keeps_it() -> None:
    rig = load_world()(SIX)
    rig.arm.open(1.0)
    assert rig.arm.can_shift
    for step in range(1, 201):
        rig.arm.command(0.0, (1e-5 * step, -5e-6 * step))
        rig.clock.sleep_until(rig.clock.now_s() + rig.arm.period_s)
    rig.clock.sleep_until(rig.clock.now_s() + 0.3)
    rig.arm.retract(1e-3, 0.01, 2.0)
    rig.clock.sleep_until(rig.clock.now_s() + 0.1)
    sample = rig.arm.drain()[-1]
    assert sample.position_m == pytest.approx(-1e-3, abs=5e-5)
    assert sample.pose[:2] == pytest.approx((-2e-3, -1e-3), abs=1e-6)
