"""The cycles of a run as means over stretches of time, the deflection of the system taken out.

Samples sorted or weighed by a noisy force bias every fit; means over time do not. A stretch ends
where the force has moved by a small share of itself, or where a shorter one would only show noise.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.fit import FloatArray, IntArray

HEAVIEST = 3.0
"""Largest weight of one stretch (a hold) over the usual one: its quantum is one number."""
STEP_OF_FORCE, STEP_OF_RANGE = 0.05, 0.0025
"""Largest change of force within a stretch: this share of its force plus that of the largest."""
LEAST_STRETCHES = 6
"""A loading of fewer stretches has no local stiffness."""
LEAST_HELD = 0.05
"""Rests below this share of their branch's time are reversals of the motion, no holds."""
EARLY = 8
"""Creep is measured from the mean of the first eighth of a hold to that of its last half."""
BETWEEN = 0.75 - 0.5 / EARLY
"""The middles of both are apart by this share of the hold."""
Deflection = Callable[[FloatArray], FloatArray]
"""Deflection in m of everything but the payload, from forces (N,) in N."""


@dataclass(frozen=True, slots=True)
class Track:
    """One branch of one cycle as it was sampled, (N,) each, in the order of time.

    Attributes:
        time_s, force_n, travel_m: travel in metres from one zero for all branches of a run.
        held: number of the hold that a sample lies in; 0 while the force is moving.
        arm_m: position of the arm where `travel_m` is that of a gauge; else None.
        second_n: second force channel, NaN where it has no sample; None without one.
    """

    time_s: FloatArray
    force_n: FloatArray
    travel_m: FloatArray
    held: IntArray
    arm_m: FloatArray | None = None
    second_n: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Path:
    """The same as means over stretches of time, (B,) each.

    Attributes:
        count: samples in each stretch.
        span_m: how far the travel went within it.
        rate_n_per_s: rate of the force within it.
    """

    time_s: FloatArray
    force_n: FloatArray
    travel_m: FloatArray
    count: FloatArray
    span_m: FloatArray
    rate_n_per_s: FloatArray
    held: IntArray

    @property
    def size(self) -> int:
        """Number of stretches."""
        return self.force_n.size


def path_of(track: Track, top_n: float, force_noise_n: float) -> Path:
    """Reduce a branch of at least one sample; `top_n` is the largest force of the run."""
    sums = [np.concatenate([[0.0], np.cumsum(values - values[0])]) for values in (
        track.time_s, track.force_n, track.travel_m)]  # fmt: skip
    edges = np.concatenate([[0], np.flatnonzero(np.diff(track.held)) + 1, [track.force_n.size]])
    cuts = [0]
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        cuts += _parted(begin, end, sums[1], float(track.force_n[0]), top_n, force_noise_n)
    cut = np.array(cuts, dtype=np.intp)
    count = np.diff(cut).astype(float)
    means = [(s[cut[1:]] - s[cut[:-1]]) / count for s in sums]
    time, force, travel = (
        mean + values[0]
        for mean, values in zip(means, (track.time_s, track.force_n, track.travel_m), strict=True)
    )
    return Path(time, force, travel, count, *_extent(time, force, travel, track, cut),
                held=track.held[cut[:-1]])  # fmt: skip


def _parted(
    begin: int, end: int, sums: FloatArray, first_n: float, top_n: float, noise_n: float
) -> list[int]:
    """Ends of the stretches between two samples."""
    ends: list[int] = []
    waiting = [(begin, end)]
    while waiting:
        low, high = waiting.pop()
        size = high - low
        middle = low + size // 2
        if size > 1:
            before = (sums[middle] - sums[low]) / (middle - low)
            after = (sums[high] - sums[middle]) / (high - middle)
            moved = abs(after - before)
            allowed = STEP_OF_FORCE * max(first_n + 0.5 * (before + after), 0.0)
            allowed += STEP_OF_RANGE * top_n
            if 2.0 * moved > allowed and moved > 3.0 * noise_n / np.sqrt(max(size / 4.0, 0.5)):
                waiting += [(middle, high), (low, middle)]
                continue
        ends.append(high)
    return ends


def _extent(
    time: FloatArray, force: FloatArray, travel: FloatArray, track: Track, cut: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Travel within each stretch, and the rate of force in it: slopes from neighbour to neighbour
    of the same kind; 0 in a hold."""
    moving = track.held[cut[:-1]] == 0
    if force.size < 2:
        return np.zeros_like(travel), np.zeros_like(force)
    lasting = np.maximum(track.time_s[cut[1:] - 1] - track.time_s[cut[:-1]], 0.0)
    elapsed = np.gradient(time)
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.where(elapsed > 0.0, np.gradient(travel) / elapsed, 0.0)
        rate = np.where(elapsed > 0.0, np.gradient(force) / elapsed, 0.0)
    return np.abs(speed) * lasting * moving, rate * moving


@dataclass(frozen=True, slots=True)
class Hold:
    """One hold: mean force, length, and deformation and force (`eased_n`) in its last half less
    those in its first eighth, which has `samples`."""

    force_n: float
    lasted_s: float
    crept_m: float
    eased_n: float
    samples: int

    def creep(self, compliance_m_per_n: float) -> float:
        """Creep in m reduced to constant force: an arm that held its position let the force relax
        instead."""
        return self.crept_m - compliance_m_per_n * self.eased_n


@dataclass(frozen=True, slots=True)
class Branch:
    """One branch of a cycle: its path, the payload's deformation (B,) along it, its holds."""

    path: Path
    deformation_m: FloatArray
    holds: tuple[Hold, ...]


@dataclass(frozen=True, slots=True)
class Loop:
    """One cycle; `unloading` is None where there is none."""

    loading: Branch
    unloading: Branch | None


def loops_of(
    tracks: Sequence[tuple[int, Track, Track | None]], deflection: Deflection, force_noise_n: float
) -> tuple[Loop, ...]:
    """Reduce the cycles of a run: number, loading and unloading of each, the first one first."""
    top_n = max(float(loading.force_n.max()) for _, loading, _ in tracks)

    def branch(track: Track) -> Branch:
        path = path_of(track, top_n, force_noise_n)
        return Branch(path, path.travel_m - deflection(path.force_n), _holds(track, deflection))

    return tuple(
        Loop(branch(loading), branch(unloading) if unloading is not None else None)
        for _, loading, unloading in tracks
    )


def _holds(track: Track, deflection: Deflection) -> tuple[Hold, ...]:
    found = []
    starts = np.concatenate([[0], np.flatnonzero(np.diff(track.held)) + 1])
    ends = [*starts[1:].tolist(), track.held.size]
    for start, end in zip(starts.tolist(), ends, strict=True):
        if track.held[start] == 0 or end - start < 4:
            continue
        force, early = track.force_n[start:end], max((end - start) // EARLY, 1)
        before, after = (
            _mean(track, part, deflection)
            for part in (slice(start, start + early), slice((start + end) // 2, end))
        )
        lasted_s = float(track.time_s[end - 1] - track.time_s[start])
        crept_m, eased_n = after[0] - before[0], after[1] - before[1]
        found.append(Hold(float(force.mean()), lasted_s, crept_m, eased_n, early))
    whole_s = float(track.time_s[-1] - track.time_s[0])
    return tuple(found) if sum(hold.lasted_s for hold in found) >= LEAST_HELD * whole_s else ()


def _mean(track: Track, part: slice, deflection: Deflection) -> tuple[float, float]:
    """Mean deformation and force."""
    force = track.force_n[part].mean(keepdims=True)
    return float(track.travel_m[part].mean() - deflection(force)[0]), float(force[0])
