"""What `open` refuses, with which code, and that it leaves nothing behind (see the leak checks)."""

from __future__ import annotations

import pytest
from long_ones import long_rows

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode


@pytest.mark.parametrize(
    ("emulation", "options", "code", "says"),
    [
        ({"version": (3, 3, 0, 0)}, {}, FaultCode.UNSUPPORTED, "3.4"),
        ({}, {"serial_number": "20009999999"}, FaultCode.WRONG_DEVICE, "20009999999"),
        ({"commands": ["local on"]}, {}, FaultCode.NOT_REMOTE, "local control"),
        ({"commands": ["freeze on"]}, {}, FaultCode.NOT_CONNECTED, "no answer"),
        ({"commands": ["nan on"]}, {}, FaultCode.NOT_FINITE, "finite"),
        ({"commands": ["protective-stop"]}, {}, FaultCode.PROTECTIVE_STOP, "unlock"),
        *long_rows(
            [
                ({"version": (10, 7, 0, 0)}, {}, FaultCode.UNSUPPORTED, "PolyScope X"),
                ({"commands": ["claim 0 23"]}, {}, FaultCode.REFUSED_COMMAND, "in use"),
                ({"commands": ["blackhole on"]}, {}, FaultCode.NOT_CONNECTED, "no answer"),
                ({"commands": ["emergency-stop"]}, {}, FaultCode.EMERGENCY_STOP, "button"),
                ({"commands": ["safeguard on"]}, {}, FaultCode.SAFEGUARD_STOP, "guard"),
            ]
        ),
    ],
)
def test_open_refuses(start_emulator, make_arm, emulation, options, code, says):
    emulator = start_emulator(**emulation)
    arm = make_arm(emulator.host, **options)
    with pytest.raises(DeviceError) as caught:
        arm.open(0.7 if code == FaultCode.NOT_CONNECTED else 5.0)
    assert caught.value.code == code
    assert says in str(caught.value)
    assert emulator.state()["uploads"] == 0


def test_a_second_arm_is_refused_and_the_first_unharmed(start_emulator, make_arm, follow, after):
    emulator = start_emulator()
    first = make_arm(emulator.host)
    first.open(15.0)
    with pytest.raises(DeviceError) as caught:
        make_arm(emulator.host).open(5.0)
    assert caught.value.code == FaultCode.REFUSED_COMMAND
    follow(first, after(0.2))
    assert first.fault() is None


def test_targets_that_are_not_finite_or_far_ahead_are_refused(start_emulator, make_arm):
    emulator = start_emulator()
    arm = make_arm(emulator.host, max_lead=0.001)
    arm.open(15.0)
    for target_m, code in ((float("nan"), FaultCode.NOT_FINITE), (0.0011, FaultCode.OUT_OF_RANGE)):
        with pytest.raises(DeviceError) as caught:
            arm.command(target_m)
        assert caught.value.code == code
    arm.command(-0.002)
    with pytest.raises(DeviceError, match="or of its last target"):
        arm.command(0.0)
    arm.close()
    with pytest.raises(DeviceError) as caught:
        arm.command(-0.002)
    assert caught.value.code == FaultCode.NOT_CONNECTED
