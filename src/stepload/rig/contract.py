"""The contract of `stepload.rig.device` as checks, for every driver, a lab's own included.

`run_contract` runs all checks that fit the kind of device; none of them needs pytest. Each check
opens the device anew and leaves it closed. Nothing moves an arm unless `Trial.move_m` says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from stepload.rig.contract_life import (
    check_close,
    check_failing_open,
    check_open,
    check_options,
    check_reopen,
    check_safe,
    check_unopened,
)
from stepload.rig.contract_loss import check_lost_link, check_stale
from stepload.rig.contract_motion import check_motion, check_stop, check_targets
from stepload.rig.contract_samples import check_drain, check_samples, check_stamps
from stepload.rig.contract_shift import check_shift
from stepload.rig.contract_standstill import check_rest
from stepload.rig.contract_trial import ContractViolation, SkippedCheck, Trial
from stepload.rig.contract_values import check_bias, check_frozen, check_load
from stepload.rig.device import Device

__all__ = [
    "CHECKS",
    "Check",
    "CheckResult",
    "CheckStatus",
    "ContractViolation",
    "SkippedCheck",
    "Trial",
    "run_check",
    "run_contract",
    "run_trial",
    "trial_of",
]

Check = Callable[[Trial], str | None]


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
    check_unopened,
    check_options,
    check_open,
    check_samples,
    check_stamps,
    check_drain,
    check_frozen,
    check_safe,
    check_close,
    check_reopen,
    check_failing_open,
    check_rest,
    check_load,
    check_bias,
    check_targets,
    check_motion,
    check_shift,
    check_stop,
    check_stale,
    check_lost_link,
)
"""In this order; those that silence the device are last, because it may stay so."""


def check_name(check: Check) -> str:
    """The name of a check as results give it."""
    return check.__name__.removeprefix("check_")


def run_check(check: Check, trial: Trial) -> CheckResult:
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
    return CheckResult(check_name(check), status, message, time.monotonic() - started_s)


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
