"""Does the arm stop, and how late does it follow: small, slow motions away from the plate."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from stepload.engine.open_rig import OpenRig
from stepload.errors import DeviceError
from stepload.identification.fit import FloatArray
from stepload.plan.model import ArmSpec, Plan
from stepload.record.lag import Lag, measure_lag
from stepload.rig.samples import ArmSample
from stepload.setup.check_line import CheckLine, Mark, graded, without_number
from stepload.setup.streams import at_rest

WAY_M = 2e-3
SPEED_M_S = 4e-3
SWING_M = 0.5e-3
SWING_S = 1.3
SWINGS = 6
LOOK_S = 0.5
STILL_M = 2e-5
LEAST_SEEN = 6
STOP_TRAVEL_M = 5e-4
STOP_WARN_S, STOP_FAIL_S = 0.5, 2.0
STOP_TIMEOUT_S = 3.0
PROOF_TIMEOUT_S = 10.0
DELAY_FAIL = 1.3


class Driven(NamedTuple):
    """Targets with the times they were sent, and the samples that came back."""

    time_s: FloatArray
    target_m: FloatArray
    samples: list[ArmSample]


def drive(rig: OpenRig, target_at: Callable[[float], float], seconds: float) -> Driven:
    """Follow `target_at` (s since now → m) in the arm's own period, from within `undisturbed`."""
    clock, arm = rig.clock, rig.arm
    times_s, targets_m = [], []
    samples = arm.drain()
    start_s = deadline_s = clock.now_s()
    while deadline_s < start_s + seconds:
        now_s = clock.now_s()
        samples += arm.drain()
        target_m = target_at(now_s - start_s)
        arm.command(target_m)
        times_s.append(now_s)
        targets_m.append(target_m)
        deadline_s = max(deadline_s + arm.period_s, now_s)
        clock.sleep_until(deadline_s)
    return Driven(np.array(times_s), np.array(targets_m), samples + arm.drain())


def position_now(rig: OpenRig) -> float:
    """Where the arm is.

    Raises:
        DeviceError: it does not say.
    """
    for _ in range(500):
        if samples := rig.arm.drain():
            return samples[-1].position_m
        rig.clock.sleep_until(rig.clock.now_s() + rig.arm.period_s)
    if (fault := rig.arm.fault()) is not None:
        raise fault.error()
    raise DeviceError("the arm tells no position", code="stale", hint="check the arm")


def _back_from(start_m: float, way_m: float) -> Callable[[float], float]:
    return lambda time_s: start_m - min(way_m, SPEED_M_S * time_s)


def return_to(rig: OpenRig, start_m: float) -> None:
    """Return slowly to where the examination began: a run measures its travel from there."""
    from_m = position_now(rig)
    way_m = start_m - from_m

    def on_the_way(time_s: float) -> float:
        return from_m + math.copysign(min(abs(way_m), SPEED_M_S * time_s), way_m)

    drive(rig, on_the_way, abs(way_m) / SPEED_M_S + LOOK_S)


def check_held(plan: Plan, rig: OpenRig) -> CheckLine:
    """Whether the arm's controller holds it where it says that it is; nothing moves."""
    off_m = position_now(rig) - rig.arm.held_m()
    return graded(
        "arm: held", abs(off_m), "m", warn=0.5 * plan.rig.arm.model_tolerance_m,
        fail=plan.rig.arm.model_tolerance_m,
        message="between the measured position and where the controller holds the arm",
        remedy="find out which of the two is wrong (encoder, zero, tool centre point)",
    )  # fmt: skip


