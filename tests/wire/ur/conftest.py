"""A UR emulator of its own for each test, and the real driver in front of it."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from stepload.errors import DeviceError
from stepload.rig.samples import ArmSample
from stepload_drivers.ur.arm import UrArm
from stepload_verify.emulators.rig_process import UrEmulatorProcess

_COUNT = itertools.count()

PATIENT = {"max_age": 0.3, "command_timeout": 0.3, "watchdog": 5.0, "prove_watchdog": False}
"""Limits that a loaded test machine does not break by itself."""


def new_host() -> str:
    """A loopback address that no other test process uses."""
    pid = os.getpid()
    return f"127.{64 + pid % 64}.{pid // 64 % 256}.{1 + next(_COUNT) % 254}"


@pytest.fixture
def start_emulator() -> Iterator[Callable[..., UrEmulatorProcess]]:
    started: list[UrEmulatorProcess] = []

    def start(**options: Any) -> UrEmulatorProcess:
        started.append(UrEmulatorProcess(new_host(), **options))
        return started[-1]

    yield start
    for emulator in started:
        emulator.close()


@pytest.fixture
def make_arm() -> Iterator[Callable[..., UrArm]]:
    made: list[UrArm] = []

    def make(host: str, **options: Any) -> UrArm:
        made.append(UrArm(host=host, **{**PATIENT, **options}))
        return made[-1]

    yield make
    for arm in made:
        arm.close()


@pytest.fixture
def free_host() -> str:
    return new_host()


@dataclass
class Drive:
    """Targets sent and samples received by `follow`."""

    targets: list[float]
    samples: list[ArmSample]


@pytest.fixture
def follow() -> Callable[..., Drive]:
    """Drive the arm towards the plate in small steps until `done`, as a run would."""

    def drive(arm: UrArm, done: Callable[[], bool], limit_s: float = 10.0) -> Drive:
        driven = Drive([], arm.drain())
        give_up_s = time.monotonic() + limit_s
        while not driven.samples and arm.fault() is None and time.monotonic() < give_up_s:
            time.sleep(0.002)
            driven.samples += arm.drain()
        target_m = driven.samples[-1].position_m if driven.samples else 0.0
        while not done() and time.monotonic() < give_up_s:
            target_m += 4e-6
            try:
                arm.command(target_m)
            except DeviceError:
                if not done():
                    raise
            driven.targets.append(target_m)
            time.sleep(0.004)
            driven.samples += arm.drain()
        return driven

    return drive


@pytest.fixture
def after() -> Callable[[float], Callable[[], bool]]:
    """A condition that becomes true after so many seconds."""

    def start(seconds: float) -> Callable[[], bool]:
        until_s = time.monotonic() + seconds
        return lambda: time.monotonic() > until_s

    return start
