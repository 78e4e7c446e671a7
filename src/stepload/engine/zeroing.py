"""At rest in free air: takes the zero of both force channels, and checks its noise and drift."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from functools import partial

from stepload.engine.course import Act, Course, Then
from stepload.engine.free_air import FreeAir
from stepload.engine.tare import TareWindow
from stepload.envelope.bounds import Measured
from stepload.envelope.schedule import BETWEEN_CYCLES_TARE_S
from stepload.envelope.zero_drift import moved_n
from stepload.errors import DomainError, RefusedError
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

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
        stopped: what to do when the operator stops the run here.
        adopt: derives thresholds from what was measured where it is worse than planned.
    """

    def __init__(self, course: Course, stopped: Then, adopt: Adopt) -> None:
        self._course = course
        self._stopped = stopped
        self._adopt = adopt
        self._then = stopped
        self._window = TareWindow()
        self._free_air = FreeAir(course, stopped)
        self._zero: Tare | None = None

    def warm_up(self, now_s: float, then: Then) -> None:
        """Wait, then `take` a zero."""
        self._then = then
        self._course.enter(Phase.WARM_UP, now_s, self._warm_up)

    def take(self, now_s: float, then: Then, touching: Then | None = None) -> None:
        """Prove free air, take the zero, check its drift, then call `then`; see `FreeAir.prove`."""
        self._then = then
        self._free_air.prove(now_s, self._begin_tare, touching)

    def look_back(self, now_s: float, then: Then) -> None:
        """Measure after a retract how far the zero has moved, then call `then`.

        Between cycles the new zero counts from now on. Free air needs no proof here: the contact
        was seen to open, and a zero further off than the drift allowed ends the run.
        """
        self._then = then
        self._begin(now_s, Phase.POST_TARE, self._look_back)

    def _begin_tare(self, now_s: float) -> None:
        self._begin(now_s, Phase.TARE, self._tare)

    def _begin(self, now_s: float, phase: Phase, act: Act) -> None:
        self._window = TareWindow()
        self._course.enter(phase, now_s, act)

    def _warm_up(self, now_s: float, _step_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._stopped(now_s)
        elif now_s - course.since_s >= course.plan.warm_up_s:
            self.take(now_s, self._then)

    def _tare(self, now_s: float, _step_s: float) -> None:
        course = self._course
        if course.stop_asked():
            self._stopped(now_s)
            return
        tare = self._window.offer(now_s, course.sup, course.plan.tare_s)
        if tare is not None and self._accept(now_s, tare):
            self._begin(now_s, Phase.DRIFT_CHECK, self._drift_check)

    def _accept(self, now_s: float, tare: Tare) -> bool:
        """Take this zero, unless it is too noisy or drifts."""
        course = self._course
        position_m = course.sup.arm.position_m
        course.emit(now_s, "tare", {**asdict(tare), "position_m": position_m})
        allowed_n, max_drift_n = NOISE_FACTOR * course.limits.noise_n, course.plan.max_drift_n
        drift_n = abs(tare.slope_n_per_s) * tare.duration_s
        if not tare.noise_n <= allowed_n:
            course.fail(
                "noise", tare.noise_n, allowed_n, "N",
                f"the force sensor's noise of {tare.noise_n:.3g} N is more than {NOISE_FACTOR:g}"
                " times what the limits were derived for",
            )  # fmt: skip
        elif not drift_n <= max_drift_n:
            course.fail(
                "drift", drift_n, max_drift_n, "N",
                f"the force drifted by {drift_n:.3g} N during the tare: warm up longer",
            )  # fmt: skip
        elif self._still_fits(tare):
            self._zero = tare
            course.tares.append(tare)
            course.sup.tare(tare.mean_n, tare.second_mean_n, tare.wrench)
        return course.failure is None

    def _drift_check(self, now_s: float, _step_s: float) -> None:
        course, zero = self._course, self._zero
        look = self._window.offer(now_s, course.sup, DRIFT_CHECK_S)
        if look is None or zero is None:
            return
        shift_n = look.mean_n - zero.mean_n
        second_n = look.second_mean_n - zero.second_mean_n
        course.emit(now_s, "drift", {"shift_n": shift_n, "second_shift_n": second_n})
        if self._stand(shift_n, second_n, "since the tare: warm up longer"):
            self._then(now_s)

    def _stand(self, shift_n: float, second_n: float, since: str) -> bool:
        """Whether no zero has moved further than is counted on; else the run cannot go on."""
        course, max_drift_n = self._course, self._course.plan.max_drift_n
        second_limit_n = course.limits.second_zero_n
        if not abs(shift_n) <= max_drift_n:
            text = f"the force's zero moved by {shift_n:+.3g} N {since}"
            course.fail("drift", shift_n, max_drift_n, "N", text)
        elif course.limits.cross_check and not abs(second_n) <= second_limit_n:
            text = f"the second force channel's zero moved by {second_n:+.3g} N {since}"
            course.fail("drift", second_n, second_limit_n, "N", text)
        return course.failure is None

    def _still_fits(self, tare: Tare) -> bool:
        """Whether the plan still leaves room with the measured noise and drift."""
        course, plan, limits = self._course, self._course.plan, self._course.limits
        noise_n = tare.noise_n if tare.sure_noise_n > limits.shown_noise_n else 0.0
        second, sure = bool(limits.cross_check), tare.sure_slope_n_per_s
        moved = partial(moved_n, plan, limits.loop_s, second_channel=second)
        drifts = moved(sure) > plan.max_drift_n or (not second and sure > limits.zero_drift_n_per_s)
        drift_n_per_s = tare.largest_slope_n_per_s if drifts else 0.0
        # A sensor with a force that never changes may not detect that a payload is dragged.
        blind = tare.live < 3 and 0.0 < limits.dragged_left < 1.0
        loud = second and tare.second_noise_n > SECOND_NOISE_FACTOR * limits.second_noise_n
        second_noise_n = tare.second_noise_n if loud else 0.0
        if noise_n == drift_n_per_s == second_noise_n == 0.0 and not blind:
            return True
        refusal = self._adopt(Measured(noise_n, drift_n_per_s, blind, second_noise_n))
        if refusal is not None:
            drift_n = moved(drift_n_per_s)
            found = f"a noise of {tare.noise_n:.3g} N and a drift of {drift_n:.3g} N until the zero"
            beside = (
                f", and a noise of {second_noise_n:.3g} N of the second channel where"
                f" second_force.noise is {limits.second_noise_n:.3g} N"
                if loud
                else ""
            )
            only = " (and nothing across the pressing axis, as a load cell)" if blind else ""
            course.fail(
                "no_room", tare.noise_n, limits.shown_noise_n, "N",
                f"the tare shows {found} is looked at again{beside}{only}; with them the plan does"
                f" not fit: {refusal.message} ({refusal.hint})",
            )  # fmt: skip
        return course.failure is None

    def _look_back(self, now_s: float, _step_s: float) -> None:
        course, plan = self._course, self._course.plan
        last = course.cycle >= plan.cycles
        duration_s = plan.tare_s if last else min(plan.tare_s, BETWEEN_CYCLES_TARE_S)
        tare = self._window.offer(now_s, course.sup, duration_s)
        if tare is None:
            return
        course.zero_shift_n = tare.mean_n - course.tares[0].mean_n
        if last:
            second_n = tare.second_mean_n - course.tares[0].second_mean_n
            second_limit_n, checked = course.limits.second_zero_n, bool(course.limits.cross_check)
            flagged = abs(course.zero_shift_n) > plan.max_drift_n
            course.tares.append(tare)
            course.sup.tare(tare.mean_n, tare.second_mean_n, tare.wrench)  # for the last touch
            course.emit(now_s, "tare", asdict(tare))
            course.emit(
                now_s,
                "zero_shift",
                {"shift_n": course.zero_shift_n, "limit_n": plan.max_drift_n,
                 "second_shift_n": second_n, "second_limit_n": second_limit_n,
                 "flagged": flagged or (checked and abs(second_n) > second_limit_n),
                 **asdict(tare)},
            )  # fmt: skip
            self._then(now_s)
            return
        before = course.tares[-1]
        shift_n, second_n = tare.mean_n - before.mean_n, tare.second_mean_n - before.second_mean_n
        if self._stand(shift_n, second_n, "within one cycle") and self._accept(now_s, tare):
            self._then(now_s)
