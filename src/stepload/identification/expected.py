"""The result that is expected of a run before it, and what narrows one.

A run without any error is judged in place of the coming one. What only the contact shows (slips, a
drift that is not even) cannot be known before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from stepload.errors import DomainError
from stepload.identification.changes import narrower
from stepload.identification.conditions import Conditions
from stepload.identification.figures import HOPELESS
from stepload.identification.fit import FloatArray
from stepload.identification.lateral import alignment_of, expected_lateral_force
from stepload.identification.loops import Track
from stepload.identification.quantity import Quantity
from stepload.identification.run_data import RunData
from stepload.identification.verdict import judge

SAMPLES_HZ = 200.0
"""Samples per second. A rig is faster, but averaging of more noise is not counted on."""
NAMED = 2
"""So many of the largest lines are narrowed."""
GAINS = 0.99
"""A change that leaves more than this share of the half width gains nothing."""
Tracks = list[tuple[int, Track, Track | None]]


@dataclass(frozen=True, slots=True)
class LoadSchedule:
    """The planned loading of a run.

    Attributes:
        levels_n: (L,) rising, the last one the top.
        from_n: force at which a loading begins, below the first level.
        up_s: (L,) time up to each level.
        down_s: (L − 1,) time from each level but the lowest down to the next.
        hold_s: at each level.
        cycles: how many; of more than two the budget needs two.
        free_s: in free air after each.
        unloads: whether it goes on after its first loading.
    """

    levels_n: FloatArray
    from_n: float
    up_s: Sequence[float]
    down_s: Sequence[float]
    hold_s: float
    cycles: int = 2
    free_s: float = 0.0
    unloads: bool = True

    def tracks(self, travel: Callable[[FloatArray], FloatArray]) -> Tracks:
        """Its cycles without error; `travel` in m at forces (N,)."""
        rising = [self.from_n, *self.levels_n.tolist()]
        branches = [_way(rising, self.up_s, self.hold_s)]
        if self.unloads and len(rising) > 2:
            branches.append(_way(rising[:0:-1], self.down_s[::-1], self.hold_s))
        moved = [travel(force_n) for force_n, _ in branches]
        found: Tracks = []
        at = 0
        for number in range(1, min(self.cycles if self.unloads else 1, 2) + 1):
            made: list[Track] = []
            for (force_n, held), travel_m in zip(branches, moved, strict=True):
                time_s = (at + np.arange(force_n.size)) / SAMPLES_HZ
                made.append(Track(time_s, force_n, travel_m, held))
                at += force_n.size
            found.append((number, made[0], made[1] if len(made) > 1 else None))
            at += round(self.free_s * SAMPLES_HZ)
        return found


def _way(
    levels_n: Sequence[float], times_s: Sequence[float], hold_s: float
) -> tuple[FloatArray, np.ndarray[tuple[int], np.dtype[np.intp]]]:
    """Force in N and number of the hold along ramps from level to level."""
    forces, held = [], []
    rest = max(round(hold_s * SAMPLES_HZ), 4)
    steps = zip(pairwise(levels_n), times_s, strict=True)
    for number, ((low_n, high_n), time_s) in enumerate(steps, 1):
        ramp = max(round(time_s * SAMPLES_HZ), 2)
        forces += [low_n + (high_n - low_n) * np.arange(1, ramp + 1) / ramp]
        forces += [np.full(rest, high_n)]
        held += [np.zeros(ramp, dtype=np.intp), np.full(rest, number, dtype=np.intp)]
    return np.concatenate(forces), np.concatenate(held)


@dataclass(frozen=True)
class Expected:
    """A run without error, and its chord with the interval that is to be expected."""

    run: RunData
    chord: Quantity

    @cached_property
    def narrowing(self) -> list[Narrowing]:
        """What narrows the chord most."""
        return narrowing(self.run, self.chord)


def expect(
    told: Conditions,
    schedule: LoadSchedule,
    deformation: Callable[[FloatArray], FloatArray],
    *,
    looked: bool = False,
) -> Expected:
    """The result to be expected of a run that has only the errors stated in its conditions.

    A drift of the force's zero is stated as its largest: its rms is expected from tare to tare.

    Args:
        deformation: of the payload in m at forces (N,).
        looked: whether its loading may end by its own deformation.

    Raises:
        DomainError: no such branch, too little in contact, or a deformation that does not rise with
            the force.
    """
    tracks = schedule.tracks(lambda force_n: deformation(force_n) + told.bend(force_n))
    up, down = tracks[0][1:]
    step_n = None
    if down is not None:
        step_n = told.sources.zero_drift_n_per_s * float(down.time_s[-1] - up.time_s[0])
        step_n /= math.sqrt(3.0)
    run = RunData(tracks=tracks, conditions=told, lateral_force=expected_lateral_force(told),
                  alignment=alignment_of(told), looked=looked, zero_step_n=step_n)  # fmt: skip
    return Expected(run, judge(run, laws=False).headline)


@dataclass(frozen=True, slots=True)
class Narrowing:
    """A line of the budget, one thing to do about it, and the half width of the interval then."""

    line: str
    todo: str
    half_width: float


def narrowing(run: RunData, now: Quantity) -> list[Narrowing]:
    """What narrows the chord of a run most: its two largest lines about which something helps."""
    found: list[Narrowing] = []
    for line in sorted(now.lines, key=lambda each: -each.relative):
        change = narrower(line.source, run.conditions)
        if change is None or any(each.todo == change[0] for each in found):
            continue
        try:
            then = judge(changed(run, change[1](run.conditions)), laws=False).headline.half_width
        except DomainError:
            continue
        if then < GAINS * now.half_width and then <= HOPELESS:
            found.append(Narrowing(line.source, change[0], then))
        if len(found) == NAMED:
            break
    return found


def changed(run: RunData, told: Conditions) -> RunData:
    """The same contact, pressed under other conditions."""
    before = run.conditions

    def moved(track: Track | None) -> Track | None:
        if track is None:
            return None
        bent_m = told.bend(track.force_n) - before.bend(track.force_n)
        return replace(track, travel_m=track.travel_m + bent_m)

    tracks = [(number, moved(up) or up, moved(down)) for number, up, down in run.tracks]
    alignment = alignment_of(told, run.alignment.quality, run.alignment.share)
    step_n, drift = run.zero_step_n, before.sources.zero_drift_n_per_s
    if step_n is not None and drift > 0.0:
        step_n *= told.sources.zero_drift_n_per_s / drift
    aside = (
        expected_lateral_force(told) if run.lateral_force.rule == "unknown" else run.lateral_force
    )
    return replace(
        run,
        tracks=tracks,
        conditions=told,
        alignment=alignment,
        zero_step_n=step_n,
        lateral_force=aside,
    )
