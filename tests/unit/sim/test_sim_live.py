"""Worlds in real time: the plan drivers called `sim`, and what emulators couple to."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from stepload.errors import DeviceError
from stepload.rig.device import Device
from stepload.rig.faults import FaultCode
from stepload.rig.world import DEFAULT_SPEC
from stepload_drivers.sim.devices import SimArm, SimDisplacementSensor, SimForceSensor
from stepload_drivers.sim.live import LiveWorld


@pytest.fixture
def closing() -> Iterator[list[Device]]:
    devices: list[Device] = []
    yield devices
    for device in devices:
        device.close()


def test_live_world_goes_where_it_is_commanded() -> None:
    live = LiveWorld(replace(DEFAULT_SPEC, surface_m=1e-4), start_s=100.0)
    live.advance_to(100.5)
    assert live.state().time_s == pytest.approx(100.5)
    assert live.state().deformation_m == pytest.approx(-1e-4)
    live.command(1.5e-4)
    live.advance_to(101.5)
    live.advance_to(100.0)
    state = live.state()
    assert state.time_s == pytest.approx(101.5)
    assert state.position_m == pytest.approx(1.5e-4, abs=4e-6)
    assert state.force_n == pytest.approx(
        DEFAULT_SPEC.system_stiffness_n_per_m * (state.drive_m - state.tip_m), rel=1e-3
    )
    assert state.arm_force_n == pytest.approx(state.force_n, abs=25.0)
    assert state.peak_force_n >= state.force_n > 20.0


def test_a_late_reader_is_told_of_the_time_it_asks_for() -> None:
    prompt = LiveWorld(DEFAULT_SPEC, start_s=50.0)
    late = LiveWorld(DEFAULT_SPEC, start_s=50.0)
    prompt.command(1e-3)
    late.command(1e-3)
    seen = [prompt.at(50.0 + 0.002 * i) for i in range(200)]
    late.advance_to(51.0)
    assert [late.at(50.0 + 0.002 * i) for i in range(200)] == seen
    assert late.state().time_s == pytest.approx(51.0)
    assert len({state.position_m for state in seen}) > 20
    late.advance_to(60.0)
    assert late.at(50.0).time_s == pytest.approx(58.0, abs=2e-3)


def wait_for(condition: Any, seconds: float = 5.0) -> None:
    give_up_s = time.monotonic() + seconds
    while not condition() and time.monotonic() < give_up_s:
        time.sleep(0.005)
    assert condition()


def test_devices_of_one_name_share_a_world_in_real_time(closing: list[Device]) -> None:
    arm = SimArm(world="shared", surface=0.05e-3, force_noise=0.5)
    force = SimForceSensor(world="shared", axis="-fz", bias=0.0)
    gauge = SimDisplacementSensor(world="shared")
    closing += [arm, force, gauge]
    for device in closing:
        device.open(2.0)
    assert (arm.period_s, force.rate_hz, gauge.rate_hz) == (0.001, 1000.0, 100.0)
    arm.command(0.1e-3)
    readings: list[float] = []

    def pressed() -> bool:
        readings.extend(-sample.wrench[2] for sample in force.drain())
        return bool(readings) and readings[-1] > 20.0

    wait_for(pressed)
    samples = arm.drain()
    assert abs(time.monotonic() - samples[-1].receive_time_s) < 1.0
    assert gauge.drain()
    arm.retract(1e-3, 0.05, 5.0)
    readings.clear()
    wait_for(lambda: pressed() or bool(readings and abs(readings[-1]) < 2.0))
    assert abs(readings[-1]) < 2.0
    assert arm.health().lost == force.health().lost == 0


def test_a_device_that_comes_too_late_is_told_so(closing: list[Device]) -> None:
    arm = SimArm(world="late")
    closing.append(arm)
    arm.open(2.0)
    late = SimForceSensor(world="late", bias=17.0)
    with pytest.raises(DeviceError, match="already runs with start_force_bias_n") as caught:
        late.open(2.0)
    assert caught.value.code == FaultCode.WRONG_DEVICE
