"""Cycles of a curve: loading, hold and unloading, found from force and travel alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.identification.curve_channels import white_noise
from stepload.identification.fit import FloatArray

TURN = 0.15
"""The force turns where it falls by this share of its last peak, or rises again by as much."""
LEAST_PEAK = 0.02
"""A peak below this share of the largest is not counted."""
HELD_PEAK = 0.99
"""Samples above this share of the cycle's peak belong to its hold."""
RETREAT = 0.01
"""Smallest retreat of an unloading, as a share of the whole travel; relaxation does not retreat."""
STILL = 1e-3
"""A travel within this share of its largest counts as standing still."""
_NOISE = 6.0


class CycleParts(NamedTuple):
    """Slices of one cycle in the order of time; `hold` may be empty.

    `loading` begins where the cycle before ends; `unloading` is None where the data end before it.
    """

    loading: slice
    hold: slice
    unloading: slice | None


def cycles_of(force_n: FloatArray, travel_m: FloatArray) -> list[CycleParts]:
    """Split a curve into cycles.

    A cycle ends where the force begins to rise again after it fell, to zero or in part. Noise,
    spikes of up to two samples, steps with holds, creep and relaxation in holds, and the pull of
    adhesion make no cycle.

    Args:
        force_n: (N,) tared force in the order of time, pressing positive.
        travel_m: (N,) travel, rising towards the payload. A fall of the force counts as unloading
            only where the travel retreats as well.

    Returns:
        The cycles; none where no force is positive.
    """
    force = _without_spikes(force_n)
    top_n = float(force.max(initial=0.0))
    if not top_n > 0.0:
        return []
    noise_n = white_noise(force_n)
    travel = _without_spikes(travel_m)
    span_m, noise_m = float(np.ptp(travel)), white_noise(travel_m)
    retreat_m = max(RETREAT * span_m, _NOISE * noise_m)
    still_m = max(STILL * span_m, _NOISE * noise_m)
    least_n = max(LEAST_PEAK * top_n, _NOISE * noise_n)
    turns = _turns(
        force, travel, least_n=least_n, least_turn_n=_NOISE * noise_n, retreat_m=retreat_m
    )
    return [_parts(force, travel, turn, slack_n=3.0 * noise_n, still_m=still_m) for turn in turns]


class _Turn(NamedTuple):
    """A cycle: its first sample, its peak, the sample after its last, and whether it unloaded."""

    start: int
    peak: int
    stop: int
    unloaded: bool


def _without_spikes(values: FloatArray) -> FloatArray:
    """Running median of five samples."""
    if values.size < 16:
        return values
    padded = np.pad(values, 2, mode="edge")
    a, b, c, d, e = (padded[i : i + values.size] for i in range(5))
    # The median of five: neither the least nor the largest of four, or else the fifth.
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray(np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), e)))


def _turns(
    force: FloatArray, travel: FloatArray, *, least_n: float, least_turn_n: float, retreat_m: float
) -> list[_Turn]:
    found: list[_Turn] = []
    start = peak_at = valley_at = 0
    peak, deepest = float(force[0]), float(travel[0])
    valley, shallowest = peak, deepest
    falling = False
    for i, (f, x) in enumerate(zip(force.tolist(), travel.tolist(), strict=True)):
        if not falling:
            if f >= peak:
                peak, peak_at = f, i
            if x > deepest:
                deepest = x
            if (
                peak > least_n
                and peak - f > max(TURN * peak, least_turn_n)
                and deepest - x > retreat_m
            ):
                falling, valley, valley_at, shallowest = True, f, i, x
        else:
            if f < valley:
                valley, valley_at = f, i
            if x < shallowest:
                shallowest = x
            if f - valley > max(TURN * peak, least_turn_n) and x - shallowest > retreat_m:
                found.append(_Turn(start, peak_at, valley_at + 1, unloaded=True))
                start, falling = valley_at + 1, False
                peak, peak_at, deepest = f, i, x
    if falling or peak > least_n:
        found.append(_Turn(start, peak_at, force.size, unloaded=falling))
    return found


def _parts(
    force: FloatArray, travel: FloatArray, turn: _Turn, *, slack_n: float, still_m: float
) -> CycleParts:
    inside = force[turn.start : turn.stop]
    peak_n = float(force[turn.peak])
    held = inside >= min(HELD_PEAK * peak_n, peak_n - slack_n)
    first = int(np.argmax(held))
    path = travel[turn.start : turn.stop]
    held[first:] |= path[first:] >= float(path.max()) - still_m
    last = held.size - int(np.argmax(held[::-1])) if turn.unloaded else held.size
    begin, end = turn.start + first + 1, turn.start + max(last, first + 1)
    unloading = slice(end, turn.stop) if turn.unloaded and end < turn.stop else None
    return CycleParts(slice(turn.start, begin), slice(begin, end), unloading)
