"""One tick: samples in, target out. The same step dry, on hardware and in replay."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from stepload.engine.controller import StepController
from stepload.engine.notices import Say, nothing
from stepload.engine.operator import Operator, StopLevel
from stepload.engine.run_state import RunState
from stepload.engine.sequence import RunSequence
from stepload.engine.steps import Control
from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Found, Trip
from stepload.errors import DomainError, RefusedError
from stepload.feasibility.bounds import Measured
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.plan.model import SecondForceSource
from stepload.record.outcome import Cause
from stepload.record.rows import Phase, TickRow
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample

SAFING_EXTRA_S = 2.0
"""Time in s beyond twice that of the retract, after which safing acts without the loop."""

ARRIVAL_SHARE = 0.25
"""Arrival tolerance as a share of the retract: an arm that never moved must not count as back."""
LATE_S = 0.2
"""Time in s for which the retract is still commanded after arrival: commands may come late."""

_SAFING = int(Phase.SAFING)
_STOP_NOW = int(StopLevel.NOW)
_new: Any = tuple.__new__


class Engine:
    """State of a run. It reads no clock and touches no device.

    `course` says where the run is, `row` is the newest tick for the record, `events` what has
    happened since the loop last emptied it, as (time_s, kind, data). `safe_reached` says whether
    the retract after a trip came to its end, `still_closed` why the contact cannot be said to be
    open there; "" where all force channels show that it is.

    Args:
        preflight: of the plan.
        operator: where stop and pause requests come in.
        start_cycle, start_level: where the run begins; the level is an index.
        found, controller: parts that tests may replace; see `Found`, `Control`.

    Raises:
        RefusedError: the plan may not be pressed.
    """

    def __init__(
        self,
        preflight: Preflight,
        operator: Operator,
        *,
        start_cycle: int = 1,
        start_level: int = 0,
        found: Found = Trip,
        controller: Control = StepController,
    ) -> None:
        plan, limits = preflight.plan, preflight.run_limits
        rig = plan.rig
        second = rig.second_force
        second_axis = (
            second.sensor.axis
            if second.source is SecondForceSource.SENSOR and second.sensor is not None
            else ""
        )
        self.limits = limits
        self.operator = operator
        self.events: list[tuple[float, str, dict[str, object]]] = []
        self.supervisor = Supervisor(limits, rig.force.axis, second_axis, found)
        self.course = RunState(
            plan.procedure, limits, self.supervisor, operator, self._emit, start_cycle
        )
        self.steps = RunSequence(
            self.course, self._adopt, start_level, controller, preflight.until,
            lambda words: self.on_word(words), preflight.aligning,
        ).steps  # fmt: skip
        self._plan = plan
        self._measured = Measured(0.0, 0.0)
        self.cause: Cause | None = None
        self.on_stop: Callable[[Cause | None], None] = lambda _cause: None
        self.on_word: Say = nothing
        self.target_m = math.nan
        self.late_s = 0.0
        self.peak_force_n = 0.0
        self.row: TickRow | None = None
        self.safing = False
        self.safe_reached = False
        self.still_closed = ""
        self._phase = int(Phase.WARM_UP)
        self._last_s = math.nan
        self._longest_step_s = 1.2 * limits.period_s  # a late tick moves less, never faster
        self._safe_m = self._safe_speed_m_s = self._give_up_s = 0.0
        self._there_s = math.nan

    @property
    def shift_m(self) -> tuple[float, float]:
        """Commanded shift across the approach; a retract keeps it."""
        return self.course.shift_m

    @property
    def retract_distance_m(self) -> float:
        """How far the arm must go back from where it may be now for the contact to be open.

        0 where it may not: its direction is not proven, and the free way behind it is used up.
        """
        course = self.course
        goal_m = self._safe_m if self.safing else course.release_m
        if course.start_m != course.start_m and not course.proven:
            return min(course.retract_m, course.free_m)
        way_m = max(max(course.expected_m, self.target_m) - goal_m, course.retract_m)
        if course.guard.found is not None:
            return 0.0
        return min(way_m, min(course.expected_m, self.target_m) - course.back_end_m)

    def tick(
        self,
        now_s: float,
        force_samples: Sequence[ForceSample],
        arm_samples: Sequence[ArmSample],
        gauge_samples: Sequence[DisplacementSample] = (),
        second_samples: Sequence[ForceSample] = (),
    ) -> tuple[float, bool]:
        """Process the samples since the last tick; the target in m, and whether the run is over.

        The target is NaN until the arm has said where it is: command nothing then. The gauge does
        not steer; its samples are recorded by the caller.
        """
        last_s, self._last_s = self._last_s, now_s
        if last_s != last_s:
            self._emit(now_s, "limits", {**self.limits.values})
        step_s = now_s - last_s
        if not 0.0 <= step_s <= self._longest_step_s:
            step_s = self._longest_step_s if step_s > 0.0 else 0.0
        sup, course, target_m = self.supervisor, self.course, self.target_m
        guard = course.guard
        cause = sup.check(
            now_s, force_samples, arm_samples, second_samples, target_m,
            self.steps.controller.c_m_per_n, self._phase,
        )  # fmt: skip
        grown = None if guard.proven else guard.follow(now_s, target_m, sup, course.proven)
        if grown is not None:
            self._emit(now_s, grown.rule, {**grown._asdict(), "goal_m": guard.goal_m})
            if cause is None and not self.safing:
                course.failure = grown
        if self.safing:
            if grown is not None:
                self._turn_round(now_s)
            done = self._retract(now_s, step_s)
        elif cause is not None:
            self.trip(cause)
            done = False
        elif self.operator.stop_level >= _STOP_NOW:
            self.on_stop(None)
            self._begin_safing(now_s)
            done = False
        else:
            if course.failure is None:
                self.target_m = course.step(now_s, step_s)
            self._phase = course.phase
            done = course.done
            if done:
                self.still_closed = sup.still_closed(now_s)
            if course.failure is not None:
                reason, value, limit, unit, message = course.failure
                age_s = max(0.0, now_s - sup.force.receive_s)
                self.trip(Cause(reason, value, limit, unit, age_s, now_s, message))
                done = False
        force_n = sup.force_n
        if force_n > self.peak_force_n:
            self.peak_force_n = force_n
        elif -force_n > self.peak_force_n:
            self.peak_force_n = -force_n
        self.row = _new(TickRow, (
            now_s, self.target_m, force_n, sup.second_n, sup.predicted_n,
            self.limits.force_limit_n, self.steps.controller.c_m_per_n, course.level_n,
            self.late_s, self._phase, course.cycle, course.step_number,
        ))  # fmt: skip
        return self.target_m, done

    def _adopt(self, measured: Measured) -> RefusedError | DomainError | None:
        """Use thresholds for the measured noise and drift, where these are worse than before.

        Returns the reason where the plan then leaves no room below F_c, else None.
        """
        last = self._measured
        self._measured = measured = Measured(
            max(last.noise_n, measured.noise_n),
            max(last.drift_n_per_s, measured.drift_n_per_s),
            last.one_axis or measured.one_axis,
            max(last.second_noise_n, measured.second_noise_n),
        )
        derived = preflight_of(self._plan, measured)
        if derived.limits is None:
            return derived.refusal
        self.limits = self.course.limits = limits = derived.limits
        self.supervisor.adopt(limits)
        self.steps.adopt(limits)
        self._emit(self._last_s, "limits", {**limits.values})
        return None

    def trip(self, cause: Cause) -> None:
        """Stop and retract for this reason, unless there is an earlier one."""
        if self.cause is not None:
            return
        self.cause = cause
        self.on_stop(cause)
        self._emit(cause.time_s, "trip", cause._asdict())
        if not self.safing:
            self._begin_safing(cause.time_s)

    def _begin_safing(self, now_s: float) -> None:
        """The target goes back to the measured position at once, then away from the surface."""
        self.safing = True
        self._phase = _SAFING
        course = self.course
        position_m = self.supervisor.arm.position_m
        found = course.guard.found
        self._safe_m = course.release_m if found is None else course.guard.goal_m
        if course.expected_m < self.target_m:
            self.target_m = course.target_m = course.expected_m
        self._safe_speed_m_s, self._there_s = 0.0, math.nan
        self._set_patience(now_s)
        self._emit(now_s, "safing", {"position_m": position_m, "goal_m": self._safe_m})

    def _set_patience(self, now_s: float) -> None:
        needed_s = abs(self.target_m - self._safe_m) / self.course.back_speed_m_s
        self._give_up_s = now_s + 2.0 * needed_s + SAFING_EXTRA_S

    def _turn_round(self, now_s: float) -> None:
        """The way back pressed: go to where the force was least."""
        self._safe_m, self._safe_speed_m_s = self.course.guard.goal_m, 0.0
        self._there_s = math.nan
        self._set_patience(now_s)

    def _retract(self, now_s: float, step_s: float) -> bool:
        if self.target_m != self.target_m or now_s > self._give_up_s:
            return True
        limits = self.limits
        self._safe_speed_m_s = min(
            self.course.back_speed_m_s,
            self._safe_speed_m_s + 2.0 * limits.acceleration_m_s2 * step_s,
        )
        way_m, turned = self._safe_speed_m_s * step_s, self.course.guard.found is not None
        if turned:
            target_m = min(self._safe_m, self.target_m + way_m)
        else:
            target_m = max(self._safe_m, self.target_m - way_m)
        self.target_m = self.course.target_m = target_m
        near_m = min(limits.model_tolerance_m, ARRIVAL_SHARE * self.course.retract_m)
        sup, there_m = self.supervisor, self._safe_m + near_m
        # A position that jumped back looks like arrival at once: the model must have arrived too.
        clear = sup.arm.position_m <= there_m and not sup.motion.model_m > there_m
        if turned:
            clear = abs(sup.arm.position_m - self._safe_m) <= near_m
        if not (self.target_m == self._safe_m and clear):
            self._there_s = math.nan
            return False
        if self._there_s != self._there_s:
            self._there_s = now_s
        # Commands may come late: the stop that follows would hold the arm where it still presses.
        if now_s - self._there_s < LATE_S:
            return False
        self.still_closed = self.supervisor.still_closed(now_s)
        if self.still_closed and self._further_back():
            return False
        self.safe_reached = not (turned and self.still_closed)
        return True

    def _further_back(self) -> bool:
        """Retract further, towards the start pose; False where no known free way is left."""
        start_m = self.course.start_m
        if not start_m < self._safe_m or self.course.guard.found is not None:
            return False
        step_m = min(self.course.retract_m, self._safe_m - start_m)
        self._safe_m -= step_m
        self._give_up_s += 2.0 * step_m / self.limits.retract_speed_m_s
        return True

    def _emit(self, time_s: float, kind: str, data: dict[str, object]) -> None:
        self.events.append((time_s, kind, data))
