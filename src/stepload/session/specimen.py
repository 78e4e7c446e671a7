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
from stepload.record.outcome import Cause, Touch
from stepload.record.rows import Phase
from stepload.report.conditions import planned
from stepload.units import format_quantity as f

SPECIMEN = "specimen"
"""Word of the stop."""
FACTOR = 2.0
"""A payload this many times softer or stiffer than expected is another one."""
SIGMAS = 3.0
Expected = tuple[float, float, float, str]
"""Found, least and most in m, and where that is from."""


class SpecimenCheck:
    """Looks at a run, and stops it if the specimen is a wrong one.

    Args:
        preflight: of the plan.
        earlier: position of the first touch and deformation at the first level, in m, of specimens
            of the same plan.
    """

    def __init__(self, preflight: Preflight, earlier: Sequence[tuple[float, float]]) -> None:
        self._theory, self._plan = preflight.theory, preflight.plan
        self._conditions = planned(preflight)
        self._touch_m, self._deformation_m = (
            map(float, np.median(earlier, axis=0)) if earlier else (math.nan, math.nan)
        )
        self._touched = self._loaded = False

    def __call__(self, engine: Engine, preflight: Preflight) -> None:
        """Look at the run as it is now."""
        row, course = engine.row, engine.course
        if row is None or not course.touches:
            return
        spans: Iterator[Expected] = iter(())
        if not self._touched:
            self._touched, what = True, "touched {} from the start"
            spans = self._height(course.touches[0], course.start_m)
        elif row.phase == Phase.HOLD and not self._loaded:
            self._loaded, what = True, f"deformed {{}} at {f(row.force_n, 'N')}"
            spans = self._softness(
                engine.supervisor.arm.position_m, row.force_n, course.touches[-1]
            )
        for found_m, low_m, high_m, source in spans:
            if not low_m <= found_m <= high_m:
                span = f"{f(low_m, 'm')} to {f(high_m, 'm')}"
                message = f"{what.format(f(found_m, 'm'))}, expected {span} by {source}"
                limit_m = low_m if found_m < low_m else high_m
                engine.trip(Cause(SPECIMEN, found_m, limit_m, "", 0.0, row.time_s, message))

    def _height(self, touch: Touch, start_m: float) -> Iterator[Expected]:
        at_m, room_m = touch.position_m - start_m, self._plan.procedure.surface_uncertainty_m
        given_m = self._theory.softest.deformation(touch.force_n) + self._bend(touch.force_n)
        plan_m, before_m = self._plan.procedure.surface_distance_m, self._touch_m - start_m
        yield at_m, plan_m - room_m, plan_m + room_m + given_m, "surface_distance"
        if not math.isnan(before_m):
            yield at_m, before_m - room_m, before_m + room_m, "those before"

    def _softness(self, travel_m: float, force_n: float, touch_n: float) -> Iterator[Expected]:
        if self._plan.rig.displacement is not None:
            return  # the travel of the arm is not what such a rig measures
        zero_m, theory = self._bend(touch_n), self._theory
        found_m = travel_m - self._bend(force_n) + zero_m
        sigma_m = float(self._conditions.bend_sigma(np.array([force_n]))[0])
        doubt_m = SIGMAS * math.hypot(self._conditions.position_resolution_m, sigma_m)
        least_m, most_m = (
            law.deformation(force_n) - law.deformation(touch_n)
            for law in (theory.stiffest, theory.softest)
        )
        before_m = self._deformation_m + zero_m
        for low_m, high_m, source in (
            (least_m, most_m, "theory"), (before_m, before_m, "those before"),
        ):  # fmt: skip
            if not math.isnan(low_m):
                yield found_m, low_m / FACTOR - doubt_m, high_m * FACTOR + doubt_m, source

    def _bend(self, force_n: float) -> float:
        return float(self._conditions.bend(np.array([force_n]))[0])
