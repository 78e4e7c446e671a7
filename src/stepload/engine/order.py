"""The order of a run: zero, approach, touch, load steps with holds, unload, retract, zero again.

A state machine that gives one position target per tick. It knows the devices only through the
supervisor's readings and never reads a clock. Each part does one thing; what follows what is
decided here.
"""

from __future__ import annotations

import math

from stepload.engine.align import Alignment
from stepload.engine.approach import FIRST, Approach
from stepload.engine.course import Course, Then
from stepload.engine.enough import FarEnough, Verdict, judge, nearest
from stepload.engine.notices import Say, nothing
from stepload.engine.retract import Retract
from stepload.engine.steps import Control, LoadSteps
from stepload.engine.zeroing import Adopt, Zeroing
from stepload.envelope.aligning import Aligning, NullingLaw
from stepload.envelope.until import Until
from stepload.record.rows import Phase

START_REST_S = 0.05
HELD_SHARE = 0.5
"""Largest error of the held position, as a share of the way to the nearest possible surface."""


class RunOrder:
    """Leads a course from its first tick to its last.

    Args:
        course: state of the run; in each tick it does what the order has set.
        adopt: see `Zeroing`.
        start_level: index of the first load level.
        controller: makes the step controller.
        until: the deformation needed at every level where the plan may end its loading early, else
            None.
        aligning, nulling: parameters of the touches on a circle and of nulling the lateral force;
            None where the plan does not ask for it.
    """

    def __init__(
        self,
        course: Course,
        adopt: Adopt,
        start_level: int,
        controller: Control,
        until: Until | None = None,
        tell: Say = nothing,
        aligning: Aligning | None = None,
        nulling: NullingLaw | None = None,
    ) -> None:
        self._tell = tell
        self.steps = LoadSteps(course, controller, nulling)
        self._course = course
        self._zeroing = Zeroing(course, self._leave, adopt)
        self._approach = Approach(course, self._leave, self._zeroing.take)
        self._alignment = None
        if aligning is not None:
            self._alignment = Alignment(course, self._approach, aligning, self._leave)
        self._retract = Retract(course)
        self._index = start_level
        self._top = len(course.plan.levels_n)
        self._far_enough = FarEnough(until) if until is not None else None
        self._standing_m = self._standing_s = math.nan
        self._resume: Then = course.finish
        course.act = self._start

    def _start(self, now_s: float, _step_s: float) -> None:
        """Take the arm over where its controller holds it, after `START_REST_S` of rest.

        The run fails if the position moves although nothing was commanded: a position that jumped
        must not be taken as the arm's. It also fails if the arm's controller holds it elsewhere: a
        command to stay would move it.
        """
        course, tolerance_m = self._course, self._course.limits.model_tolerance_m
        position_m = course.sup.arm.position_m
        if self._standing_m != self._standing_m:
            self._standing_m, self._standing_s = position_m, now_s
        moved_m = position_m - self._standing_m
        if abs(moved_m) > tolerance_m:
            course.fail(
                "moving", moved_m, tolerance_m, "m",
                f"the arm moved by {moved_m * 1e3:+.3g} mm, or says so, and nothing was commanded:"
                " stop whatever moves it, and start again",
            )  # fmt: skip
        elif now_s - self._standing_s >= START_REST_S and self._held_here(position_m):
            held_m = course.held_m
            course.target_m = course.start_m = position_m if held_m != held_m else held_m
            self._zeroing.warm_up(now_s, self._align)

    def _held_here(self, position_m: float) -> bool:
        """Whether the controller holds the arm here; fails the run where it does not."""
        course, plan = self._course, self._course.plan
        free_m = plan.surface_distance_m - plan.surface_uncertainty_m
        tolerance_m = min(course.limits.model_tolerance_m, HELD_SHARE * free_m)
        off_m = position_m - course.held_m
        if not abs(off_m) > tolerance_m:
            return True
        course.fail(
            "held", off_m, tolerance_m, "m",
            f"the arm says that it is {off_m * 1e3:+.3g} mm from where its controller holds it: a"
            " command to stay there would move it by as much. Nothing was commanded: find out"
            " which of the two is wrong (encoder, zero, tool centre point), and start again",
        )  # fmt: skip
        return False

    def _align(self, now_s: float) -> None:
        if self._alignment is None:
            self._first_approach(now_s)
        else:
            self._alignment.begin(now_s, self._first_approach)

    def _first_approach(self, now_s: float) -> None:
        if self._course.operator.paused:
            self._pause(now_s, self._first_approach)
        else:
            self._approach.begin(now_s, FIRST, self._course.plan.touches, self._touched)

    def _touched(self, now_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._leave(now_s)
        elif course.operator.paused:
            self._open_and_pause(now_s)
        else:
            self.steps.new_contact()
            if self._far_enough is not None and course.cycle == 1:
                touch = course.touches[-1]
                self._far_enough.touched(touch.force_n, touch.position_m)
            self._load(now_s)

    def _load(self, now_s: float) -> None:
        level_n = self._course.plan.levels_n[self._index]
        self.steps.load(now_s, self._index + 1, level_n, self._loaded)

    def _loaded(self, now_s: float) -> None:
        course = self._course
        course.levels_done += 1
        self._index += 1
        if course.cycle == 1:
            self._look_whether_enough(now_s)
        if course.failure is not None:
            return
        if course.stop_asked():
            self._leave(now_s)
        elif self._index < self._top:
            if course.operator.paused:
                self._open_and_pause(now_s)
            else:
                self._load(now_s)
        elif course.plan.unload:
            self._index -= 1
            self._unloaded(now_s)
        else:
            self._end_cycle(now_s)

    def _look_whether_enough(self, now_s: float) -> None:
        """End the loading at this level, or the run, depending on the deformation."""
        course, far = self._course, self._far_enough
        if far is None:
            return
        index = self._index - 1
        force_n, position_m = self.steps.held_mean
        deformation_m = far.held(force_n, position_m)
        needs, asked = far.until.needs, far.until.asked
        verdict = judge(needs, index, deformation_m)
        course.emit(
            now_s,
            "until",
            {"verdict": verdict.value, "level_n": needs[index].level_n,
             "deformation_m": deformation_m, "needed_m": needs[index].needed_m, "asked": asked,
             "top_force_n": course.plan.top_force_n},
        )  # fmt: skip
        reach = nearest(needs, index, deformation_m)
        if verdict is Verdict.ENOUGH:
            self._top = self._index
            if self._top < len(needs):
                self._tell(
                    f"far enough for ±{100.0 * asked:g} % at {needs[index].level_n:g} N of "
                    f"{course.plan.top_force_n:g} N: no more force than this"
                )
        elif verdict is Verdict.UNREACHABLE and reach is not None:
            course.fail(
                "until", reach.most_m, reach.need.least_m, "m",
                f"an interval of ±{100.0 * asked:g} % cannot be reached: at "
                f"{needs[index].level_n:g} N the payload has given way by "
                f"{deformation_m * 1e6:.3g} µm, {reach.text}",
            )  # fmt: skip

    def _unload(self, now_s: float) -> None:
        self._index -= 1
        if self._index < 0:
            self._end_cycle(now_s)
        else:
            level_n = self._course.plan.levels_n[self._index]
            self.steps.unload(now_s, self._index + 1, level_n, self._unloaded)

    def _unloaded(self, now_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._leave(now_s)
        elif course.operator.paused:
            if self._index > 0:  # an unloading cannot go on in another contact
                course.emit(now_s, "cycle_cut", {"cycle": course.cycle, "steps": self._index})
            self._open_cycle(now_s)
        else:
            self._unload(now_s)

    def _end_cycle(self, now_s: float) -> None:
        course, plan = self._course, self._course.plan
        if plan.lift_off or course.cycle >= plan.cycles:
            self._open_cycle(now_s)
        else:
            level_n = plan.unload_fraction * plan.levels_n[self._top - 1]
            self.steps.unload(now_s, 0, level_n, self._unloaded_between)

    def _unloaded_between(self, now_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._leave(now_s)
        elif course.operator.paused:
            self._open_cycle(now_s)
        else:
            self._next_cycle()
            self._load(now_s)

    def _open_cycle(self, now_s: float) -> None:
        self._retract.begin(now_s, self._look_back)

    def _next_cycle(self) -> None:
        self._course.cycle += 1
        self._index = 0

    def _look_back(self, now_s: float) -> None:
        self._zeroing.look_back(now_s, self._looked_back)

    def _looked_back(self, now_s: float) -> None:
        course = self._course
        last = course.cycle >= course.plan.cycles
        if course.stop_asked():
            course.finish(now_s)
            return
        if not last:
            self._next_cycle()
        if course.operator.paused:
            self._pause(now_s, self._last_touch if last else self._approach_again)
        elif last:
            self._last_touch(now_s)
        else:
            self._approach.begin(now_s, "cycle", 1, self._touched)

    def _last_touch(self, now_s: float) -> None:
        self._approach.begin(now_s, "last", 1, self._leave)

    def _open_and_pause(self, now_s: float) -> None:
        self._retract.begin(now_s, lambda now_s: self._pause(now_s, self._approach_again))

    def _pause(self, now_s: float, then: Then) -> None:
        """Wait in free air, take a new zero, then call `then`."""
        self._resume = then
        self._course.enter(Phase.PAUSED, now_s, self._paused)

    def _paused(self, now_s: float, _step_s: float) -> None:
        if self._course.stop_asked():
            self._course.finish(now_s)
        elif not self._course.operator.paused:
            self._zeroing.take(now_s, self._resume)

    def _approach_again(self, now_s: float) -> None:
        if self._course.operator.paused:
            self._pause(now_s, self._approach_again)
        else:
            self._approach.begin(now_s, "resume", 1, self._touched)

    def _leave(self, now_s: float) -> None:
        self._retract.begin(now_s, self._course.finish)
