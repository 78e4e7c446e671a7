"""The child's loop: every package to the run, every target to the controller, every doubt fatal.

It stops sending to the controller, so that the controller's own watchdog stops the arm, when the
run falls silent while the arm follows targets. It ends the process at the first doubt about the
connection.
"""

from __future__ import annotations

import math
import os
import signal
import time
from typing import Any, NoReturn

from stepload.rig.faults import TAKEN_OVER, FaultCode
from stepload_drivers.motion import NO_SHIFT
from stepload_drivers.ur import wire
from stepload_drivers.ur.ports import ControlPort, ReceivePort
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import (
    PLAYING,
    STOPPED,
    Problem,
    Standstill,
    UrState,
    Vector6,
    data_problem,
    safety_problem,
    target_pose,
    travel_m,
)
from stepload_drivers.ur.watch import WATCHDOG_SHARE, Watch
from stepload_drivers.ur.wire import Link

POLL_S = 0.0004
HANG_S = 2.0
RESEND_SHARE = 0.2
"""Inputs are sent again after this share of the watchdog's time."""
GAP_SEEN_S = 0.05
"""A stop detected within this time after a gap in sending is attributed to that gap."""
CLOCK_SLACK_S = 1.0
REPORTED = 3
"""Exit status of a child that has reported its fault itself."""


def stay_alive_for(seconds: float) -> None:
    """End this process by SIGALRM unless called again: works even while a library holds the GIL."""
    signal.setitimer(signal.ITIMER_REAL, seconds)


