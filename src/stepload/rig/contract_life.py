"""Checks of a device's life: made, opened, made safe, closed, opened again."""

from __future__ import annotations

import math
from contextlib import closing

from stepload.errors import DeviceError
from stepload.rig.contract_leaks import leaks, resources
from stepload.rig.contract_trial import (
    GRACE_S,
    ContractViolation,
    SkippedCheck,
    Stopwatch,
    Trial,
    drain,
    nominal_rate_hz,
    require,
)
from stepload.rig.device import Device, Health, Identity
from stepload.rig.faults import FaultCode

UNKNOWN_OPTION = "no_such_option"
SPREAD_S, SPREAD_PERIODS = 0.05, 3.0
"""A burst that arrives at once may be stamped so far back."""


def check_unopened(trial: Trial) -> None:
    """An unopened device touches nothing, has no samples and no fault, and closes."""
    before = resources()
    device = trial.make()
    opened = leaks(before, trial.leak_grace_s)
    require(not opened, f"the constructor opened {opened}; only `open` may")
    require(drain(device) == [], "drain() before open() gave samples")
    health = device.health()
    require(isinstance(health, Health), f"health() gave {type(health).__name__}, not Health")
    require(math.isinf(health.age_s), f"age before the first sample is {health.age_s}, not inf")
    require(device.fault() is None, f"a fault before open(): {device.fault()}")
    device.close()
    device.close()


def check_options(trial: Trial) -> None:
    """An option that the driver does not know is refused, not swallowed."""
    if trial.make_with is None:
        raise SkippedCheck("the device is not made from options here")
    try:
        device = trial.make_with({UNKNOWN_OPTION: 1})
    except Exception:  # whatever refuses it: TypeError of the call, or an error of the driver's own
        return
    device.close()
    raise ContractViolation(
        f"took the unknown option {UNKNOWN_OPTION!r} without a word: a misspelt option would be "
        "ignored"
    )


def check_open(trial: Trial) -> None:
    """`open` keeps its deadline, identifies the device, and returns with the first sample there."""
    with closing(trial.make()) as device:
        watch = Stopwatch(trial)
        identity = device.open(trial.open_timeout_s)
        took_s = watch.seconds
        limit_s = trial.open_timeout_s + GRACE_S
        require(took_s < limit_s, f"open({trial.open_timeout_s}) took {took_s:.1f} s")
        require(isinstance(identity, Identity), f"open() gave {type(identity).__name__}")
        for field in ("driver", "model", "serial_number", "firmware", "calibration_revision"):
            value = getattr(identity, field)
            require(
                isinstance(value, str) and bool(value.strip()),
                f"identity.{field} is {value!r}; write 'unknown' where the device does not tell",
            )
        rate_hz = nominal_rate_hz(device)
        require(math.isfinite(rate_hz) and rate_hz > 0.0, f"nominal rate is {rate_hz} Hz")
        health = device.health()
        require(health.received > 0, "open() returned before the first sample")
        require(math.isfinite(health.age_s), f"age after open() is {health.age_s}")
        require(device.fault() is None, f"a fault right after open(): {device.fault()}")
        require(len(drain(device)) > 0, "the sample that open() waited for was not delivered")


def check_safe(trial: Trial) -> None:
    """`safe` works opened and twice in a row; unopened and closed it may refuse, not crash."""
    with closing(trial.make()) as device:
        _safe_or_refused(device)
        device.open(trial.open_timeout_s)
        for which in ("the first", "the second"):
            try:
                device.safe(trial.open_timeout_s)
            except DeviceError as error:
                raise ContractViolation(
                    f"{which} safe() of a sound device failed: {error}"
                ) from error
    _safe_or_refused(device)
    device.close()


def _safe_or_refused(device: Device) -> None:
    try:
        device.safe(1.0)
    except DeviceError:
        return


def check_close(trial: Trial) -> None:
    """`close` gives back threads, processes and ports, twice, and leaves the device callable."""
    before = resources()
    with closing(trial.make()) as device:
        device.open(trial.open_timeout_s)
    device.close()
    left = leaks(before, trial.leak_grace_s)
    require(not left, f"left open after close(): {left}")
    drain(device)
    device.health()
    device.fault()


def check_reopen(trial: Trial) -> None:
    """A closed device opens again, counts from zero, and hands out nothing of its first life."""
    with closing(trial.make()) as device:
        device.open(trial.open_timeout_s)
        trial.wait(trial.observe_s)
        before = device.health().received
        device.close()
        begin_s = trial.now_s()
        try:
            device.open(trial.open_timeout_s)
        except DeviceError as error:
            raise ContractViolation(f"the second open() after close() failed: {error}") from error
        require(device.fault() is None, f"a fault right after the second open(): {device.fault()}")
        samples = drain(device)
        require(len(samples) > 0, "the second open() returned before its first sample")
        oldest_s = begin_s - max(SPREAD_S, SPREAD_PERIODS / nominal_rate_hz(device))
        old = sum(sample.receive_time_s < oldest_s for sample in samples)
        require(old == 0, f"after the second open() {old} samples from before it were handed out")
        received = device.health().received
        require(
            received < before + len(samples),
            f"health counts {received} samples after the second open(), which delivered "
            f"{len(samples)}: it must count since open()",
        )


def check_failing_open(trial: Trial) -> None:
    """An `open` that cannot be done in time raises `DeviceError` and leaves nothing open."""
    before = resources()
    device = trial.make()
    watch = Stopwatch(trial)
    try:
        device.open(1e-6)
    except DeviceError as error:
        took_s = watch.seconds
        require(error.code in list(FaultCode), f"code {error.code!r} is no FaultCode")
        require(took_s < GRACE_S, f"open(0.000001) took {took_s:.1f} s to fail")
        left = leaks(before, trial.leak_grace_s)
        require(not left, f"left open after a failed open(): {left}")
    finally:
        device.close()
