"""The contract of `stepload.rig.device` as checks, for every driver, a lab's own included.

`run_contract` runs all checks that fit the kind of device; none of them needs pytest. Each check
opens the device anew and leaves it closed. Nothing moves an arm unless `Trial.move_m` says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

from stepload.rig import contract_arm as arm
from stepload.rig import contract_life as life
from stepload.rig import contract_samples as samples
from stepload.rig.contract_trial import ContractViolation as ContractViolation
from stepload.rig.contract_trial import SkippedCheck as SkippedCheck
from stepload.rig.contract_trial import Trial as Trial
from stepload.rig.device import Device

Check = Callable[[Trial], str | None]
TriedT = TypeVar("TriedT")


class CheckStatus(StrEnum):
    """How a check ended."""

    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One check: `message` says what was wrong, why it was skipped, or what was seen."""

    name: str
    status: CheckStatus
    message: str
    seconds: float


CHECKS: tuple[Check, ...] = (
    life.check_unopened, life.check_options, life.check_open,
    samples.check_samples, samples.check_stamps, samples.check_drain, samples.check_frozen,
    life.check_safe, life.check_close, life.check_reopen, life.check_failing_open,
    arm.check_rest, samples.check_load, samples.check_bias,
    arm.check_targets, arm.check_motion, arm.check_shift, arm.check_stop,
    life.check_stale, life.check_lost_link,
)  # fmt: skip
"""In this order; those that silence the device are last, because it may stay so."""


def run_check(check: Callable[[TriedT], str | None], trial: TriedT) -> CheckResult:
    """Run one check; whatever it raises becomes its result."""
    started_s = time.monotonic()
    status, message = CheckStatus.PASSED, ""
    try:
        message = check(trial) or ""
    except SkippedCheck as reason:
        status, message = CheckStatus.SKIPPED, str(reason)
    except ContractViolation as violation:
        status, message = CheckStatus.FAILED, str(violation)
    except Exception as error:  # any other exception breaks the contract too
        status, message = CheckStatus.FAILED, f"{type(error).__name__}: {error}"
    name = check.__name__.removeprefix("check_")
    return CheckResult(name, status, message, time.monotonic() - started_s)


def run_trial(trial: Trial) -> list[CheckResult]:
    """Run every check; a failure does not keep the others from running."""
    return [run_check(check, trial) for check in CHECKS]


def trial_of(
    driver: Callable[..., Device], options: Mapping[str, object]
) -> tuple[Callable[[], Device], Callable[[Mapping[str, object]], Device]]:
    """`Trial.make` and `Trial.make_with` for a driver with its options."""
    return lambda: driver(**options), lambda more: driver(**options, **more)


def run_contract(
    kind: type[Device], driver: Callable[..., Device], options: Mapping[str, object]
) -> list[CheckResult]:
    """Run the contract against a driver with its options, in real time, without moving an arm.

    Raises:
        ContractViolation: the driver makes something that is not a `kind`.
    """
    make, make_with = trial_of(driver, options)
    device = make()
    if not isinstance(device, kind):
        raise ContractViolation(f"{type(device).__name__} is no {kind.__name__}")
    return run_trial(Trial(make, make_with))
