"""The sequence of a run: zero, approach, touch, load steps with holds, unload, retract, zero again.

A generator that sets one position target per tick; it reads top to bottom. It knows the devices
only through the supervisor's readings and never reads a clock. What a phase returns says what
follows. The supervisor stays apart: it stops a run, whatever phase that is in.
"""

from __future__ import annotations

import math

from stepload.engine.align import Alignment
from stepload.engine.approach import FIRST, Approach
from stepload.engine.notices import Say, nothing
from stepload.engine.phases import PHASES, Exit, May, Steps, phase
from stepload.engine.retract import retract
from stepload.engine.run_state import RunState
from stepload.engine.steps import Control, LoadSteps
from stepload.engine.stopping_rule import StoppingRule, Verdict, judge, nearest
from stepload.engine.zeroing import Adopt, Zeroing
from stepload.feasibility.aligning import Aligning
from stepload.feasibility.until import Until
from stepload.record.rows import Phase

START_REST_S = 0.05
__all__ = ["PHASES", "RunSequence"]  # the table is whole once every phase is imported
HELD_SHARE = 0.5
"""Largest error of the held position, as a share of the way to the nearest possible surface."""


class RunSequence:
    """Leads a course from its first tick to its last.

    Args:
        course: state of the run; in each tick it resumes the order.
        adopt: see `Zeroing`.
        start_level: index of the first load level.
        controller: makes the step controller.
        until: the deformation needed at every level where the plan may end its loading early, else
            None.
        aligning: parameters of the touches on a circle; None where the plan asks for none.
    """

    def __init__(
        self,
        course: RunState,
        adopt: Adopt,
        start_level: int,
        controller: Control,
        until: Until | None = None,
        tell: Say = nothing,
        aligning: Aligning | None = None,
    ) -> None:
        self._tell = tell
        self.steps = LoadSteps(course, controller)
        self._course = course
        self._zeroing = Zeroing(course, adopt)
        self._approach = Approach(course, self._zeroing)
        self._alignment = Alignment(course, self._approach, aligning) if aligning else None
        self._index = start_level
        self._top = len(course.procedure.levels_n)
        self._stopping = StoppingRule(until) if until is not None else None
        course.sequence = self._run()

    def _run(self) -> Steps:
        """The whole run. However it is left, the contact is opened, here or by safing."""
        left = (
            (yield from self._take_over())
            or (yield from self._zeroing.warm_up())
            or (yield from self._zeroing.take())
            or (yield from self._align())
            or (yield from self._cycles())
            or (yield from self._approach.touch("last", 1))
        )
        if left is None or left is Exit.STOP:
            left = yield from retract(self._course)
        if left is not Exit.FAIL:
            self._course.finish()
        return left

    def _take_over(self) -> Steps:
        """Take the arm over where its controller holds it, after `START_REST_S` of rest.

        The run fails if the position moves although nothing was commanded: a position that jumped
        must not be taken as the arm's. It also fails if the arm's controller holds it elsewhere: a
        command to stay would move it.
        """
        course, tolerance_m = self._course, self._course.limits.model_tolerance_m
        standing_m = standing_s = math.nan
        while True:
            position_m = course.sup.arm.position_m
            if standing_m != standing_m:
                standing_m, standing_s = position_m, course.now_s
            moved_m = position_m - standing_m
            if abs(moved_m) > tolerance_m:
                return course.fail(
                    "moving", moved_m, tolerance_m, "m",
                    f"the arm moved by {moved_m * 1e3:+.3g} mm, or says so, and nothing was"
                    " commanded: stop whatever moves it, and start again",
                )  # fmt: skip
            if course.now_s - standing_s >= START_REST_S:
                break
            yield
        if left := self._held_here(position_m):
            return left
        held_m = course.held_m
        course.target_m = course.start_m = position_m if held_m != held_m else held_m
        return None

    def _held_here(self, position_m: float) -> Exit | None:
        """Fails the run where the controller holds the arm elsewhere."""
        course, procedure = self._course, self._course.procedure
        free_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
        tolerance_m = min(course.limits.model_tolerance_m, HELD_SHARE * free_m)
        off_m = position_m - course.held_m
        if not abs(off_m) > tolerance_m:
            return None
        return course.fail(
            "held", off_m, tolerance_m, "m",
            f"the arm says that it is {off_m * 1e3:+.3g} mm from where its controller holds it: a"
            " command to stay there would move it by as much. Nothing was commanded: find out"
            " which of the two is wrong (encoder, zero, tool centre point), and start again",
        )  # fmt: skip

    def _align(self) -> Steps:
        return (yield from self._alignment.check()) if self._alignment else None

    def _cycles(self) -> Steps:
        """Every cycle: touch, press, retract, look back at the zero."""
        course, procedure = self._course, self._course.procedure
        purpose, touches, last = FIRST, procedure.touches, False
        while not last:
            while course.operator.paused:
                if left := (yield from self._wait()):
                    return left
            if left := (yield from self._approach.touch(purpose, touches)):
                return left
            purpose, touches = "cycle", 1
            left = yield from self._press()
            if left is Exit.PAUSE:
                if left := (yield from retract(course)) or (yield from self._wait()):
                    return left
                purpose = "resume"
                continue
            left = left or (yield from retract(course)) or (yield from self._zeroing.look_back())
            if left:
                return left
            if course.stop_requested():
                return Exit.END
            last = course.cycle >= procedure.cycles
            if not last:
                self._next_cycle()
            if course.operator.paused:
                purpose = "resume"
                if left := (yield from self._wait()):
                    return left
        return None

    def _press(self) -> Steps:
        """In contact: every level up, and down again where the plan asks for it.

        A pause on the way up is an exit; one on the way down ends the cycle: an unloading cannot go
        on in another contact.
        """
        course, procedure = self._course, self._course.procedure
        if left := self._requested():
            return left
        self.steps.new_contact()
        if self._stopping is not None and course.cycle == 1:
            touch = course.touches[-1]
            self._stopping.touched(touch.force_n, touch.position_m)
        while True:
            if left := (yield from self._up()):
                return left
            left = (yield from self._down()) if procedure.unload else None
            if left or procedure.lift_off or course.cycle >= procedure.cycles:
                return None if left is Exit.PAUSE else left
            low_n = procedure.unload_fraction * procedure.levels_n[self._top - 1]
            if left := (yield from self.steps.step(0, low_n, up=False)):
                return left
            if left := self._requested():
                return None if left is Exit.PAUSE else left
            self._next_cycle()

    def _requested(self) -> Exit | None:
        """What the operator asks for, between two steps."""
        if self._course.stop_requested():
            return Exit.STOP
        return Exit.PAUSE if self._course.operator.paused else None

    def _up(self) -> Steps:
        """Level by level up, until there is none left or the deformation is enough."""
        course, levels_n = self._course, self._course.procedure.levels_n
        while True:
            index = self._index
            if left := (yield from self.steps.step(index + 1, levels_n[index])):
                return left
            course.levels_done += 1
            self._index += 1
            if left := self._judge_reach():
                return left
            left = self._requested()
            if self._index >= self._top and left is not Exit.STOP:
                return None
            if left:
                return left

    def _down(self) -> Steps:
        """Level by level down."""
        course, levels_n = self._course, self._course.procedure.levels_n
        self._index -= 1
        while True:
            left = self._requested()
            if left is Exit.PAUSE and self._index > 0:
                course.tell("cycle_cut", {"cycle": course.cycle, "steps": self._index})
            if left:
                return left
            self._index -= 1
            if self._index < 0:
                return None
            level_n = levels_n[self._index]
            if left := (yield from self.steps.step(self._index + 1, level_n, up=False)):
                return left

    def _next_cycle(self) -> None:
        self._course.cycle += 1
        self._index = 0

    def _wait(self) -> Steps:
        """Wait in free air, then take a new zero."""
        return (yield from self._paused()) or (yield from self._zeroing.take())

    @phase(Phase.PAUSED, "the operator paused, and the contact is open", May.STAND, Exit.END)
    def _paused(self) -> Steps:
        """Wait until the operator resumes."""
        course = self._course
        course.enter(Phase.PAUSED)
        while True:
            yield
            if course.stop_requested():
                return Exit.END
            if not course.operator.paused:
                return None

    def _judge_reach(self) -> Exit | None:
        """End the loading at this level, or the run, depending on the deformation."""
        course, far = self._course, self._stopping
        if far is None or course.cycle != 1:
            return None
        index = self._index - 1
        force_n, position_m = self.steps.held_mean
        deformation_m = far.held(force_n, position_m)
        needs, requested = far.until.needs, far.until.requested
        verdict = judge(needs, index, deformation_m)
        course.tell(
            "until",
            {"verdict": verdict.value, "level_n": needs[index].level_n,
             "deformation_m": deformation_m, "needed_m": needs[index].needed_m,
             "requested": requested, "top_force_n": course.procedure.top_force_n},
        )  # fmt: skip
        reach = nearest(needs, index, deformation_m)
        if verdict is Verdict.ENOUGH:
            self._top = self._index
            if self._top < len(needs):
                self._tell(
                    f"far enough for ±{100.0 * requested:g} % at {needs[index].level_n:g} N of "
                    f"{course.procedure.top_force_n:g} N: no more force than this"
                )
        elif verdict is Verdict.UNREACHABLE and reach is not None:
            return course.fail(
                "until", reach.most_m, reach.need.least_m, "m",
                f"an interval of ±{100.0 * requested:g} % cannot be reached: at "
                f"{needs[index].level_n:g} N the payload has given way by "
                f"{deformation_m * 1e6:.3g} µm, {reach.text}",
            )  # fmt: skip
        return None
