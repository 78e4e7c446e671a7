"""What all steps of a set-up share: the devices opened for one step and read at rest, and more."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from stepload.errors import DeviceError
from stepload.feasibility.preflight import Preflight
from stepload.identification.fit import FloatArray
from stepload.plan.driver_options import read_options
from stepload.plan.hazards import HAZARDS, PAGE
from stepload.plan.problems import PlanError
from stepload.plan.source import Source
from stepload.plan.tree import Place, parse_tree
from stepload.record.outcome import RunOutcome
from stepload.rig.clock import Clock, MonotonicClock
from stepload.rig.device import Arm, Device, ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.plugins import load_driver
from stepload.rig.samples import ArmSample, ForceSample
from stepload.setup.answers import Answers
from stepload.setup.state import State
from stepload.setup.yaml_keys import Value, below, quoted, written

ARMS, SENSORS = "stepload.arms", "stepload.force_sensors"
OPEN_S, SAFE_S = 15.0, 3.0
ARM, FORCE, SECOND = "second_force", "force", "second_force.sensor"
"""Keys of a rig: the arm's own force channel, the sensor, and one that checks it."""


@dataclass(frozen=True, slots=True)
class Bench:
    """Open devices; `sensors` by their key in the rig, with what each device says it is."""

    arm: Arm
    sensors: Mapping[str, ForceSensor]
    clock: Clock
    identities: Mapping[str, Identity]


Opener = Callable[[Mapping[str, Value], bool], AbstractContextManager[Bench]]
"""Opens what the values of a rig name: the arm, and with True its sensors too."""


class Received(NamedTuple):
    """All samples of a period of time, by device."""

    arm: list[ArmSample]
    force: dict[str, list[ForceSample]]

    def forces_n(self, name: str) -> FloatArray:
        """Forces (N, 3) of a sensor, or (N, 1) of the arm's own channel, `ARM`.

        Raises:
            DeviceError: there are none, or the sensor itself calls one of them bad.
        """
        samples = self.arm if name == ARM else self.force[name]
        if len(samples) < 3:
            what = "arm" if name == ARM else name
            raise DeviceError(
                f"rig.{what}: no data come in", code=FaultCode.STALE, hint="power and cable?"
            )
        if name == ARM:
            return np.array([[sample.force_n] for sample in self.arm])
        refuse_flagged(name, self.force[name])
        return np.array([sample.wrench[:3] for sample in self.force[name]])


def refuse_flagged(name: str, samples: Sequence[ForceSample]) -> None:
    """Refuse readings of a sensor that it flags.

    Raises:
        DeviceError: the sensor itself calls one of them bad.
    """
    if any(sample.status for sample in samples):
        raise DeviceError(
            f"rig.{name}: the sensor itself calls its readings bad (status bits"
            f" {max(sample.status for sample in samples)})",
            code=FaultCode.DEVICE_REPORTS, hint="is it overloaded? docs/devices has its page",
        )  # fmt: skip


def listen(bench: Bench, seconds: float) -> Received:
    """What arrives in so many seconds while nothing is commanded.

    Raises:
        DeviceError: a device has a fault.
    """
    received = Received([], {name: [] for name in bench.sensors})
    clock = bench.clock
    bench.arm.drain()
    for sensor in bench.sensors.values():
        sensor.drain()
    end_s = clock.now_s() + seconds
    while clock.now_s() < end_s:
        clock.sleep_until(clock.now_s() + bench.arm.period_s)
        received.arm.extend(bench.arm.drain())
        for name, sensor in bench.sensors.items():
            received.force[name].extend(sensor.drain())
    refuse_faults(bench)
    return received


def refuse_faults(bench: Bench) -> None:
    """Raise the first fault that a device has.

    Raises:
        DeviceError: it has one.
    """
    for device in (bench.arm, *bench.sensors.values()):
        if (fault := device.fault()) is not None:
            raise fault.error()


def options_of(group: str, driver: str, values: Mapping[str, Value]) -> dict[str, object]:
    """Options of a driver in SI, from the texts of a rig file.

    Raises:
        PlanError: every option that the driver does not take as given.
    """
    text = written({key: Value(value.text, "") for key, value in values.items()}) if values else ""
    source = Source(f"options of {driver}", None, text, text.encode())
    at = Place(source, 1, 1)
    root, problems = parse_tree(source) if text else (None, [])
    options = read_options(group, driver, at, root, problems)
    if problems:
        raise PlanError(tuple(problems))
    return options


def _made(group: str, key: str, values: Mapping[str, Value]) -> Device:
    driver = values[f"{key}.driver"].text
    options = options_of(group, driver, below(values, f"{key}.options"))
    return load_driver(group, driver)(**options)


@contextmanager
def opened(values: Mapping[str, Value], with_sensors: bool) -> Iterator[Bench]:
    """Open the devices that `values` name; the arm is told to stop and all are closed at the end.

    Raises:
        DeviceError: one did not open; those already open were closed again.
    """
    sensors = {
        key: cast(ForceSensor, _made(SENSORS, key, values))
        for key in (FORCE, SECOND)
        if with_sensors and f"{key}.driver" in values
    }
    arm = cast(Arm, _made(ARMS, "arm", values))
    identities: dict[str, Identity] = {}
    with ExitStack() as stack:
        for key, device in (*sensors.items(), ("arm", arm)):
            stack.callback(device.close)
            identities[key] = device.open(OPEN_S)
        stack.callback(_stop, arm)
        yield Bench(arm, sensors, MonotonicClock(), identities)


def _stop(arm: Arm) -> None:
    with suppress(DeviceError):
        arm.safe(SAFE_S)


Press = Callable[[Preflight, Path], RunOutcome]
"""Presses a plan with its devices and keeps everything in a directory."""


@dataclass(frozen=True, slots=True)
class Setup:
    """The set-up of one rig file.

    Args:
        rig: path of the rig file.
        state: what earlier steps have found.
        opened: opens the devices that the rig's values name.
        press: presses the plan of the first touch.
        today: the day that measurements are dated with.
    """

    rig: Path
    state: State
    answers: Answers
    opened: Opener
    press: Press
    today: date

    def tell(self, line: str) -> None:
        """Show a line to the person who sets up."""
        self.answers.person.tell(line)

    @property
    def you(self) -> str:
        """The origin text of values that were answered."""
        return f"stated at the set-up, {self.today}"

    @property
    def measured(self) -> str:
        """The origin text of values that were measured now."""
        return f"measured {self.today}"

    def stated(self, name: str) -> Value:
        """A text that was answered, as a value of the rig file."""
        return Value(quoted(self.answers.text(name)), self.you)

    @property
    def plan(self) -> Path:
        """Where the plan of the first payload is written: beside the rig file."""
        return self.rig.parent / self.answers.text("plan")


def say_hazards(setup: Setup, before: str) -> None:
    """Say what a person must know before a hand comes near the arm, or before it moves."""
    setup.tell(before)
    for hazard in HAZARDS:
        setup.tell(f"  - {hazard}")
    setup.tell(f"more, with what to do about each: {PAGE}")
