"""In contact: bring the force to a level, up or down, and hold it there until it has settled."""

from __future__ import annotations

import math
from collections.abc import Callable

from stepload.engine.controller import StepController
from stepload.engine.course import Course, Then
from stepload.engine.nulling import Nulling
from stepload.engine.retract import not_open
from stepload.engine.settle import SettleTest
from stepload.envelope.aligning import NullingLaw
from stepload.envelope.bounds import step_patience_s
from stepload.envelope.limits import RunLimits
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
        nulling: law by which lateral force is nulled before a level is held, None where it is not.
    """

    def __init__(
        self, course: Course, controller: Control, nulling: NullingLaw | None = None
    ) -> None:
        self._course = course
        self._control = controller
        self._settle = SettleTest()
        self._nulling = Nulling(course, nulling)
        self._same_contact = False
        self._hold_phase = Phase.HOLD
        self._then: Then = course.finish
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

    def load(self, now_s: float, number: int, level_n: float, then: Then) -> None:
        """Rise to `level_n`, hold it, then call `then`; `number` is the step's in the record."""
        self._begin(now_s, number, level_n, 1.0, then)

    def unload(self, now_s: float, number: int, level_n: float, then: Then) -> None:
        """Come down to `level_n`, hold it, then call `then`."""
        self._begin(now_s, number, level_n, -1.0, then)

    def _begin(self, now_s: float, number: int, level_n: float, sign: float, then: Then) -> None:
        course, sup = self._course, self._course.sup
        course.step_number, course.level_n = number, level_n
        self._then = then
        if not self._same_contact:
            course.press(now_s)
        held = self._same_contact and self._ticks
        rested_n = self.held_mean[0] if held else course.dwelt_n
        self.controller.begin(
            level_n, sup.smooth_n, sup.arm.position_m, sign, self._same_contact, rested_n,
            course.target_m,
        )  # fmt: skip
        self._same_contact = True
        self._hold_phase = Phase.HOLD if sign > 0.0 else Phase.UNLOAD_HOLD
        course.enter(Phase.LOAD if sign > 0.0 else Phase.UNLOAD, now_s, self._go)

    def _go(self, now_s: float, step_s: float) -> None:
        course, controller = self._course, self.controller
        sup = course.sup
        course.target_m = controller.step(
            sup.force_n, sup.smooth_n, sup.arm.position_m, course.target_m, step_s
        )
        if course.target_m < course.surface_m - course.retract_m:
            not_open(course, course.level_n)
        if not (controller.reached or self._too_long(now_s)):
            return
        self._nulling.begin(now_s, self._begin_hold)

    def _begin_hold(self, now_s: float) -> None:
        course, limits = self._course, self._course.limits
        if self.controller.reached and course.target_m > course.deepest_m:
            course.deepest_m = course.target_m
        eps_n = max(limits.band_n, SETTLE_SHARE * course.level_n)
        self._settle.begin(now_s + 4.0 / limits.step_rate_per_s, course.plan.hold_s, eps_n)
        self._force_sum_n = self._position_sum_m = 0.0
        self._ticks = 0
        self._rest_n = math.nan
        course.enter(self._hold_phase, now_s, self._hold)

    def _too_long(self, now_s: float) -> bool:
        course = self._course
        if now_s - course.since_s < step_patience_s(course.plan):
            return False
        missed = {"level_n": course.level_n, "force_n": course.sup.smooth_n}
        course.emit(now_s, "level_missed", {**missed})
        return True

    def _late(self, held_s: float) -> None:
        """End the run (R9) where an only force channel still rises though nothing moves: it lags.

        The next step would take a force for proven that the payload bore long before.
        """
        course, limits, sup = self._course, self._course.limits, self._course.sup
        if limits.cross_check or course.phase != Phase.HOLD or held_s < 2.0 * limits.reaction_s:
            return
        if self._rest_n != self._rest_n:
            self._rest_n, self._rest_m = sup.smooth_n, sup.arm.position_m
        moved_m = max(0.0, sup.arm.position_m - self._rest_m) + limits.position_resolution_m
        allowed_n = limits.touch_force_n + limits.zero_drift_n_per_s * held_s
        allowed_n += limits.stiffness_n_per_m * moved_m
        rose_n = sup.smooth_n - self._rest_n
        if rose_n > allowed_n:
            course.fail(
                "R9", rose_n, allowed_n, "N",
                f"the force rose by {rose_n:.3g} N in a hold, where nothing moves. The only force"
                " channel shows the force too late",
            )  # fmt: skip

    def _hold(self, now_s: float, _step_s: float) -> None:
        course, settle = self._course, self._settle
        sup = course.sup
        settle.add(now_s, sup.force_n)
        self._force_sum_n += sup.force_n
        self._position_sum_m += sup.arm.position_m
        self._ticks += 1
        held_s = now_s - course.since_s
        self._late(held_s)
        if held_s < course.plan.hold_s:
            return
        timed_out = held_s >= course.plan.hold_s + course.plan.settle_timeout_s
        if not (settle.settled or timed_out):
            return
        course.emit(
            now_s,
            "held",
            {"level_n": course.level_n, "force_n": course.sup.smooth_n,
             "settled": settle.settled and self.controller.reached, "held_s": held_s,
             "cycle": course.cycle, "step": course.step_number,
             "loading": course.phase == Phase.HOLD},
        )  # fmt: skip
        self._then(now_s)
