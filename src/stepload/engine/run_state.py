"""The state of a run, shared by the parts of its sequence."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from stepload.engine.operator import Operator
from stepload.engine.phases import Exit
from stepload.engine.retract_guard import RetractGuard
from stepload.engine.supervisor import Supervisor
from stepload.engine.watch import Trip
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.zero_drift import pressed_shift_n
from stepload.plan.model import Procedure
from stepload.record.outcome import Tare, Touch
from stepload.record.rows import Phase

_LOAD = int(Phase.LOAD)
Emit = Callable[[float, str, dict[str, object]], None]


class RunState:
    """The present phase and what has been found so far.

    `sequence` is resumed in each tick, at `now_s`, `step_s` after the last one. `target_m` is the
    commanded position (NaN until the arm has reported its own), `held_m` the position at which its
    controller reported to hold it before the first command (NaN: it did not), `shift_m` the
    commanded shift across the approach, `speed_m_s` the speed of the target, `goal_m` where `move`
    and `rest_at_goal` go to. `surface_m` is the position of the last touch, NaN before, `dwelt_n`
    the mean force in contact after it, and `deepest_m` the largest target at which a level was
    held.
    `failure` is set when the run cannot go on, `done` when it has come to its end, `interrupted`
    when the operator ended it.
    """

    def __init__(
        self,
        procedure: Procedure,
        limits: RunLimits,
        supervisor: Supervisor,
        operator: Operator,
        emit: Emit,
        cycle: int,
    ) -> None:
        self.procedure = procedure
        self.limits = limits
        self.sup = supervisor
        self.operator = operator
        self.emit = emit
        self.guard = RetractGuard(limits)
        self.sequence: Iterator[None] = iter(())
        self.phase = int(Phase.WARM_UP)
        self.since_s = self.now_s = self.step_s = 0.0
        self.cycle = cycle
        self.step_number = 0
        self.level_n = 0.0
        self.target_m = self.start_m = self.held_m = math.nan
        self.shift_m = (0.0, 0.0)
        self.speed_m_s = 0.0
        self.goal_m = math.nan
        self._rest_from_s = math.nan
        self.dwelt_n = 0.0
        self.surface_m = math.nan
        self.deepest_m = -math.inf
        self.done = False
        self.interrupted = False
        self.failure: Trip | None = None
        self.touches: list[Touch] = []
        self.tares: list[Tare] = []
        self.zero_shift_n = math.nan
        self._open_by_s = math.inf
        self.levels_done = 0

    @property
    def expected_m(self) -> float:
        """The measured position, limited to within a retract of the target.

        A measured position that is further away is wrong, or the arm does not follow; either way
        it must not lead the arm, least of all towards the surface.
        """
        position_m, target_m = self.sup.arm.position_m, self.target_m
        if target_m != target_m:
            return position_m
        return max(target_m - self.retract_m, min(position_m, target_m + self.retract_m))

    @property
    def release_m(self) -> float:
        """Position at which the contact is surely open: a retract behind arm, target and surface.

        A run that is stopped at its start pose retracts from there too, whatever position the arm
        reports, so the start pose needs that much room behind it.
        """
        known_m = self.expected_m
        for behind_m in (self.target_m, self.surface_m):
            if behind_m < known_m:
                known_m = behind_m
        return max(known_m - self.retract_m, self.back_end_m)

    @property
    def free_m(self) -> float:
        """The free way that the plan states, from the start pose on in either direction."""
        return self.procedure.surface_distance_m - self.procedure.surface_uncertainty_m

    @property
    def proven(self) -> bool:
        """Whether the arm's direction is proven, by a touch."""
        return self.guard.proven or self.surface_m == self.surface_m

    @property
    def back_end_m(self) -> float:
        """How far back the target may go: until the direction is proven "back" may be a push."""
        if self.proven or self.start_m != self.start_m:
            return -math.inf
        return self.start_m - self.free_m

    @property
    def back_speed_m_s(self) -> float:
        """Speed of a motion back: that of a touch until the direction is proven."""
        limits = self.limits
        if self.proven:
            return limits.retract_speed_m_s
        return min(limits.retract_speed_m_s, limits.guarded_speed_m_s)

    @property
    def may_be_zero(self) -> bool:
        """Whether the readings of both channels may be zero drift since the run's first tare."""
        sup, limits, first, last = self.sup, self.limits, self.tares[0], self.tares[-1]
        moved_n = sup.smooth_n + last.mean_n - first.mean_n
        if not abs(moved_n) <= self.procedure.max_drift_n:
            return False
        second_n = sup.second_n + last.second_mean_n - first.second_mean_n
        return not limits.cross_check or abs(second_n) <= limits.second_zero_n

    @property
    def zeroed_s(self) -> float:
        """The middle of the tare that the zero of the force is from."""
        tare = self.tares[-1]
        return tare.time_s - 0.5 * tare.duration_s

    @property
    def open_n(self) -> float:
        """Force in N up to which a contact counts as open: the zero may have drifted as stated."""
        drift_n = 0.0
        if self.tares:
            drift_n = self.limits.drift_n_per_s * (self.now_s - self.zeroed_s)
        return self.limits.touch_force_n + min(drift_n, self.procedure.max_drift_n)

    @property
    def retract_m(self) -> float:
        """Clearance that opens the contact."""
        return self.procedure.retract_m

    def step(self, now_s: float, step_s: float) -> float:
        """Run one tick; returns the target in m.

        Raises:
            RuntimeError: the sequence is over, and the run is neither done nor failed.
        """
        self.now_s, self.step_s = now_s, step_s
        if now_s > self._open_by_s and self.phase == _LOAD:
            self._old_zero(now_s)
        if next(self.sequence, self) is self and not self.done and self.failure is None:
            raise RuntimeError("the sequence of the run ended without an end of the run")
        return self.target_m

    def press(self) -> None:
        """From now on the payload is pressed, for as long as the zero of the force can be believed.

        Only a load step makes force of a zero that moves: elsewhere the target stands or goes back.
        """
        limits = self.limits
        drift = limits.zero_drift_n_per_s
        if drift > 0.0:
            before_s = self.now_s - self.zeroed_s
            before_n = pressed_shift_n(drift, before_s, 0.0, limits.touch_force_n)
            self._open_by_s = self.now_s + (limits.zero_shift_n - before_n) / drift

    def _old_zero(self, now_s: float) -> None:
        """End the run: its zero has not been looked at for too long."""
        limits = self.limits
        age_s = now_s - self.zeroed_s
        which = (
            "second force channel, and that of the main one alike,"
            if limits.cross_check
            else "only force channel"
        )
        moved_n = limits.zero_shift_n + limits.zero_drift_n_per_s * (now_s - self._open_by_s)
        self.fail(
            "old_zero", moved_n, limits.zero_shift_n, "N",
            f"the zero of the {which} is {age_s:.0f} s old and may have moved by more"
            f" than the {limits.zero_shift_n:.3g} N that are counted on: its drift is up to"
            f" {limits.zero_drift_n_per_s:.3g} N/s, and in an approach R11 lets it move by the"
            " touch force",
        )  # fmt: skip

    def enter(self, phase: Phase) -> None:
        """Begin a phase, at rest."""
        self.phase = int(phase)
        self.since_s = self.now_s
        self.speed_m_s = 0.0
        self._rest_from_s = math.nan
        self.tell(
            "phase",
            {"phase": phase.name, "cycle": self.cycle, "step": self.step_number,
             "level_n": self.level_n},
        )  # fmt: skip

    def tell(self, kind: str, data: dict[str, object]) -> None:
        """An event of this tick, for the record."""
        self.emit(self.now_s, kind, data)

    def fail(self, reason: str, value: float, limit: float, unit: str, message: str) -> Exit:
        """Record that the run cannot go on, and why; the exit of the phase."""
        self.failure = Trip(reason, value, limit, unit, message)
        return Exit.FAIL

    def finish(self) -> None:
        """End the run; the target stays."""
        self.done = True
        self.enter(Phase.DONE)

    def stop_requested(self) -> bool:
        """Whether the operator has asked for the end; if so the run counts as interrupted."""
        if self.operator.stop_level:
            self.interrupted = True
            return True
        return False

    def move(self, fastest_m_s: float) -> bool:
        """Move the target towards the goal with bounded acceleration; True when it is there."""
        gap_m, step_s = self.goal_m - self.target_m, self.step_s
        way_m = abs(gap_m)
        acceleration = self.limits.acceleration_m_s2
        speed = min(
            fastest_m_s,
            self.speed_m_s + acceleration * step_s,
            math.sqrt(2.0 * acceleration * way_m),
        )
        if speed * step_s >= way_m:
            self.target_m = self.goal_m
            self.speed_m_s = 0.0
            return True
        self.speed_m_s = speed
        self.target_m += math.copysign(speed * step_s, gap_m)
        return False

    def aim(self, goal_m: float) -> None:
        """Set the goal of `move` and `rest_at_goal`."""
        self.goal_m = goal_m
        self._rest_from_s = math.nan

    def rest_at_goal(self, rest_s: float) -> bool:
        """Move back to the goal; True after `rest_s` of rest there."""
        if not self.move(self.back_speed_m_s):
            return False
        if self._rest_from_s != self._rest_from_s:
            self._rest_from_s = self.now_s
        return self.now_s - self._rest_from_s >= rest_s
