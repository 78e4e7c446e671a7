"""Causes other than the connection that keep the arm from following, checked at every package."""

from __future__ import annotations

import time

from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.configuration import ConfigurationClient
from stepload_drivers.ur.remote import RemoteCheck
from stepload_drivers.ur.setting_changes import change
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PLAYING, Problem, UrState, safety_problem
from stepload_drivers.ur.stop_cause import local_control, stopped

TOLD_S = 1.0
TOLD_AGE_S = 3.0
REFUSAL_GRACE_S = 0.05


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
            return self._why_no_program(state, unsent_s)
        if self._remote_check.remote is False:
            return local_control(program_runs=True)
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

    def _why_no_program(self, state: UrState, unsent_s: float) -> Problem | None:
        """None while the dashboard is being asked."""
        if not self._remote_check.done():
            return None
        return stopped(
            state,
            remote=self._remote_check.remote,
            unsent_s=unsent_s,
            watchdog_s=self._watchdog_s,
        )
