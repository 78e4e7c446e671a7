"""A short plan that runs as a whole, in real time, on an emulated rig of its own."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import DriverChoice, Plan
from stepload.rehearse import world_for
from stepload_drivers.emulators.rig_process import RigProcess

DEMO = Path(__file__).parents[3] / "procedures" / "demo-wire.yaml"
_COUNT = itertools.count()


def _host() -> str:
    pid = os.getpid()
    return f"127.{128 + pid % 64}.{pid // 64 % 256}.{1 + next(_COUNT) % 254}"


@dataclass
class EmulatedRun:
    """A plan, and the emulated rig that its addresses lead to."""

    plan: Plan
    rig: RigProcess


@pytest.fixture
def emulated_run() -> Iterator[Callable[..., EmulatedRun]]:
    """`emulated_run(sensor="robotous_can", world={...}, faults=[...], step_n=5.0)`."""
    started: list[RigProcess] = []

    def start(
        *,
        sensor: str = "bota_serial",
        world: dict[str, Any] | None = None,
        faults: tuple[str, ...] = (),
        **procedure: Any,
    ) -> EmulatedRun:
        plan = load_plan(DEMO)
        quick = {
            "tare_s": 0.5, "warm_up_s": 0.0, "touches": 1, "hold_s": 0.3, "unload": False,
            "surface_distance_m": 1e-3, "surface_uncertainty_m": 1e-4, "retract_m": 1e-3,
            "levels_n": (10.0, 20.0), "top_force_n": 20.0,
        }  # fmt: skip
        plan = replace(plan, procedure=replace(plan.procedure, **{**quick, **procedure}))
        spec = replace(world_for(plan), **(world or {}))
        rig = RigProcess(spec, ur=_host(), sensors=(sensor,), faults=faults)
        started.append(rig)
        arm, force = plan.rig.arm, plan.rig.force
        ur = {**arm.driver.options, **rig.options["ur"], "prove_watchdog": False}
        read = {**rig.options[sensor], "max_age": force.driver.options["max_age"]}
        return EmulatedRun(
            replace(
                plan,
                rig=replace(
                    plan.rig,
                    arm=replace(arm, driver=DriverChoice("ur", ur)),
                    force=replace(force, driver=DriverChoice(sensor, read)),
                ),
            ),
            rig,
        )

    yield start
    for rig in started:
        rig.close()
