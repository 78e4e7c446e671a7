"""The device contract on the UR arm, real ur_rtde and emulated controller included."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from stepload.rig.contract import CHECKS, SkippedCheck, Trial, trial_of
from stepload_drivers.ur.arm import UrArm
from stepload_verify.emulators.ur_process import UrEmulatorProcess


@pytest.fixture
def trial() -> Iterator[Trial]:
    pid = os.getpid()
    with UrEmulatorProcess(f"127.{32 + pid % 32}.{pid // 32 % 256}.9") as emulator:
        options = {"host": emulator.host, "max_age": 0.3, "leash": 2.0, "watchdog": 5.0}
        yield Trial(
            *trial_of(UrArm, options),
            open_timeout_s=10.0,
            silence=lambda: emulator.command("freeze on"),
            restore=lambda: emulator.command("freeze off"),
            stale_s=0.8,
            move_m=0.002,
            speed_m_s=0.01,
        )


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_ur_arm_keeps_the_contract(trial: Trial, check) -> None:
    try:
        check(trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))
