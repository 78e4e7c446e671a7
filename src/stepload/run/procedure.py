"""The order of a run: tare, approach, touch, load steps with holds, unload, retract, tare again.

A state machine that gives one position target per tick. It sees the world through the supervisor's
readings and never looks at a clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from typing import NamedTuple

from stepload.plan.model import Procedure
from stepload.record.rows import Phase
from stepload.run.controller import StepController
from stepload.run.limits import RunLimits
from stepload.run.operator import Operator
from stepload.run.settle import RingTest, SettleTest
from stepload.run.supervisor import Supervisor
from stepload.run.tare import LEAST_READINGS, Tare, TareWindow

DRIFT_CHECK_S = 0.5
REST_S = 0.2
RING_TIMEOUT_S = 2.0
BETWEEN_CYCLES_TARE_S = 1.0
NOISE_FACTOR = 3.0
TOUCH_SAMPLES = 2
LOAD_TIMEOUT_FACTOR = 20.0
SETTLE_SHARE = 0.005
"""Creep over a hold, as a share of the level, that still counts as rest."""

Emit = Callable[[float, str, dict[str, object]], None]


class Touch(NamedTuple):
    """One raw touch point: position and tared force at the tick of detection."""

    time_s: float
    position_m: float
    force_n: float
    speed_m_s: float
    cycle: int
    purpose: str


class Failure(NamedTuple):
    """Why the procedure cannot go on."""

    reason: str
    value: float
    limit: float
    unit: str
    message: str


class StepProcedure:
    """State of the procedure; `step` once per tick.

    `phase`, `cycle`, `step_number` and `level_n` say where it is, `target_m` what it asks of the
    arm. `failure` is set when it cannot go on, `done` when it has come to its end.
    """

    def __init__(
        self,
        plan: Procedure,
        limits: RunLimits,
        supervisor: Supervisor,
        operator: Operator,
        emit: Emit,
        *,
        start_cycle: int = 1,
        start_level: int = 0,
    ) -> None:
        self._plan = plan
        self._limits = limits
        self._sup = supervisor
        self._operator = operator
        self._emit = emit
        self._controller = StepController(limits)
        self._settle = SettleTest()
        self._ring = RingTest(limits.noise_n)
        self._window = TareWindow()
        self._levels = plan.levels_n
        self._index = start_level
        self._act: Callable[[float, float], None] = self._start
        self._after_retract: Callable[[float], None] = self._begin_post_tare
        self._since_s = 0.0
        self._rest_from_s = math.nan
        self._speed_m_s = 0.0
        self._goal_m = 0.0
        self._touching = 0
        self._touches_left = plan.touches
        self._purpose = "first"
        self._start_m = math.nan
        self._surface_m = math.nan
        self._same_contact = False
        self.phase = int(Phase.WARM_UP)
        self.cycle = start_cycle
        self.step_number = 0
        self.level_n = 0.0
        self.target_m = math.nan
        self.done = False
        self.interrupted = False
        self.failure: Failure | None = None
        self.touches: list[Touch] = []
        self.tares: list[Tare] = []
        self.zero_shift_n = math.nan
        self.levels_done = 0

    @property
    def compliance_m_per_n(self) -> float:
        """c_use of the controller."""
        return self._controller.c_m_per_n

    @property
    def retract_m(self) -> float:
        """Clearance that opens the contact."""
        return self._plan.retract_m

    @property
    def release_m(self) -> float:
        """Position at which the contact is surely open, as far as it is known.

        A run that is stopped at its start pose goes back from there too: what the arm believes is
        no reason not to retract, so the start pose needs that much room behind it.
        """
        known_m = self._sup.arm.position_m
        if self._surface_m == self._surface_m:
            known_m = min(known_m, self._surface_m)
        return known_m - self._plan.retract_m

    def step(self, now_s: float, step_s: float) -> float:
        """One tick; the target in m (NaN until the arm has said where it is)."""
        self._act(now_s, step_s)
        return self.target_m

    # -- at rest ---------------------------------------------------------------------------------

    def _enter(self, phase: Phase, now_s: float, act: Callable[[float, float], None]) -> None:
        self.phase = int(phase)
        self._since_s = now_s
        self._speed_m_s = 0.0
        self._act = act
        self._emit(
            now_s,
            "phase",
            {"phase": phase.name, "cycle": self.cycle, "step": self.step_number,
             "level_n": self.level_n},
        )  # fmt: skip

    def _fail(self, reason: str, value: float, limit: float, unit: str, message: str) -> None:
        self.failure = Failure(reason, value, limit, unit, message)

    def _start(self, now_s: float, _step_s: float) -> None:
        position_m = self._sup.arm.position_m
        if position_m == position_m:
            self.target_m = self._start_m = position_m
            self._enter(Phase.WARM_UP, now_s, self._warm_up)

    def _warm_up(self, now_s: float, _step_s: float) -> None:
        if self._stop_asked():
            self._finish(now_s)
        elif now_s - self._since_s >= self._plan.warm_up_s:
            self._begin_tare(now_s)

    def _begin_tare(self, now_s: float) -> None:
        self._window = TareWindow()
        self._enter(Phase.TARE, now_s, self._tare)

    def _collect(self, now_s: float, duration_s: float) -> Tare | None:
        sup = self._sup
        if sup.force.fresh:
            self._window.add(now_s, sup.force.raw_n, sup.second_raw_n)
        if now_s - self._since_s < duration_s or self._window.count < LEAST_READINGS:
            return None
        return self._window.result()

    def _tare(self, now_s: float, _step_s: float) -> None:
        if self._stop_asked():
            self._finish(now_s)
            return
        tare = self._collect(now_s, self._plan.tare_s)
        if tare is None:
            return
        self._emit(now_s, "tare", asdict(tare))
        allowed_n = NOISE_FACTOR * self._limits.noise_n
        drift_n = abs(tare.slope_n_per_s) * self._plan.tare_s
        if tare.noise_n > allowed_n:
            self._fail(
                "noise", tare.noise_n, allowed_n, "N",
                f"the force sensor's noise of {tare.noise_n:.3g} N is more than {NOISE_FACTOR:g}"
                " times what the limits were derived for",
            )  # fmt: skip
        elif drift_n > self._plan.max_drift_n:
            self._fail(
                "drift", drift_n, self._plan.max_drift_n, "N",
                f"the force drifted by {drift_n:.3g} N during the tare: warm up longer",
            )  # fmt: skip
        else:
            self.tares.append(tare)
            self._sup.tare(tare.mean_n, tare.second_mean_n)
            self._window = TareWindow()
            self._enter(Phase.DRIFT_CHECK, now_s, self._drift_check)

    def _drift_check(self, now_s: float, _step_s: float) -> None:
        look = self._collect(now_s, DRIFT_CHECK_S)
        if look is None:
            return
        limits, zero = self._limits, self.tares[-1]
        shift_n = look.mean_n - zero.mean_n
        second_shift_n = look.second_mean_n - zero.second_mean_n
        self._emit(now_s, "drift", {"shift_n": shift_n, "second_shift_n": second_shift_n})
        if abs(shift_n) > self._plan.max_drift_n:
            self._fail(
                "drift", shift_n, self._plan.max_drift_n, "N",
                f"the force moved by {shift_n:+.3g} N since the tare",
            )  # fmt: skip
        elif limits.cross_check and abs(second_shift_n) > 0.5 * limits.cross_tolerance_n:
            self._fail(
                "drift", second_shift_n, 0.5 * limits.cross_tolerance_n, "N",
                f"the second force channel moved by {second_shift_n:+.3g} N since the tare",
            )  # fmt: skip
        else:
            self._begin_approach(now_s)

    # -- towards the surface ---------------------------------------------------------------------

    def _begin_approach(self, now_s: float) -> None:
        plan, limits = self._plan, self._limits
        run_out_m = 2.0 * limits.fast_speed_m_s * limits.reaction_s
        if self._surface_m == self._surface_m:
            near_m = self._surface_m - self._gap_m()
        else:
            near_m = plan.surface_distance_m - plan.surface_uncertainty_m
        self._goal_m = near_m - run_out_m
        self._touching = 0
        self._enter(Phase.FAST_APPROACH, now_s, self._fast_approach)

    def _fast_approach(self, now_s: float, step_s: float) -> None:
        limits = self._limits
        if self._touched(now_s) or self._stopped_in_air(now_s):
            return
        if self.target_m >= self._goal_m or self._move(self._goal_m, limits.fast_speed_m_s, step_s):
            self._enter(Phase.GUARDED_APPROACH, now_s, self._guarded_approach)
        self._leash()

    def _guarded_approach(self, now_s: float, step_s: float) -> None:
        limits = self._limits
        if self._touched(now_s) or self._stopped_in_air(now_s):
            return
        speed = min(limits.guarded_speed_m_s, self._speed_m_s + limits.acceleration_m_s2 * step_s)
        if self._purpose != "first":
            speed = min(speed, 0.5 * limits.guarded_speed_m_s)
        self._speed_m_s = speed
        self.target_m += speed * step_s
        self._leash()

    def _leash(self) -> None:
        """In free air the target stays within reach of what a surface just ahead could bear."""
        end_m = self._sup.arm.position_m + self._limits.leash_free_m
        if self.target_m > end_m:
            self.target_m = end_m

    def _touched(self, now_s: float) -> bool:
        sup = self._sup
        if sup.force.fresh:
            self._touching = self._touching + 1 if sup.force_n > self._limits.touch_force_n else 0
        if self._touching < TOUCH_SAMPLES:
            return False
        position_m = sup.arm.position_m
        touch = Touch(
            now_s, position_m, sup.force_n, self._speed_m_s, self.cycle, self._purpose
        )  # fmt: skip
        self.touches.append(touch)
        self._emit(now_s, "touch", touch._asdict())
        self._surface_m = position_m
        self.target_m = min(self.target_m, position_m)
        self._ring.begin(now_s + 2.0 * self._limits.reaction_s, sup.force_n)
        self._enter(Phase.DWELL, now_s, self._dwell)
        return True

    def _dwell(self, now_s: float, _step_s: float) -> None:
        ring = self._ring
        ring.add(now_s, self._sup.force_n)
        if not ring.quiet and now_s - self._since_s < RING_TIMEOUT_S:
            return
        self._touches_left -= 1
        if self._purpose == "last" or self._stop_asked():
            self._begin_retract(now_s, self._finish)
        elif self._touches_left > 0:
            self._purpose = "again"
            self._goal_m = self._surface_m - self._gap_m()
            self._rest_from_s = math.nan
            self._enter(Phase.TOUCH_RETRACT, now_s, self._touch_retract)
        else:
            self._same_contact = False
            self._begin_load(now_s)

    def _gap_m(self) -> float:
        """How far to back off between touches."""
        limits = self._limits
        gap_m = max(
            20.0 * limits.position_resolution_m,
            4.0 * limits.lost_motion_m,
            0.3 * limits.guarded_speed_m_s,
        )
        return min(self._plan.retract_m, gap_m)

    def _touch_retract(self, now_s: float, step_s: float) -> None:
        if not self._move(self._goal_m, self._limits.retract_speed_m_s, step_s):
            return
        if self._rest_from_s != self._rest_from_s:
            self._rest_from_s = now_s
        if now_s - self._rest_from_s < REST_S:
            return
        if self._sup.smooth_n > 0.5 * self._limits.touch_force_n:
            if self._goal_m <= self._surface_m - self._plan.retract_m:
                self._not_open()
            self._goal_m = max(self._goal_m - self._gap_m(), self._surface_m - self._plan.retract_m)
            self._rest_from_s = math.nan
            return
        self._touching = 0
        self._enter(Phase.GUARDED_APPROACH, now_s, self._guarded_approach)

    def _not_open(self) -> None:
        self._fail(
            "not_open", self._sup.smooth_n, 0.5 * self._limits.touch_force_n, "N",
            f"the contact did not open: {self._sup.smooth_n:.3g} N are left after retracting by"
            f" {self._plan.retract_m * 1e3:g} mm",
        )  # fmt: skip

    # -- in contact ------------------------------------------------------------------------------

    def _begin_load(self, now_s: float) -> None:
        self.level_n = self._levels[self._index]
        self.step_number = self._index + 1
        sup = self._sup
        self._controller.begin(
            self.level_n, sup.smooth_n, sup.arm.position_m, 1.0, self._same_contact
        )
        self._same_contact = True
        self._enter(Phase.LOAD, now_s, self._load)

    def _load(self, now_s: float, step_s: float) -> None:
        sup, controller = self._sup, self._controller
        self.target_m = controller.step(
            sup.force_n, sup.smooth_n, sup.arm.position_m, self.target_m, step_s
        )
        if controller.reached or self._too_long(now_s):
            self._begin_hold(now_s, Phase.HOLD, self._hold)

    def _too_long(self, now_s: float) -> bool:
        if now_s - self._since_s < LOAD_TIMEOUT_FACTOR * self._plan.settle_timeout_s:
            return False
        self._emit(now_s, "level_missed", {"level_n": self.level_n, "force_n": self._sup.smooth_n})
        return True

    def _begin_hold(self, now_s: float, phase: Phase, act: Callable[[float, float], None]) -> None:
        limits = self._limits
        eps_n = max(limits.band_n, SETTLE_SHARE * self.level_n)
        self._settle.begin(now_s + 4.0 / limits.step_rate_per_s, self._plan.hold_s, eps_n)
        self._enter(phase, now_s, act)

    def _held(self, now_s: float) -> bool:
        settle = self._settle
        settle.add(now_s, self._sup.force_n)
        held_s = now_s - self._since_s
        if held_s < self._plan.hold_s:
            return False
        timed_out = held_s >= self._plan.hold_s + self._plan.settle_timeout_s
        if not (settle.settled or timed_out):
            return False
        self._emit(
            now_s,
            "held",
            {"level_n": self.level_n, "force_n": self._sup.smooth_n, "settled": settle.settled,
             "held_s": held_s, "cycle": self.cycle, "step": self.step_number,
             "loading": self.phase == Phase.HOLD},
        )  # fmt: skip
        return True

    def _hold(self, now_s: float, _step_s: float) -> None:
        if not self._held(now_s):
            return
        self.levels_done += 1
        self._index += 1
        if self._stop_asked():
            self._begin_retract(now_s, self._finish)
        elif self._operator.paused:
            self._begin_retract(now_s, self._begin_pause)
        elif self._index < len(self._levels):
            self._begin_load(now_s)
        elif self._plan.unload:
            self._index -= 1
            self._next_unload(now_s)
        else:
            self._end_cycle(now_s)

    def _next_unload(self, now_s: float) -> None:
        self._index -= 1
        if self._index < 0:
            self._end_cycle(now_s)
        else:
            self._begin_unload(now_s, self._levels[self._index])

    def _begin_unload(self, now_s: float, level_n: float) -> None:
        self.level_n = level_n
        self.step_number = self._index + 1
        sup = self._sup
        self._controller.begin(level_n, sup.smooth_n, sup.arm.position_m, -1.0, True)
        self._enter(Phase.UNLOAD, now_s, self._unload)

    def _unload(self, now_s: float, step_s: float) -> None:
        sup, controller = self._sup, self._controller
        self.target_m = controller.step(
            sup.force_n, sup.smooth_n, sup.arm.position_m, self.target_m, step_s
        )
        if controller.reached or self._too_long(now_s):
            self._begin_hold(now_s, Phase.UNLOAD_HOLD, self._unload_hold)

    def _unload_hold(self, now_s: float, _step_s: float) -> None:
        if not self._held(now_s):
            return
        if self._stop_asked():
            self._begin_retract(now_s, self._finish)
        elif self._index >= 0:
            self._next_unload(now_s)
        else:
            self._next_cycle()
            self._begin_load(now_s)

    def _end_cycle(self, now_s: float) -> None:
        self._index = -1
        if self._plan.lift_off or self.cycle >= self._plan.cycles:
            self._begin_retract(now_s, self._begin_post_tare)
        else:
            self._begin_unload(now_s, self._plan.unload_fraction * self._plan.top_force_n)

    def _next_cycle(self) -> None:
        self.cycle += 1
        self._index = 0

    # -- away from the surface -------------------------------------------------------------------

    def _begin_retract(self, now_s: float, then: Callable[[float], None]) -> None:
        self._goal_m = self.release_m
        self._after_retract = then
        self._rest_from_s = math.nan
        self.level_n = 0.0
        self._enter(Phase.RETRACT, now_s, self._retract)

    def _retract(self, now_s: float, step_s: float) -> None:
        if not self._move(self._goal_m, self._limits.retract_speed_m_s, step_s):
            return
        if self._rest_from_s != self._rest_from_s:
            self._rest_from_s = now_s
        if now_s - self._rest_from_s < REST_S + 4.0 * self._limits.loop_s:
            return
        if self._sup.smooth_n > self._limits.touch_force_n:
            self._not_open()
        else:
            self._after_retract(now_s)

    def _begin_post_tare(self, now_s: float) -> None:
        self._window = TareWindow()
        self._enter(Phase.POST_TARE, now_s, self._post_tare)

    def _post_tare(self, now_s: float, _step_s: float) -> None:
        last = self.cycle >= self._plan.cycles
        duration_s = self._plan.tare_s
        tare = self._collect(now_s, duration_s if last else min(duration_s, BETWEEN_CYCLES_TARE_S))
        if tare is None:
            return
        self.tares.append(tare)
        self.zero_shift_n = tare.mean_n - self.tares[0].mean_n
        self._emit(
            now_s,
            "zero_shift",
            {"shift_n": self.zero_shift_n, "limit_n": self._plan.max_drift_n,
             "flagged": abs(self.zero_shift_n) > self._plan.max_drift_n, **asdict(tare)},
        )  # fmt: skip
        if self._stop_asked():
            self._finish(now_s)
            return
        self._touches_left = 1
        if last:
            self._purpose = "last"
        else:
            self._next_cycle()
            self._purpose = "cycle"
        self._begin_approach(now_s)

    def _begin_pause(self, now_s: float) -> None:
        self._enter(Phase.PAUSED, now_s, self._paused)

    def _paused(self, now_s: float, _step_s: float) -> None:
        if self._stop_asked():
            self._finish(now_s)
        elif not self._operator.paused:
            self._touches_left = 1
            self._purpose = "resume"
            if self._index >= len(self._levels):
                self._end_paused_cycle(now_s)
            else:
                self._begin_tare(now_s)

    def _end_paused_cycle(self, now_s: float) -> None:
        """The pause came after the top level: what is left of the cycle is its unloading."""
        if self.cycle >= self._plan.cycles:
            self._begin_post_tare(now_s)
        else:
            self._next_cycle()
            self._begin_tare(now_s)

    def _stop_asked(self) -> bool:
        if self._operator.stop_level:
            self.interrupted = True
            return True
        return False

    def _stopped_in_air(self, now_s: float) -> bool:
        if not self._stop_asked():
            return False
        self._begin_retract(now_s, self._finish)
        return True

    def _finish(self, now_s: float) -> None:
        self.done = True
        self._enter(Phase.DONE, now_s, self._rest)

    def _rest(self, _now_s: float, _step_s: float) -> None:
        """Nothing more to do; the target stays."""

    def _move(self, goal_m: float, fastest_m_s: float, step_s: float) -> bool:
        """Move the target towards a goal with bounded acceleration; True when it is there."""
        gap_m = goal_m - self.target_m
        way_m = abs(gap_m)
        acceleration = self._limits.acceleration_m_s2
        speed = min(
            fastest_m_s,
            self._speed_m_s + acceleration * step_s,
            math.sqrt(2.0 * acceleration * way_m),
        )
        if speed * step_s >= way_m:
            self.target_m = goal_m
            self._speed_m_s = 0.0
            return True
        self._speed_m_s = speed
        self.target_m += math.copysign(speed * step_s, gap_m)
        return False
