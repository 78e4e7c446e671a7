"""Opens the devices of a plan, or the simulated rig in their place, and closes what it opened."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import cast

from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.safing import Action, make_safe
from stepload.errors import DeviceError
from stepload.feasibility.aligning import SIX_AXES_REMEDY
from stepload.feasibility.preflight import Preflight
from stepload.plan.model import DeviceSpec, Plan, SecondForceSource
from stepload.rig.clock import Clock, MonotonicClock
from stepload.rig.device import (
    Arm,
    ArmConfiguration,
    Device,
    DisplacementSensor,
    ForceSensor,
    Identity,
)
from stepload.rig.faults import FaultCode
from stepload.rig.plugins import load_driver
from stepload.rig.world import WorldView, load_world

OPEN_TIMEOUT_S = 15.0
CLOSE_DEADLINE_S = 10.0
RATE_TOLERANCE = 0.05
_log = logging.getLogger(__name__)


@dataclass(slots=True)
class OpenRig:
    """Open devices with their identities; `world` exists in a dry run only.

    `stands` is the arm's configuration after opening, None where it reports none. `close_errors` is
    filled when the devices are closed: it names those that failed to close.
    """

    arm: Arm
    force: ForceSensor
    displacement: DisplacementSensor | None
    second_force: ForceSensor | None
    clock: Clock
    identities: Mapping[str, Identity]
    rates_hz: Mapping[str, float]
    world: WorldView | None
    close_errors: list[str] = field(default_factory=list)
    stands: ArmConfiguration | None = None


def _made(group: str, spec: DeviceSpec) -> Device:
    return load_driver(group, spec.driver)(**spec.options)


def _devices(plan: Plan) -> tuple[Arm, ForceSensor, DisplacementSensor | None, ForceSensor | None]:
    rig = plan.rig
    gauge = rig.displacement and _made("stepload.displacement_sensors", rig.displacement)
    second = None
    if rig.second_force.source is SecondForceSource.SENSOR and rig.second_force.sensor:
        second = _made("stepload.force_sensors", rig.second_force.sensor)
    return (
        cast(Arm, _made("stepload.arms", rig.arm)),
        cast(ForceSensor, _made("stepload.force_sensors", rig.force)),
        cast(DisplacementSensor | None, gauge),
        cast(ForceSensor | None, second),
    )


def _close(role: str, device: Device, errors: list[str]) -> None:
    """Close a device with a deadline: one that hangs must not block finishing the record."""
    closing = Action(f"closing the {role.replace('_', ' ')}", device.close, CLOSE_DEADLINE_S)
    failed = [f"{o.name}: {o.error}" for o in make_safe([closing], Operator()) if o.error]
    _log.info("%s closed%s", role, "".join(f"; {each}" for each in failed))
    errors += failed


def _check_rates(plan: Plan, arm: Arm, force: ForceSensor, second: ForceSensor | None) -> None:
    """Refuse devices at other rates than planned: every delay and filter is derived from them.

    Sensors may be faster than planned, the arm may not.
    """
    rig = plan.rig
    rows = [
        ("arm", rig.arm.rate_hz, 1.0 / arm.period_s, 1.0 + RATE_TOLERANCE),
        ("force", rig.force.rate_hz, force.rate_hz, math.inf),
    ]
    if second is not None and rig.second_force.sensor is not None:
        planned_hz = rig.second_force.sensor.rate_hz
        rows.append(("second_force.sensor", planned_hz, second.rate_hz, math.inf))
    for name, planned_hz, actual_hz, highest in rows:
        if not 1.0 - RATE_TOLERANCE <= actual_hz / planned_hz <= highest:
            raise DeviceError(
                f"rig.{name} runs at {actual_hz:.4g} Hz, the plan says {planned_hz:.4g} Hz",
                code=FaultCode.WRONG_DEVICE,
                hint=f"state the true rate in rig.{name}.rate, or set the driver's own rate option",
            )


def _check_held(arm: Arm) -> None:
    """Refuse an arm that does not report where it is held: a command to stay might move it."""
    if math.isfinite(arm.held_m()):
        return
    raise DeviceError(
        "the arm does not tell where its controller holds it: where its measured position is off, a"
        " first command to stay there would move it, and nothing could stop that in time",
        code=FaultCode.UNSUPPORTED,
        hint="let the driver tell it (Arm.held_m)",
    )


def _check_shift(plan: Plan, arm: Arm, *, dry_run: bool) -> None:
    """Refuse an arm that cannot move across its approach where the plan needs that."""
    if plan.procedure.alignment is None or arm.can_shift:
        return
    raise DeviceError(
        "procedure.alignment needs an arm that can go across its approach, and this one cannot",
        code=FaultCode.REFUSED_COMMAND,
        hint=SIX_AXES_REMEDY if dry_run else "leave it out, and align by hand",
    )


@contextmanager
def opened(preflight: Preflight, *, dry_run: bool, seed: int | None = None) -> Iterator[OpenRig]:
    """The open rig of a plan; sensors open before the arm and close after it.

    Raises:
        DeviceError: a device did not open, or has another rate than planned; those already open
            were closed again.
    """
    plan = preflight.plan
    world: WorldView | None = None
    clock: Clock = MonotonicClock()
    if dry_run:
        told = plan.rig.simulation
        simulated = load_world(told.world)(world_for(preflight, seed=seed), **told.world_options)
        arm, force = simulated.arm, simulated.force
        gauge, second = simulated.displacement, simulated.second_force
        clock, world = simulated.clock, simulated.world
    else:
        plan.refuse_missing()
        arm, force, gauge, second = _devices(plan)
    roles: dict[str, Device | None] = {
        "force_sensor": force, "second_force_sensor": second, "displacement_sensor": gauge,
        "arm": arm,
    }  # fmt: skip
    identities = {}
    errors: list[str] = []
    with ExitStack() as stack:
        for role, device in roles.items():
            if device is not None:
                stack.callback(_close, role, device, errors)
                _log.info("opening the %s: %s", role, type(device).__name__)
                identities[role] = identity = device.open(OPEN_TIMEOUT_S)
                _log.info("%s open: %s", role, identity)
        _check_rates(plan, arm, force, second)
        _check_shift(plan, arm, dry_run=dry_run)
        _check_held(arm)
        rates_hz = {
            "force": force.rate_hz, "arm": 1.0 / arm.period_s, "tick": 1.0 / arm.period_s,
        }  # fmt: skip
        if second is not None:
            rates_hz["second_force"] = second.rate_hz
        if gauge is not None:
            rates_hz["displacement"] = gauge.rate_hz
        yield OpenRig(
            arm, force, gauge, second, clock, identities, rates_hz, world, errors,
            arm.configuration(),
        )  # fmt: skip
