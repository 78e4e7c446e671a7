"""The channels of a curve from elsewhere, turned, tared and zeroed, and its cycles."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError
from stepload.identification.curve_channels import (
    LEAST_SLOPE,
    FreeAir,
    first_touch,
    free_air,
    signs,
    spikes,
    white_noise,
)
from stepload.identification.curve_cycles import CycleParts, cycles_of
from stepload.identification.fit import FloatArray
from stepload.identification.loops import Track
from stepload.record.curves import Curve
from stepload.units import format_quantity

TOUCH_SHARE = 0.01
"""A curve's touch is where the force passes this share of its peak, at least six times noise."""
TOUCH_NOISE = 6.0
SAME_PEAK = 0.95
"""The first cycle that reaches this share of the largest force is the loading; in growing cycles,
only the forces above all earlier peaks are a first loading."""
LIGHT_TOUCH = 0.1
"""A first press below this share of the largest force, which is released again, is a touch."""
ADHESION = 0.02
"""Least pull before the touch that counts as adhesion, as a share of the peak."""
NEAR_TOP = 0.5
"""Least share of the largest force at which the lateral force is evaluated."""
LEAST_SPAN = 0.3
"""Least range of force of a loading, as a share of the peak."""


Tracks = list[tuple[int, Track, Track | None]]
"""Number, loading with its hold, and unloading of each cycle."""


@dataclass(frozen=True, slots=True)
class Zeroed:
    """Whole channels (N,), turned, tared and zeroed; where the touch is and which force found it.

    `lateral_n` is the size of the lateral force, `time_s` the time; None where the file has none.
    `touch_n` is 0 and `begin` 0 where the zero of the file is kept; `seen_free` says whether free
    air before the touch shows the zero of the force.
    """

    time_s: FloatArray | None
    travel_m: FloatArray
    force_n: FloatArray
    lateral_n: FloatArray | None
    parts: tuple[CycleParts, ...]
    begin: int
    touch_n: float
    noise_n: float
    noise_m: float
    adhesion_n: float
    notes: tuple[str, ...]
    seen_free: bool

    @property
    def loadings(self) -> list[slice]:
        """The loading of every cycle without its hold; the first begins at the touch."""
        first = self.parts[0].loading
        begin = max(first.start, min(self.begin, first.stop - 1))
        return [slice(begin, first.stop), *(part.loading for part in self.parts[1:])]

    def tracks(self, loading: NDArray[np.intp], growing: int) -> Tracks:
        """The cycles; of growing ones the first loading, and the unloading from its top."""
        if growing > 1:
            return [(1, self._track(loading), self._unloading(self.parts[growing - 1]))]
        return [
            (number, self._track(np.arange(up.start, part.hold.stop)), self._unloading(part))
            for number, (up, part) in enumerate(zip(self.loadings, self.parts, strict=True), 1)
        ]

    def _track(self, index: NDArray[np.intp]) -> Track:
        # Without a time the rows of the whole file stand for it: those of a branch begin where the
        # one before has ended.
        time_s = np.arange(self.force_n.size, dtype=float) if self.time_s is None else self.time_s
        held = np.zeros(self.force_n.size, dtype=np.intp)
        for part in self.parts:
            held[part.hold] = 1
        return Track(time_s[index], self.force_n[index], self.travel_m[index], held[index])

    def _unloading(self, part: CycleParts) -> Track | None:
        way = part.unloading
        return None if way is None else self._track(np.arange(way.start, way.stop))

    @property
    def lateral_share(self) -> float | None:
        """The largest share of the lateral force near the top of a loading."""
        if self.lateral_n is None:
            return None
        shares = []
        for up in self.loadings:
            force_n = self.force_n[up]
            high = force_n > NEAR_TOP * float(force_n.max())
            shares.append(float(np.median(self.lateral_n[up][high]) / np.mean(force_n[high])))
        return max(shares)


