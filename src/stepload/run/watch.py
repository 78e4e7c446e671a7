"""Is this stream of samples alive and sane? Rules R3, R4 and R10, one watch for each stream."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from stepload.rig.samples import ArmSample, ForceSample

AXES = {"fx": 0, "fy": 1, "fz": 2}
EMPTY_TICKS = 3
"""A host that was late itself gives its readers this many ticks to catch up."""
LATE_CLOCK_TICKS = 5
CLOCK_TRACKING = 1e-3
"""Share of a clock difference that is taken for slow drift and followed, per tick."""


class Finding(NamedTuple):
    """What is wrong with a stream."""

    rule: str
    value: float
    limit: float
    unit: str
    message: str


def wrench_axis(axis: str) -> tuple[int, float]:
    """Index into a wrench and sign of "+fx" … "-fz"."""
    return AXES[axis[1:]], -1.0 if axis[0] == "-" else 1.0


class _Clock:
    """R10: device time against host time, by the newest sample of each tick."""

    __slots__ = ("_late", "_limit_s", "_offset_s")

    def __init__(self, limit_s: float) -> None:
        self._limit_s = limit_s
        self._offset_s = float("nan")
        self._late = 0

    def runs_away(self, receive_s: float, device_s: float) -> float:
        """Difference in s once it has lasted; 0.0 while sound or where the device has no clock."""
        offset_s = receive_s - device_s
        away_s = offset_s - self._offset_s
        if -self._limit_s < away_s < self._limit_s:
            self._offset_s += CLOCK_TRACKING * away_s
            self._late = 0
            return 0.0
        if away_s != away_s:  # no device clock, or the first sample
            self._offset_s = offset_s
            return 0.0
        self._late += 1
        return away_s if self._late >= LATE_CLOCK_TICKS else 0.0


class ForceWatch:
    """State of one force stream; `raw_n` is the newest reading along the pressing axis."""

    __slots__ = (
        "_clock", "_clock_limit_s", "_empty", "_full_scale_n", "_index", "_name",
        "_same", "_sequence", "_sign", "_stale_s", "_wrench", "fresh", "identical_counts", "raw_n",
        "receive_s",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        axis: str,
        *,
        full_scale_n: float,
        stale_s: float,
        identical_counts: int,
        clock_s: float,
    ) -> None:
        self._name = name
        self._index, self._sign = wrench_axis(axis)
        self._full_scale_n = full_scale_n
        self._stale_s = stale_s
        self.identical_counts = identical_counts
        self._clock = _Clock(clock_s)
        self._clock_limit_s = clock_s
        self._sequence = -1
        self._wrench: tuple[float, ...] = ()
        self._same = 0
        self._empty = 0
        self.raw_n = float("nan")
        self.receive_s = float("nan")
        self.fresh = False

    def project(self, sample: ForceSample) -> float:
        """Force along the pressing axis, not tared."""
        return self._sign * sample.wrench[self._index]

    def take(self, samples: Sequence[ForceSample], now_s: float) -> Finding | None:
        """Follow the stream; the first thing wrong with it."""
        if not samples:
            return self._missing(now_s)
        self._empty = 0
        self.fresh = True
        finding = None
        for sample in samples:
            sequence, device_s, receive_s, status, wrench, _ = sample
            raw_n = self._sign * wrench[self._index]
            if sequence <= self._sequence:
                finding = finding or Finding(
                    "R10", float(sequence), float(self._sequence), "",
                    f"{self._name}: sample {sequence} came after sample {self._sequence}",
                )  # fmt: skip
            if wrench == self._wrench:
                self._same += 1
                if self._same >= self.identical_counts > 0:
                    finding = finding or Finding(
                        "R4", float(self._same + 1), float(self.identical_counts), "samples",
                        f"{self._name}: {self._same + 1} identical samples in a row",
                    )  # fmt: skip
            else:
                self._same = 0
                self._wrench = wrench
            if status:
                finding = finding or Finding(
                    "R4", float(status), 0.0, "",
                    f"{self._name}: the device flags its sample (status {status})",
                )  # fmt: skip
            if -self._full_scale_n < raw_n < self._full_scale_n:
                self.raw_n = raw_n
            else:
                finding = finding or Finding(
                    "R4", raw_n, self._full_scale_n, "N",
                    f"{self._name}: {raw_n:.4g} N is not finite or beyond full scale",
                )  # fmt: skip
            self._sequence = sequence
        self.receive_s = receive_s
        if away_s := self._clock.runs_away(receive_s, device_s):
            finding = finding or Finding(
                "R10", away_s, self._clock_limit_s, "s",
                f"{self._name}: device time is {away_s * 1e3:+.1f} ms away from host time",
            )  # fmt: skip
        return finding

    def _missing(self, now_s: float) -> Finding | None:
        self.fresh = False
        self._empty += 1
        if self.receive_s != self.receive_s:
            self.receive_s = now_s
        age_s = now_s - self.receive_s
        if age_s > self._stale_s and self._empty >= EMPTY_TICKS:
            return Finding(
                "R3", age_s, self._stale_s, "s",
                f"{self._name}: no new sample for {age_s * 1e3:.1f} ms",
            )  # fmt: skip
        return None


class ArmWatch:
    """State of the arm's stream; `force_n` is its own force channel, not tared."""

    __slots__ = (
        "_clock", "_clock_limit_s", "_counts", "_empty", "_force_n", "_needs_force", "_same",
        "_sequence", "_stale_s", "force_n", "position_m", "receive_s",
    )  # fmt: skip

    def __init__(
        self, *, stale_s: float, identical_counts: int, clock_s: float, needs_force: bool
    ) -> None:
        self._stale_s = stale_s
        self._counts = identical_counts
        self._clock = _Clock(clock_s)
        self._clock_limit_s = clock_s
        self._needs_force = needs_force
        self._sequence = -1
        self._same = 0
        self._empty = 0
        self._force_n = float("nan")
        self.force_n = float("nan")
        self.position_m = float("nan")
        self.receive_s = float("nan")

    def take(self, samples: Sequence[ArmSample], now_s: float) -> Finding | None:
        """Follow the stream; the first thing wrong with it."""
        if not samples:
            self._empty += 1
            if self.receive_s != self.receive_s:
                self.receive_s = now_s
            age_s = now_s - self.receive_s
            if age_s > self._stale_s and self._empty >= EMPTY_TICKS:
                return Finding(
                    "R3", age_s, self._stale_s, "s",
                    f"arm: no new sample for {age_s * 1e3:.1f} ms",
                )  # fmt: skip
            return None
        self._empty = 0
        finding = None
        for sample in samples:
            sequence, device_s, receive_s, status, position_m, force_n, _ = sample
            if sequence <= self._sequence:
                finding = finding or Finding(
                    "R10", float(sequence), float(self._sequence), "",
                    f"arm: sample {sequence} came after sample {self._sequence}",
                )  # fmt: skip
            if status:
                finding = finding or Finding(
                    "R4", float(status), 0.0, "",
                    f"arm: cannot follow commands, or flags its sample (status {status})",
                )  # fmt: skip
            if position_m - position_m == 0.0:
                self.position_m = position_m
            else:
                finding = finding or Finding(
                    "R4", position_m, 0.0, "m", f"arm: position {position_m} is not finite"
                )
            if self._needs_force:
                finding = finding or self._check_force(force_n)
            self._sequence = sequence
        self.receive_s = receive_s
        if away_s := self._clock.runs_away(receive_s, device_s):
            finding = finding or Finding(
                "R10", away_s, self._clock_limit_s, "s",
                f"arm: device time is {away_s * 1e3:+.1f} ms away from host time",
            )  # fmt: skip
        return finding

    def _check_force(self, force_n: float) -> Finding | None:
        if force_n == self._force_n:
            self._same += 1
            if self._same >= self._counts > 0:
                return Finding(
                    "R4", float(self._same + 1), float(self._counts), "samples",
                    f"arm force: {self._same + 1} identical samples in a row",
                )  # fmt: skip
            return None
        self._same = 0
        self._force_n = force_n
        if force_n - force_n == 0.0:
            self.force_n = force_n
            return None
        return Finding("R4", force_n, 0.0, "N", f"arm force: {force_n} N is not finite")
