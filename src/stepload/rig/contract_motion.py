"""Checks of an arm that really moves; none does unless the trial allows it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from stepload.errors import SteploadError
from stepload.rig.contract_trial import (
    ContractViolation,
    SkippedCheck,
    Stopwatch,
    Trial,
    idle,
    opened,
    require,
)
from stepload.rig.device import Arm
from stepload.rig.samples import ArmSample

ARRIVE_S = 1.0
HOLD_S = 0.5
HELD_S = 0.2
"""Largest age in s of the position that an arm reports to be held at."""
NEAR_SHARE = 0.2
FASTEST = 1.5
STOP_TRIES = 3
STOP_SHARE = 0.5
"""The stop is tried on a step back of this share of the allowed move."""


@contextmanager
def moving_arm(trial: Trial) -> Iterator[Arm]:
    """An open arm that may move; it is made safe if a check fails."""
    if not isinstance(trial.make(), Arm):
        raise SkippedCheck("only arms move")
    if trial.move_m == 0.0:
        raise SkippedCheck("moving was not allowed: NOT checked (--move)")
    with opened(trial) as device:
        assert isinstance(device, Arm)
        try:
            yield device
        except Exception:
            with suppress(SteploadError):
                device.safe(trial.open_timeout_s)
            raise


def check_motion(trial: Trial) -> None:
    """An arm reports where it is held, goes to its target, holds it, and retracts."""
    with moving_arm(trial) as arm:
        start_m = _position(arm, trial)
        _require_near("held at rest", arm.held_m(), start_m, trial)
        quarter_m = start_m + 0.25 * trial.move_m
        _ramp(arm, start_m, quarter_m, trial)
        _require_followed(start_m, quarter_m, _position(arm, trial))
        target_m = start_m + trial.move_m
        _ramp(arm, quarter_m, target_m, trial)
        reached_m = _position(arm, trial)
        _require_near("target", reached_m, target_m, trial)
        _require_near("held at the target", _held(arm, trial), target_m, trial)
        idle(arm, trial, HOLD_S)
        _require_near("position held", _position(arm, trial), reached_m, trial)
        watch = Stopwatch(trial)
        arm.retract(trial.move_m, trial.speed_m_s, trial.open_timeout_s)
        speed_m_s = trial.move_m / watch.seconds
        _require_near("retracted", _position(arm, trial), reached_m - trial.move_m, trial)
        require(
            speed_m_s < FASTEST * trial.speed_m_s,
            f"retract() at {trial.speed_m_s * 1e3:g} mm/s went at {speed_m_s * 1e3:.1f} mm/s",
        )
        arm.safe(trial.open_timeout_s)


def _ramp(arm: Arm, from_m: float, to_m: float, trial: Trial) -> None:
    """Command a ramp at the trial's speed, then repeat the last target until the arm is there."""
    step_m = trial.speed_m_s * arm.period_s
    target_m = from_m
    while target_m < to_m:
        target_m = min(target_m + step_m, to_m)
        arm.command(target_m)
        trial.wait(arm.period_s)
    position_m = math.nan
    for _ in range(round(ARRIVE_S / arm.period_s)):
        arm.command(target_m)
        trial.wait(arm.period_s)
        for sample in arm.drain():
            position_m = sample.position_m
        if abs(position_m - to_m) < 0.1 * NEAR_SHARE * trial.move_m:
            return


def _require_followed(start_m: float, target_m: float, position_m: float) -> None:
    """The first short move shows whether the position is live, and which direction is forwards."""
    asked_m, moved_m = target_m - start_m, position_m - start_m
    moved = f"{moved_m * 1e3:.4f} mm for a command of {asked_m * 1e3:+.4f} mm"
    require(
        abs(moved_m) > NEAR_SHARE * asked_m,
        f"the measured position is frozen, or the arm does not follow: {moved}",
    )
    require(moved_m > 0.0, f"the measured position has the wrong sign: {moved}")


def _require_near(what: str, position_m: float, expected_m: float, trial: Trial) -> None:
    require(
        abs(position_m - expected_m) < NEAR_SHARE * trial.move_m,
        f"{what}: {position_m * 1e3:.4f} mm, expected {expected_m * 1e3:.4f} mm",
    )


def _held(arm: Arm, trial: Trial) -> float:
    """Where the arm reports that it is held, after a wait that makes the report recent."""
    idle(arm, trial, HELD_S)
    return arm.held_m()


def _position(device: Arm, trial: Trial) -> float:
    return newest(device, trial).position_m


def newest(device: Arm, trial: Trial) -> ArmSample:
    """The newest sample after a wait for one.

    Raises:
        ContractViolation: none comes.
    """
    device.drain()
    for _ in range(200):
        trial.wait(device.period_s)
        if samples := device.drain():
            return samples[-1]
    fault = device.fault()
    why = f": {fault.code}: {fault.message}" if fault else ""
    raise ContractViolation(f"an open arm delivers no samples{why}")


def check_stop(trial: Trial) -> str:
    """`safe` stops an arm that moves: it does not go on to the target that it had.

    The arm is sent back, away from the plate, in one step. A host that stalls may let it arrive
    before `safe` is called; a stop that does nothing lets it arrive every time.
    """
    for _ in range(STOP_TRIES):
        with moving_arm(trial) as arm:
            step_m = STOP_SHARE * trial.move_m
            start_m = _position(arm, trial)
            arm.command(start_m - step_m)
            idle(arm, trial, 2.0 * arm.period_s)
            arm.safe(trial.open_timeout_s)
            stopped_m = _position(arm, trial)
            idle(arm, trial, HOLD_S)
            rest_m = _position(arm, trial)
        went_m, after_m = start_m - rest_m, abs(rest_m - stopped_m)
        if went_m < 0.9 * step_m and after_m < 0.1 * step_m:
            return f"stopped after {went_m * 1e3:.3f} of {step_m * 1e3:.3f} mm"
    raise ContractViolation(
        f"safe() does not stop the arm: sent {step_m * 1e3:.3f} mm back and made safe under way it "
        f"went {went_m * 1e3:.3f} mm, {after_m * 1e3:.3f} mm of it after safe() had returned"
    )


def check_targets(trial: Trial) -> None:
    """A target that is not finite is refused, and so is a retract that would go forwards."""
    with moving_arm(trial) as arm:
        start_m = _position(arm, trial)
        for target in (math.nan, math.inf, -math.inf):
            refused(f"command({target})", arm.command, target)
        for distance in (-trial.move_m, math.nan):
            refused(f"retract({distance:g} m)", arm.retract, distance, trial.speed_m_s, ARRIVE_S)
        idle(arm, trial, HOLD_S)
        _require_near("after refused targets", _position(arm, trial), start_m, trial)


def refused(what: str, call: Callable[..., None], *arguments: object) -> None:
    try:
        call(*arguments)
    except SteploadError:
        return
    raise ContractViolation(f"{what} was accepted: a broken number must never reach the arm")
