"""The device contract, run on the simulated devices in virtual and in real time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from stepload.rig.contract import Trial, Verdict, run_contract, run_trial
from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor
from stepload.rig.world import SimulatedRig, WorldFault
from stepload_drivers.sim.devices import SimArm, SimDisplacementSensor, SimForceSensor
from stepload_drivers.sim.live import DEFAULT_SPEC
from stepload_drivers.sim.world import open_world

SPEC = replace(DEFAULT_SPEC, gauge_rate_hz=200.0, second_force_rate_hz=500.0)
SILENT_FROM_S = 0.35
DEVICES: dict[str, tuple[str, Callable[[SimulatedRig], Device | None]]] = {
    "arm": ("arm_lost", lambda rig: rig.arm),
    "force": ("force_lost", lambda rig: rig.force),
    "second": ("second_lost", lambda rig: rig.second_force),
    "gauge": ("gauge_lost", lambda rig: rig.displacement),
}


def virtual_trial(name: str, *, silent: bool) -> Trial:
    kind, pick = DEVICES[name]
    rigs: list[SimulatedRig] = []
    faults = (WorldFault(kind, SILENT_FROM_S, math.inf, 0.0),) if silent else ()

    def make() -> Device:
        rigs.append(open_world(replace(SPEC, faults=faults)))
        device = pick(rigs[-1])
        assert device is not None
        return device

    def wait(seconds: float) -> None:
        clock = rigs[-1].clock
        clock.sleep_until(clock.now_s() + seconds)

    def silence() -> None:
        wait(0.1)

    return Trial(
        make,
        wait=wait,
        silence=silence if silent else None,
        move_m=1e-3,
        speed_m_s=0.01,
    )


@pytest.mark.parametrize("name", DEVICES)
def test_virtual_devices_keep_the_contract(name: str) -> None:
    results = {result.name: result for result in run_trial(virtual_trial(name, silent=False))}
    failed = {r.name: r.message for r in results.values() if r.verdict is Verdict.FAILED}
    assert not failed
    if name == "arm":
        assert results["motion"].verdict is Verdict.PASSED


@pytest.mark.parametrize("name", DEVICES)
def test_virtual_devices_that_fall_silent_latch_a_fault(name: str) -> None:
    results = {result.name: result for result in run_trial(virtual_trial(name, silent=True))}
    assert results["stale"].verdict is Verdict.PASSED, results["stale"].message


@pytest.mark.parametrize(
    ("kind", "driver"),
    [
        (Arm, SimArm),
        (ForceSensor, SimForceSensor),
        (DisplacementSensor, SimDisplacementSensor),
    ],
)
def test_real_time_devices_keep_the_contract(
    kind: type[Device], driver: Callable[..., Device]
) -> None:
    results = run_contract(kind, driver, {"world": f"contract {kind.__name__}"})
    assert not {r.name: r.message for r in results if r.verdict is Verdict.FAILED}
