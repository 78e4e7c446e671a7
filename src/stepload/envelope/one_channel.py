"""Two force channels that are one and the same sensor, and so can only agree."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import cast

from stepload.declaration.sections import keys, schema_of
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import DeviceSpec, Plan, SecondForceSource
from stepload.rig.device import ForceSensor
from stepload.rig.plugins import load_driver

GROUP = "stepload.force_sensors"


@cache
def _driver(name: str) -> type[ForceSensor]:
    return cast(type[ForceSensor], load_driver(GROUP, name))


def one_channel_reasons(plan: Plan) -> Iterator[Reason]:
    """Refusals where both force channels read the same sensor.

    Raises:
        BadInputError: a driver of the plan is not installed.
    """
    first, second = plan.rig.force, plan.rig.second_force
    remedy = "second_force.source: none, or a second force sensor"
    if second.source is SecondForceSource.ARM and _driver(first.driver).built_into_arm:
        yield Reason(
            "channels_are_one", Severity.REFUSE,
            f"force.driver {first.driver} and second_force.source: arm read the same sensor.",
            remedy, key="rig.second_force",
        )  # fmt: skip
    if second.sensor is not None and same_device(first, second.sensor):
        yield Reason(
            "channels_are_one", Severity.REFUSE,
            f"force and second_force.sensor are one device, {first.driver} at {_address(first)}.",
            remedy, key="rig.second_force",
        )  # fmt: skip


def same_device(first: DeviceSpec, second: DeviceSpec) -> bool:
    """Whether both name one device; other axes, rates or scales of it do not make it a second."""
    return (
        first.driver == second.driver
        and bool(_address(first))
        and (_address(first) == _address(second))
    )


def _address(choice: DeviceSpec) -> str:
    """A device's address: the options in the driver's `ADDRESS`, or its required texts."""
    driver = _driver(choice.driver)
    names = driver.ADDRESS or tuple(
        key.name
        for key in keys(driver.OPTIONS)
        if key.required and key.is_text and "enum" not in schema_of(key.hint)
    )
    return ", ".join(f"{name} {choice.options.get(name)}" for name in names)
