"""Properties read from an imported curve: noise, quantum, free air, touch, signs, glitches."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stepload.identification.fit import BoolArray, FloatArray, IntArray
from stepload.units import format_quantity as f

LEAST_SLOPE = 0.15
"""A contact with an exponent up to 2.5 at 1 % of its peak force is at least that stiff, as a share
of its mean stiffness; what is softer is free air."""
REPEATS = 0.5
"""A channel with fewer distinct values than this share of its samples is quantised."""
FINEST = 1e-9
"""A quantum below this share of the channel's range is ignored."""
EXACT = 1e-5
"""A channel whose noise and quantum are below this share of its range was computed or smoothed: its
data do not show how accurately it was measured."""
TILT_SHARE, _TILT_STEPS = 0.1, 8
"""The slope of the force in free air is used only if it was seen over this share of the travel."""
_DIFFERENCES, _SMOOTH = 4, 0.3
_WINDOWS, _WINDOW = 64, 2048
"""Noise of long data is taken from so many windows of so many samples."""
_KEPT, _KEPT_SD = 0.98, 0.933
"""Share of the differences that is kept, and its standard deviation where noise is normal."""
_AT_AN_END = 0.002
"""Share of the samples that is taken as one end of the travel."""
_CLEAR = 0.5
"""An end whose force is below this share of the other's is the one in free air."""
_SEEN, _OF_NOISE = 0.05, 6.0
"""Least difference of the two ends for a sign change: as a share of the force range, and in
standard deviations of the noise."""
LEAST_SAMPLES = 32
"""Shortest table in which glitches are looked for: below it one looks like the top of a press."""
WIDEST = 2
"""Largest number of samples in a glitch."""
SUDDEN = 5.0
"""Least ratio of a glitch to the steps between the samples next to it. The top of a press and the
dip of a snap-in, which have a gradual flank, stay below."""
MOST = 0.01
"""Above this share of outliers the channel is taken as it is, and none counts as a glitch."""
_BESIDE, _ABOUT = 3, 12
_NOISE, _QUANTA, _LEAST = 10.0, 4.0, 1e-3


def white_noise(values: FloatArray, order: int = _DIFFERENCES) -> float:
    """Standard deviation of the noise between samples; 0 for too few.

    Fourth differences are blind to the curvature of a law, even where samples are few; spikes and
    the corners of ramps are left out.
    """
    if len(values) <= 2 * order:
        return 0.0
    if len(values) > _WINDOWS * _WINDOW:
        starts = np.linspace(0, len(values) - _WINDOW, _WINDOWS).astype(np.intp)
        windows = values[starts[:, None] + np.arange(_WINDOW)]
        differences = np.sort(np.abs(np.diff(windows, order, axis=1)), axis=None)
    else:
        differences = np.sort(np.abs(np.diff(values, order)))
    kept = differences[: math.ceil(_KEPT * differences.size)]
    gain = math.sqrt(math.comb(2 * order, order))
    return float(np.sqrt(np.mean(kept**2))) / (gain * _KEPT_SD)


def quantum(values: FloatArray) -> float:
    """The resolution of a channel as its data show it, in its unit; 0 where it is not quantised."""
    different = np.unique(values)
    if len(different) > max(REPEATS * len(values), 3):
        return 0.0
    steps = np.diff(different)
    steps = steps[steps > 1e-3 * float(np.median(steps))] if steps.size else steps
    least = FINEST * float(np.ptp(values))
    return float(steps.min()) if steps.size and float(steps.min()) > least else 0.0


def is_exact(values: FloatArray) -> bool:
    """Whether a channel is neither noisy nor quantised, so that its data do not show its accuracy.

    White noise has the same size in differences of every order; a smooth signal becomes smaller.
    """
    least, noise = EXACT * float(np.ptp(values)), white_noise(values)
    if quantum(values) > least:
        return False
    return noise <= least or white_noise(values, 2 * _DIFFERENCES) < _SMOOTH * noise


def first_touch(force_n: FloatArray, touch_n: float) -> int:
    """Index of the first sample of a lasting contact; a spike in free air does not count."""
    half = int(np.argmax(force_n >= 0.5 * force_n.max()))
    free = np.flatnonzero(force_n[:half] < touch_n)
    return int(free[-1]) + 1 if free.size else 0


class FreeAir(NamedTuple):
    """The force in free air: its mean, and its slope over the travel about `at_m`."""

    mean_n: float
    slope_n_per_m: float
    at_m: float

    def at(self, travel_m: FloatArray) -> FloatArray:
        """Force extrapolated from free air to a travel."""
        return np.asarray(self.mean_n + self.slope_n_per_m * (travel_m - self.at_m))


