"""Whether the specimen under the arm is the one that the plan describes, seen while it is pressed.

The supervisor guards the payload whatever it is (R1, R2, R6, R8). This tells a wrong piece from a
right one earlier: by the height of the first touch and the deformation at the first level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stepload.engine.tick import Engine
from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.report.conditions import planned
from stepload.units import format_quantity as f

SPECIMEN = "specimen"
"""Word of the stop."""
FACTOR = 2.0
"""A payload this many times softer or stiffer than expected is another one."""
SIGMAS = 3.0


class SpecimenCheck:
    """Looks at a run, and stops it if the specimen is a wrong one.

    Args:
        preflight: of the plan.
        earlier: position of the first touch and deformation at the first level, in m, of specimens
            of the same plan.
    """

    def __init__(self, preflight: Preflight, earlier: Sequence[tuple[float, float]]) -> None:
        self._theory, self._procedure = preflight.theory, preflight.plan.procedure
        self._conditions, self._gauge = planned(preflight), preflight.plan.rig.displacement
        self._before = [float(each) for each in np.median(earlier, axis=0)] if earlier else []
        self._touched = self._loaded = False

    def __call__(self, engine: Engine, preflight: Preflight) -> None:
        """Look at the run as it is now."""
        row, course = engine.row, engine.course
        if row is None or not course.touches:
            return
        first, last = course.touches[0], course.touches[-1]
        if not self._touched:
            self._touched = True
            self._height(engine, first.position_m - course.start_m, first.force_n)
        # With a gauge the travel of the arm is not what is measured.
        elif row.phase == Phase.HOLD and not self._loaded and self._gauge is None:
            self._loaded = True
            travel_m = engine.supervisor.arm.position_m - last.position_m
            self._softness(engine, travel_m, row.force_n, last.force_n)

    def _height(self, engine: Engine, found_m: float, force_n: float) -> None:
        procedure, told = self._procedure, "touched {} from the start"
        plan_m, room_m = procedure.surface_distance_m, procedure.surface_uncertainty_m
        given_m = self._theory.softest.deformation(force_n) + self._bend(force_n)
        high_m = plan_m + room_m + given_m
        self._judge(engine, told, found_m, plan_m - room_m, high_m, "surface_distance")
        for before_m in (each - engine.course.start_m for each in self._before[:1]):
            ends_m = before_m - room_m, before_m + room_m
            self._judge(engine, told, found_m, *ends_m, "those before")

    def _softness(self, engine: Engine, travel_m: float, force_n: float, touch_n: float) -> None:
        zero_m, told = self._bend(touch_n), f"deformed {{}} at {f(force_n, 'N')}"
        found_m = travel_m - self._bend(force_n) + zero_m
        sigma_m = float(self._conditions.bend_sigma(np.array([force_n]))[0])
        doubt_m = SIGMAS * math.hypot(self._conditions.position_resolution_m, sigma_m)
        least_m, most_m = (
            law.deformation(force_n) - law.deformation(touch_n)
            for law in (self._theory.stiffest, self._theory.softest)
        )
        spans = [(least_m, most_m, "theory")]
        spans += [(each + zero_m, each + zero_m, "those before") for each in self._before[1:]]
        for low_m, high_m, source in spans:
            ends_m = low_m / FACTOR - doubt_m, FACTOR * high_m + doubt_m
            self._judge(engine, told, found_m, *ends_m, source)

    def _bend(self, force_n: float) -> float:
        return float(self._conditions.bend(np.array([force_n]))[0])

    def _judge(
        self, engine: Engine, told: str, found_m: float, low_m: float, high_m: float, source: str
    ) -> None:
        if not low_m <= found_m <= high_m and engine.row is not None:
            span = f"{f(low_m, 'm')} to {f(high_m, 'm')}"
            message = f"{told.format(f(found_m, 'm'))}, expected {span} by {source}"
            limit_m, now_s = low_m if found_m < low_m else high_m, engine.row.time_s
            engine.trip(Cause(SPECIMEN, found_m, limit_m, "", 0.0, now_s, message))
