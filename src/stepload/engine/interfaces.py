"""Protocols of what a run needs: the open devices of a rig, and the sink of its record."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

from stepload.record.rows import TickRow
from stepload.rig.clock import Clock
from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample


class RecordSink(Protocol):
    """Where the loop writes samples, ticks and events; nothing here may block."""

    force: Callable[[ForceSample], None]
    second_force: Callable[[ForceSample], None]
    arm: Callable[[ArmSample], None]
    displacement: Callable[[DisplacementSample], None]
    tick: Callable[[TickRow], None]

    def event(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        """Record an event."""
        ...

    def problem(self) -> str:
        """Why recording does not work any more; "" while it does."""
        ...


class RigDevices(Protocol):
    """The open devices of a rig; `stepload.rig.world.SimulatedRig` is one."""

    arm: Arm
    force: ForceSensor
    displacement: DisplacementSensor | None
    second_force: ForceSensor | None
    clock: Clock


def by_role(rig: RigDevices) -> list[tuple[str, Device]]:
    """The devices that the rig has, each with its role; the arm comes first."""
    roles: list[tuple[str, Device | None]] = [
        ("arm", rig.arm),
        ("force sensor", rig.force),
        ("second force sensor", rig.second_force),
        ("displacement sensor", rig.displacement),
    ]
    return [(role, device) for role, device in roles if device is not None]
