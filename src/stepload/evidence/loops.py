"""The cycles of a run, reduced, with the deflection of the system taken out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.evidence.path import Path, Track, path_of

LEAST_STRETCHES = 6
"""A loading of fewer stretches has no local stiffness."""


LEAST_HELD = 0.05
"""Rests below this share of their branch's time are reversals of the motion, no holds."""
EARLY = 8
"""Creep is measured from the mean of the first eighth of a hold to that of its last half."""
BETWEEN = 0.75 - 0.5 / EARLY
"""The middles of both are apart by this share of the hold."""


@dataclass(frozen=True, slots=True)
class Hold:
    """One hold: the change of the deformation in it.

    Attributes:
        force_n: mean force in N.
        lasted_s: its length.
        crept_m: deformation in its last half less that in its first eighth.
        eased_n: the same of the force; negative where it relaxed.
        samples: number of samples in the first eighth.
    """

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


Deflection = Callable[[FloatArray], FloatArray]
"""Deflection in m of everything but the payload, from forces (N,) in N."""


def loops_of(
    tracks: Sequence[tuple[int, Track, Track | None]], deflection: Deflection, force_noise_n: float
) -> tuple[Loop, ...]:
    """Reduce the cycles of a run.

    Args:
        tracks: number, loading and unloading of each cycle, the first one first.
        deflection: the system's part of the travel.
        force_noise_n: standard deviation of one force sample.
    """
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
