"""Checks of a device's life: made, opened, made safe, closed, opened again; and of one whose data
stop: it reports that, invents no data, and can still be closed."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from stepload.errors import DeviceError
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
from stepload.rig.device import Arm, Device, Health, Identity
from stepload.rig.faults import Fault, FaultCode

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


def resources() -> set[str]:
    """Threads, child processes, sockets, terminals and devices held by this process."""
    found = {
        f"thread {thread.name} ({thread.native_id})"
        for thread in threading.enumerate()
        if thread.is_alive()
    }
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


def leaks(before: set[str], grace_s: float) -> list[str]:
    """What is held now and was not `before`, once it had `grace_s` to go away."""
    give_up_s = time.monotonic() + grace_s
    while (left := resources() - before) and time.monotonic() < give_up_s:
        time.sleep(0.02)
    return sorted(left)
