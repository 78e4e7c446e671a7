"""Stop and retract without ur_rtde, for when the child is dead or not trusted.

A new ur_rtde would need two TCP handshakes, 23 recipes, a 42 kB upload and a working data stream
before its first command, and its constructor can hang. A dashboard line, or a program of four lines
on a script port, needs one TCP connection; it replaces the program that runs, and starts from the
controller's own target pose: no measured position, right or wrong, can lead it towards the surface.
RTDE is read only to confirm.

A program handed over to a controller that does not answer may still be carried out when it wakes,
so it is not sent again, and no stop is sent after it, before its end was observed. Before every
sending the controller is asked who has control, and its dashboard is watched for as long as a
retract is tried: after one sign of a person or a safety system nothing is sent any more. Nothing is
sent to a controller that does not answer, since it might be carried out at any later time.
"""

from __future__ import annotations

import math
import time
from contextlib import closing, suppress

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.client import RtdeClient, dashboard, send_script
from stepload_drivers.ur.configuration import read_configuration
from stepload_drivers.ur.dashboard_watch import ASK_LIMIT_S, DashboardWatch, require_nobody
from stepload_drivers.ur.last_state import LastState
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

DECELERATION_M_S2 = 2.0
ACCELERATION_M_S2 = 0.2
STILL_M = 2e-5
STILL_PACKAGES = 5
IDLE_LIMIT_S = 1.0
"""Time without a running program after which ours was not started, or has ended."""
SENDINGS = 2
"""Largest number of times that a program is sent: once more if it was lost."""
SAME_S = 0.3
"""Age of an unchanged package from which it is no news of the controller."""
OWN_PROGRAM_S = 1.0
"""Time after the watchdog's own within which our program ends by its watchdog."""
ASK_AGAIN_S = 0.1
LEAST_SPEED = 0.01
"""Share of full speed below which the slider counts as holding the arm."""
BEGUN_SHARE = 0.2
"""Share of the way from which a retract counts as carried out, even if it ended short."""

STOP_SCRIPT = f"def stepload_stop():\n  stopl({DECELERATION_M_S2})\nend\n"


def retract_script(
    approach: tuple[float, float, float], distance_m: float, speed_m_s: float
) -> str:
    """URScript: stop, then straight back along the approach axis from where the target stopped."""
    step = ", ".join(f"{-component * distance_m:.9f}" for component in approach)
    return (
        "def stepload_retract():\n"
        f"  stopl({DECELERATION_M_S2})\n"
        f"  movel(pose_add(get_target_tcp_pose(), p[{step}, 0, 0, 0]), "
        f"a={ACCELERATION_M_S2}, v={speed_m_s:.6f})\n"
        "end\n"
    )


def stop(host: str, deadline_s: float) -> None:
    """End the running program; by dashboard, else by script. Always sends.

    Raises:
        DeviceError: neither way was confirmed by `deadline_s`.
    """
    with suppress(DeviceError):
        replies = dashboard(host, ["stop", "running"], _soon(deadline_s))
        if replies[0] == "Stopped" and replies[1].lower().endswith("false"):
            return
    send_script(host, STOP_SCRIPT, deadline_s)
    with closing(RtdeClient(host, deadline_s)) as rtde:
        _wait_still(rtde)


def _soon(deadline_s: float) -> float:
    """The end of the time for a question, at the latest `deadline_s`."""
    return min(deadline_s, time.monotonic() + ASK_LIMIT_S)


def _started(rtde: RtdeClient) -> UrState:
    """Let the controller send; the first package."""
    rtde.version()
    rtde.start(125.0)
    return rtde.read()


def _wait_still(rtde: RtdeClient) -> None:
    still, last = 0, _started(rtde)
    while still < STILL_PACKAGES:
        package = rtde.read()
        moved_m = max(abs(a - b) for a, b in zip(package.pose[:3], last.pose[:3], strict=True))
        still = still + 1 if moved_m < STILL_M and package.runtime_state != PLAYING else 0
        last = package


