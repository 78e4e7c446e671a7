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

FACTOR = 2.0
"""A payload this many times softer or stiffer than expected is another one."""
SIGMAS = 3.0


class SpecimenCheck:
    """Looks at a run, and stops it if the specimen is a wrong one.

    Args:
        earlier: position of the first touch and deformation at the first level, in m, of specimens
            of the same plan.
    """

    def __init__(self, earlier: Sequence[tuple[float, float]]) -> None:
        self._before = np.median(earlier, axis=0).tolist() if earlier else []
        self._touched = self._loaded = False

    def __call__(self, engine: Engine, preflight: Preflight) -> None:
        """Look at the run as it is now."""
        row, course, theory = engine.row, engine.course, preflight.theory
        if row is None or not course.touches:
            return
        # With a gauge the travel of the arm is not what is measured.
        loaded = row.phase == Phase.HOLD and preflight.plan.rig.displacement is None
        if self._touched and (self._loaded or not loaded):
            return
        first, last, force_n = course.touches[0], course.touches[-1], row.force_n
        conditions, procedure = planned(preflight), preflight.plan.procedure
        bend_m, zero_m, touch_m = conditions.bend(np.array([force_n, last.force_n, first.force_n]))
        if not self._touched:
            self._touched, told = True, "touched {} from the start"
            found_m, room_m = first.position_m - course.start_m, procedure.surface_uncertainty_m
            given_m = theory.softest.deformation(first.force_n) + touch_m
            plan_m = procedure.surface_distance_m
            looks = [(plan_m - room_m, plan_m + room_m + given_m, "surface_distance")]
            if self._before:
                at_m = self._before[0] - course.start_m
                looks.append((at_m - room_m, at_m + room_m, "those before"))
        else:
            self._loaded, told = True, f"deformed {{}} at {f(force_n, 'N')}"
            found_m = engine.supervisor.arm.position_m - last.position_m - bend_m + zero_m
            sigma_m = float(conditions.bend_sigma(np.array([force_n]))[0])
            doubt_m = SIGMAS * math.hypot(conditions.position_resolution_m, sigma_m)
            least_m, most_m = (law.deformation(force_n) - law.deformation(last.force_n)
                               for law in (theory.stiffest, theory.softest))  # fmt: skip
            source = "theory"
            if self._before:  # what was measured is better known
                least_m, most_m, source = (self._before[1] + zero_m,) * 2 + ("those before",)
            looks = [(least_m / FACTOR - doubt_m, most_m * FACTOR + doubt_m, source)]
        for low_m, high_m, source in looks:
            if found_m < low_m or found_m > high_m:
                span = f"{f(low_m, 'm')} to {f(high_m, 'm')}"
                message = f"{told.format(f(found_m, 'm'))}, expected {span} by {source}"
                limit_m = low_m if found_m < low_m else high_m
                engine.trip(Cause("specimen", found_m, limit_m, "", 0.0, row.time_s, message))
