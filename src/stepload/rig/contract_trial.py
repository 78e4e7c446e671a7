"""How a device is tried, and what the checks of the contract share."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import cast

from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample

Sample = ForceSample | ArmSample | DisplacementSample

SAMPLE_OF: dict[type[Device], type[Sample]] = {
    ForceSensor: ForceSample,
    DisplacementSensor: DisplacementSample,
    Arm: ArmSample,
}

GRACE_S = 2.0
"""Time that a call with a deadline may take beyond it."""
MIN_SAMPLES = 10
POLL_S = 0.005


class ContractViolation(AssertionError):  # noqa: N818
    """A device does not do what `stepload.rig.device` says."""


class SkippedCheck(Exception):  # noqa: N818
    """This check does not fit the device or the trial."""


@dataclass(frozen=True, slots=True)
class Trial:
    """How to try a device.

    Args:
        make: a new, unopened device.
        make_with: the same with further options; None: it is not made from options.
        open_timeout_s: deadline given to `open`.
        observe_s: how long to watch its samples.
        wait: lets that many seconds pass (for a simulated device: of its own time).
        now_s: the clock of `receive_time_s` (for a simulated device: its own).
        silence: makes the device stop sending while its link stays, or cuts the link; None: cannot
            be tried.
        restore: undoes `silence`.
        stale_s: how soon after `silence` a fault is due.
        load: puts a load on an unloaded sensor and returns its true size, in N or m; None: no truth
            is known.
        load_axis: the force component that the load makes larger, such as "+fz"; "": not known, and
            the sign of the reading is not checked.
        noise: standard deviation of a reading at rest, in N or m; None: not known.
        resolution: smallest step between two readings, in N or m.
        move_m: distance that an arm may really move; 0: it is not moved.
        speed_m_s: speed of that move.
        leak_grace_s: how long threads and ports may take to go away after `close`.
    """

    make: Callable[[], Device]
    make_with: Callable[[Mapping[str, object]], Device] | None = None
    open_timeout_s: float = 5.0
    observe_s: float = 0.3
    wait: Callable[[float], None] = time.sleep
    now_s: Callable[[], float] = time.monotonic
    silence: Callable[[], None] | None = None
    restore: Callable[[], None] = lambda: None
    stale_s: float = 2.0
    load: Callable[[], float] | None = None
    load_axis: str = ""
    noise: float | None = None
    resolution: float = 0.0
    move_m: float = 0.0
    speed_m_s: float = 0.01
    leak_grace_s: float = 1.5


@contextmanager
def opened(trial: Trial) -> Iterator[Device]:
    """A device that is open inside `with`, and closed after it."""
    device = trial.make()
    device.open(trial.open_timeout_s)
    try:
        yield device
    finally:
        device.close()


class Stopwatch:
    """Seconds since it was made, on the host's clock or the device's own, whichever went further.

    A call may block in simulated time as well as in real time.
    """

    def __init__(self, trial: Trial) -> None:
        self._now_s = trial.now_s
        self._begin_s, self._host_begin_s = trial.now_s(), time.monotonic()

    @property
    def seconds(self) -> float:
        return max(self._now_s() - self._begin_s, time.monotonic() - self._host_begin_s)


def require(condition: bool, message: str) -> None:
    """Raises ContractViolation with `message` unless `condition` holds."""
    if not condition:
        raise ContractViolation(message)


def drain(device: Device) -> list[Sample]:
    """The samples of any kind of device.

    Raises:
        ContractViolation: they are not what such a device delivers.
    """
    assert isinstance(device, Arm | ForceSensor | DisplacementSensor)
    expected = next(kind for owner, kind in SAMPLE_OF.items() if isinstance(device, owner))
    given: object = device.drain()
    require(isinstance(given, list), f"drain() gave {type(given).__name__}, not a list")
    samples = cast(list[Sample], given)
    for sample in samples:
        require(
            isinstance(sample, expected),
            f"drain() gave {type(sample).__name__}, not {expected.__name__}",
        )
    return samples


def nominal_rate_hz(device: Device) -> float:
    """The rate at which an open device says that it samples."""
    if isinstance(device, Arm):
        return 1.0 / device.period_s
    assert isinstance(device, ForceSensor | DisplacementSensor)
    return device.rate_hz


def idle(device: Device, trial: Trial, seconds: float) -> None:
    """Let time pass without draining; the device is asked for its fault, as the engine does."""
    end_s = trial.now_s() + seconds
    while (left_s := end_s - trial.now_s()) > 0.0:
        device.fault()
        trial.wait(min(POLL_S, left_s))


def observe(device: Device, trial: Trial) -> list[Sample]:
    """Samples over `observe_s`, or longer for a slow device."""
    samples = drain(device)
    left_s = max(trial.observe_s, MIN_SAMPLES / nominal_rate_hz(device))
    while left_s > 0.0:
        trial.wait(POLL_S)
        left_s -= POLL_S
        samples += drain(device)
    return samples
