"""The retract of safing: sent, and repeated as long as the arm does not answer."""

from __future__ import annotations

import time
from dataclasses import dataclass

from stepload.engine.force_left import ForceLeft
from stepload.engine.notices import Say
from stepload.engine.operator import Operator
from stepload.errors import DeviceError
from stepload.rig.device import Arm
from stepload.rig.faults import NO_ANSWER, FaultCode

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
