"""Nulls the lateral force by moving the arm sideways, before a level is held.

A tip that is pressed by an arm is drawn sideways and rubs. The arm yields to the lateral force,
slowly enough to be stable where it is three times as stiff sideways as believed, and within a
limit. It ends where the force is gone, where its time is up, or where it has grown or not fallen:
then the sensor is not turned against the arm as the plan says.
"""

from __future__ import annotations

import math

from stepload.engine.phases import May, Steps, phase
from stepload.engine.run_state import RunState
from stepload.feasibility.aligning import NullingLaw
from stepload.record.rows import Phase

Shift = tuple[float, float]
GROWN_SHARE = 0.1
"""Share of the initial force: a rise by more than this above the least so far is not noise."""
GROWN_DEADS = 2.0
USELESS_SHARE = 0.7
"""Share of the initial force: if more is left when the time is up, nulling is given up."""


def nulled(shift_m: Shift, across_n: Shift, law: NullingLaw, step_s: float) -> Shift:
    """The shift after one more tick.

    It moves against the force at |f| / (K τ), not faster and not further than the law allows; a
    force below its noise is ignored.

    Args:
        shift_m: the shift now.
        across_n: lateral force of the tip on the plate along the arm's axes 1 and 2.
    """
    size_n = math.hypot(*across_n)
    if size_n <= law.dead_n:
        return shift_m
    speed_m_s = min(size_n / (law.stiffness_n_per_m * law.time_constant_s), law.fastest_m_s)
    part = speed_m_s * step_s / size_n
    x_m, y_m = (at - part * force for at, force in zip(shift_m, across_n, strict=True))
    way_m = math.hypot(x_m, y_m)
    if way_m > law.largest_m:
        scale = law.largest_m / way_m
        return scale * x_m, scale * y_m
    return x_m, y_m


class Nulling:
    """Nulls the lateral force level by level; not again in a run in which it grew or did not fall.

    Args:
        course: state of the run.
        law: gains and limits; None where the plan asks for no nulling.
    """

    def __init__(self, course: RunState, law: NullingLaw | None) -> None:
        self._course = course
        self._law = law

    def null(self) -> Steps:
        """Null the lateral force; at once over where there is nothing to do."""
        law = self._law
        if law is not None and not self._course.sup.smooth_n < law.from_n:
            yield from self._null(law)
        return None

    @phase(Phase.NULLING, "before a hold, where the plan asks for it", May.ACROSS)
    def _null(self, law: NullingLaw) -> Steps:
        """Go sideways until the lateral force is gone, its time is up, or it grows."""
        course = self._course
        first_n = least_n = math.hypot(*self._across_n(law))
        begin_m = course.shift_m
        grown_n = max(GROWN_DEADS * law.dead_n, GROWN_SHARE * first_n)
        course.enter(Phase.NULLING)
        why = ""
        while not why:
            yield
            across_n = self._across_n(law)
            size_n = math.hypot(*across_n)
            least_n = min(least_n, size_n)
            if size_n > least_n + grown_n:
                why, self._law = "grown", None
            elif size_n <= law.dead_n:
                why = "gone"
            elif course.stop_requested():
                why = "stop"
            elif course.now_s - course.since_s < law.longest_s:
                course.shift_m = nulled(course.shift_m, across_n, law, course.step_s)
            elif size_n > USELESS_SHARE * first_n:
                why, self._law = "useless", None
            else:
                why = "time"
        course.tell(
            "nulled",
            {"level_n": course.level_n, "before_n": first_n, "after_n": size_n,
             "shift_m": list(course.shift_m),
             "moved_m": math.dist(course.shift_m, begin_m), "why": why},
        )  # fmt: skip
        return None

    def _across_n(self, law: NullingLaw) -> Shift:
        """Lateral force in N in the axes of the arm."""
        one, other = self._course.sup.force.load_across_n
        c, s = math.cos(law.turn_rad), math.sin(law.turn_rad)
        return c * one - s * other, s * one + c * other
