"""Force, deformation and creep of every hold, from the events of the engine and the data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.record.reader import Event
from stepload.results.press_data import HOLDS, PressData, number

END_SHARE = 0.1
"""Share of a hold that is averaged at its beginning and its end for the creep."""


@dataclass(frozen=True, slots=True)
class Level:
    """One hold of a load level.

    Attributes:
        cycle, step: numbers from 1; `loading` is True on the way up.
        level_n: the commanded force.
        start_s, end_s: on the run's clock.
        settled: whether the level was reached and the force came to rest within the allowed time.
        force_n, deformation_m: means over the hold; the deflection of the system is subtracted from
            the deformation. NaN where the record has no sample of the hold.
        force_change_n, creep_m: from the first tenth of the hold to its last.
        samples: number of samples in the means.
    """

    cycle: int
    step: int
    loading: bool
    level_n: float
    start_s: float
    end_s: float
    settled: bool
    force_n: float
    deformation_m: float
    force_change_n: float
    creep_m: float
    samples: int


def levels_of(
    data: PressData, events: Sequence[Event], conditions: Conditions
) -> tuple[Level, ...]:
    """Every hold of a run in the order of time.

    Raises:
        BadInputError: an event of a hold lacks a value.
    """
    held = np.isin(data.phase, HOLDS)
    time_s, force_n = data.time_s[held], data.force_n[held]
    deformation_m = data.travel_m[held] - conditions.bend(force_n)
    found = []
    for event in events:
        if event.kind != "held":
            continue
        end_s = event.time_s
        start_s = end_s - number(event, "held_s")
        first, last = np.searchsorted(time_s, [start_s, end_s], side="left")
        force, deformation = force_n[first:last], deformation_m[first:last]
        found.append(
            Level(
                cycle=int(number(event, "cycle")),
                step=int(number(event, "step")),
                loading=bool(event.data.get("loading")),
                level_n=number(event, "level_n"),
                start_s=start_s,
                end_s=end_s,
                settled=bool(event.data.get("settled")),
                force_n=float(force.mean()) if force.size else math.nan,
                deformation_m=float(deformation.mean()) if force.size else math.nan,
                force_change_n=_change(force),
                creep_m=_change(deformation),
                samples=int(force.size),
            )
        )
    return tuple(found)


def _change(values: FloatArray) -> float:
    """Mean of the last tenth less that of the first; NaN where a tenth has no two samples."""
    part = int(values.size * END_SHARE)
    return float(values[-part:].mean() - values[:part].mean()) if part >= 2 else math.nan
