"""Faults of controller and network while the arm moves: what is told, and that it stands still."""

from __future__ import annotations

import time

import pytest
from long_ones import long, long_rows

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status

GIVE_UP_S = 10.0

UNTRUE = {FaultCode.NOT_FINITE, FaultCode.OUT_OF_RANGE}
NO_MORE_DATA = {FaultCode.STALE, FaultCode.NOT_CONNECTED, FaultCode.DRIVER} | UNTRUE
"""After these the driver hands out nothing any more."""

RESET = ["drop rst"]
"""After a reset ur_rtde's threads race: it gives up, or crashes. Reconnect it cannot either way."""


def wait_until_still(emulator):
    """The truth: where the arm stands, once its program has ended or nothing moves it."""
    give_up_s = time.monotonic() + GIVE_UP_S
    last = emulator.state()
    while time.monotonic() < give_up_s:
        time.sleep(0.1)
        now = emulator.state()
        if abs(now["position_m"] - last["position_m"]) < 1e-7:
            return now
        last = now
    raise AssertionError(f"the arm still moves: {last}")


@pytest.mark.parametrize(
    ("commands", "codes"),
    [
        (["drop"], {FaultCode.NOT_CONNECTED}),
        (["freeze on"], {FaultCode.STALE}),
        (["blackhole on"], {FaultCode.STALE}),
        (["wrong-type on"], {FaultCode.STALE}),
        (["nan on"], {FaultCode.NOT_FINITE}),
        (["wrong-size receive"], {FaultCode.DRIVER}),
        (["protective-stop"], {FaultCode.PROTECTIVE_STOP}),
        (["emergency-stop"], {FaultCode.EMERGENCY_STOP}),
        (["safeguard on"], {FaultCode.SAFEGUARD_STOP}),
        (["kill-program"], {FaultCode.PROGRAM_STOPPED}),
        (["local on", "kill-program"], {FaultCode.NOT_REMOTE}),
        *long_rows(
            [
                (RESET, {FaultCode.NOT_CONNECTED, FaultCode.DRIVER}),
                (["refuse on"], {FaultCode.NOT_CONNECTED}),
                (["repeat on"], {FaultCode.STALE}),
                (["random on"], UNTRUE),
                (["wrong-size control"], {FaultCode.NOT_CONNECTED}),
            ]
        ),
    ],
    ids=lambda value: ", ".join(sorted(value)) if isinstance(value, set) else value[0],
)
def test_fault_is_told_apart_and_the_arm_stops(
    start_emulator, make_arm, follow, after, commands, codes
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.2))
    for command in commands:
        emulator.command(command)
    follow(arm, lambda: arm.fault() is not None)
    fault = arm.fault()
    assert fault is not None
    assert fault.code in codes, fault.message
    if fault.code == FaultCode.DRIVER and commands != RESET:
        assert "crashed (SIGABRT)" in fault.message
    assert fault.hint
    try:
        arm.safe(2.0)
    except DeviceError:
        assert commands[0] in ("refuse on", "blackhole on")
    assert wait_until_still(emulator)["uploads"] == 1
    with_status = arm.drain()
    if with_status and fault.code not in NO_MORE_DATA:
        assert with_status[-1].status == Status.STOPPED


@pytest.mark.parametrize("command", ["drop", *long(("repeat on", "wrong-size receive"))])
def test_retract_goes_out_when_ur_rtde_is_gone(start_emulator, make_arm, follow, after, command):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.2))
    emulator.command(command)
    follow(arm, lambda: arm.fault() is not None)
    emulator.command("repeat off")
    before = wait_until_still(emulator)["position_m"]
    arm.retract(0.002, 0.02, 5.0)
    assert wait_until_still(emulator)["position_m"] == pytest.approx(before - 0.002, abs=2e-4)


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("freeze on", FaultCode.NOT_CONNECTED),
        pytest.param("nan on", FaultCode.NOT_FINITE, marks=pytest.mark.long),
        pytest.param("random on", FaultCode.OUT_OF_RANGE, marks=pytest.mark.long),
        pytest.param("wrong-type on", FaultCode.CORRUPT, marks=pytest.mark.long),
    ],
)
def test_retract_without_data_is_carried_out_though_it_cannot_be_confirmed(
    start_emulator, make_arm, follow, after, command, code
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.2))
    emulator.command(command)
    before = emulator.state()["position_m"]
    with pytest.raises(DeviceError) as caught:
        arm.retract(0.002, 0.02, 2.0)
    assert caught.value.code == code
    assert wait_until_still(emulator)["position_m"] < before - 0.0015


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("protective-stop", FaultCode.PROTECTIVE_STOP),
        pytest.param("emergency-stop", FaultCode.EMERGENCY_STOP, marks=pytest.mark.long),
        ("kill-program", FaultCode.PROGRAM_STOPPED),
    ],
)
def test_retract_says_why_it_cannot(start_emulator, make_arm, follow, after, command, code):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.1))
    emulator.command(command)
    with pytest.raises(DeviceError) as caught:
        arm.retract(0.002, 0.02, 3.0)
    assert caught.value.code == code


def test_releasing_a_safeguard_does_not_move_a_safe_arm(start_emulator, make_arm, follow, after):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.2))
    emulator.command("safeguard on")
    follow(arm, lambda: arm.fault() is not None)
    arm.safe(2.0)
    before = emulator.state()
    emulator.command("safeguard off")
    time.sleep(0.3)
    assert emulator.state()["position_m"] == pytest.approx(before["position_m"], abs=1e-9)
    assert emulator.state()["runtime_state"] == 1


@pytest.mark.parametrize("command", ["rate 50", *long(["jitter 0.02"])])
def test_fewer_packages_are_counted_from_the_time_stamps(
    start_emulator, make_arm, follow, after, command
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    emulator.command(command)
    follow(arm, after(0.6))
    health = arm.health()
    assert health.lost > 50
    assert health.rate_hz < 450
    assert health.longest_gap_s > 0.005
    assert arm.fault() is None


def test_short_packages_end_in_a_fault_before_an_untrue_value_gets_out(
    start_emulator, make_arm, follow, after
):
    """ur_rtde reads on past the end of a package cut in half, without a word."""
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    samples = follow(arm, after(0.2)).samples
    emulator.command("short on")
    give_up_s = time.monotonic() + GIVE_UP_S
    while arm.fault() is None and time.monotonic() < give_up_s:
        samples += arm.drain()
        time.sleep(0.002)
    fault = arm.fault()
    assert fault is not None
    assert fault.code in UNTRUE | {FaultCode.CLOCK}, fault.message
    truth = wait_until_still(emulator)
    for sample in samples + arm.drain():
        assert -1e-4 < sample.position_m < truth["target_m"] + 1e-4
        assert abs(sample.force_n) < 1e-3
