"""Data passed from a reader thread to the engine's thread: samples, counters, age, first fault.

One producer (the reader thread) and one consumer (the engine's thread); no locks, because every
shared step is a single atomic operation on a deque, a dict or a reference.
"""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

from stepload.errors import DeviceError
from stepload.rig.device import Health
from stepload.rig.faults import Fault, FaultCode

Sample = TypeVar("Sample")

CORRUPT_WINDOW_S = 1.0
CORRUPT_SHARE = 0.02
BACKLOG_S = 60.0
FROZEN_COUNT = 25
READER_S = 2.0
CLOCK_SHARE = 0.01
CLOCK_SLACK_S = 0.5
JUMP_S = 2.0
"""A step of the device's clock from one sample to the next that only a restart explains."""


class Stream(Generic[Sample]):
    """Samples on their way from one device, with the watch over them.

    Args:
        name: name of the device, for messages.
        period_s: nominal time between samples.
        stale_s: age of the newest sample from which on the device counts as dead.
        frozen_s: time after which exactly repeated values are a fault; inf: never.
        value_of: what is compared for `frozen_s`.
    """

    def __init__(
        self,
        name: str,
        period_s: float,
        stale_s: float,
        frozen_s: float = math.inf,
        value_of: Callable[[Sample], object] = lambda sample: None,
    ) -> None:
        self.name = name
        self.period_s = period_s
        self._stale_s = stale_s
        self._frozen_s = frozen_s
        self._value_of = value_of
        self._queue: deque[Sample] = deque()
        self._backlog = int(BACKLOG_S / period_s) + 1
        self._received = self._lost = 0
        self._first_s = self._last_s = self._looked_s = math.nan
        self._longest_gap_s = 0.0
        self._errors: dict[str, int] = {}
        self._totals: dict[str, int] = {}
        self._bad_times: deque[float] = deque(maxlen=max(5, int(CORRUPT_SHARE / period_s)))
        self._same_since_s, self._same_count = math.nan, 0
        self._same_value: object = None
        self._fault: Fault | None = None
        self._progress = threading.Event()

    def put(self, samples: Sequence[Sample], arrival_s: float) -> None:
        """Add samples that were taken off the wire together at `arrival_s` (reader thread)."""
        if not samples:
            return
        if self._received:
            self._longest_gap_s = max(self._longest_gap_s, arrival_s - self._last_s)
        else:
            self._first_s = arrival_s
        if len(self._queue) > self._backlog:
            self._lost += len(samples)
            self.latch(
                FaultCode.DRIVER,
                f"{self.name}: nobody took its samples for {BACKLOG_S:.0f} s",
                "a program bug: drain every device each tick",
            )
            return
        if self._frozen_s < math.inf:
            self._watch_frozen(samples, arrival_s)
        self._received += len(samples)
        self._queue.extend(samples)
        self._last_s = arrival_s
        self._progress.set()

    def _watch_frozen(self, samples: Sequence[Sample], arrival_s: float) -> None:
        for sample in samples:
            value = self._value_of(sample)
            if value != self._same_value:
                self._same_value, self._same_count, self._same_since_s = value, 0, arrival_s
            self._same_count += 1
        frozen_s = max(arrival_s - self._same_since_s, (self._same_count - 1) * self.period_s)
        if self._same_count >= FROZEN_COUNT and frozen_s > self._frozen_s:
            self.latch(
                FaultCode.STALE,
                f"{self.name}: {self._same_count} readings in {frozen_s:.3f} s were the same to "
                f"the last bit (limit {self._frozen_s:g} s); a live sensor has noise",
                "the sensor or its converter has stopped measuring: power it off and on",
            )

    def drain(self) -> list[Sample]:
        """All samples since the last call, oldest first (engine thread)."""
        take = self._queue.popleft
        return [take() for _ in range(len(self._queue))]

    def count(self, error: str, number: int = 1) -> None:
        """Count an error that does not affect the neighbouring samples."""
        if number:
            self._errors[error] = self._errors.get(error, 0) + number

    def corrupt(self, error: str, number: int = 1) -> None:
        """Count frames that failed a check; too many within a second are a fault."""
        self.count(error, number)
        now_s = time.monotonic()
        self._bad_times.extend([now_s] * min(number, self._bad_times.maxlen or 0))
        if number and len(self._bad_times) == self._bad_times.maxlen:
            span_s = now_s - self._bad_times[0]
            if span_s < CORRUPT_WINDOW_S:
                self.latch(
                    FaultCode.CORRUPT,
                    f"{self.name}: {len(self._bad_times)} damaged frames within {span_s:.2f} s "
                    f"(limit {len(self._bad_times) - 1} in {CORRUPT_WINDOW_S:g} s); last: {error}",
                    "check cable, shield, ground, termination and bit rate",
                )

    def total(self, error: str, total: int, *, corrupt: bool = False) -> int:
        """Count what a total that begins with the stream has grown by; returns that."""
        grown = total - self._totals.get(error, 0)
        self._totals[error] = total
        (self.corrupt if corrupt else self.count)(error, grown)
        return grown

    def lose(self, number: int) -> None:
        """Count samples that the device produced but nobody received (negative: found again)."""
        self._lost = max(0, self._lost + number)

    def latch(self, code: FaultCode, message: str, hint: str) -> None:
        """Keep the first fault; later ones are consequences."""
        if self._fault is None:
            self._fault = Fault(code, message, hint, time.monotonic())
        self._progress.set()

    @property
    def latched(self) -> Fault | None:
        """The first fault so far; looks for none."""
        return self._fault

    def looked(self, began_s: float) -> None:
        """The reader has taken all that had arrived when it began to look (reader thread)."""
        self._looked_s = began_s

    def fault(self) -> Fault | None:
        """The first fault; latches staleness by itself.

        Age counts up to the reader's last look, so that a stall of the host is not blamed on the
        device; a reader that does not look any more is a fault of its own.
        """
        if self._fault is None and self._received:
            age_s = self._looked_s - self._last_s
            idle_s = time.monotonic() - max(self._looked_s, self._last_s)
            if idle_s > READER_S:
                self.latch(
                    FaultCode.DRIVER,
                    f"{self.name}: its reader has not looked for {idle_s:.1f} s "
                    f"(limit {READER_S:g} s)",
                    "the host is overloaded or the driver hangs: start anew",
                )
            elif age_s > self._stale_s:
                self.latch(
                    FaultCode.STALE,
                    f"{self.name}: newest sample is {age_s:.3f} s old (limit {self._stale_s:g} s)",
                    "check power and cable; the link may look open all the same",
                )
        return self._fault

    def health(self) -> Health:
        span_s = self._last_s - self._first_s
        rate_hz = (self._received - 1) / span_s if self._received > 1 and span_s > 0.0 else 0.0
        age_s = time.monotonic() - self._last_s if self._received else math.inf
        return Health(
            self._received, self._lost, rate_hz, age_s, self._longest_gap_s, dict(self._errors)
        )

    def wait_first(self, timeout_s: float) -> None:
        """Return when the first sample is there.

        Raises:
            DeviceError: a fault came first, or nothing came.
        """
        self._progress.wait(max(0.0, timeout_s))
        if self._fault is not None:
            raise self._fault.error()
        if not self._received:
            raise DeviceError(
                f"{self.name}: no good sample came in time "
                f"(errors so far: {self._errors or 'none'})",
                code=FaultCode.NOT_CONNECTED,
                hint="check power, cable, bit rate and that nothing else reads the same port",
            )


