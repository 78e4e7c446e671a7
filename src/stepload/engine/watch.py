"""Is this stream of samples alive and sane? Rules R3, R4 and R10, one watch for each stream."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot
from typing import NamedTuple

from stepload.rig.samples import ArmSample, ForceSample, SixFloats

AXES = {"fx": 0, "fy": 1, "fz": 2}
EMPTY_TICKS = 3
"""Ticks in a row without a sample before R3 may trip: after a late tick a reader must catch up."""
LATE_CLOCK_TICKS = 5
AHEAD_S = 1e-4
"""A sample stamped this much later than its tick has no age that R3 could judge."""
LIVES_SAMPLES = 20
LIVES_SHARE = 0.05
"""A sensor whose lateral components changed more often than this in free air, and in more than this
share of its readings, measures lateral force. A change of one step of its resolution does not
count: where noise is less than a step, a sound sensor stands still as soon as its mean lies between
two steps."""
COARSE_SAMPLES = 5
COARSE_SHARE = 0.001
COARSE_COUNTS = 150
"""With this many lateral changes the noise is at least 0.3 of a step: such a sensor may repeat
itself, but not for `COARSE_COUNTS` readings."""
STEPS = 1.5
"""A change by more than this multiple of the smallest one seen is more than one step."""
ACROSS_ALPHA = 0.1
"""Share of a new reading in the smoothed force across the pressing axis, per tick."""
CLOCK_TRACKING = 1e-3
"""Share of a clock difference that counts as slow drift and is followed, per tick."""


class Trip(NamedTuple):
    """A rule that samples have broken, with the value and the limit it was judged by."""

    rule: str
    value: float
    limit: float
    unit: str
    message: str


Found = Callable[[str, float, float, str, str], Trip | None]
"""Makes a trip of (rule, value, limit, unit, message). A run uses `Trip` itself; tests of the
rules may pass one that leaves a rule out."""


def wrench_axis(axis: str) -> tuple[int, float]:
    """Index into a wrench and sign of "+fx" … "-fz"."""
    return AXES[axis[1:]], -1.0 if axis[0] == "-" else 1.0


class _StreamWatch:
    """Checks that a stream is fresh (R3), in order, and not stamped in the future (R10).

    `receive_s` is the receive time of the newest sample, `fresh` whether this tick brought one.
    """

    def __init__(self, name: str, *, stale_s: float, clock_s: float, found: Found) -> None:
        self.name = name
        self.found = found
        self._stale_s = stale_s
        self._clock_s = clock_s
        self._sequence = -1
        self._empty = self._late = 0
        self.receive_s = self._offset_s = float("nan")
        self.fresh = False

    def _timed(
        self, device_s: float, receive_s: float, now_s: float, trip: Trip | None
    ) -> Trip | None:
        """R10 for the times of the newest sample, where no earlier rule is broken."""
        self.receive_s = receive_s
        if receive_s - now_s > AHEAD_S:
            trip = trip or self.found(
                "R10", receive_s - now_s, AHEAD_S, "s",
                f"{self.name}: a sample is stamped {(receive_s - now_s) * 1e3:.3g} ms later than"
                " now: its age cannot be known",
            )  # fmt: skip
        away_s, clock_s = receive_s - device_s - self._offset_s, self._clock_s
        if -clock_s < away_s < clock_s:
            self._offset_s += CLOCK_TRACKING * away_s
            self._late = 0
            return trip
        if away_s != away_s:  # no device clock, or the first sample
            self._offset_s = receive_s - device_s
            return trip
        self._late += 1
        if self._late >= LATE_CLOCK_TICKS:
            trip = trip or self.found(
                "R10", away_s, clock_s, "s",
                f"{self.name}: device time is {away_s * 1e3:+.1f} ms away from host time",
            )  # fmt: skip
        return trip

    def _disorder(self, sequence: int, last: int) -> Trip | None:
        return self.found(
            "R10", float(sequence), float(last), "",
            f"{self.name}: sample {sequence} came after sample {last}",
        )  # fmt: skip

    def _missing(self, now_s: float) -> Trip | None:
        self.fresh = False
        self._empty += 1
        if self.receive_s != self.receive_s:
            self.receive_s = now_s
        age_s = now_s - self.receive_s
        if age_s > self._stale_s and self._empty >= EMPTY_TICKS:
            return self.found(
                "R3", age_s, self._stale_s, "s",
                f"{self.name}: no new sample for {age_s * 1e3:.1f} ms",
            )  # fmt: skip
        return None

    def _frozen(self, name: str, equal: int, counts: int) -> Trip | None:
        return self.found(
            "R4", float(equal), float(counts), "samples",
            f"{name}: {equal} identical samples in a row",
        )  # fmt: skip


class ForceWatch(_StreamWatch):
    """Watches a force sensor; `raw_n` is its newest reading along the pressing axis, not tared, and
    `smooth_n` the same, filtered over some ticks. `across_n` is its newest lateral force, less that
    at `tare`, and `smooth_across_n` the same, filtered.

    `wrench` is that reading as the sensor gives it, six components, () before any; `same` how often
    it was repeated.
    """

    def __init__(
        self,
        name: str,
        axis: str,
        *,
        full_scale_n: float,
        stale_s: float,
        identical_counts: int,
        clock_s: float,
        found: Found = Trip,
    ) -> None:
        super().__init__(name, stale_s=stale_s, clock_s=clock_s, found=found)
        self._index, self._sign = wrench_axis(axis)
        self._i, self._j = (index for index in AXES.values() if index != self._index)
        self._zero: Sequence[float] = (0.0,) * 6
        self._smooth_i = self._smooth_j = float("nan")
        self.across_n = self.smooth_across_n = 0.0
        self._torque_i = self._torque_j = 0.0
        self._full_scale_n = full_scale_n
        self.identical_counts = identical_counts
        self.wrench: tuple[float, ...] = ()
        self.same = self._same_across = self._lived_across = self._seen_across = 0
        self._least_across = 0
        self._step_i = self._step_j = float("inf")
        self._lives_across: bool | None = None
        self.raw_n = self.smooth_n = float("nan")

    def torque_beside(self, lever_m: float) -> float:
        """Lateral torque in N·m that a force on the axis does not explain, filtered and tared.

        The force is taken to act `lever_m` from the sensor's origin towards the plate. The sign of
        the axis does not show whether a sensor reports the plate's force on the tool or the tool's
        on the plate, so on which side of it the plate lies: the smaller of both results counts.
        """
        i, j, zero = self._i, self._j, self._zero
        if self._smooth_i != self._smooth_i:
            return 0.0
        across_i, across_j = self._smooth_i - zero[i], self._smooth_j - zero[j]
        torque_i, torque_j = self._torque_i - zero[3 + i], self._torque_j - zero[3 + j]
        return min(
            hypot(torque_i + side * across_j, torque_j - side * across_i)
            for side in (lever_m, -lever_m)
        )

    def tare(self, wrench: Sequence[float] = ()) -> None:
        """Use this mean of the six components as zero; without one, the present filtered values."""
        if self._lives_across is None:
            lived, seen = self._lived_across, self._seen_across
            if not lived > max(float(LIVES_SAMPLES), LIVES_SHARE * seen):
                self._least_across = COARSE_COUNTS
            self._lives_across = lived > max(float(COARSE_SAMPLES), COARSE_SHARE * seen)
        if wrench:
            self._zero = tuple(wrench)
        elif self._smooth_i == self._smooth_i:
            zero, i, j = [0.0] * 6, self._i, self._j
            zero[i], zero[j] = self._smooth_i, self._smooth_j
            zero[3 + i], zero[3 + j] = self._torque_i, self._torque_j
            self._zero = tuple(zero)
        if wrench := self.wrench:
            zero_i, zero_j = self._zero[self._i], self._zero[self._j]
            self.across_n = hypot(wrench[self._i] - zero_i, wrench[self._j] - zero_j)
            if self._smooth_i == self._smooth_i:
                self.smooth_across_n = hypot(self._smooth_i - zero_i, self._smooth_j - zero_j)

    @property
    def axis(self) -> tuple[int, float]:
        """Index of the pressing axis in the wrench, and its sign."""
        return self._index, self._sign

    def project(self, sample: ForceSample) -> float:
        """Force along the pressing axis, not tared."""
        return self._sign * sample.wrench[self._index]

    def take(self, samples: Sequence[ForceSample], now_s: float) -> Trip | None:
        """Process new samples; returns the first trip, or None."""
        if not samples:
            return self._missing(now_s)
        self._empty = 0
        self.fresh = True
        disorder = trip = None
        last, held, scale_n = self._sequence, self.wrench, self._full_scale_n
        index, sign, i, j = self._index, self._sign, self._i, self._j
        for sample in samples:
            sequence, device_s, receive_s, status, wrench, _ = sample
            if sequence <= last:
                disorder = disorder or self._disorder(sequence, last)
            last = sequence
            raw_n = sign * wrench[index]
            if wrench == held:
                self.same += 1
                if self.same >= self.identical_counts > 0:
                    trip = trip or self._frozen(self.name, self.same + 1, self.identical_counts)
            else:
                if trip is None:
                    if self._lives_across is not None and wrench[i] != held[i]:
                        self._same_across = 0
                    else:
                        trip = self._judge_across(wrench, held)
                self.same = 0
                self.wrench = held = wrench
            if status:
                trip = trip or self.found(
                    "R4", float(status), 0.0, "",
                    f"{self.name}: the device flags its sample (status {status})",
                )  # fmt: skip
            whole_n = sum(wrench)
            if -scale_n < raw_n < scale_n and whole_n - whole_n == 0.0:
                self.raw_n = raw_n
            else:
                trip = trip or self.found(
                    "R4", raw_n, scale_n, "N",
                    f"{self.name}: {raw_n:.4g} N, or a force across it, is not finite or beyond"
                    " full scale",
                )  # fmt: skip
        self._sequence = last
        zero, smooth_i, smooth_j = self._zero, self._smooth_i, self._smooth_j
        if trip is None:
            force_i, force_j = wrench[i], wrench[j]
            torque_i, torque_j = wrench[i + 3], wrench[j + 3]
            if smooth_i != smooth_i:
                self.smooth_n, smooth_i, smooth_j = raw_n, force_i, force_j
                self._torque_i, self._torque_j = torque_i, torque_j
            self.smooth_n += ACROSS_ALPHA * (raw_n - self.smooth_n)
            self._smooth_i = smooth_i = smooth_i + ACROSS_ALPHA * (force_i - smooth_i)
            self._smooth_j = smooth_j = smooth_j + ACROSS_ALPHA * (force_j - smooth_j)
            self._torque_i += ACROSS_ALPHA * (torque_i - self._torque_i)
            self._torque_j += ACROSS_ALPHA * (torque_j - self._torque_j)
        zero_i, zero_j = zero[i], zero[j]
        self.across_n = hypot(held[i] - zero_i, held[j] - zero_j)
        if smooth_i == smooth_i:
            self.smooth_across_n = hypot(smooth_i - zero_i, smooth_j - zero_j)
        away_s, clock_s = receive_s - device_s - self._offset_s, self._clock_s
        if receive_s - now_s <= AHEAD_S and -clock_s < away_s < clock_s:
            self.receive_s = receive_s
            self._offset_s += CLOCK_TRACKING * away_s
            self._late = 0
            return disorder or trip
        return self._timed(device_s, receive_s, now_s, disorder or trip)

    def _judge_across(self, wrench: Sequence[float], last: Sequence[float]) -> Trip | None:
        """R4 where the lateral components are frozen while the rest of the reading changes.

        Only for a sensor whose lateral components changed in free air; those of a load cell do not.
        """
        i, j = self._i, self._j
        if self._lives_across is None and last:
            self._seen_across += 1
            if self._leaps(abs(wrench[i] - last[i]), abs(wrench[j] - last[j])):
                self._lived_across += 1
        if not last or wrench[i] != last[i] or wrench[j] != last[j]:
            self._same_across = 0
            return None
        self._same_across += 1
        counts, equal = self.identical_counts, self._same_across
        if not self._lives_across or not counts > 0:
            return None
        counts = max(counts, self._least_across)
        if equal < counts:
            return None
        return self._frozen(f"{self.name}, across the axis", equal + 1, counts)

    def _leaps(self, change_i: float, change_j: float) -> bool:
        """Whether one of the changes is over `STEPS` times the smallest one of its component."""
        if 0.0 < change_i < self._step_i:
            self._step_i = change_i
        if 0.0 < change_j < self._step_j:
            self._step_j = change_j
        return change_i > STEPS * self._step_i or change_j > STEPS * self._step_j


class ArmSide:
    """Lateral force by the arm's own estimate, filtered; `across_n` is it less that at `tare`.

    `told` is true once the arm has reported any.
    """

    def __init__(self) -> None:
        self.told = False
        self.across_n = self._x_n = self._y_n = self._zero_x_n = self._zero_y_n = 0.0

    def take(self, wrench: SixFloats) -> bool:
        """Filter the newest wrench; False if it is not finite although an earlier one was."""
        x_n, y_n = wrench[0], wrench[1]
        if not (x_n - x_n == 0.0 and y_n - y_n == 0.0):
            return not self.told
        if not self.told:
            self.told, self._x_n, self._y_n = True, x_n, y_n
        self._x_n += ACROSS_ALPHA * (x_n - self._x_n)
        self._y_n += ACROSS_ALPHA * (y_n - self._y_n)
        self.across_n = hypot(self._x_n - self._zero_x_n, self._y_n - self._zero_y_n)
        return True

    def tare(self) -> None:
        """Use the present filtered force as zero."""
        self._zero_x_n, self._zero_y_n = self._x_n, self._y_n
        self.across_n = 0.0


class ArmWatch(_StreamWatch):
    """Watches the arm; `force_n` is its own force channel, not tared, `side` its own lateral force
    where it is the second channel, `pose` its newest pose."""

    def __init__(
        self,
        *,
        stale_s: float,
        identical_counts: int,
        clock_s: float,
        needs_force: bool,
        found: Found = Trip,
    ) -> None:
        super().__init__("arm", stale_s=stale_s, clock_s=clock_s, found=found)
        self._counts = identical_counts
        self._needs_force = needs_force
        self._same = 0
        self._force_n = float("nan")
        self.force_n = float("nan")
        self.position_m = float("nan")
        self.pose: SixFloats = (float("nan"),) * 6
        self.side = ArmSide()

    def take(self, samples: Sequence[ArmSample], now_s: float) -> Trip | None:
        """Process new samples; returns the first trip, or None."""
        if not samples:
            return self._missing(now_s)
        self._empty = 0
        self.fresh = True
        disorder = trip = None
        last, needs_force = self._sequence, self._needs_force
        for sample in samples:
            sequence, device_s, receive_s, status, position_m, force_n, pose, wrench = sample
            if sequence <= last:
                disorder = disorder or self._disorder(sequence, last)
            last = sequence
            if status:
                trip = trip or self.found(
                    "R4", float(status), 0.0, "",
                    f"arm: cannot follow commands, or flags its sample (status {status})",
                )  # fmt: skip
            if position_m - position_m == 0.0:
                self.position_m = position_m
                self.pose = pose
            else:
                trip = trip or self.found(
                    "R4", position_m, 0.0, "m", f"arm: position {position_m} is not finite"
                )
            if needs_force:
                if force_n != self._force_n and force_n - force_n == 0.0:
                    self._same = 0
                    self._force_n = self.force_n = force_n
                else:
                    force = self._judge_force(force_n)
                    trip = trip or force
        self._sequence = last
        if needs_force and not self.side.take(wrench):
            trip = trip or self.found(
                "R4", float("nan"), 0.0, "N", "arm force: it is not finite across the press"
            )
        away_s, clock_s = receive_s - device_s - self._offset_s, self._clock_s
        if receive_s - now_s <= AHEAD_S and -clock_s < away_s < clock_s:
            self.receive_s = receive_s
            self._offset_s += CLOCK_TRACKING * away_s
            self._late = 0
            return disorder or trip
        return self._timed(device_s, receive_s, now_s, disorder or trip)

    def _judge_force(self, force_n: float) -> Trip | None:
        """R4 for a force of the arm that repeats itself, or is not finite."""
        if force_n == self._force_n:
            self._same += 1
            if self._same >= self._counts > 0:
                return self._frozen("arm force", self._same + 1, self._counts)
            return None
        self._same = 0
        self._force_n = force_n
        return self.found("R4", force_n, 0.0, "N", f"arm force: {force_n} N is not finite")
