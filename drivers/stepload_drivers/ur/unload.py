"""A retract past ur_rtde that can be taken up again: sent once, then looked for.

A program handed over to a controller that does not answer may still be carried out when it wakes,
so it is not sent again, and no stop is sent after it, before it was seen to have ended. Before
every sending the controller is asked who has the arm: after a person or a safety system took over
nothing is sent any more.
"""

from __future__ import annotations

import math
import time

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ArmSample
from stepload_drivers.ur.client import RtdeClient, dashboard, send_script
from stepload_drivers.ur.preflight import in_remote_control, not_remote
from stepload_drivers.ur.rescue import ASK_LIMIT_S, IDLE_LIMIT_S, retract_script
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import (
    PAUSED,
    PLAYING,
    UrState,
    Vector6,
    arrived_m,
    safety_problem,
    travel_m,
)

SENDINGS = 2
"""A program that was lost on its way is sent once more."""
SAME_S = 0.3
"""One and the same package for so long is no news of the controller."""
OWN_PROGRAM_S = 1.0
"""Our program ends by its watchdog at most so long after the watchdog's own time."""
MOVED_M = 2e-3
"""Beside the lead of its last target the arm goes no further by itself."""
ASK_AGAIN_S = 0.1
BEGUN_SHARE = 0.2
"""Of the way: a retract that got this far was carried out, and ended by somebody if it is short."""


