"""At rest in free air: proves that nothing touches, takes the zero, checks its noise and drift.

A tare in contact would subtract that contact's force from every later reading, and nothing could
detect it any more. So the arm backs off first, within the free way that the plan states until its
direction is proven: force that changes with it was contact.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from functools import partial

from stepload.engine.phases import Exit, May, Steps, phase
from stepload.engine.retract import REST_S
from stepload.engine.run_state import RunState
from stepload.engine.tare import TareWindow
from stepload.errors import DomainError, RefusedError
from stepload.feasibility.bounds import Measured
from stepload.feasibility.schedule import BETWEEN_CYCLES_TARE_S
from stepload.feasibility.zero_drift import moved_n
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

LOOK_S = 0.2
"""Duration of each measurement, before and after backing off: ten periods of 50 Hz mains."""
FREE_SIGMAS = 6.0
ALLOWED_SHARE = 0.5
"""Share of the allowed drift and cross-check tolerance below which a change counts as none, since
sensors are not ideal at rest; more where backing off takes longer than that share of a tare."""
DRIFT_CHECK_S = 0.5
NOISE_FACTOR = 3.0
SECOND_NOISE_FACTOR = 1.5
"""The second channel's noise counts as found above this many times what is stated: a tare may
hold few new readings of it."""

Adopt = Callable[[Measured], RefusedError | DomainError | None]
"""Adopts thresholds for this noise and drift; returns why the plan does not fit them, or None."""


class Zeroing:
    """Takes the zero, and measures later how far it has moved.

    Args:
        course: state of the run.
        adopt: derives thresholds from what was measured where it is worse than planned.
    """

    def __init__(self, course: RunState, adopt: Adopt) -> None:
        self._course = course
        self._adopt = adopt

    def take(self, on_the_way: bool = False) -> Steps:
        """Prove free air, take the zero, check its drift; see `free_air`."""
        return (
            (yield from self.free_air(on_the_way))
            or (yield from self.tare())
            or (yield from self.drift_check())
        )

    @phase(Phase.WARM_UP, "the arm was taken over", May.STAND, Exit.STOP)
    def warm_up(self) -> Steps:
        """Wait until the sensors are warm."""
        course = self._course
        course.enter(Phase.WARM_UP)
        while True:
            yield
            if course.stop_requested():
                return Exit.STOP
            if course.now_s - course.since_s >= course.procedure.warm_up_s:
                return None

    @phase(Phase.FREE_AIR, "before every tare", May.BACK, Exit.STOP, Exit.CONTACT, Exit.FAIL)
    def free_air(self, on_the_way: bool = False) -> Steps:
        """Read both force channels, back off by the plan's retract, and read them again.

        In contact the run fails. `on_the_way`, in an approach, contact is an exit, and a smaller
        change already counts as contact: a payload much softer than planned is still compressed
        after the retract.
        """
        course = self._course
        window, before = TareWindow(), None
        course.enter(Phase.FREE_AIR)
        while before is None:
            yield
            if course.stop_requested():
                return Exit.STOP
            before = window.offer(course.now_s, course.sup, LOOK_S)
        course.aim(max(course.target_m - course.retract_m, course.back_end_m))
        back_m = course.target_m - course.goal_m
        yield
        while not course.rest_at_goal(REST_S + 4.0 * course.limits.loop_s):
            yield
        window, after = TareWindow(), None
        while after is None:
            yield
            after = window.offer(course.now_s, course.sup, LOOK_S)
        return self._free(before, after, back_m, on_the_way)

    def _free(self, before: Tare, after: Tare, back_m: float, on_the_way: bool) -> Exit | None:
        """Whether backing off has changed no force."""
        course, limits = self._course, self._course.limits
        change_n = after.mean_n - before.mean_n
        second_n = after.second_mean_n - before.second_mean_n
        course.tell(
            "free_air",
            {"backed_off_m": back_m, "change_n": change_n,
             "second_change_n": second_n, "before": asdict(before), "after": asdict(after)},
        )  # fmt: skip
        share = ALLOWED_SHARE
        if not on_the_way:
            apart_s = after.time_s - before.time_s
            share = max(ALLOWED_SHARE, min(1.0, apart_s / course.procedure.tare_s))
        # `max_drift` leaves room for a whole cycle. Between two looks a touch is contact.
        drift_n = min(course.procedure.max_drift_n, limits.touch_force_n / share)
        tolerance_n = limits.cross_tolerance_n
        if on_the_way:
            drift_n = tolerance_n = limits.moved_zero_n
        error_n = math.hypot(after.mean_error_n, before.mean_error_n)
        changes = [("force", change_n, error_n, drift_n)]
        if limits.cross_check:
            error_n = math.hypot(after.second_mean_error_n, before.second_mean_error_n)
            changes.append(("second force channel", second_n, error_n, tolerance_n))
        for name, change_n, error_n, allowed_n in changes:
            limit_n = max(FREE_SIGMAS * error_n, share * allowed_n)
            if abs(change_n) <= limit_n:
                continue
            if on_the_way:
                return Exit.CONTACT
            return self._in_contact(name, change_n, limit_n, back_m)
        return None

    def _in_contact(self, name: str, change_n: float, limit_n: float, back_m: float) -> Exit:
        course = self._course
        if change_n > 0.0 and not course.proven:
            return course.fail(*course.guard.turn(change_n, limit_n))
        return course.fail(
            "not_free", change_n, limit_n, "N",
            f"the {name} changed by {change_n:+.3g} N when the arm backed off by"
            f" {back_m * 1e3:.3g} mm: it was in contact, and a zero taken there"
            " would be wrong. Move the start pose away from the surface, see that nothing drags on"
            " the tool, and start again",
        )  # fmt: skip

    @phase(Phase.TARE, "free air was proved", May.STAND, Exit.STOP, Exit.FAIL)
    def tare(self) -> Steps:
        """Take the zero of both force channels."""
        course, window = self._course, TareWindow()
        course.enter(Phase.TARE)
        while True:
            yield
            if course.stop_requested():
                return Exit.STOP
            tare = window.offer(course.now_s, course.sup, course.procedure.tare_s)
            if tare is not None:
                return self._accept(tare)

    @phase(Phase.DRIFT_CHECK, "after a tare", May.STAND, Exit.FAIL)
    def drift_check(self) -> Steps:
        """See whether the zero stays."""
        course, window, zero = self._course, TareWindow(), self._course.tares[-1]
        course.enter(Phase.DRIFT_CHECK)
        look = None
        while look is None:
            yield
            look = window.offer(course.now_s, course.sup, DRIFT_CHECK_S)
        shift_n = look.mean_n - zero.mean_n
        second_n = look.second_mean_n - zero.second_mean_n
        course.tell("drift", {"shift_n": shift_n, "second_shift_n": second_n})
        return self._stays(shift_n, second_n, "since the tare: warm up longer")

    @phase(Phase.POST_TARE, "after the retract of a cycle", May.STAND, Exit.FAIL)
    def look_back(self) -> Steps:
        """Measure how far the zero has moved.

        Between cycles the new zero counts from now on. Free air needs no proof here: the contact
        was seen to open, and a zero further off than the drift allowed ends the run.
        """
        course, procedure, window = self._course, self._course.procedure, TareWindow()
        course.enter(Phase.POST_TARE)
        last = course.cycle >= procedure.cycles
        duration_s = procedure.tare_s if last else min(procedure.tare_s, BETWEEN_CYCLES_TARE_S)
        tare = None
        while tare is None:
            yield
            tare = window.offer(course.now_s, course.sup, duration_s)
        course.zero_shift_n = tare.mean_n - course.tares[0].mean_n
        if last:
            self._keep_last(tare)
            return None
        before = course.tares[-1]
        shift_n, second_n = tare.mean_n - before.mean_n, tare.second_mean_n - before.second_mean_n
        return self._stays(shift_n, second_n, "within one cycle") or self._accept(tare)

    def _keep_last(self, tare: Tare) -> None:
        """After the last cycle the zero counts for the last touch; how far it moved is told."""
        course, limits = self._course, self._course.limits
        limit_n, second_limit_n = course.procedure.max_drift_n, limits.second_zero_n
        second_n = tare.second_mean_n - course.tares[0].second_mean_n
        flagged = abs(course.zero_shift_n) > limit_n
        second_flagged = bool(limits.cross_check) and abs(second_n) > second_limit_n
        self._use(tare)
        course.tell("tare", asdict(tare))
        course.tell(
            "zero_shift",
            {"shift_n": course.zero_shift_n, "limit_n": limit_n, "second_shift_n": second_n,
             "second_limit_n": second_limit_n, "flagged": flagged or second_flagged,
             **asdict(tare)},
        )  # fmt: skip

    def _use(self, tare: Tare) -> None:
        self._course.tares.append(tare)
        self._course.sup.tare(tare.mean_n, tare.second_mean_n, tare.wrench)

    def _accept(self, tare: Tare) -> Exit | None:
        """Take this zero, unless it is too noisy or drifts."""
        course = self._course
        position_m = course.sup.arm.position_m
        course.tell("tare", {**asdict(tare), "position_m": position_m})
        allowed_n, max_drift_n = NOISE_FACTOR * course.limits.noise_n, course.procedure.max_drift_n
        drift_n = abs(tare.slope_n_per_s) * tare.duration_s
        if not tare.noise_n <= allowed_n:
            return course.fail(
                "noise", tare.noise_n, allowed_n, "N",
                f"the force sensor's noise of {tare.noise_n:.3g} N is more than {NOISE_FACTOR:g}"
                " times what the limits were derived for",
            )  # fmt: skip
        if not drift_n <= max_drift_n:
            return course.fail(
                "drift", drift_n, max_drift_n, "N",
                f"the force drifted by {drift_n:.3g} N during the tare: warm up longer",
            )  # fmt: skip
        left = self._fit(tare)
        if left is None:
            self._use(tare)
        return left

    def _stays(self, shift_n: float, second_n: float, since: str) -> Exit | None:
        """Fails the run where a zero has moved further than is counted on."""
        course, max_drift_n = self._course, self._course.procedure.max_drift_n
        second_limit_n = course.limits.second_zero_n
        if not abs(shift_n) <= max_drift_n:
            text = f"the force's zero moved by {shift_n:+.3g} N {since}"
            return course.fail("drift", shift_n, max_drift_n, "N", text)
        if course.limits.cross_check and not abs(second_n) <= second_limit_n:
            text = f"the second force channel's zero moved by {second_n:+.3g} N {since}"
            return course.fail("drift", second_n, second_limit_n, "N", text)
        return None

    def _fit(self, tare: Tare) -> Exit | None:
        """Fails the run where the measured noise and drift leave the plan no room."""
        course, procedure, limits = self._course, self._course.procedure, self._course.limits
        noise_n = tare.noise_n if tare.sure_noise_n > limits.shown_noise_n else 0.0
        second, sure = bool(limits.cross_check), tare.sure_slope_n_per_s
        moved = partial(moved_n, procedure, limits.loop_s, second_channel=second)
        drifts = moved(sure) > procedure.max_drift_n
        drifts = drifts or (not second and sure > limits.zero_drift_n_per_s)
        drift_n_per_s = tare.largest_slope_n_per_s if drifts else 0.0
        # A sensor with a force that never changes may not detect that a payload is dragged.
        blind = tare.live < 3 and 0.0 < limits.dragged_left < 1.0
        loud = second and tare.second_noise_n > SECOND_NOISE_FACTOR * limits.second_noise_n
        second_noise_n = tare.second_noise_n if loud else 0.0
        if noise_n == drift_n_per_s == second_noise_n == 0.0 and not blind:
            return None
        refusal = self._adopt(Measured(noise_n, drift_n_per_s, blind, second_noise_n))
        if refusal is None:
            return None
        drift_n = moved(drift_n_per_s)
        found = f"a noise of {tare.noise_n:.3g} N and a drift of {drift_n:.3g} N until the zero"
        beside = (
            f", and a noise of {second_noise_n:.3g} N of the second channel where"
            f" second_force.noise is {limits.second_noise_n:.3g} N"
            if loud
            else ""
        )
        only = " (and nothing across the pressing axis, as a load cell)" if blind else ""
        return course.fail(
            "no_room", tare.noise_n, limits.shown_noise_n, "N",
            f"the tare shows {found} is looked at again{beside}{only}; with them the plan does"
            f" not fit: {refusal.message} ({refusal.hint})",
        )  # fmt: skip