class Loop:
    """State of one connection.

    `expect_stop` is set while a stop of the program is wanted; `muted` while nothing is sent;
    `target_m` is the target that the arm follows, None while it follows none; `commanded_m` the
    last one there was, 0 (where the arm stood) before any; `shift_m` the travel across that goes
    with either, which only a target of the run changes; `sent_s` a time just before the last
    input to the controller. Once `taken_over`, by a person or a safety system, no target is sent.
    """

    def __init__(self, link: Link, settings: Settings, period_s: float) -> None:
        self.link = link
        self.settings = settings
        self.standstill = Standstill()
        self.control: ControlPort | None = None
        self.requests: list[dict[str, Any]] = []
        self.target_m: float | None = None
        self.commanded_m = 0.0
        self.shift_m = NO_SHIFT
        self.fresh_target = False
        self.muted = False
        self.expect_stop = False
        self.taken_over = False
        self.received_s = time.monotonic()
        self._period_s = period_s
        self._receive = ReceivePort(settings)
        self._state: UrState | None = None
        self._offset_s = 0.0
        self.sent_s = 0.0
        self._refused_s = math.inf
        self._unsent_s = math.nan
        self._gap_s, self._gap_end_s = 0.0, -math.inf
        self._has_fault = False
        self.watch = Watch(settings)
        self.forgive_pause()
        while self._state is None:
            self.step()
        self.begin_here()

    @property
    def state(self) -> UrState:
        """The newest package."""
        assert self._state is not None
        return self._state

    def begin_here(self) -> None:
        """Count travel from the pose of the newest package."""
        self.start: Vector6 = self.state.pose

    @property
    def position_m(self) -> float:
        return travel_m(self.state.pose, self.start, self.settings.approach)

    def forgive_pause(self) -> None:
        """Count the age of data from now: a constructor has blocked the interpreter."""
        self._seen_s = time.monotonic()

    def follow(self, position_m: float | None) -> None:
        """Take over a target, or none; one that is not finite ends the process."""
        if position_m is not None and not math.isfinite(position_m):
            self._not_finite(f"position target {position_m}")
        self.target_m = position_m
        self.fresh_target = position_m is not None
        if position_m is not None:
            self.commanded_m = position_m

    def _obey(self, message: bytes) -> None:
        """Take over a target of the run, which may be across the approach too."""
        position_m, shift_m = wire.unpack_target(message)
        if not all(map(math.isfinite, shift_m)):
            self._not_finite(f"shift {shift_m}")
        self.shift_m = shift_m
        self.follow(position_m)

    def _not_finite(self, what: str) -> NoReturn:
        hint = "a bug of the run: please report it with the record"
        self.die(FaultCode.NOT_FINITE, f"{what} m is not finite", hint)

    def step(self) -> None:
        """Process messages of both sides, send what is due, wait a little."""
        for message in self.link.receive(POLL_S):
            self.received_s = time.monotonic()
            if message[:1] == wire.TARGET:
                if not self.taken_over:
                    self._obey(message)
                    self.muted = False
            elif message[:1] == wire.REQUEST:
                self.requests.append(wire.unpack_json(message))
        self._poll()
        if self.control is not None and not self.muted:
            self._send_due(self.control)

    def _poll(self) -> None:
        self._check_connected()
        now_s = time.monotonic()
        state = self._receive.read_new(self._state)
        if state is None:
            self._check_age(now_s)
            return
        stay_alive_for(HANG_S)
        if told := self.watch.poll():
            self.link.send(wire.pack_configuration(told))
        self._check(state, now_s)
        self._state, self._seen_s = state, now_s
        self.standstill.add(state)
        self.link.send(wire.pack_sample(now_s, state))

    def _check_connected(self) -> None:
        """ur_rtde's "not connected" is trusted at once, its "connected" never."""
        if self._receive.connected() and (self.control is None or self.control.connected()):
            return
        self.die(
            FaultCode.NOT_CONNECTED,
            "the controller closed the connection",
            "check cable and controller; the arm's watchdog stops it",
        )

    def _check_age(self, now_s: float) -> None:
        age_s, limit_s = now_s - self._seen_s, self.settings.max_age_s
        if age_s > limit_s and self._receive.read_new(self._state) is None:
            self.die(
                FaultCode.STALE,
                f"no new data package for {age_s * 1e3:.0f} ms, limit {limit_s * 1e3:.0f} ms",
                "check cable, switch and the controller's load; the arm's watchdog stops it",
            )

    def _check(self, state: UrState, now_s: float) -> None:
        if problem := data_problem(state):
            self.die(*problem)
        if self._state is None:
            self._offset_s = now_s - state.timestamp_s
            return
        ahead_s = self._offset_s + state.timestamp_s - now_s
        if state.timestamp_s <= self._state.timestamp_s or abs(ahead_s) > CLOCK_SLACK_S:
            self.die(
                FaultCode.CLOCK,
                f"the controller's clock went from {self._state.timestamp_s:.3f} s to "
                f"{state.timestamp_s:.3f} s, {ahead_s:+.3f} s against the host",
                "was the controller restarted?",
            )
        if self.control is not None and not self.expect_stop:
            self.taken_over = self.taken_over or safety_problem(state) is not None
            if not self._has_fault:
                self._find_fault(state, now_s)

    def _find_fault(self, state: UrState, now_s: float) -> None:
        """Report once why the arm does not follow."""
        if state.runtime_state != PLAYING and math.isnan(self._unsent_s):
            recent = now_s - self._gap_end_s < GAP_SEEN_S
            self._unsent_s = max(now_s - self.sent_s, self._gap_s if recent else 0.0)
        if problem := self.watch.problem(state, now_s, self._refused_s, self._unsent_s):
            self._has_fault = self.muted = True
            self.taken_over = self.taken_over or problem.code in TAKEN_OVER
            self._report(problem)
            if self.taken_over and state.runtime_state != STOPPED:
                self.watch.end_program()  # a paused program would continue once released

    def _send_due(self, control: ControlPort) -> None:
        """Forward a fresh target at once; else repeat the last input often enough."""
        now_s = time.monotonic()
        if not self.fresh_target:
            if now_s - self.sent_s < RESEND_SHARE / self.settings.watchdog_hz:
                return
            if (
                self.target_m is not None
                and now_s - self.received_s > self.settings.command_timeout_s
            ):
                return
        if self.target_m is None:
            sent = control.kick()
        else:
            pose = target_pose(self.start, self.settings.approach, self.target_m, self.shift_m)
            sent = control.servo(pose, self._period_s)
        self.fresh_target = False
        if self.sent_s and now_s - self.sent_s >= WATCHDOG_SHARE / self.settings.watchdog_hz:
            self._gap_s, self._gap_end_s = now_s - self.sent_s, now_s
        self.sent_s = now_s
        self._refused_s = math.inf if sent else min(self._refused_s, now_s)

    def _report(self, problem: Problem) -> None:
        self.link.send(
            wire.pack_json(
                wire.FAULT,
                code=problem.code.value,
                message=problem.message,
                hint=problem.hint,
                time_s=time.monotonic(),
            )
        )

    def die(self, code: FaultCode, message: str, hint: str) -> NoReturn:
        """Report and end at once: no state can be trusted any more."""
        self._report(Problem(code, message, hint))
        self.link.drain(0.05)
        os._exit(REPORTED)
