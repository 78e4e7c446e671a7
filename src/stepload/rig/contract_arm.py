"""Checks of an arm: nothing moves it but its commands; and, where the trial allows it to move, that
it goes along its approach and across it, and that `safe` stops it.

What an arm does before the first `open` is back cannot be seen there; that it does it again at the
second one, can.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress

import numpy as np
from numpy.typing import NDArray

from stepload.errors import SteploadError
from stepload.rig.contract_trial import (
    MIN_SAMPLES,
    POLL_S,
    ContractViolation,
    SkippedCheck,
    Stopwatch,
    Trial,
    drain,
    idle,
    opened,
    require,
)
from stepload.rig.device import LARGEST_SHIFT_M, Arm
from stepload.rig.samples import ArmSample

Vector = NDArray[np.float64]
Place = tuple[float, ...]
"""Place of the TCP in m, and position along the approach: one of them may begin anew at `open`."""

WATCH_S = 1.0
CLOSED_S = 0.5
STILL_M = 1e-4
"""No arm that stands comes back less exactly; noise and resolution are added."""
SIGMAS = 6.0
SIGMA_OF_STEP = 1.05
"""Standard deviation over the median step from one sample to the next, of normal noise."""


def check_rest(trial: Trial) -> str:
    """Neither `open` nor `close` moves an arm: it stands where it stood, and goes on standing."""
    arm = trial.make()
    if not isinstance(arm, Arm):
        raise SkippedCheck("only arms move")
    with closing(arm):
        arm.open(trial.open_timeout_s)
        first = _watched(arm, trial)
        limit_m = _limit_m(first, trial)
        _require_still("the first open()", first, limit_m)
        arm.close()
        trial.wait(CLOSED_S)
        arm.open(trial.open_timeout_s)
        second = _watched(arm, trial)
        _require_still("the second open()", second, limit_m)
    went_m = _apart_m(_mean(second), _mean(first))
    require(
        went_m <= limit_m,
        f"after close() and a second open() the arm stands {went_m * 1e3:.3f} mm from where it "
        f"stood before, {_because(limit_m)}: one of the two moves it, and nobody commanded that",
    )
    return f"{went_m * 1e3:.3f} mm apart after close() and open() (limit {limit_m * 1e3:.3f} mm)"


def _watched(arm: Arm, trial: Trial) -> list[Place]:
    """Where the arm is during the first second after an open."""
    samples = drain(arm)
    end_s = trial.now_s() + max(WATCH_S, MIN_SAMPLES * arm.period_s)
    while trial.now_s() < end_s:
        trial.wait(POLL_S)
        samples += drain(arm)
        if fault := arm.fault():
            raise ContractViolation(f"a fault at rest: {fault.code}: {fault.message}")
    require(len(samples) >= MIN_SAMPLES, f"only {len(samples)} samples at rest")
    return [(*s.pose[:3], s.position_m) for s in samples if isinstance(s, ArmSample)]


def _limit_m(places: list[Place], trial: Trial) -> float:
    """How far readings of an arm at rest may be apart. A slow move does not look like noise."""
    noise_m = trial.noise
    if noise_m is None:
        steps = [
            [abs(new - old) for old, new in itertools.pairwise(axis)]
            for axis in zip(*places, strict=True)
        ]
        noise_m = SIGMA_OF_STEP * max(statistics.median(axis) for axis in steps)
    return STILL_M + SIGMAS * noise_m + trial.resolution


def _require_still(since: str, places: list[Place], limit_m: float) -> None:
    begin = _mean(places[:MIN_SAMPLES])
    went_m = max(_apart_m(place, begin) for place in places)
    require(
        went_m <= limit_m,
        f"in the first second after {since} the arm went {went_m * 1e3:.3f} mm, "
        f"{_because(limit_m)}: open() moves it before anything supervises it",
    )


def _because(limit_m: float) -> str:
    return f"{limit_m * 1e3:.3f} mm is what noise and resolution explain"


def _mean(places: list[Place]) -> Place:
    return tuple(math.fsum(axis) / len(places) for axis in zip(*places, strict=True))


def _apart_m(one: Place, other: Place) -> float:
    return max(math.dist(one[:3], other[:3]), abs(one[3] - other[3]))


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
        ramp(arm, trial, (start_m,), (quarter_m,))
        _require_followed(start_m, quarter_m, _position(arm, trial))
        target_m = start_m + trial.move_m
        ramp(arm, trial, (quarter_m,), (target_m,))
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


def ramp(arm: Arm, trial: Trial, start: tuple[float, ...], end: tuple[float, ...]) -> None:
    """Command a ramp at the trial's speed, then the last target until the arm is there.

    Args:
        start, end: travel along the approach, or along the three axes with the shift.
    """
    steps = max(1, math.ceil(math.dist(start, end) / (trial.speed_m_s * arm.period_s)))
    for step in range(1, steps + round(ARRIVE_S / arm.period_s)):
        part = min(1.0, step / steps)
        position_m, *shift = (a + part * (b - a) for a, b in zip(start, end, strict=True))
        if shift:
            arm.command(position_m, (shift[0], shift[1]))
        else:
            arm.command(position_m)
        trial.wait(arm.period_s)
        arm.drain()


def _require_followed(start_m: float, target_m: float, position_m: float) -> None:
    """The first short move shows whether the position is live, and which direction is forwards."""
    requested_m, moved_m = target_m - start_m, position_m - start_m
    moved = f"{moved_m * 1e3:.4f} mm for a command of {requested_m * 1e3:+.4f} mm"
    require(
        abs(moved_m) > NEAR_SHARE * requested_m,
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


def check_shift(trial: Trial) -> str:
    """An arm that says it can shift does so, along axes 1 and 2, and refuses what no arm may do."""
    kind = trial.make()
    if isinstance(kind, Arm) and not kind.can_shift:
        raise SkippedCheck("this arm cannot shift: plans with alignment are refused")
    with moving_arm(trial) as arm:
        if not arm.can_shift:
            raise SkippedCheck("this arm cannot shift as it is set up")
        start_m, begin = _rest(arm, trial)
        for shift_m in ((math.nan, 0.0), (0.0, math.inf), (2.0 * LARGEST_SHIFT_M, 0.0)):
            refused(f"a shift of {shift_m} m", arm.command, start_m, shift_m)
        refused("a jump to the largest shift", arm.command, start_m, (0.0, LARGEST_SHIFT_M))
        way_m = trial.move_m
        ramp(arm, trial, (start_m, 0.0, 0.0), (start_m, way_m, 0.0))
        first = _moved("axis 1", arm, begin, start_m, trial)
        ramp(arm, trial, (start_m, way_m, 0.0), (start_m, 0.0, way_m))
        second = _moved("axis 2", arm, begin, start_m, trial)
        before = _rest(arm, trial)[1]
        arm.retract(way_m, trial.speed_m_s, trial.open_timeout_s)
        back = before - _rest(arm, trial)[1]
        across_m = max(abs(float(back @ axis)) / way_m for axis in (first, second))
        require(
            across_m < NEAR_SHARE * way_m,
            f"a retract went {across_m * 1e3:.4f} mm across the approach: it must keep the shift",
        )
        turn = float(np.cross(first, second) @ back) / way_m**3
        require(
            turn > 0.5,
            "axes 1 and 2 and the approach are no right-handed frame by the arm's pose: a tilt "
            "would be corrected the wrong way",
        )
        arm.safe(trial.open_timeout_s)
    return f"{way_m * 1e3:g} mm along both axes"


def _moved(name: str, arm: Arm, begin: Vector, start_m: float, trial: Trial) -> Vector:
    """The measured change of the pose: it must be across the approach, and as far as asked."""
    position_m, pose = _rest(arm, trial)
    went, requested_m = pose - begin, trial.move_m
    along_m = position_m - start_m
    went_m = math.sqrt(max(0.0, float(went @ went) - along_m**2))
    require(
        abs(went_m - requested_m) < NEAR_SHARE * requested_m,
        f"shift along {name}: the pose went {went_m * 1e3:.4f} mm across the approach, asked were "
        f"{requested_m * 1e3:.4f} mm: it is ignored, or in another unit",
    )
    require(
        abs(along_m) < NEAR_SHARE * requested_m,
        f"shift along {name}: the position along the approach went {along_m * 1e3:+.4f} mm",
    )
    return went


def _rest(arm: Arm, trial: Trial) -> tuple[float, Vector]:
    """Position along the approach and place of the TCP, of the newest sample."""
    sample = newest(arm, trial)
    return sample.position_m, np.array(sample.pose[:3])