def zero(curve: Curve, *, keep_zero: bool) -> Zeroed:
    """Turn, tare and zero a curve.

    Args:
        keep_zero: keep the zero of the file where the data begin in contact.

    Raises:
        BadInputError: there is no pressing in the data.
    """
    curve, notes = _without_glitches(curve)
    given = _travel(curve)
    turn = signs(given, curve.force_n)
    travel_m, force_n = turn.travel * given, turn.force * curve.force_n
    if turn.force < 0.0:
        notes.append("pressing is negative in the file: the force was turned")
    if turn.travel < 0.0:
        notes.append("the travel falls towards the payload in the file: it was turned")
    noise_n, noise_m = white_noise(force_n), white_noise(travel_m)
    span_n = turn.deep_n - turn.shallow_n
    offset_n = turn.shallow_n if turn.shallow_n < -TOUCH_SHARE * span_n else 0.0
    parts = _presses(force_n - offset_n, travel_m)
    if not parts:
        top_n = float(force_n.max())
        raise BadInputError(
            f"the largest force is {top_n + 0.0:.3g} N", hint="there is no pressing in these data"
        )
    first = slice(parts[0].loading.start, parts[0].hold.stop)
    x, f = travel_m[first], force_n[first]
    band_n = max(TOUCH_SHARE * float(np.ptp(f)), TOUCH_NOISE * noise_n)
    air = free_air(x, f, band_n)
    if air is not None:
        force_n = force_n - air.at(travel_m)
        if air.slope_n_per_m or abs(air.mean_n - offset_n) > TOUCH_SHARE * span_n:
            parts = _presses(force_n, travel_m) or parts
            first = slice(parts[0].loading.start, parts[0].hold.stop)
            x = travel_m[first]
        f = force_n[first]
        notes += _tare_notes(air, x, band_n)
    touch = first_touch(f, band_n)
    lead_in = air is not None or _is_soft(x, f, touch)
    begin, touch_n = 0, 0.0
    if lead_in or not keep_zero:
        begin, touch_n = first.start + touch, band_n
        if touch == 0:
            touch_n = max(band_n, float(f[0]))
            there = format_quantity(float(f[0]), "N")
            notes.append(f"the data begin in contact, at {there}: the zero is that of the fit")
        else:
            notes.append(f"touch taken where the force passes {format_quantity(band_n, 'N')}")
        travel_m = travel_m - travel_m[begin]
    if first.start:
        notes.append(f"the first {first.start} samples hold touches only: left out")
    return Zeroed(
        curve.time_s,
        travel_m,
        force_n,
        _lateral(curve.lateral_n, begin),
        tuple(parts),
        max(begin, first.start),
        touch_n,
        noise_n,
        noise_m,
        _pull(f[:touch], max(ADHESION * float(f.max()), TOUCH_NOISE * noise_n)) if lead_in else 0.0,
        tuple(notes),
        air is not None,
    )


def _travel(curve: Curve) -> FloatArray:
    travel_m = curve.displacement_m if curve.displacement_m is not None else curve.position_m
    assert travel_m is not None
    return travel_m


