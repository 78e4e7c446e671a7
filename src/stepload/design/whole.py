"""One simulated run through the whole pipeline, in the form that its record would have."""

from __future__ import annotations

import math

import numpy as np

from stepload.design.course import Course, Stretch
from stepload.design.world import Runs
from stepload.errors import DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.evidence.answer import weigh
from stepload.evidence.path import Track
from stepload.evidence.pressed import Pressed, Touch
from stepload.evidence.quantity import Quantity


def pressed_of(
    told: Conditions, run: Course, force_n: FloatArray, travel_m: FloatArray, zero_step_n: float
) -> Pressed:
    """A simulated run as the input of the evidence.

    Args:
        told: the conditions of the identification.
        run: its course.
        force_n, travel_m: (N,) as measured.
        zero_step_n: change of the force's zero from tare to tare.
    """

    def track(part: tuple[Stretch, ...]) -> Track:
        inside = slice(part[0].start, part[-1].stop)
        held = np.concatenate([np.full(s.stop - s.start, i * s.held) for i, s in enumerate(part)])
        return Track(
            run.time_s[inside], force_n[inside], travel_m[inside] - travel_m[run.touches[0]], held
        )

    first, last = (
        Touch(float(run.time_s[at]), float(travel_m[at] - travel_m[run.touches[0]]),
              float(force_n[at])) for at in run.touches
    )  # fmt: skip
    return Pressed(
        tracks=[
            (cycle, track(run.branch(cycle, loading=True)), track(run.branch(cycle, loading=False)))
            for cycle in (1, 2)
        ],
        conditions=told,
        touches=(first, last),
        zero_step_n=zero_step_n,
        doubts=tuple(told.table_doubts(float(force_n[run.loading].max()))),
    )


def headline(told: Conditions, run: Course, runs: Runs, number: int) -> Quantity | None:
    """The headline of one simulated run by the whole pipeline; None where there is none."""
    taken = pressed_of(
        told, run, runs.force_n[number], runs.travel_m[number], float(runs.zero_step_n[number])
    )
    try:
        found = weigh(taken).headline
    except DomainError:
        return None
    return found if math.isfinite(found.value_n_per_m) else None
