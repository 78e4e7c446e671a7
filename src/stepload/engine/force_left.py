"""The force left on the payload after the loop has ended, as read by the force sensor."""

from __future__ import annotations

import threading

from stepload.engine.tick import Engine
from stepload.rig.clock import Clock
from stepload.rig.device import ForceSensor

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