def free_air(travel_m: FloatArray, force_n: FloatArray, band_n: float) -> FreeAir | None:
    """The force while the arm moves in free air; None where the data begin in contact or at rest.

    Its slope is used only where it exceeds the band over the whole travel: it is drift, or optical
    interference of a cantilever.

    Args:
        travel_m, force_n: (N,) a loading, force not tared.
        band_n: how far the force may go in free air.
    """
    begin_n = float(np.median(force_n[: max(len(force_n) // 100, 5)]))
    end = first_touch(force_n - begin_n, band_n)
    if end < 8:
        return None
    span_m = float(np.ptp(travel_m))
    found = _line(travel_m[: end // 2 + 1], force_n[: end // 2 + 1], span_m, band_n)
    for _ in range(_TILT_STEPS):
        # A slope leaves the band before the touch: what follows the line is free air as well.
        further = first_touch(force_n - found.at(travel_m), band_n)
        if not found.slope_n_per_m or further <= end:
            break
        end = further
        found = _line(travel_m[: end // 2 + 1], force_n[: end // 2 + 1], span_m, band_n)
    x, y = travel_m[:end] - travel_m[:end].mean(), force_n[:end]
    spread = float(x @ x)
    mean_slope = float(np.ptp(force_n)) / max(span_m, math.ulp(0.0))
    if spread <= 0.0:
        return None
    slope = float(x @ y) / spread
    if slope + 3.0 * float(np.std(y - slope * x)) / math.sqrt(spread) > LEAST_SLOPE * mean_slope:
        return None
    if float(np.ptp(travel_m[:end])) < TILT_SHARE * span_m:
        return FreeAir(float(force_n[: end // 2 + 1].mean()), 0.0, found.at_m)
    return found


def _line(x: FloatArray, y: FloatArray, span_m: float, band_n: float) -> FreeAir:
    at_m, mean_n = float(x.mean()), float(y.mean())
    off = x - at_m
    spread = float(off @ off)
    slope = float(off @ y) / spread if spread > 0.0 else 0.0
    error = float(np.std(y)) / math.sqrt(spread) if spread > 0.0 else math.inf
    seen = abs(slope) * span_m > band_n and abs(slope) > 5.0 * error
    return FreeAir(mean_n, slope if seen else 0.0, at_m)


class Signs(NamedTuple):
    """Factors +1 or −1 that make pressing positive and travel rise towards the payload.

    `shallow_n` is the force at the shallow end, `deep_n` at the deep one, after turning.
    """

    travel: float
    force: float
    shallow_n: float
    deep_n: float


def signs(travel_m: FloatArray, force_n: FloatArray) -> Signs:
    """Find the deep end of the travel, where the payload is pressed, and the signs that follow.

    The force at the deep end counts as pressing even if adhesion pulls harder elsewhere. The
    shallow end is the one without force; where an offset hides that, the one where the data begin.
    """
    count = max(3, round(_AT_AN_END * travel_m.size))
    order = np.argpartition(travel_m, [count - 1, travel_m.size - count])
    low_n = float(np.median(force_n[order[:count]]))
    high_n = float(np.median(force_n[order[-count:]]))
    if abs(low_n) < _CLEAR * abs(high_n):
        deep_is_high = True
    elif abs(high_n) < _CLEAR * abs(low_n):
        deep_is_high = False
    else:
        begin = float(np.median(travel_m[: max(3, travel_m.size // 100)]))
        deep_is_high = begin - float(travel_m.min()) <= float(travel_m.max()) - begin
    shallow, deep = (low_n, high_n) if deep_is_high else (high_n, low_n)
    if abs(deep - shallow) < max(_SEEN * float(np.ptp(force_n)), _OF_NOISE * white_noise(force_n)):
        return Signs(1.0, 1.0, low_n, high_n)
    force = 1.0 if deep > shallow else -1.0
    return Signs(1.0 if deep_is_high else -1.0, force, force * shallow, force * deep)


def spikes(values: FloatArray) -> BoolArray:
    """Samples (N,) that deviate while their neighbours on both sides agree with each other.

    After Hampel, a sample is compared with medians of its neighbourhood: it deviates by more than
    ten median steps, four quanta and 0.1 % of the range. None is reported in tables of fewer than
    32 samples, in the first and last three samples, or where more than 1 % would be.
    """
    found = np.zeros(values.size, dtype=np.bool_)
    if values.size < LEAST_SAMPLES:
        return found
    low, high = np.percentile(values, [5.0, 95.0])
    least = max(_LEAST * float(high - low), _QUANTA * quantum(values))
    steps = np.abs(np.diff(values))
    for width in range(1, WIDEST + 1):
        for at in _outside(values, steps, width, least):
            about = steps[max(at - _ABOUT, 0) : at + width - 1 + _ABOUT]
            off = min(steps[at - 1], steps[at + width - 1])
            if off > _NOISE * np.median(about):
                found[at : at + width] = True
    return found if found.sum() <= MOST * values.size + 1.0 else np.zeros_like(found)


def _outside(values: FloatArray, steps: FloatArray, width: int, least: float) -> IntArray:
    """Places where `width` samples lie outside both neighbours, which hardly move."""
    at = np.arange(_BESIDE, values.size - width - _BESIDE + 1)
    before, after = values[at - 1], values[at + width]
    inside = np.lib.stride_tricks.sliding_window_view(values, width)[at]
    above = inside.min(axis=1) - np.maximum(before, after)
    below = np.minimum(before, after) - inside.max(axis=1)
    busy = np.abs(after - before)
    for further in range(1, _BESIDE):
        left, right = steps[at - 1 - further], steps[at + width - 1 + further]
        busy = np.maximum(busy, np.maximum(left, right))
    off = np.maximum(above, below) > np.maximum(SUDDEN * busy, least)
    return np.asarray(at[off], dtype=np.intp)


THEORY_FACTOR = 5.0
"""Largest factor between the deformation and that of the payload's law without a doubt."""
LARGEST_DEFORMATION_M, LARGEST_TRAVEL_M = 0.01, 0.1
LARGEST_FORCE_N = 1e6
COARSEST_QUANTUM_M, COARSEST_QUANTUM_N = 1e-4, 1e3
LEAST_SYSTEM_SHARE = 0.005
"""A machine whose deflection is a smaller share of the travel may be left uncorrected."""


def plausibility(
    deformation_m: FloatArray,
    force_n: FloatArray,
    *,
    travel_m: FloatArray | None = None,
    system_stiffness_n_per_m: float | None = None,
    position_quantum_m: float = 0.0,
    force_quantum_n: float = 0.0,
    theory_k: float | None = None,
    theory_n: float | None = None,
) -> tuple[str, ...]:
    """Doubts about the magnitudes of a loading, one sentence each.

    Args:
        deformation_m, force_n: (N,) of the payload while it is pressed, from its touch.
        travel_m: the whole travel of the machine, with its approach.
        system_stiffness_n_per_m: K_s that was stated; None where there was none to state.
        position_quantum_m, force_quantum_n: steps of the channels; 0 where they have none.
        theory_k, theory_n: the payload's law (3) in N/m^n, where it is known: then it alone judges
            the deformation.
    """
    found: list[str] = []
    if not force_n.size:
        return ()
    top_n = float(force_n.max())
    at = int(force_n.argmax())
    deformed_m = float(deformation_m[at])
    if theory_k is not None and theory_n is not None:
        expected_m = (top_n / theory_k) ** (1.0 / theory_n) if top_n > 0.0 else 0.0
        if not expected_m / THEORY_FACTOR <= deformed_m <= expected_m * THEORY_FACTOR:
            found.append(
                f"{f(deformed_m, 'm')} of deformation at {f(top_n, 'N')}, where the payload's law "
                f"gives {f(expected_m, 'm')}: is the unit of a column wrong, or the payload?"
            )
    elif deformed_m > LARGEST_DEFORMATION_M:
        found.append(
            f"the payload is deformed by {f(deformed_m, 'm')}: are these metres? State the "
            "payload (--payload), if its law gives as much"
        )
    span_m = 0.0 if travel_m is None else float(np.ptp(travel_m))
    if span_m > LARGEST_TRAVEL_M:
        found.append(f"a travel of {f(span_m, 'm')}: in metres?")
    if top_n > LARGEST_FORCE_N:
        found.append(f"forces up to {f(top_n, 'N')}: are these newtons?")
    if position_quantum_m >= COARSEST_QUANTUM_M:
        found.append(f"positions in steps of {f(position_quantum_m, 'm')}: are these metres?")
    if force_quantum_n >= COARSEST_QUANTUM_N:
        found.append(f"forces in steps of {f(force_quantum_n, 'N')}: are these newtons?")
    if system_stiffness_n_per_m is not None and theory_k is None:
        bent_m = top_n / system_stiffness_n_per_m
        share = bent_m / (bent_m + deformed_m) if deformed_m > 0.0 else 1.0
        if share < LEAST_SYSTEM_SHARE:
            found.append(
                f"K_s takes {f(bent_m, 'm')} of {f(bent_m + deformed_m, 'm')} of travel: is the "
                "unit of a column wrong? A machine so much stiffer need not be stated"
            )
    return tuple(found)
