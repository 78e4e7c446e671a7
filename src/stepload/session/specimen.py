"""Whether the specimen under the arm is the one that the plan describes, seen while it is pressed.

The supervisor guards the payload whatever it is (R1, R2, R6, R8). This tells a wrong piece from a
right one earlier: by the height of the first touch and the deformation at the first level.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from stepload.engine.tick import Engine
from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.report.conditions import planned
from stepload.units import format_quantity as f

FACTOR = 2.0
"""A payload this many times softer or stiffer than expected is another one."""
SIGMAS = 3.0
Look = tuple[float, float, float, str]
"""What was found, least and most in m, and where these are from."""


class SpecimenCheck:
    """Looks at a run, and stops it if the specimen is a wrong one.

    Args:
        preflight: of the plan.
        earlier: position of the first touch and deformation at the first level, in m, of specimens
            of the same plan.
    """

    def __init__(self, preflight: Preflight, earlier: Sequence[tuple[float, float]]) -> None:
        self._preflight, self._conditions = preflight, planned(preflight)
        self._before = [float(each) for each in np.median(earlier, axis=0)] if earlier else []
        self._touched = self._loaded = False

    def __call__(self, engine: Engine, preflight: Preflight) -> None:
        """Look at the run as it is now."""
        row, course, plan = engine.row, engine.course, self._preflight.plan
        if row is None or not course.touches:
            return
        first, last = course.touches[0], course.touches[-1]
        looks: Iterator[Look] = iter(())
        if not self._touched:
            self._touched, told = True, "touched {} from the start"
            looks = self._height(first.position_m - course.start_m, first.force_n, course.start_m)
        # With a gauge the travel of the arm is not what is measured.
        elif row.phase == Phase.HOLD and not self._loaded and plan.rig.displacement is None:
            self._loaded, told = True, f"deformed {{}} at {f(row.force_n, 'N')}"
            travel_m = engine.supervisor.arm.position_m - last.position_m
            looks = self._softness(travel_m, row.force_n, last.force_n)
        for found_m, low_m, high_m, source in looks:
            if found_m < low_m or found_m > high_m:
                span = f"{f(low_m, 'm')} to {f(high_m, 'm')}"
                message = f"{told.format(f(found_m, 'm'))}, expected {span} by {source}"
                limit_m = low_m if found_m < low_m else high_m
                engine.trip(Cause("specimen", found_m, limit_m, "", 0.0, row.time_s, message))

    def _height(self, found_m: float, force_n: float, start_m: float) -> Iterator[Look]:
        procedure, softest = self._preflight.plan.procedure, self._preflight.theory.softest
        plan_m, room_m = procedure.surface_distance_m, procedure.surface_uncertainty_m
        given_m = softest.deformation(force_n) + self._bend(force_n)
        yield found_m, plan_m - room_m, plan_m + room_m + given_m, "surface_distance"
        for each in self._before[:1]:
            yield found_m, each - start_m - room_m, each - start_m + room_m, "those before"

    def _softness(self, travel_m: float, force_n: float, touch_n: float) -> Iterator[Look]:
        zero_m, theory = self._bend(touch_n), self._preflight.theory
        sigma_m = float(self._conditions.bend_sigma(np.array([force_n]))[0])
        doubt_m = SIGMAS * math.hypot(self._conditions.position_resolution_m, sigma_m)
        least_m, most_m = (
            law.deformation(force_n) - law.deformation(touch_n)
            for law in (theory.stiffest, theory.softest)
        )
        found_m, source = travel_m - self._bend(force_n) + zero_m, "theory"
        if self._before:  # what was measured is better known
            least_m = most_m = self._before[1] + zero_m
            source = "those before"
        yield found_m, least_m / FACTOR - doubt_m, most_m * FACTOR + doubt_m, source

    def _bend(self, force_n: float) -> float:
        return float(self._conditions.bend(np.array([force_n]))[0])
