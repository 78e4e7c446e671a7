"""The contract of `stepload.rig.device` as checks, for every driver, a lab's own included.

`run_contract` runs all checks that fit the kind of device; none of them needs pytest. Each check
opens the device anew and leaves it closed. Nothing moves an arm unless `Trial.move_m` says so.
"""

from __future__ import annotations

import itertools
import math
import os
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from stepload.errors import DeviceError
from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor, Health, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample

Sample = ForceSample | ArmSample | DisplacementSample

GRACE_S = 2.0
LEAK_GRACE_S = 1.5
MIN_SAMPLES = 10
POLL_S = 0.005
RATE_TOLERANCE = 0.25
RATE_LOOKS = 6
"""A host that stalls once spoils a short look at the rate, not a long one."""


class ContractViolation(AssertionError):  # noqa: N818
    """A device does not do what `stepload.rig.device` says."""


class Verdict(StrEnum):
    PASSED = "passed"
    FAILED = "failed"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One check: `message` says what was wrong, or why it was skipped."""

    name: str
    verdict: Verdict
    message: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Trial:
    """How to try a device.

    Args:
        make: a new, unopened device.
        open_timeout_s: deadline given to `open`.
        observe_s: how long to watch its samples.
        wait: lets that many seconds pass (for a simulated device: of its own time).
        silence: makes the device stop sending while its link stays; None: cannot be tried.
        stale_s: how soon after that a fault is due.
        move_m: distance that an arm may really move; 0: it is not moved.
        speed_m_s: speed of that move.
    """

    make: Callable[[], Device]
    open_timeout_s: float = 5.0
    observe_s: float = 0.3
    wait: Callable[[float], None] = time.sleep
    silence: Callable[[], None] | None = None
    stale_s: float = 2.0
    move_m: float = 0.0
    speed_m_s: float = 0.01


class SkippedCheck(Exception):  # noqa: N818
    """This check does not fit the device or the trial."""


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ContractViolation(message)


def _resources() -> set[str]:
    """Threads, child processes, sockets, terminals and devices held by this process."""
    found = {f"thread {thread.name}" for thread in threading.enumerate() if thread.is_alive()}
    for entry in Path("/proc/self/fd").glob("*"):
        try:
            target = os.readlink(entry)
        except OSError:
            continue
        if target.startswith(("socket:", "/dev/")):
            found.add(f"open file {entry.name} -> {target}")
    for task in Path("/proc/self/task").glob("*/children"):
        try:
            found |= {f"process {pid}" for pid in task.read_text().split()}
        except OSError:
            continue
    return found


def _leaks(before: set[str]) -> set[str]:
    """What is held now and was not `before`, once a grace time has passed."""
    give_up_s = time.monotonic() + LEAK_GRACE_S
    while (left := _resources() - before) and time.monotonic() < give_up_s:
        time.sleep(0.02)
    return left


def _drain(device: Device) -> list[Sample]:
    assert isinstance(device, Arm | ForceSensor | DisplacementSensor)
    return list(device.drain())


def _rate_hz(device: Device) -> float:
    if isinstance(device, Arm):
        return 1.0 / device.period_s
    assert isinstance(device, ForceSensor | DisplacementSensor)
    return device.rate_hz


def _observe(device: Device, trial: Trial) -> list[Sample]:
    """Samples over `observe_s`, or longer for a slow device."""
    rate_hz = _rate_hz(device)
    samples = _drain(device)
    left_s = max(trial.observe_s, MIN_SAMPLES / rate_hz)
    while left_s > 0.0:
        trial.wait(POLL_S)
        left_s -= POLL_S
        samples += _drain(device)
    return samples


class _Opened:
    """A device that is open inside `with`, and closed after it."""

    def __init__(self, trial: Trial) -> None:
        self._device = trial.make()
        self._timeout_s = trial.open_timeout_s

    def __enter__(self) -> Device:
        self._device.open(self._timeout_s)
        return self._device

    def __exit__(self, *_: object) -> None:
        self._device.close()


def check_unopened(trial: Trial) -> None:
    """An unopened device touches nothing, has no samples and no fault, and closes."""
    before = _resources()
    device = trial.make()
    opened = _leaks(before)
    _require(not opened, f"the constructor opened {sorted(opened)}; only `open` may")
    _require(_drain(device) == [], "drain() before open() gave samples")
    health = device.health()
    _require(isinstance(health, Health), f"health() gave {type(health).__name__}, not Health")
    _require(math.isinf(health.age_s), f"age before the first sample is {health.age_s}, not inf")
    _require(device.fault() is None, f"a fault before open(): {device.fault()}")
    device.close()
    device.close()


def check_open(trial: Trial) -> None:
    """`open` keeps its deadline, tells who answers, and is back when the first sample is there."""
    device = trial.make()
    started_s = time.monotonic()
    try:
        identity = device.open(trial.open_timeout_s)
        took_s = time.monotonic() - started_s
        limit_s = trial.open_timeout_s + GRACE_S
        _require(took_s < limit_s, f"open({trial.open_timeout_s}) took {took_s:.1f} s")
        _require(isinstance(identity, Identity), f"open() gave {type(identity).__name__}")
        for field in ("driver", "model", "serial_number", "firmware", "calibration_revision"):
            value = getattr(identity, field)
            _require(
                isinstance(value, str) and bool(value.strip()),
                f"identity.{field} is {value!r}; write 'unknown' where the device does not tell",
            )
        rate_hz = _rate_hz(device)
        _require(math.isfinite(rate_hz) and rate_hz > 0.0, f"nominal rate is {rate_hz} Hz")
        health = device.health()
        _require(health.received > 0, "open() returned before the first sample")
        _require(math.isfinite(health.age_s), f"age after open() is {health.age_s}")
        _require(device.fault() is None, f"a fault right after open(): {device.fault()}")
        _require(len(_drain(device)) > 0, "the sample that open() waited for was not delivered")
    finally:
        device.close()


def check_samples(trial: Trial) -> None:
    """Nothing repeated, nothing lost unnoticed, no time runs backwards, all values finite."""
    with _Opened(trial) as device:
        rate_hz = _rate_hz(device)
        samples = _observe(device, trial)
        looks = 1
        while looks < RATE_LOOKS and not _near(device.health().rate_hz, rate_hz):
            samples += _observe(device, trial)
            looks += 1
        health = device.health()
        samples += _drain(device)
        after = device.health()
        if fault := device.fault():
            raise ContractViolation(f"a fault while watching: {fault.code}: {fault.message}")
    _require(len(samples) >= MIN_SAMPLES, f"only {len(samples)} samples at {rate_hz:g} Hz")
    gaps = 0
    for old, new in itertools.pairwise(samples):
        _require(
            new.sequence > old.sequence,
            f"sequence {new.sequence} after {old.sequence}: repeated or out of order",
        )
        gaps += new.sequence - old.sequence - 1
        _require(
            new.receive_time_s >= old.receive_time_s,
            f"receive time went back by {old.receive_time_s - new.receive_time_s:.6f} s",
        )
        if math.isfinite(new.device_time_s) and math.isfinite(old.device_time_s):
            _require(new.device_time_s >= old.device_time_s, "device time went back")
    for sample in samples:
        _require_finite(sample)
    _require(gaps <= after.lost, f"sequence shows {gaps} lost samples, health only {after.lost}")
    if not isinstance(device, Arm):
        _require(
            health.received <= len(samples) <= after.received,
            f"{len(samples)} samples delivered, health counts {health.received} to "
            f"{after.received}",
        )
    _require(
        _near(after.rate_hz, rate_hz),
        f"measured rate {after.rate_hz:.1f} Hz, nominal {rate_hz:g} Hz",
    )


def _near(measured_hz: float, nominal_hz: float) -> bool:
    return abs(measured_hz / nominal_hz - 1.0) < RATE_TOLERANCE


def _require_finite(sample: Sample) -> None:
    if isinstance(sample, ForceSample):
        values: tuple[float, ...] = sample.wrench
        _require(len(values) == 6, f"a wrench of {len(values)} values")
    elif isinstance(sample, ArmSample):
        values = (sample.position_m, *sample.pose)
        _require(len(sample.pose) == 6, f"a pose of {len(sample.pose)} values")
    elif isinstance(sample, DisplacementSample):
        values = (sample.displacement_m,)
    else:
        raise ContractViolation(f"drain() gave {type(sample).__name__}")
    _require(
        all(map(math.isfinite, (*values, sample.receive_time_s))) or sample.status != 0,
        f"a sample that is not finite has status 0: {sample}",
    )


def check_safe(trial: Trial) -> None:
    """`safe` works opened and twice in a row; unopened and closed it may refuse, not crash."""
    device = trial.make()
    _safe_or_refused(device)
    try:
        device.open(trial.open_timeout_s)
        for _ in range(2):
            try:
                device.safe(trial.open_timeout_s)
            except DeviceError as error:
                raise ContractViolation(f"safe() of a sound device failed: {error}") from error
    finally:
        device.close()
    _safe_or_refused(device)
    device.close()


def _safe_or_refused(device: Device) -> None:
    try:
        device.safe(1.0)
    except DeviceError:
        return


def check_close(trial: Trial) -> None:
    """`close` gives back threads, processes and ports, twice, and leaves the device callable."""
    before = _resources()
    device = trial.make()
    try:
        device.open(trial.open_timeout_s)
    finally:
        device.close()
    device.close()
    left = _leaks(before)
    _require(not left, f"left open after close(): {sorted(left)}")
    _drain(device)
    device.health()
    device.fault()


def check_failing_open(trial: Trial) -> None:
    """An `open` that cannot be done in time raises `DeviceError` and leaves nothing open."""
    before = _resources()
    device = trial.make()
    started_s = time.monotonic()
    try:
        device.open(1e-6)
    except DeviceError as error:
        _require(error.code in list(FaultCode), f"code {error.code!r} is no FaultCode")
        took_s = time.monotonic() - started_s
        _require(took_s < GRACE_S, f"open(0.000001) took {took_s:.1f} s to fail")
        left = _leaks(before)
        _require(not left, f"left open after a failed open(): {sorted(left)}")
    finally:
        device.close()


def check_stale(trial: Trial) -> None:
    """A device that falls silent latches a fault, keeps it, and repeats no sample."""
    if trial.silence is None:
        raise SkippedCheck("nothing to silence the device with")
    with _Opened(trial) as device:
        trial.wait(trial.observe_s)
        trial.silence()
        trial.wait(trial.stale_s)
        _drain(device)
        fault = device.fault()
        if fault is None:
            raise ContractViolation(f"silent for {trial.stale_s:g} s, and no fault")
        _require(
            fault.code in (FaultCode.STALE, FaultCode.NOT_CONNECTED, FaultCode.DRIVER),
            f"silent, but the fault is {fault.code}: {fault.message}",
        )
        _require(_drain(device) == [], "samples out of silence")
        _require(device.fault() == fault, "the fault is not latched")


def check_bias(trial: Trial) -> None:
    """`bias` tells the truth: after True the sensor reads zero. Needs free air."""
    with _Opened(trial) as device:
        if not isinstance(device, ForceSensor):
            raise SkippedCheck("only force sensors have a bias")
        before = _mean_force(_observe(device, trial))
        if not device.bias(trial.open_timeout_s):
            raise SkippedCheck("the device has no bias")
        trial.wait(trial.observe_s)
        _drain(device)
        after = _mean_force(_observe(device, trial))
        _require(
            after[0] <= 0.2 * before[0] + 6.0 * after[1],
            f"after bias() it still reads {after[0]:.3f} N (before {before[0]:.3f} N)",
        )


def _mean_force(samples: list[Sample]) -> tuple[float, float]:
    """Size of the mean force and its spread, in N."""
    forces = [sample.wrench[:3] for sample in samples if isinstance(sample, ForceSample)]
    means = [sum(axis) / len(forces) for axis in zip(*forces, strict=True)]
    variance = sum((value - means[i]) ** 2 for force in forces for i, value in enumerate(force))
    return math.hypot(*means), math.sqrt(variance / len(forces))


def check_motion(trial: Trial) -> None:
    """An arm goes to its target, holds it without further commands, and retracts."""
    with _Opened(trial) as device:
        if not isinstance(device, Arm):
            raise SkippedCheck("only arms move")
        if trial.move_m == 0.0:
            raise SkippedCheck("moving was not allowed")
        start_m = _position(device, trial)
        target_m = start_m
        step_m = trial.speed_m_s * device.period_s
        while target_m < start_m + trial.move_m:
            target_m = min(target_m + step_m, start_m + trial.move_m)
            device.command(target_m)
            trial.wait(device.period_s)
        for _ in range(int(1.0 / device.period_s)):
            device.command(target_m)
            trial.wait(device.period_s)
        reached_m = _position(device, trial)
        _require_near("target", reached_m, target_m, trial)
        trial.wait(0.5)
        _require_near("position held", _position(device, trial), reached_m, trial)
        device.retract(trial.move_m, trial.speed_m_s, trial.open_timeout_s)
        _require_near("retracted", _position(device, trial), reached_m - trial.move_m, trial)
        device.safe(trial.open_timeout_s)


def _require_near(what: str, position_m: float, expected_m: float, trial: Trial) -> None:
    _require(
        abs(position_m - expected_m) < 0.2 * trial.move_m,
        f"{what}: {position_m * 1e3:.4f} mm, expected {expected_m * 1e3:.4f} mm",
    )


def _position(device: Arm, trial: Trial) -> float:
    device.drain()
    for _ in range(200):
        trial.wait(device.period_s)
        if samples := device.drain():
            return samples[-1].position_m
    raise ContractViolation("an open arm delivers no samples")


CHECKS: tuple[Callable[[Trial], None], ...] = (
    check_unopened,
    check_open,
    check_samples,
    check_safe,
    check_close,
    check_failing_open,
    check_bias,
    check_motion,
    check_stale,
)
"""In this order; `check_stale` is last, because what was silenced may stay so."""


def run_trial(trial: Trial) -> list[CheckResult]:
    """Run every check; a failure does not keep the others from running."""
    results = []
    for check in CHECKS:
        started_s = time.monotonic()
        verdict, message = Verdict.PASSED, ""
        try:
            check(trial)
        except SkippedCheck as reason:
            verdict, message = Verdict.SKIPPED, str(reason)
        except ContractViolation as violation:
            verdict, message = Verdict.FAILED, str(violation)
        except Exception as error:  # any other exception breaks the contract too
            verdict, message = Verdict.FAILED, f"{type(error).__name__}: {error}"
        name = check.__name__.removeprefix("check_")
        results.append(CheckResult(name, verdict, message, time.monotonic() - started_s))
    return results


def run_contract(
    kind: type[Device], driver: Callable[..., Device], options: Mapping[str, object]
) -> list[CheckResult]:
    """Run the contract against a driver with its options, in real time, without moving an arm.

    Raises:
        ContractViolation: the driver makes something that is not a `kind`.
    """
    device = driver(**options)
    if not isinstance(device, kind):
        raise ContractViolation(f"{type(device).__name__} is no {kind.__name__}")
    return run_trial(Trial(lambda: driver(**options)))
