"""Checks of a device whose data stop: it reports that, invents no data, and can still be closed."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from stepload.errors import DeviceError
from stepload.rig.contract_leaks import leaks, resources
from stepload.rig.contract_trial import (
    GRACE_S,
    POLL_S,
    ContractViolation,
    SkippedCheck,
    Stopwatch,
    Trial,
    drain,
    nominal_rate_hz,
    opened,
    require,
)
from stepload.rig.device import Arm, Device
from stepload.rig.faults import Fault, FaultCode

SAFE_S = 2.0
UNDRAINED_S = 30.0
"""A device that is not drained for longer, in s, may have another fault because of that."""
STALE_PERIODS = 10.0
SETTLE_SHARE = 0.5
"""Share of the time by which samples under way must have come when the device falls silent."""
LOST = (FaultCode.STALE, FaultCode.NOT_CONNECTED, FaultCode.DRIVER)


@contextmanager
def _silenced(silence: Callable[[], None], trial: Trial) -> Iterator[None]:
    begin_s = time.monotonic()
    try:
        silence()
        if (took_s := time.monotonic() - begin_s) > UNDRAINED_S:
            raise SkippedCheck(
                f"it took {took_s:.0f} s to make the device fall silent (limit {UNDRAINED_S:g} s), "
                "and nobody drained it meanwhile: try again"
            )
        yield
    finally:
        trial.restore()


def _silencer(trial: Trial) -> Callable[[], None]:
    if trial.silence is None:
        raise SkippedCheck(
            "nothing made the device fall silent: staleness is NOT proven (--unplug)"
        )
    return trial.silence


def check_stale(trial: Trial) -> str:
    """A device that falls silent latches a fault, keeps it, and repeats no sample."""
    silence = _silencer(trial)
    with opened(trial) as device:
        trial.wait(trial.observe_s)
        drain(device)
        with _silenced(silence, trial):
            watch = Stopwatch(trial)
            limit_s = _stale_s(device, trial)
            fault, late = _wait_for_fault(device, trial)
            require(
                fault is not None or not late,
                f"{SETTLE_SHARE * limit_s:g} s after its data stopped it still handed out "
                f"{late} samples: old values in the place of missing ones",
            )
            if fault is None:
                raise ContractViolation(f"silent for {limit_s:g} s, and no fault: never stale")
            after_s = watch.seconds
            require(fault.code in LOST, f"silent, but the fault is {fault.code}: {fault.message}")
            drain(device)
            trial.wait(10.0 / nominal_rate_hz(device))
            require(drain(device) == [], "samples out of silence, after the fault")
            require(device.fault() == fault, "the fault is not latched")
    return f"{fault.code} after {after_s:.2f} s"


def _stale_s(device: Device, trial: Trial) -> float:
    """How soon a fault is due; a slow device may wait for some of its periods."""
    return max(trial.stale_s, STALE_PERIODS / nominal_rate_hz(device))


def _wait_for_fault(device: Device, trial: Trial) -> tuple[Fault | None, int]:
    """The fault, and how many samples came although the device had long been silent."""
    late, passed_s, limit_s = 0, 0.0, _stale_s(device, trial)
    while passed_s < limit_s:
        trial.wait(POLL_S)
        passed_s += POLL_S
        fresh = len(drain(device))
        if passed_s > SETTLE_SHARE * limit_s:
            late += fresh
        if fault := device.fault():
            return fault, late
    return None, late


def check_lost_link(trial: Trial) -> str:
    """After the data have stopped, `safe`, `command` and `close` neither hang nor crash."""
    silence = _silencer(trial)
    before = resources()
    device = trial.make()
    try:
        device.open(trial.open_timeout_s)
        trial.wait(trial.observe_s)
        position_m = _last_position_m(device)
        with _silenced(silence, trial):
            _wait_for_fault(device, trial)
            confirmed = _in_time("safe()", lambda: device.safe(SAFE_S), SAFE_S, trial)
            _in_time("a second safe()", lambda: device.safe(SAFE_S), SAFE_S, trial)
            if isinstance(device, Arm):
                _in_time("command()", lambda: device.command(position_m), 0.0, trial)
            _in_time("close()", device.close, 0.0, trial)
    finally:
        with suppress(Exception):
            device.close()
    left = leaks(before, trial.leak_grace_s)
    require(not left, f"left open after the link was lost and close(): {left}")
    return "safe() confirmed" if confirmed else "safe() raised DeviceError in time"


def _last_position_m(device: Device) -> float:
    samples = device.drain() if isinstance(device, Arm) else []
    return samples[-1].position_m if samples else 0.0


def _in_time(what: str, call: Callable[[], None], limit_s: float, trial: Trial) -> bool:
    """Whether `call` returned without `DeviceError`.

    Raises:
        ContractViolation: it raised something else, or was not back in time.
    """
    watch = Stopwatch(trial)
    confirmed = True
    try:
        call()
    except DeviceError:
        confirmed = False
    except Exception as error:
        raise ContractViolation(
            f"{what} after the link was lost raised {type(error).__name__}: {error}"
        ) from error
    took_s = watch.seconds
    require(
        took_s < limit_s + GRACE_S,
        f"{what} after the link was lost took {took_s:.1f} s (limit {limit_s + GRACE_S:g} s)",
    )
    return confirmed