def check_stop(rig: OpenRig) -> CheckLine:
    """Stop the arm in slow motion away from the plate, and see that it stands."""
    start_m = position_now(rig)
    drive(rig, _back_from(start_m, WAY_M), 0.5 * WAY_M / SPEED_M_S)
    clock = rig.clock
    sent_s = clock.now_s()
    before_m = position_now(rig)
    try:
        rig.arm.safe(STOP_TIMEOUT_S)
    except DeviceError as error:
        return CheckLine("arm: stop", Mark.FAIL, math.nan, STOP_TRAVEL_M, "m",
                    f"not confirmed: {error.message}", "do not run; see the pendant")  # fmt: skip
    took_s = clock.now_s() - sent_s
    seen: list[float] = []
    while clock.now_s() < sent_s + took_s + LOOK_S:
        seen += [sample.position_m for sample in rig.arm.drain()]
        clock.sleep_until(clock.now_s() + rig.arm.period_s)
    if len(seen) < LEAST_SEEN:
        return CheckLine("arm: stop", Mark.FAIL, math.nan, STOP_TRAVEL_M, "m",
                    "too few positions after the stop", "do not run")  # fmt: skip
    late = np.array(seen[len(seen) // 2 :])
    noise_m = at_rest(np.arange(float(len(late))), late).noise
    travel_m = abs(seen[-1] - before_m)
    message = (
        f"stopped at {SPEED_M_S * 1e3:g} mm/s in free air: confirmed after {took_s * 1e3:.0f} ms"
    )
    if late.max() - late.min() > STILL_M + 6.0 * noise_m:
        return CheckLine("arm: stop", Mark.FAIL, travel_m, STOP_TRAVEL_M, "m",
                    f"{message}, and still moving", "do not run")  # fmt: skip
    line = graded(
        "arm: stop", travel_m, "m", warn=STOP_TRAVEL_M, fail=4.0 * STOP_TRAVEL_M,
        message=f"{message}; travelled on", remedy="lower the speeds, or the servo's look-ahead",
    )  # fmt: skip
    if took_s > STOP_FAIL_S or (took_s > STOP_WARN_S and line.mark is Mark.OK):
        mark = Mark.FAIL if took_s > STOP_FAIL_S else Mark.WARN
        return CheckLine("arm: stop", mark, took_s, STOP_WARN_S, "s", message, "check the network")
    return line


def check_watchdog(rig: OpenRig) -> CheckLine:
    """Starve the arm of commands in slow motion away from the plate."""
    name = "arm: watchdog"
    try:
        proof = rig.arm.prove_stop(WAY_M, SPEED_M_S, PROOF_TIMEOUT_S)
    except DeviceError as error:
        return without_number(name, Mark.FAIL, error.message, error.hint, "s")
    if proof is None:
        why = "this driver knows no watchdog in the arm to prove"
        return without_number(name, Mark.SKIPPED, why)
    return graded(
        name, proof.still_s, "s", warn=1.5, fail=3.0,
        message=f"left without commands it ended its program after {proof.stop_s * 1e3:.0f} ms and "
        f"stood after {proof.still_s * 1e3:.0f} ms, {proof.travel_m * 1e3:.2f} mm further",
        remedy="raise the driver's watchdog rate",
    )  # fmt: skip


def backlash_s(arm: ArmSpec) -> float:
    """Delay in s that lost motion adds to the response to swings: it is crossed at each turn."""
    return arm.lost_motion_m / (2.0 * SWING_M / SWING_S)


def response_lag(rig: OpenRig) -> Lag:
    """Lag from a target to the measured position as the engine sees it, by slow swings."""
    start_m = position_now(rig)

    def swing(time_s: float) -> float:
        return start_m - SWING_M * 0.5 * (1.0 - math.cos(2.0 * math.pi * time_s / SWING_S))

    driven = drive(rig, swing, SWINGS * SWING_S)
    drive(rig, lambda _: start_m, 0.1)
    time_s = np.array([sample.receive_time_s for sample in driven.samples])
    position_m = np.array([sample.position_m for sample in driven.samples])
    inside = (time_s > driven.time_s[0]) & (time_s < driven.time_s[-1])
    time_s, first = np.unique(time_s[inside], return_index=True)
    target_m = np.interp(time_s, driven.time_s, driven.target_m)
    return measure_lag(time_s, position_m[inside][first] * 1e6, target_m, max_lag_s=0.5)


def check_response(plan: Plan, rig: OpenRig) -> tuple[CheckLine, float | None]:
    """The arm's answer in free air against the plan's figures; the measured lag in s."""
    name = "arm: response"
    lag = response_lag(rig)
    if not math.isfinite(lag.lag_s):
        return without_number(name, Mark.FAIL, f"not measured: {lag.how}",
                              "does the arm follow small targets?", "s"), None  # fmt: skip
    arm = plan.rig.arm
    planned_s = arm.command_delay_s + arm.lag_s + 2.0 / arm.rate_hz + backlash_s(arm)
    slack_s = 2.0 * lag.sigma_s
    line = graded(
        name, lag.lag_s, "s", warn=planned_s + slack_s, fail=DELAY_FAIL * planned_s + slack_s,
        message=f"± {lag.sigma_s * 1e3:.1f} ms from a target to the measured motion, free air; "
        "the plan's command delay, lag and two periods",
        remedy="raise rig.arm.command_delay or lag: the force budget rests on them",
    )  # fmt: skip
    return line, lag.lag_s
