"""In contact: bring the force to a level, up or down, and hold it there until it has settled."""

from __future__ import annotations

import math
from collections.abc import Callable

from stepload.engine.controller import StepController
from stepload.engine.force_state import SettleTest
from stepload.engine.phases import Exit, May, Steps, phase
from stepload.engine.retract import not_open
from stepload.engine.run_state import RunState
from stepload.feasibility.bounds import step_patience_s
from stepload.feasibility.limits import RunLimits
from stepload.record.rows import Phase

SETTLE_SHARE = 0.005
"""Creep over a hold, as a share of the level, that still counts as rest."""


Control = Callable[[RunLimits], StepController]
"""Makes the step controller of a run. A run uses `StepController` itself; tests of its layers of
safety may pass one that leaves a layer out."""


class LoadSteps:
    """Brings the force to one level at a time and holds it there.

    Args:
        course: state of the run.
        controller: makes `controller`, which brings the force to a level.
    """

    def __init__(self, course: RunState, controller: Control) -> None:
        self._course = course
        self._control = controller
        self._settle = SettleTest()
        self._same_contact = False
        self._force_sum_n = self._position_sum_m = 0.0
        self._ticks = 0
        self._rest_n = self._rest_m = math.nan
        self.controller = controller(course.limits)

    def adopt(self, limits: RunLimits) -> None:
        """Go on with a controller for these limits; between levels only."""
        self.controller = self._control(limits)

    def new_contact(self) -> None:
        """Discard what was learned of the payload's compliance: the contact is a new one."""
        self._same_contact = False

    @property
    def held_mean(self) -> tuple[float, float]:
        """Mean force in N and position in m of the last hold."""
        return self._force_sum_n / self._ticks, self._position_sum_m / self._ticks

    def step(self, number: int, level_n: float, up: bool = True) -> Steps:
        """Rise or come down to `level_n` and hold it; `number` is the step's in the record."""
        return (yield from self._go(number, level_n, up)) or (yield from self._hold(up))

    @phase(Phase.LOAD, "in contact, below the level", May.TOWARDS, Exit.FAIL)
    @phase(Phase.UNLOAD, "in contact, above the level", May.BACK, Exit.FAIL)
    def _go(self, number: int, level_n: float, up: bool) -> Steps:
        """Bring the force to a level, or give it up after its time."""
        course, sup, controller = self._course, self._course.sup, self.controller
        course.step_number, course.level_n = number, level_n
        if not self._same_contact:
            course.press()
        held = self._same_contact and self._ticks
        rested_n = self.held_mean[0] if held else course.dwelt_n
        controller.begin(
            level_n, sup.smooth_n, sup.arm.position_m, 1.0 if up else -1.0, self._same_contact,
            rested_n, course.target_m,
        )  # fmt: skip
        self._same_contact = True
        course.enter(Phase.LOAD if up else Phase.UNLOAD)
        patience_s = step_patience_s(course.procedure)
        while True:
            yield
            course.target_m = controller.step(
                sup.force_n, sup.smooth_n, sup.arm.position_m, course.target_m, course.step_s
            )
            if course.target_m < course.surface_m - course.retract_m:
                return not_open(course, level_n)
            if controller.reached:
                return None
            if course.now_s - course.since_s >= patience_s:
                course.tell("level_missed", {"level_n": level_n, "force_n": sup.smooth_n})
                return None

    @phase(Phase.HOLD, "a level was reached or given up", May.STAND, Exit.FAIL)
    @phase(Phase.UNLOAD_HOLD, "a level was reached or given up", May.STAND, Exit.FAIL)
    def _hold(self, up: bool) -> Steps:
        """Hold a level until it has settled."""
        course, limits, sup, settle = (
            self._course, self._course.limits, self._course.sup, self._settle
        )  # fmt: skip
        if self.controller.reached and course.target_m > course.deepest_m:
            course.deepest_m = course.target_m
        eps_n = max(limits.band_n, SETTLE_SHARE * course.level_n)
        hold_s = course.procedure.hold_s
        settle.begin(course.now_s + 4.0 / limits.step_rate_per_s, hold_s, eps_n)
        self._force_sum_n = self._position_sum_m = 0.0
        self._ticks = 0
        self._rest_n = math.nan
        course.enter(Phase.HOLD if up else Phase.UNLOAD_HOLD)
        longest_s = hold_s + course.procedure.settle_timeout_s
        while True:
            yield
            settle.add(course.now_s, sup.force_n)
            self._force_sum_n += sup.force_n
            self._position_sum_m += sup.arm.position_m
            self._ticks += 1
            held_s = course.now_s - course.since_s
            if left := self._late(held_s):
                return left
            if held_s >= hold_s and (settle.settled or held_s >= longest_s):
                break
        course.tell(
            "held",
            {"level_n": course.level_n, "force_n": sup.smooth_n,
             "settled": settle.settled and self.controller.reached, "held_s": held_s,
             "cycle": course.cycle, "step": course.step_number,
             "loading": up},
        )  # fmt: skip
        return None

    def _late(self, held_s: float) -> Exit | None:
        """End the run (R9) where an only force channel still rises though nothing moves: it lags.

        The next step would take a force for proven that the payload bore long before.
        """
        course, limits, sup = self._course, self._course.limits, self._course.sup
        if limits.cross_check or course.phase != Phase.HOLD or held_s < 2.0 * limits.reaction_s:
            return None
        if self._rest_n != self._rest_n:
            self._rest_n, self._rest_m = sup.smooth_n, sup.arm.position_m
        moved_m = max(0.0, sup.arm.position_m - self._rest_m) + limits.position_resolution_m
        allowed_n = limits.touch_force_n + limits.zero_drift_n_per_s * held_s
        allowed_n += limits.stiffness_n_per_m * moved_m
        rose_n = sup.smooth_n - self._rest_n
        if not rose_n > allowed_n:
            return None
        return course.fail(
            "R9", rose_n, allowed_n, "N",
            f"the force rose by {rose_n:.3g} N in a hold, where nothing moves. The only force"
            " channel shows the force too late",
        )  # fmt: skip