class ClockWatch:
    """Arrival times by the device's own clock, which is watched against the host's.

    Latches `clock` when the two part by more than the slack and 1 % of the time.

    Args:
        slack_s: how late samples may come, at least 0.5 s.
    """

    def __init__(self, slack_s: float) -> None:
        self._slack_s = max(CLOCK_SLACK_S, slack_s)
        self._start: tuple[float, float] | None = None
        self._last_s = -math.inf

    def arrivals(
        self, device_s: Sequence[float], arrival_s: float, stream: Stream[Any]
    ) -> list[float]:
        """When the samples of these device times, taken off the wire together, arrived.

        Never before the sample before them, so that time does not go back.
        """
        self._compare(device_s[-1], arrival_s, stream)
        times_s = [max(arrival_s - (device_s[-1] - at_s), self._last_s) for at_s in device_s]
        self._last_s = times_s[-1]
        return times_s

    def _compare(self, device_s: float, host_s: float, stream: Stream[Any]) -> None:
        if self._start is None:
            self._start = (device_s, host_s)
        device_s, host_s = device_s - self._start[0], host_s - self._start[1]
        limit_s = self._slack_s + CLOCK_SHARE * host_s
        if abs(device_s - host_s) > limit_s:
            stream.latch(
                FaultCode.CLOCK,
                f"{stream.name}: its clock counts {device_s:.3f} s while the host counts "
                f"{host_s:.3f} s (limit ± {limit_s:.3f} s)",
                "the host reads too slowly, or the sensor's clock is wrong",
            )
