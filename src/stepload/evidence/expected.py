"""Expected uncertainty of a chord before it is measured, and what narrows one.

A run without any error is used in place of the coming one. What only the contact shows (slips, a
drift that is not even) cannot be known before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stepload.errors import DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.evidence import figures
from stepload.evidence.changes import narrower
from stepload.evidence.lateral import alignment_of, expected_sideways
from stepload.evidence.loops import Track
from stepload.evidence.quantity import Quantity
from stepload.evidence.reading import branch_chord, no_branch, read_of
from stepload.evidence.run_data import RunData
from stepload.units import format_quantity

SAMPLES_HZ = 200.0
"""Samples per second. A rig is faster, but averaging of more noise is not counted on."""
NAMED = 2
"""So many of the largest lines are narrowed."""
GAINS = 0.99
"""A change that leaves more than this share of the half width gains nothing."""
LOWER_FORCES, LOWER_GAINS = (0.7, 0.5, 0.35), 0.9
"""Shares of the top force that are tried, and the share of the half width that one must leave."""
LEAST_SPAN = 3.0
"""Least factor of a lower top force above the touch."""
Tracks = list[tuple[int, Track, Track | None]]


@dataclass(frozen=True, slots=True)
class Course:
    """The planned course of a run.

    Attributes:
        levels_n: (L,) rising, the last one the top.
        from_n: force at which a loading begins, below the first level.
        up_s: (L,) time up to each level.
        down_s: (L − 1,) time from each level but the lowest down to the next.
        hold_s: at each level.
        cycles: how many; of more than two the budget needs two.
        free_s: in free air after each.
        unloads: whether the course goes on after its first loading.
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


def expected_run(told: Conditions, tracks: Tracks, *, looked: bool = False) -> RunData:
    """A run that has only the errors stated in its conditions.

    A drift of the force's zero is stated as its largest: its rms is expected from tare to tare.
    `looked`: its loading may end by its own deformation.
    """
    up, down = tracks[0][1:]
    step_n = None
    if down is not None:
        step_n = told.sources.zero_drift_n_per_s * float(down.time_s[-1] - up.time_s[0])
        step_n /= math.sqrt(3.0)
    return RunData(tracks=tracks, conditions=told, sideways=expected_sideways(told),
                   alignment=alignment_of(told), looked=looked, zero_step_n=step_n)  # fmt: skip


def expected_chord(run: RunData) -> Quantity:
    """The chord of the branch that is asked for, with the interval that its budget gives.

    Raises:
        DomainError: no such branch, too little in contact, or a deformation that does not rise with
            the force.
    """
    branch = run.conditions.branch
    found = branch_chord(run, read_of(run), branch)
    if found is None:
        raise DomainError(no_branch(run, branch))
    return found


@dataclass(frozen=True, slots=True)
class Narrowing:
    """A line of the budget, one thing to do about it, and the half width of the interval then."""

    line: str
    todo: str
    half_width: float


def narrowing(run: RunData, now: Quantity | None = None) -> list[Narrowing]:
    """What narrows the chord of a run most: its two largest lines about which something helps.

    Args:
        run: measured, or expected.
        now: its chord as it is; None: computed.
    """
    now = now or expected_chord(run)
    found: list[Narrowing] = []
    for line in sorted(now.lines, key=lambda each: -each.relative):
        change = narrower(line.source, run.conditions)
        if change is None or any(each.todo == change[0] for each in found):
            continue
        then = expected_chord(changed(run, change[1](run.conditions))).half_width
        if then < GAINS * now.half_width and then <= figures.HOPELESS:
            found.append(Narrowing(line.source, change[0], then))
        if len(found) == NAMED:
            break
    return found


def lower_force(run: RunData, now: Quantity) -> Narrowing | None:
    """A lower top force that narrows the chord of an expected run; None where none does.

    A softer payload counts less of the deflection of the rig, a smaller deformation more of the
    errors of travel.
    """
    found: list[Narrowing] = []
    forces_n = run.tracks[0][1].force_n
    for share in LOWER_FORCES:
        top_n = share * float(forces_n.max())
        if top_n < LEAST_SPAN * float(forces_n.min()):
            continue
        lower = _scaled(run, share)
        try:
            half = expected_chord(lower).half_width
        except DomainError:
            continue
        if half < LOWER_GAINS * now.half_width:
            found.append(Narrowing("top force", f"top force {format_quantity(top_n, 'N')}", half))
    return min(found, key=lambda each: each.half_width, default=None)


def _scaled(run: RunData, share: float) -> RunData:
    """The same course of an expected run up to this share of its top force, from the same touch."""
    up = run.tracks[0][1]
    least_n, top_n = float(up.force_n.min()), float(up.force_n.max())
    slope = (share * top_n - least_n) / (top_n - least_n)
    order = np.argsort(up.force_n, kind="stable")
    known_n, known_m = np.append(0.0, up.force_n[order]), np.append(0.0, up.travel_m[order])

    def scaled(track: Track | None) -> Track | None:
        if track is None:
            return None
        force_n = least_n + slope * (track.force_n - least_n)
        return replace(track, force_n=force_n, travel_m=np.interp(force_n, known_n, known_m))

    tracks = [(number, scaled(up) or up, scaled(down)) for number, up, down in run.tracks]
    return replace(run, tracks=tracks)


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
    aside = expected_sideways(told) if run.sideways.rule == "unknown" else run.sideways
    return replace(
        run, tracks=tracks, conditions=told, alignment=alignment, zero_step_n=step_n, sideways=aside
    )