def _without_glitches(curve: Curve) -> tuple[Curve, list[str]]:
    """The rows without a glitch of force or travel, and notes on the others."""
    travel_m = _travel(curve)
    off = {"force": spikes(curve.force_n), "travel": spikes(travel_m)}
    bad = off["force"] | off["travel"]
    if not bad.any():
        return curve, []

    def left(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[..., ~bad]

    kept = replace(
        curve,
        time_s=left(curve.time_s),
        position_m=left(curve.position_m),
        displacement_m=left(curve.displacement_m),
        force_n=curve.force_n[~bad],
        lateral_n=left(curve.lateral_n),
    )
    first, what = int(np.argmax(bad)), " or ".join(name for name, each in off.items() if each.any())
    rows = "row" if bad.sum() == 1 else "rows"
    return kept, [
        f"{bad.sum()} of {bad.size} {rows} dropped: the {what} jumps away and comes back within "
        f"two samples (first in row {first + 1}, {format_quantity(curve.force_n[first], 'N')})"
    ]


def first_loading(zeroed: Zeroed) -> tuple[NDArray[np.intp], int, list[str]]:
    """Indices of the first loading, of how many growing cycles it is, and notes on the rest.

    Raises:
        BadInputError: the data hold no loading.
    """
    force_n, parts = zeroed.force_n, zeroed.parts
    total, notes = len(force_n), []
    top_n = float(force_n.max())
    chosen, reached_n = [], -math.inf
    for part in parts:
        index = np.arange(part.loading.start, part.hold.stop)
        chosen.append(index[force_n[index] > reached_n])
        if chosen[-1].size:
            reached_n = float(force_n[index].max())
        if reached_n >= SAME_PEAK * top_n:
            break
    loading = np.concatenate(chosen)
    last = int(loading[-1]) + 1
    if len(chosen) > 1:
        notes.append(
            f"first loading only: of {len(chosen)} growing cycles what is above all before, "
            f"{len(loading)} of {total} samples"
        )
    elif last < total:
        notes.append(f"first loading only: the first {last} of {total} samples")
    if len(parts) > 1:
        notes.append(f"{len(parts)} cycles found")
    loading = loading[loading >= zeroed.begin]
    span_n = float(np.ptp(force_n[loading])) if loading.size else 0.0
    if span_n < LEAST_SPAN * top_n:
        raise BadInputError(
            f"there is no loading in these data: before the force falls it changes by "
            f"{format_quantity(span_n, 'N')} of {format_quantity(top_n, 'N')}",
            hint="give the whole test, from free air on, in the order of time",
        )
    return loading, len(chosen), notes


def _presses(force_n: FloatArray, travel_m: FloatArray) -> list[CycleParts]:
    """The cycles without the light touches that may come before them."""
    parts = cycles_of(force_n, travel_m)
    top_n = float(force_n.max())
    while len(parts) > 1:
        peak_n = float(force_n[parts[0].loading.start : parts[0].hold.stop].max())
        after = parts[0].unloading
        left = after is not None and float(force_n[after].min()) < LIGHT_TOUCH * peak_n
        if not left or peak_n > LIGHT_TOUCH * top_n:
            break
        parts.pop(0)
    return parts


def _tare_notes(air: FreeAir, travel_m: FloatArray, band_n: float) -> Iterator[str]:
    if abs(air.mean_n) > band_n:
        yield f"the force in free air is {format_quantity(air.mean_n, 'N')}: taken out"
    if air.slope_n_per_m:
        drift_n = air.slope_n_per_m * float(np.ptp(travel_m))
        yield (
            f"the force in free air changes by {format_quantity(drift_n, 'N')} over the "
            "travel: taken out as a straight line"
        )


def _pull(before_n: FloatArray, least_n: float) -> float:
    """Size of the pull before the touch, over at least three samples; 0 if there are fewer."""
    if before_n.size < 3:
        return 0.0
    pull_n = -float(np.partition(before_n, 2)[2])
    return pull_n if pull_n > least_n else 0.0


def _is_soft(travel_m: FloatArray, force_n: FloatArray, touch: int) -> bool:
    """Whether the data before the touch are too soft for any contact."""
    if touch == 0:
        return False
    moved_m = float(travel_m[touch] - travel_m[0])
    mean = float(np.ptp(force_n)) / max(float(np.ptp(travel_m)), math.ulp(0.0))
    return moved_m > 0.0 and float(force_n[touch] - force_n[0]) < 0.3 * LEAST_SLOPE * mean * moved_m


def _lateral(components_n: FloatArray | None, touch: int) -> FloatArray | None:
    """Size (N,) of the lateral force, tared by what it was before the touch."""
    if components_n is None:
        return None
    before = components_n[:, : max(touch, 1)]
    tared = components_n - np.median(before, axis=1, keepdims=True)
    return np.asarray(np.sqrt((tared**2).sum(axis=0)))
