"""The retract of safing, repeated while the arm does not answer, and the force that is left."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from stepload.engine.notices import Say
from stepload.engine.operator import Operator
from stepload.engine.tick import Engine
from stepload.errors import DeviceError
from stepload.rig.clock import Clock
from stepload.rig.device import Arm, ForceSensor
from stepload.rig.faults import NO_ANSWER, FaultCode

WINDOW_S = 0.05
LOOK_S = 0.1
"""A sensor that does not come back by then has hung: the arm must not wait for it."""
NOT_THE_FORCE = frozenset({"", "R3", "R7", "device", "loop", "hang"})
"""Causes of a stop that leave the force channels trusted; after others they prove nothing."""


class ForceLeft:
    """The last known force and its age. `look` takes in what the sensor has sent since.

    `force_n` is the mean of the last samples, less the zero.
    """

    def __init__(self, engine: Engine, sensor: ForceSensor, clock: Clock) -> None:
        self._engine, self._sensor, self._clock = engine, sensor, clock
        self._sound = True
        self._looking: threading.Thread | None = None
        self.force_n = engine.supervisor.smooth_n

    def look(self) -> None:
        """Read new samples, if the sensor still delivers any; never raises and never hangs."""
        cause = self._engine.cause
        if cause is not None and cause.rule == "hang":  # another thread is still in a device
            return
        if self._looking is not None and self._looking.is_alive():
            return
        self._looking = threading.Thread(target=self._take, name="force left", daemon=True)
        try:
            self._looking.start()
        except RuntimeError:  # no thread can be started
            return
        self._looking.join(LOOK_S)

    def _take(self) -> None:
        supervisor = self._engine.supervisor
        try:
            samples = self._sensor.drain()
        except Exception:
            samples = []
        if not samples:
            return
        try:
            self._sound = supervisor.force.take(samples, self._clock.now_s()) is None
            since_s = samples[-1].receive_time_s - WINDOW_S
            read_n = [supervisor.force.project(s) for s in samples if s.receive_time_s >= since_s]
            self.force_n = sum(read_n) / len(read_n) - supervisor.zero_n
        except Exception:  # samples that cannot be read prove nothing
            self._sound = False

    @property
    def age_s(self) -> float:
        """Age of the newest sample."""
        return max(0.0, self._clock.now_s() - self._engine.supervisor.force.receive_s)

    @property
    def proven(self) -> bool:
        """Whether the reading is recent, sound, tared, and not itself the cause of the stop."""
        engine = self._engine
        rule = engine.cause.rule if engine.cause else ""
        fresh = self.age_s <= engine.limits.stale_force_s
        return engine.supervisor.tared and self._sound and fresh and rule in NOT_THE_FORCE

    @property
    def gone(self) -> bool:
        """Whether the sensor proves that the contact is open."""
        return self.proven and abs(self.force_n) <= self._engine.limits.touch_force_n

    @property
    def still_on(self) -> bool:
        """Whether the sensor proves that the contact is still closed."""
        return self.proven and abs(self.force_n) > self._engine.limits.touch_force_n

    @property
    def words(self) -> str:
        """The reading and its age."""
        if not self._engine.supervisor.tared:
            return "the force is not known, no zero was taken"
        return f"the force sensor reads {self.force_n:.3g} N, {self.age_s:.2f} s old"


AGAIN_S = 0.2
REMIND_S = 5.0
LATE = "what was sent may still move the arm back when it answers again: keep clear of it"
SETTLE_S = 0.1
"""Time in s after the retract until the force sensor shows its effect."""


@dataclass(frozen=True, slots=True)
class Way:
    """A retract: how far, how fast, how long one attempt may take, how long to go on trying."""

    distance_m: float
    speed_m_s: float
    timeout_s: float
    patience_s: float


def unload(arm: Arm, way: Way, force: ForceLeft, operator: Operator, say: Say) -> None:
    """Retract, and repeat it whenever the arm answers again, until the arm confirms it.

    Ends early where the force sensor proves that the contact is open, or on a stop signal that
    comes after the operator was told that the retract is repeated.

    Raises:
        DeviceError: not confirmed, with what is known of the force.
    """
    say(f"safing: the arm is asked to go back by {way.distance_m * 1e3:.2f} mm")
    begun_s = time.monotonic()
    force.look()
    trying = _Trying(way, begun_s, force, operator, say)
    fault = arm.fault() if way.patience_s > 0.0 else None
    if fault is not None and fault.code in NO_ANSWER:
        trying.tell()
    while True:
        try:
            arm.retract(way.distance_m, way.speed_m_s, way.timeout_s)
            break
        except DeviceError as error:
            force.look()
            patient = error.code in NO_ANSWER and way.patience_s > 0.0
            over = trying.over() if patient else force.words
            if over:
                told = f"{error.message}; {over}"
                stays = "" if force.gone else "THE FORCE MAY STAY ON; "
                if patient:
                    stays += f"{LATE}; "
                say(f"safing: the retract is NOT confirmed: {told}. {stays}{error.hint}")
                raise DeviceError(told, code=error.code, hint=error.hint) from error
        time.sleep(AGAIN_S)
    took_s = time.monotonic() - begun_s
    if way.patience_s > 0.0:
        time.sleep(SETTLE_S)
    force.look()
    if force.still_on:
        say(f"safing: the arm says that it is back, but {force.words}: use the emergency stop")
        raise DeviceError(
            f"the arm says that it is back, but {force.words}", code=FaultCode.REFUSED_COMMAND
        )
    say(f"safing: the retract is confirmed by the arm after {took_s:.1f} s; {force.words}")


class _Trying:
    """Goes on trying until a deadline, of which the operator is informed."""

    def __init__(
        self, way: Way, begun_s: float, force: ForceLeft, operator: Operator, say: Say
    ) -> None:
        self._until_s = begun_s + way.timeout_s + way.patience_s
        self._distance_m = way.distance_m
        self._force, self._operator, self._say = force, operator, say
        self._told_s = -REMIND_S
        self._signals: int | None = None

    def tell(self) -> None:
        """Say that the arm does not answer, again after a while."""
        now_s = time.monotonic()
        if now_s - self._told_s < REMIND_S:
            return
        self._told_s = now_s
        if self._signals is None:
            self._signals = self._operator.signals
        until = time.strftime("%H:%M:%S", time.localtime(time.time() + self._until_s - now_s))
        self._say(
            f"safing: the arm does not answer; trying until {until}; {self._force.words}; "
            "USE THE EMERGENCY STOP if it presses on; when it answers it goes back by "
            f"{self._distance_m * 1e3:.2f} mm: keep clear of it, or press the emergency stop first "
            "and leave it pressed; Ctrl+C ends the trying"
        )

    def over(self) -> str:
        """Why nothing is tried any more; "" while the trying goes on."""
        if self._signals is not None and self._operator.signals > self._signals:
            return f"the operator has ended the trying; {self._force.words}"
        if time.monotonic() >= self._until_s:
            return f"given up after the time for trying; {self._force.words}"
        if self._signals is not None and self._force.gone:
            return f"not tried any more, for {self._force.words}: the contact is open"
        self.tell()
        return ""