class Unloading:
    """Retracts the arm without ur_rtde from where it was `last` seen.

    `under_way` says that a retract was handed over and not seen to have ended.
    """

    def __init__(self, settings: Settings, last: ArmSample | None) -> None:
        self._settings = settings
        self._seen: Vector6 | None = last.pose if last else None
        self._from: Vector6 | None = None
        self._back_m = 0.0
        self._alone_s = time.monotonic()
        self._handed_over_s = math.nan
        self._refused: DeviceError | None = None

    @property
    def under_way(self) -> bool:
        return not math.isnan(self._handed_over_s)

    @property
    def age_s(self) -> float:
        """Time since the retract that is under way was handed over."""
        return time.monotonic() - self._handed_over_s

    def retract(self, distance_m: float, speed_m_s: float, deadline_s: float) -> None:
        """Stop and move back by `distance_m`, and see it done; called again, it goes on with it.

        Raises:
            DeviceError: not seen done by `deadline_s`. NOT_CONNECTED and STALE: no answer, call
                again; else the controller says why nothing moves the arm any more.
        """
        if self._refused is not None:
            raise self._refused
        for _ in range(SENDINGS):
            if not self.under_way:
                self._ask_who_has_the_arm(deadline_s)
                left_m = distance_m - max(0.0, self._back_m)
                script = retract_script(self._settings.approach, left_m, speed_m_s)
                send_script(self._settings.host, script, deadline_s)
                self._handed_over_s = time.monotonic()
            carried_out = self._watch(distance_m, deadline_s)
            if self._back_m >= arrived_m(distance_m):
                self._from, self._back_m = None, 0.0
                return
            if carried_out:
                break
        self._refuse(
            FaultCode.REFUSED_COMMAND,
            f"retract ended {self._back_m * 1e3:.2f} mm back, {distance_m * 1e3:.2f} mm were asked "
            "for",
            "the arm has stopped; move it clear by hand on the pendant",
        )

    def ended(self, deadline_s: float) -> bool:
        """Whether nothing that was handed over can still move the arm, by the dashboard's word."""
        if not self.under_way:
            return True
        idle_since_s = math.inf
        while (now_s := time.monotonic()) < deadline_s:
            try:
                [reply] = dashboard(self._settings.host, ["running"], _soon(deadline_s))
            except DeviceError:
                return False
            idle = reply.lower().endswith("false")
            idle_since_s = min(idle_since_s, now_s) if idle else math.inf
            if now_s - idle_since_s >= IDLE_LIMIT_S:  # what waits on a script port has begun
                self._handed_over_s = math.nan
                return True
            time.sleep(ASK_AGAIN_S)
        return False

    def _refuse(self, code: FaultCode, message: str, hint: str) -> None:
        """No retract is sent from now on."""
        self._handed_over_s = math.nan
        self._refused = DeviceError(message, code=code, hint=hint)
        raise self._refused

    def _ask_who_has_the_arm(self, deadline_s: float) -> None:
        """Raises where somebody else has it; a controller that tells nothing passes, once."""
        settings = self._settings
        own_s = 1.0 / settings.watchdog_hz + OWN_PROGRAM_S
        if time.monotonic() - self._alone_s < own_s:
            own_s = math.inf  # our own program still runs: ours replaces it
        package = self._sight(_soon(deadline_s), own_s)
        if package is not None:
            self._check_stopped_by_nobody(package)
            if package.runtime_state == PLAYING and own_s < math.inf:
                self._refuse(
                    FaultCode.PROGRAM_STOPPED,
                    "another program runs on the controller: no retract is sent",
                    "stop it on the pendant and move the arm clear by hand",
                )
            if self._seen is not None:
                went_m = math.dist(package.pose[:3], self._seen[:3])
                if went_m > MOVED_M + settings.max_lead_m:
                    self._refuse(
                        FaultCode.PROGRAM_STOPPED,
                        f"the arm stands {went_m * 1e3:.1f} mm from where it was last seen: "
                        "somebody has moved it, no retract is sent",
                        "move it clear by hand on the pendant",
                    )
            self._keep(package)
        if in_remote_control(settings.host, ASK_LIMIT_S) is False:
            error = not_remote(settings.host)
            self._refuse(FaultCode(error.code), error.message, error.hint)
        self._from = self._from or self._seen

    def _sight(self, deadline_s: float, own_s: float) -> UrState | None:
        """The newest package, None without an answer.

        A program of ours that slept with the controller is given `own_s` to end by its watchdog.
        """
        wait_s = 0.0 if own_s == math.inf else own_s
        try:
            with RtdeClient(self._settings.host, deadline_s + wait_s) as rtde:
                package = _started(rtde)
                until_s = time.monotonic() + wait_s
                while package.runtime_state == PLAYING and time.monotonic() < until_s:
                    package = rtde.read()
                return package
        except DeviceError:
            return None

    def _check_stopped_by_nobody(self, package: UrState) -> None:
        if problem := safety_problem(package):
            self._refuse(problem.code, f"retract not possible: {problem.message}", problem.hint)
        if package.runtime_state == PAUSED:
            self._refuse(
                FaultCode.PROGRAM_STOPPED,
                "the program on the controller was paused by somebody: no retract is sent",
                "stop it on the pendant and move the arm clear by hand",
            )

    def _keep(self, package: UrState) -> None:
        self._seen = package.pose
        self._from = self._from or package.pose
        self._back_m = -travel_m(package.pose, self._from, self._settings.approach)

    def _watch(self, distance_m: float, deadline_s: float) -> bool:
        """Follow the retract to its end; whether it was carried out at all.

        The end is that the arm has arrived, or that no program has run for a while.
        """
        played = False
        with RtdeClient(self._settings.host, deadline_s) as rtde:
            package = _started(rtde)
            idle_since_s = news_s = time.monotonic()
            while (now_s := time.monotonic()) - idle_since_s < IDLE_LIMIT_S:
                self._check_stopped_by_nobody(package)
                self._keep(package)
                if package.runtime_state == PLAYING:
                    played, idle_since_s = True, now_s
                elif self._back_m >= arrived_m(distance_m):
                    break
                stamp_s = package.timestamp_s
                package = rtde.read()
                if package.timestamp_s > stamp_s:
                    news_s = time.monotonic()
                elif time.monotonic() - news_s > SAME_S:
                    raise DeviceError(
                        "retract handed over, but the controller's data stand still",
                        code=FaultCode.STALE,
                        hint="use the emergency stop if the arm presses on",
                    )
        self._handed_over_s = math.nan
        return played or self._back_m > BEGUN_SHARE * distance_m


def _started(rtde: RtdeClient) -> UrState:
    rtde.version()
    rtde.start(125.0)
    return rtde.read()


def _soon(deadline_s: float) -> float:
    return min(deadline_s, time.monotonic() + ASK_LIMIT_S)
