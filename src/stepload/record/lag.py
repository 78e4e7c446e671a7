"""The delay of the force behind the position, estimated from the ramps of a run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_WINDOW_S = 4.0
_SHORT_WINDOW_S = 2.0
_LEAST_WINDOWS = 3
_SMOOTH_S = 0.1
_EVERY_S = 0.01
_BLOCK_S = 0.25
_DEGREE = 3
_ROUNDS = 12
_PRECISION_S = 2e-5
LAG_THAT_MATTERS_S = 0.5e-3
"""A smaller lag changes no result; a larger one is corrected where it is a lag."""


@dataclass(frozen=True, slots=True)
class Lag:
    """The delay of the force behind the position, in s, with its standard uncertainty.

    NaN and inf where no ramp allows an estimate; `how` says what it is based on.
    """

    lag_s: float
    sigma_s: float
    how: str

    @property
    def correction_s(self) -> float:
        """The part to correct for, in s: all of a significant lag, nothing of a lead.

        A sensor is late, never early. A force that is ahead of its position comes from creep or
        damping of the contact or the load path: correcting for it would make that part of the law.
        """
        late = self.lag_s > max(3.0 * self.sigma_s, LAG_THAT_MATTERS_S)
        return self.lag_s if late else 0.0


@dataclass(frozen=True, slots=True)
class _Segment:
    """One stretch in contact on an even grid; force already smoothed, of length N - margin."""

    grid_s: FloatArray
    time_s: FloatArray
    position_m: FloatArray
    force_n: FloatArray
    rate_n_per_s: FloatArray


def _smooth(values: FloatArray, size: int) -> FloatArray:
    weights = np.hanning(size + 2)[1:-1]
    return np.convolve(values, weights / weights.sum(), "valid")


def _segments(
    time_s: FloatArray, force_n: FloatArray, position_m: FloatArray, chosen: BoolArray, dt_s: float
) -> Iterator[_Segment]:
    size = round(_SMOOTH_S / dt_s) | 1
    edges = np.flatnonzero(np.diff(np.concatenate(([0], chosen.view(np.int8), [0]))))
    for start, stop in edges.reshape(-1, 2).tolist():
        grid_s = np.arange(time_s[start], time_s[stop - 1], dt_s)
        if len(grid_s) < size + round(_SHORT_WINDOW_S / dt_s):
            continue
        part = slice(start, stop)
        force = _smooth(np.interp(grid_s, time_s[part], force_n[part]), size)
        yield _Segment(grid_s, time_s[part], position_m[part], force, np.gradient(force, dt_s))


def _windows(samples: int, dt_s: float) -> Iterator[tuple[int, int]]:
    """Equal windows of 4 s or more; where that makes fewer than three, of 2 s or more."""
    span_s = samples * dt_s
    count = max(min(_LEAST_WINDOWS, int(span_s / _SHORT_WINDOW_S)), int(span_s / _WINDOW_S))
    size = samples // max(count, 1)
    for first in range(0, count * size, size):
        yield first, first + size


def _scores(segments: list[_Segment], lag_s: float, dt_s: float) -> FloatArray:
    """Evidence of each window on a lag beyond `lag_s`: (N, 3) of score, weight and variance.

    A force that comes late by a small t is g(x) − t·dF/dt: per window the force is regressed on a
    cubic of the shifted position, and score / weight is the coefficient of −dF/dt. The variance is
    that of the score, from sums over blocks longer than the smoothing, so that correlated noise, or
    more noise in a ramp than at rest, is accounted for.
    """
    every = max(1, round(_EVERY_S / dt_s))
    per_block = max(1, round(_BLOCK_S / (every * dt_s)))
    found = []
    for segment in segments:
        margin = len(segment.grid_s) - len(segment.force_n) + 1
        position = _smooth(
            np.interp(segment.grid_s - lag_s, segment.time_s, segment.position_m), margin
        )
        for first, stop in _windows(len(position), dt_s):
            window = slice(first, stop, every)
            x = position[window]
            spread = float(np.ptp(x))
            if spread == 0.0 or len(x) <= (_DEGREE + 2) * per_block:
                continue
            law, _ = np.linalg.qr(np.vander((x - x.mean()) / spread, _DEGREE + 1))
            y, rate = segment.force_n[window], segment.rate_n_per_s[window]
            rate = rate - law @ (law.T @ rate)
            y = y - law @ (law.T @ y)
            parts = np.add.reduceat(rate * y, np.arange(0, len(x), per_block))
            free = len(parts) / (len(parts) - _DEGREE - 2)
            found.append((-float(parts.sum()), float(rate @ rate), free * float(parts @ parts)))
    return np.array(found).reshape(-1, 3)


def measure_lag(
    time_s: FloatArray,
    force_n: FloatArray,
    position_m: FloatArray,
    in_contact: BoolArray | None = None,
    max_lag_s: float = 0.1,
) -> Lag:
    """Lag of force behind position from the ramps of a run.

    Within a window of some seconds the force is a smooth function of the position, and a lag shows
    where the speed changes: at both ends of a ramp. The lag is the shift at which the rate of the
    force explains nothing more; its uncertainty comes from the noise within the windows or from how
    much they disagree, whichever is more. Damping and creep look like a negative lag and are
    measured with it: see `Lag.correction_s`.

    Args:
        time_s, force_n, position_m: shape (N,), times rising.
        in_contact: which samples to use, all when None.
        max_lag_s: a larger lag is not believed.
    """
    chosen = np.ones(len(time_s), bool) if in_contact is None else in_contact
    if chosen.sum() < 16:
        return Lag(np.nan, np.inf, "no data in contact")
    dt_s = float(np.median(np.diff(time_s)))
    segments = list(_segments(time_s, force_n, position_m, chosen, dt_s))
    scores = _scores(segments, 0.0, dt_s)
    count = len(scores)
    if count < _LEAST_WINDOWS:
        return Lag(np.nan, np.inf, f"only {count} windows of 2 s, {_LEAST_WINDOWS} are needed")
    unknown = Lag(np.nan, np.inf, f"no clear ramp in {count} windows")
    lag_s, step_s = 0.0, float(scores[:, 0].sum() / scores[:, 1].sum())
    for _ in range(_ROUNDS):
        if not abs(lag_s + step_s) < max_lag_s:
            return unknown
        before = float(scores[:, 0].sum())
        lag_s += step_s
        scores = _scores(segments, lag_s, dt_s)
        left = float(scores[:, 0].sum())
        slope = (before - left) / step_s
        if not slope > 0.0:
            return unknown
        step_s = left / slope
        if abs(step_s) < _PRECISION_S:
            break
    else:
        return unknown
    each = scores[:, 0] - scores[:, 0].mean()
    variance = max(float(each @ each) * count / (count - 1), float(scores[:, 2].sum()))
    return Lag(lag_s + step_s, np.sqrt(variance) / slope, f"the ends of ramps in {count} windows")
