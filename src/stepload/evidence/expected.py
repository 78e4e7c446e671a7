"""Expected uncertainty of a chord before it is measured, from the sources of error alone.

A loading without any error is used in place of the coming one. Effects of the contact (creep, set,
a shape that no law has) cannot be known before, so the interval of the run itself is wider, never
narrower.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.smooth import smooth_lengths
from stepload.evidence import figures
from stepload.evidence.chord import Chord, chord
from stepload.evidence.elastic import Elastic, elastic_of
from stepload.evidence.errors import errors_of
from stepload.evidence.loops import Loop, loops_of
from stepload.evidence.path import Track
from stepload.evidence.pressed import Pressed
from stepload.evidence.quantity import Quantity
from stepload.evidence.rehearse import TO_SIGMA, creep_threshold
from stepload.evidence.signs import hold_creep

SAMPLES_HZ = 50.0
"""Samples per second. A rig is faster, but averaging of more noise is not counted on."""


def loading(
    levels_n: FloatArray, *, from_n: float, rate_n_per_s: float, hold_s: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Planned course of a loading: time in s, force in N and number of the hold, (N,) each.

    Args:
        levels_n: rising, the last one the top.
        from_n: force at which it begins, below the first level.
        rate_n_per_s: of the ramps.
        hold_s: at each level.
    """
    forces, held, before = [], [], from_n
    for number, level_n in enumerate(levels_n.tolist(), 1):
        ramp = max(round((level_n - before) / rate_n_per_s * SAMPLES_HZ), 2)
        rest = max(round(hold_s * SAMPLES_HZ), 4)
        forces += [before + (level_n - before) * np.arange(1, ramp + 1) / ramp]
        forces += [np.full(rest, level_n)]
        held += [np.zeros(ramp), np.full(rest, number)]
        before = level_n
    force_n = np.concatenate(forces)
    return np.arange(force_n.size) / SAMPLES_HZ, force_n, np.concatenate(held)


def expected_chord(run: Pressed, *, held: bool = False) -> Quantity:
    """The chord of a run's first loading with the interval that its sources of error alone give.

    Args:
        run: a loading without error, and what is known of the errors of the one to come.
        held: whether the creep counts that its holds cannot exclude.

    Raises:
        DomainError: the loading has too few places of different force.
    """
    loops = loops_of(run.tracks, run.conditions.bend, 0.0)
    first = loops[0].loading
    main = chord(first)
    elastic = elastic_of(first, main, run.conditions.bend)
    lengths = smooth_lengths(run.conditions.sources.smooth_length_n, elastic.top_n)
    reading = figures.Reading(
        main=main,
        upper=main,
        path=first.path,
        errors=[errors_of(run, first, elastic, None, length_n) for length_n in lengths],
        law_sets=[],
        power=elastic.q,
        left=figures.Discrepancies(
            creep_m=_unseen_creep(run, loops, main, elastic) if held else 0.0
        ),
    )
    return figures.quantities(run, reading)["chord"]


def _unseen_creep(run: Pressed, loops: Sequence[Loop], main: Chord, elastic: Elastic) -> float:
    """Standard uncertainty in m of the creep that holds as planned do not exclude."""
    creep = hold_creep(loops, main.from_n, elastic)
    if creep is None:
        return 0.0
    limit_m = creep_threshold(creep, loops, elastic, run.conditions.sources)
    return limit_m * creep.total_per_mean / TO_SIGMA


def without_error(
    course: tuple[FloatArray, FloatArray, FloatArray], travel_m: FloatArray
) -> list[tuple[int, Track, None]]:
    """The tracks of a run that is a loading only.

    Args:
        course: as `loading` gives it.
        travel_m: (N,) along it.
    """
    time_s, force_n, held = course
    return [(1, Track(time_s, force_n, travel_m, held.astype(np.intp)), None)]
