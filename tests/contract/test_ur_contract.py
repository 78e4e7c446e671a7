"""The device contract on the UR arm, real ur_rtde and emulated controller included."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace

import pytest
from clock_checks import CONTRACT

from stepload.rig.contract import SkippedCheck, Trial, trial_of
from stepload.rig.contract_loss import check_lost_link, check_stale
from stepload_drivers.ur.arm import UrArm
from stepload_drivers.ur.force import UrForce
from stepload_verify.emulators.ur_process import UrEmulatorProcess

SLOW = {"lag_s": 0.1, "surface_m": 1.0}
"""A servo with the look-ahead time of the driver: a late `safe` still meets it under way."""


@pytest.fixture
def emulator() -> Iterator[UrEmulatorProcess]:
    pid = os.getpid()
    with UrEmulatorProcess(f"127.{32 + pid % 32}.{pid // 32 % 256}.9", world=SLOW) as emulator:
        yield emulator


@pytest.fixture
def trial(emulator) -> Trial:
    options = {"host": emulator.host, "max_age": 0.3, "leash": 2.0, "watchdog": 5.0}
    return Trial(
        *trial_of(UrArm, options),
        open_timeout_s=10.0,
        silence=lambda: emulator.command("freeze on"),
        restore=lambda: emulator.command("freeze off"),
        stale_s=0.8,
        move_m=0.002,
    )


@pytest.mark.parametrize("check", CONTRACT)
def test_ur_arm_keeps_the_contract(trial: Trial, check) -> None:
    try:
        check(trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))


@pytest.mark.parametrize("check", [check_stale, check_lost_link])
def test_ur_arm_whose_controller_is_gone_keeps_the_contract(emulator, trial, check) -> None:
    check(replace(trial, silence=lambda: emulator.command("refuse on")))


@pytest.fixture
def force_trial(emulator) -> Trial:
    return Trial(
        *trial_of(UrForce, {"host": emulator.host}),
        observe_s=0.2,
        silence=lambda: emulator.command("freeze on"),
        restore=lambda: emulator.command("freeze off"),
        stale_s=0.4,
    )


@pytest.mark.parametrize("check", CONTRACT)
def test_the_sensor_in_its_flange_keeps_the_contract(force_trial: Trial, check) -> None:
    try:
        check(force_trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))