class Unloading:
    """Retracts the arm without ur_rtde from where it was `last` seen.

    `under_way` says that a retract was sent and its end was not observed. From construction to
    `close` the dashboard is watched.
    """

    def __init__(self, settings: Settings, last: LastState) -> None:
        self._settings = settings
        self._last = last
        self._from: Vector6 | None = None
        self._back_m = 0.0
        self._alone_s = time.monotonic()
        self._handed_over_s = math.nan
        self._refused: DeviceError | None = None
        self._own_s = 1.0 / settings.watchdog_hz + OWN_PROGRAM_S
        self._dashboard = DashboardWatch(
            settings.host, self._own_s, lambda: self.under_way, last.loaded
        )
        self._dashboard.start()

    def close(self) -> None:
        """Watch the dashboard no longer."""
        self._dashboard.close()

    @property
    def under_way(self) -> bool:
        return not math.isnan(self._handed_over_s)

    @property
    def age_s(self) -> float:
        """Time since the pending retract was sent."""
        return time.monotonic() - self._handed_over_s

    def retract(self, distance_m: float, speed_m_s: float, deadline_s: float) -> None:
        """Stop and move back by `distance_m`, and check that it is done; a further call resumes it.

        Raises:
            DeviceError: not observed to be done by `deadline_s`. NOT_CONNECTED and STALE: no
                answer, call again; otherwise the controller's reason why nothing moves the arm any
                more.
        """
        self._refuse_after_a_sign()
        for _ in range(SENDINGS):
            if not self.under_way:
                self._ask_who_has_the_arm(deadline_s)
                left_m = distance_m - max(0.0, self._back_m)
                script = retract_script(self._settings.approach, left_m, speed_m_s)
                send_script(self._settings.host, script, deadline_s)
                self._handed_over_s = time.monotonic()
                self._last.sent_back(left_m)
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
        """Whether no retract that was sent can still move the arm, so that a stop does no harm.

        According to the dashboard; or the speed slider holds the arm, so that a retract left in the
        controller would begin whenever somebody raises it.
        """
        if not self.under_way:
            return True
        if self._held_by_slider(self._configuration(_soon(deadline_s))):
            self._handed_over_s = math.nan
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
        """Send no retract from now on."""
        self._handed_over_s = math.nan
        self._refused = DeviceError(message, code=code, hint=hint)
        raise self._refused

    def _refuse_after_a_sign(self) -> None:
        """One sign of a person, at any time, is enough."""
        if self._refused is None and (sign := self._dashboard.sign):
            told = f"while the arm did not answer, {sign.message}: "
            if self.under_way:
                told += (
                    f"the retract that was handed over {self.age_s:.1f} s ago may still begin, no "
                    "other is sent"
                )
                hint = f"keep clear of the arm until its program is stopped; {sign.hint}"
                self._refuse(sign.code, told, hint)
            self._refuse(sign.code, f"{told}no retract is sent", sign.hint)
        if self._refused is not None:
            raise self._refused

    def _ask_who_has_the_arm(self, deadline_s: float) -> None:
        """Raises where somebody else has control, or where this cannot be excluded."""
        begun_s = time.monotonic()
        own_s = self._own_s if begun_s - self._alone_s >= self._own_s else math.inf
        package = self._sight(_soon(deadline_s), own_s)
        if package is not None:
            self._check_stopped_by_nobody(package)
            if package.runtime_state == PLAYING and own_s < math.inf:
                self._refuse(
                    FaultCode.PROGRAM_STOPPED,
                    "another program runs on the controller: no retract is sent",
                    "stop it on the pendant and move the arm clear by hand",
                )
            now = self._configuration(_soon(deadline_s))
            if self._held_by_slider(now):
                self._refuse(
                    FaultCode.SETTING_CHANGED,
                    "the speed slider holds the arm: no retract is sent, for it would begin "
                    "whenever somebody raises it",
                    "move the arm clear by hand on the pendant",
                )
            if moved := self._last.moved(package, now):
                self._refuse(
                    FaultCode.PROGRAM_STOPPED,
                    f"{moved}: somebody had the arm while it did not answer, no retract is sent",
                    "move it clear by hand on the pendant",
                )
            self._keep(package)
        answers = self._dashboard.ask()
        until_s = min(deadline_s, begun_s + self._own_s)
        while package is None and answers and answers.program == "PLAYING":
            if time.monotonic() >= until_s:
                break
            time.sleep(ASK_AGAIN_S)  # until our own program has ended by its watchdog
            answers = self._dashboard.ask()
        self._refuse_after_a_sign()
        if package is None:
            require_nobody(self._settings.host, answers)
        self._from = self._from or self._last.pose

    @staticmethod
    def _held_by_slider(now: ArmConfiguration | None) -> bool:
        speed = None if now is None else now.speed_fraction
        return speed is not None and speed < LEAST_SPEED

    def _configuration(self, deadline_s: float) -> ArmConfiguration | None:
        with suppress(DeviceError):
            return read_configuration(self._settings.host, deadline_s)
        return None

    def _sight(self, deadline_s: float, own_s: float) -> UrState | None:
        """The newest package, None without an answer, and where data stand still.

        A program of ours that was suspended with the controller gets `own_s` to end by its
        watchdog.
        """
        wait_s = 0.0 if own_s == math.inf else own_s
        try:
            with closing(RtdeClient(self._settings.host, deadline_s + wait_s)) as rtde:
                first = _started(rtde)
                package = rtde.read()
                until_s = time.monotonic() + wait_s
                while package.runtime_state == PLAYING and time.monotonic() < until_s:
                    package = rtde.read()
                return package if package.timestamp_s > first.timestamp_s else None
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
        self._last.take(package)
        self._from = self._from or package.pose
        self._back_m = -travel_m(package.pose, self._from, self._settings.approach)

    def _watch(self, distance_m: float, deadline_s: float) -> bool:
        """Follow the retract to its end; returns whether it was carried out at all.

        The end is that the arm has arrived, or that no program has run for a while.
        """
        played = False
        with closing(RtdeClient(self._settings.host, deadline_s)) as rtde:
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
