"""Whether the specimen under the arm is the one that the plan describes, seen while it is pressed.

The supervisor guards the payload whatever it is (R1, R2, R6, R8). This tells a wrong piece from a
right one earlier: by the height of the first touch and the deformation at the first level.
"""

from __future__ import annotations

import math

import numpy as np

from stepload.engine.tick import Engine
from stepload.feasibility.preflight import Preflight
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.report.conditions import planned
from stepload.units import format_quantity as f

FACTOR = 2.0
"""A payload this many times softer or stiffer than theory is another one."""
SIGMAS = 3.0


class SpecimenCheck:
    """Looks at a run, and stops it if the specimen is a wrong one."""

    def __init__(self) -> None:
        self._touched = self._loaded = False

    def __call__(self, engine: Engine, preflight: Preflight) -> None:
        """Look at the run as it is now."""
        row, course, theory = engine.row, engine.course, preflight.theory
        # With a gauge the travel of the arm is not what is measured.
        loaded = row and row.phase == Phase.HOLD and preflight.plan.rig.displacement is None
        if row is None or not course.touches or (self._touched and (self._loaded or not loaded)):
            return
        first, last, force_n = course.touches[0], course.touches[-1], row.force_n
        conditions, procedure = planned(preflight), preflight.plan.procedure
        bend_m, zero_m, touch_m = conditions.bend(np.array([force_n, last.force_n, first.force_n]))
        if not self._touched:
            self._touched, told, source = True, "touched {} from the start", "surface_distance"
            plan_m, room_m = procedure.surface_distance_m, procedure.surface_uncertainty_m
            found_m, low_m = first.position_m - course.start_m, plan_m - room_m
            high_m = plan_m + room_m + theory.softest.deformation(first.force_n) + touch_m
        else:
            self._loaded, told, source = True, f"deformed {{}} at {f(force_n, 'N')}", "theory"
            found_m = engine.supervisor.arm.position_m - last.position_m - bend_m + zero_m
            sigma_m = float(conditions.bend_sigma(np.array([force_n]))[0])
            doubt_m = SIGMAS * math.hypot(conditions.position_resolution_m, sigma_m)
            least_m, most_m = (law.deformation(force_n) - law.deformation(last.force_n)
                               for law in (theory.stiffest, theory.softest))  # fmt: skip
            low_m, high_m = least_m / FACTOR - doubt_m, most_m * FACTOR + doubt_m
        if found_m < low_m or found_m > high_m:
            span, limit_m = f"{f(low_m, 'm')} to {f(high_m, 'm')}", max(low_m, min(found_m, high_m))
            message = f"{told.format(f(found_m, 'm'))}, expected {span} by {source}"
            cause = Cause("specimen", float(found_m), float(limit_m), "", 0.0, row.time_s, message)
            engine.trip(cause)
