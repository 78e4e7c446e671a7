"""The device contract on the UR arm, real ur_rtde and emulated controller included."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from clock_checks import CONTRACT
from long_ones import long

from stepload.rig.contract import SkippedCheck, Trial, trial_of
from stepload.rig.contract_life import check_lost_link, check_stale
from stepload_drivers.ur.arm import UrArm
from stepload_drivers.ur.force import UrForce
from stepload_verify.emulators.rig_process import UrEmulatorProcess

SLOW = {"lag_s": 0.1, "surface_m": 1.0}
"""A servo with the look-ahead time of the driver: a late `safe` still meets it under way."""


@contextmanager
def serving(number: int) -> Iterator[UrEmulatorProcess]:
    pid = os.getpid()
    host = f"127.{32 + pid % 32}.{pid // 32 % 256}.{number}"
    with UrEmulatorProcess(host, world=SLOW) as emulator:
        yield emulator


@pytest.fixture(scope="module")
def shared() -> Iterator[UrEmulatorProcess]:
    """One controller for all checks that leave it as it was; each of them opens the arm anew."""
    with serving(9) as emulator:
        yield emulator


@pytest.fixture
def own() -> Iterator[UrEmulatorProcess]:
    with serving(10) as emulator:
        yield emulator


def arm_trial(emulator: UrEmulatorProcess) -> Trial:
    options = {"host": emulator.host, "max_age": 0.3, "command_timeout": 2.0, "watchdog": 5.0}
    return Trial(
        *trial_of(UrArm, options),
        open_timeout_s=10.0,
        silence=lambda: emulator.command("freeze on"),
        restore=lambda: emulator.command("freeze off"),
        stale_s=0.8,
        move_m=0.001,
    )


def force_trial(emulator: UrEmulatorProcess) -> Trial:
    return Trial(
        *trial_of(UrForce, {"host": emulator.host}),
        observe_s=0.2,
        silence=lambda: emulator.command("freeze on"),
        restore=lambda: emulator.command("freeze off"),
        stale_s=0.4,
    )


SILENCES = (check_stale, check_lost_link)
"""Checks after which a controller may stay silent."""


ACROSS = "check_shift"
"""The arm goes across its approach in tests/wire/ur too, which takes half the time."""


@pytest.fixture
def emulator(shared: UrEmulatorProcess, request: pytest.FixtureRequest) -> UrEmulatorProcess:
    """What the check of this test may have."""
    silences = request.getfixturevalue("check") in SILENCES
    found: UrEmulatorProcess = request.getfixturevalue("own") if silences else shared
    return found


def keeps(trial: Trial, check) -> None:
    try:
        check(trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))


@pytest.mark.parametrize(
    "check",
    [
        pytest.param(*each.values, marks=[*each.marks, pytest.mark.long], id=each.id)
        if each.id == ACROSS
        else each
        for each in CONTRACT
    ],
)
def test_ur_arm_keeps_the_contract(emulator, check) -> None:
    keeps(arm_trial(emulator), check)


@pytest.mark.parametrize("check", [check_lost_link, *long([check_stale])])
def test_ur_arm_whose_controller_is_gone_keeps_the_contract(own, check) -> None:
    check(replace(arm_trial(own), silence=lambda: own.command("refuse on")))


@pytest.mark.parametrize("check", CONTRACT)
def test_the_sensor_in_its_flange_keeps_the_contract(emulator, check) -> None:
    keeps(force_trial(emulator), check)
