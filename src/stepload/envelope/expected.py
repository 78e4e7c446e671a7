"""The run of a plan without error, and the interval that its stated errors give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stepload.envelope.conditions import conditions_of
from stepload.envelope.load_times import LoadTimes
from stepload.envelope.theory import Theory
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.evidence.expected import Course, expected_chord, expected_run
from stepload.evidence.quantity import Quantity
from stepload.evidence.run_data import RunData
from stepload.plan.model import Plan


def expected_result(plan: Plan, theory: Theory, climbs: LoadTimes | None) -> Quantity:
    """The chord of a run by theory's stiffest law, with the interval that the known errors give.

    Raises:
        DomainError: there is no contact law, or no loading, to predict from.
    """
    return expected_chord(planned_run(plan, theory, climbs))


def planned_run(plan: Plan, theory: Theory, climbs: LoadTimes | None) -> RunData:
    """The run of a plan without error, by theory's stiffest law; `climbs`: its ramps' times.

    Raises:
        DomainError: there is no contact law to predict from.
    """
    conditions, procedure = conditions_of(plan, theory), plan.procedure
    levels_n = procedure.levels_n
    from_n = min(procedure.touch_force_n, 0.5 * levels_n[0])
    ramps_s = np.diff([from_n, *levels_n]) / procedure.load_rate_n_per_s
    course = Course(
        np.array(levels_n), from_n, ramps_s.tolist(), ramps_s[1:].tolist(), procedure.hold_s,
        procedure.cycles,
    )  # fmt: skip
    if climbs is not None:
        course = replace(course, up_s=climbs.up_s, down_s=climbs.down_s)
    travel = travel_of(theory.stiffest.deformation, conditions)
    return expected_run(conditions, course.tracks(travel))


def travel_of(
    deformation: Callable[[float], float], conditions: Conditions
) -> Callable[[FloatArray], FloatArray]:
    """Travel in m at forces (N,): that of the payload and of the system."""

    def travel(force_n: FloatArray) -> FloatArray:
        forces_n, places = np.unique(force_n, return_inverse=True)
        law_m = np.array([deformation(each) for each in forces_n])[places]
        return np.asarray(law_m + conditions.bend(force_n))

    return travel
