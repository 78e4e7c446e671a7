"""A short plan that runs as a whole, in real time, on an emulated rig of its own."""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from stepload.engine.rehearse import world_for
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, SecondForce
from stepload_verify.emulators.rig_process import RigProcess

sys.path.insert(0, str(Path(__file__).parent))  # for fault_table

DEMO = Path(__file__).parents[3] / "procedures" / "demo-wire.yaml"
RATES_HZ = {"ati_can": 500.0, "line_serial": 100.0, "ur_force": 500.0}
_COUNT = itertools.count()


def _host() -> str:
    pid = os.getpid()
    return f"127.{128 + pid % 64}.{pid // 64 % 256}.{1 + next(_COUNT) % 254}"


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """With the long runs, a table of what each fault came to."""
    if config.getoption("markexpr") == "not long":
        return
    for outcome in ("passed", "failed"):
        for report in terminalreporter.getreports(outcome):
            for text in (value for name, value in report.user_properties if name == "outcome"):
                words = report.nodeid.partition("[")[2].rstrip("]")
                terminalreporter.write_line(f"{report.duration:5.1f} s  {words}: {text}")


@pytest.fixture
def free_host() -> str:
    """A loopback address that no other test process uses."""
    return _host()


@dataclass
class EmulatedRun:
    """A plan, and the emulated rig that its addresses lead to."""

    plan: Plan
    rig: RigProcess


@pytest.fixture
def emulated_run() -> Iterator[Callable[..., EmulatedRun]]:
    """`emulated_run(sensor="robotous_can", world={...}, faults=[...], top_force_n=5.0)`."""
    started: list[RigProcess] = []

    def start(
        *,
        sensor: str = "bota_serial",
        world: dict[str, Any] | None = None,
        faults: tuple[str, ...] = (),
        transport: str = "slcan",
        version: str = "5.12",
        arm_rate_hz: float = 500.0,
        elastic_limit_n: float = 100.0,
        **procedure: Any,
    ) -> EmulatedRun:
        plan = load_plan(DEMO)
        quick = {
            "tare_s": 0.25, "warm_up_s": 0.0, "touches": 1, "hold_s": 0.2, "unload": False,
            "surface_distance_m": 3e-5, "surface_uncertainty_m": 2e-5, "retract_m": 3e-4,
            "levels_n": (10.0, 20.0), "top_force_n": 20.0, "load_rate_n_per_s": 30.0,
            "touch_force_n": 1.0,
        }  # fmt: skip
        arm = replace(plan.rig.arm, rate_hz=arm_rate_hz)
        force = replace(plan.rig.force, rate_hz=RATES_HZ.get(sensor, plan.rig.force.rate_hz))
        plan = replace(
            plan,
            payload=replace(plan.payload, declared_force_limit_n=elastic_limit_n),
            procedure=replace(plan.procedure, **{**quick, **procedure}),
            identify=replace(plan.identify, accept_unidentifiable="short steps"),
            rig=replace(plan.rig, arm=arm, force=force),
        )
        surface_m = plan.procedure.surface_distance_m
        spec = replace(world_for(preflight_of(plan)), **{"surface_m": surface_m, **(world or {})})
        if own := sensor == "ur_force":  # in the base frame the plate pushes upwards
            force = replace(force, axis="+fz")
            spec = replace(spec, arm_force_noise_n=force.noise_n)
        rig = RigProcess(
            spec,
            ur=_host(),
            sensors=() if own else (sensor,),
            faults=faults,
            transport=transport,
            version=version,
        )
        started.append(rig)
        ur = {**arm.options, **rig.options["ur"], "prove_watchdog": False}
        address = rig.options["ur"] if own else rig.options[sensor]
        read = {**address, "max_age": force.options["max_age"]}
        return EmulatedRun(
            replace(
                plan,
                rig=replace(
                    plan.rig,
                    arm=replace(arm, driver="ur", options=ur),
                    force=replace(force, driver=sensor, options=read),
                    second_force=SecondForce() if own else plan.rig.second_force,
                ),
            ),
            rig,
        )

    yield start
    for rig in started:
        rig.close()
