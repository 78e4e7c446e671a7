"""Causes other than the connection that keep the arm from following, checked at every package."""

from __future__ import annotations

import contextlib
import threading
import time

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.client import REMOTE, Dashboard
from stepload_drivers.ur.configuration import ConfigurationClient, change
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PAUSING, PLAYING, Problem, UrState, safety_problem

TOLD_S = 1.0
TOLD_AGE_S = 3.0
REFUSAL_GRACE_S = 0.05
ASK_S = 0.2
EVERY_S = 1.0
WATCHDOG_SHARE = 0.9
"""Share of its time without our input after which a stop is attributed to the watchdog."""


class Watch:
    """Safety, settings, program and remote control of one controller.

    Its connections are made here: see `ports.ControlPort`. `told` reads the settings; `armed` are
    their required values, None before they are known.

    Raises:
        DeviceError: the controller does not report its settings.
    """

    def __init__(self, settings: Settings) -> None:
        self.told = ConfigurationClient(settings.host, time.monotonic() + TOLD_S)
        self.armed: ArmConfiguration | None = None
        self._remote_check = RemoteCheck(settings.host)
        self._watchdog_s = 1.0 / settings.watchdog_hz

    def poll(self) -> ArmConfiguration | None:
        """Process the answers of both connections; returns a new configuration, if there is one."""
        self._remote_check.poll()
        return self.told.configuration if self.told.poll() else None

    def problem(
        self, state: UrState, now_s: float, refused_s: float, unsent_s: float
    ) -> Problem | None:
        """The present fault, as specific as possible; also None while that is being determined.

        Args:
            state: the newest package.
            now_s: monotonic time, as for the other times.
            refused_s: since when the controller has refused inputs; inf: it takes them.
            unsent_s: time without sending when the end of the program was detected.
        """
        if problem := safety_problem(state) or self._setting_problem(now_s):
            return problem
        if state.runtime_state != PLAYING:
            if not self._remote_check.done():
                return None
            return _stopped(state, self._remote_check.remote, unsent_s, self._watchdog_s)
        if self._remote_check.remote is False:
            return _local_control("the program still runs")
        if now_s - refused_s > REFUSAL_GRACE_S:
            return Problem(
                FaultCode.REFUSED_COMMAND,
                "the controller refused a position target",
                "read the log on the pendant",
            )
        return None

    def _setting_problem(self, now_s: float) -> Problem | None:
        if self.armed is None or self.told.configuration is None:
            return None
        age_s = now_s - self.told.seen_s
        if age_s > TOLD_AGE_S:
            return Problem(
                FaultCode.STALE,
                f"no speed slider, payload and TCP told for {age_s:.1f} s, limit {TOLD_AGE_S:g} s",
                "check the network and the controller's load",
            )
        return change(self.armed, self.told.configuration)

    def end_program(self) -> None:
        """End the program by the dashboard, so that a paused one does not continue."""
        self._remote_check.end_program()


def _local_control(program: str) -> Problem:
    return Problem(
        FaultCode.NOT_REMOTE,
        f"somebody at the pendant switched the controller to local control; {program}",
        "when the operator is done: switch the pendant to remote control, then start anew",
    )


def _stopped(state: UrState, remote: bool | None, unsent_s: float, watchdog_s: float) -> Problem:
    """Why the program does not run; no motion is allowed unless the watchdog certainly ended it.

    Args:
        state: the newest package; no safety stop is in force.
        remote: whether the controller is in remote control; None where it does not report it.
        unsent_s: time without sending when the end of the program was detected.
        watchdog_s: time of the controller's watchdog.
    """
    if remote is False:
        return _local_control("our program runs no more")
    what = (
        f"the control program on the controller does not run (runtime_state {state.runtime_state})"
    )
    paused = state.runtime_state in PAUSING
    if unsent_s >= WATCHDOG_SHARE * watchdog_s and not paused:
        return Problem(
            FaultCode.WATCHDOG_STOP,
            f"{what}: its watchdog stopped it, nothing was sent for {unsent_s * 1e3:.0f} ms",
            "check the load of this computer, and `command_timeout`; then start anew",
        )
    cause = (
        "stopped from the pendant or dashboard, replaced by another program, or stopped by its "
        "watchdog because our inputs did not arrive"
    )
    if paused:
        cause = "somebody paused it at the pendant, or a program over the dashboard"
    return Problem(
        FaultCode.PROGRAM_STOPPED,
        f"{what}: {cause}",
        "nothing moves the arm now: move it clear on the pendant, see its log, then start anew",
    )


class RemoteCheck:
    """Asks the dashboard for remote control outside the loop, so that data continue meanwhile.

    The connection is made beforehand: see `ports.ControlPort`. `remote` is None where the
    controller cannot or does not report it (PolyScope below 5.6).
    """

    def __init__(self, host: str) -> None:
        self.remote: bool | None = None
        self._thread: threading.Thread | None = None
        self._dashboard: Dashboard | None = None
        self._requested_s = time.monotonic()
        self._final = False
        self._tells = True
        with contextlib.suppress(DeviceError):
            self._dashboard = Dashboard(host, time.monotonic() + ASK_S)

    def poll(self) -> None:
        """Ask once every `EVERY_S`, for as long as the answers make sense."""
        if not self._asking and time.monotonic() - self._requested_s >= EVERY_S:
            self._start()

    def done(self) -> bool:
        """Whether a question put after the first call is answered or given up."""
        if not self._asking and not self._final:
            self._final = True
            self._start()
        return not self._asking

    @property
    def _asking(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def _start(self) -> None:
        self._requested_s = time.monotonic()
        if self._dashboard is not None and self._tells:
            self._thread = threading.Thread(target=self._ask, daemon=True)
            self._thread.start()

    def end_program(self) -> None:
        """Send the dashboard's stop, also outside the loop; whether it is obeyed is not known."""
        threading.Thread(target=self._stop, daemon=True).start()

    def _stop(self) -> None:
        if self._thread is not None:
            self._thread.join(ASK_S)
        if self._dashboard is not None:
            with contextlib.suppress(DeviceError):
                self._dashboard.ask("stop", time.monotonic() + ASK_S)

    def _ask(self) -> None:
        assert self._dashboard is not None
        try:
            reply = self._dashboard.ask("is in remote control", time.monotonic() + ASK_S)
            self.remote = REMOTE.get(reply.lower())
            self._tells = self.remote is not None
        except DeviceError:  # a late answer would be taken for the next question's
            self.remote = None
            self._dashboard = None
