"""The few calls of ur_rtde that are used, each with its return value checked.

Left out on purpose: reconnect(), blocking moves, servoC, the queries that do not wait for their
answer. `getTimestamp` is the only proof of fresh data; isConnected() is asked for bad news only.
"""

from __future__ import annotations

import resource
from typing import Any

from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import VARIABLES, UrState

READS = 3
NO_MORE_FILES = 3
"""As many as the standard streams, which stay open; fewer would also forbid poll() on one."""


class ReceivePort:
    """RTDEReceiveInterface with our variables only.

    Raises:
        RuntimeError: ur_rtde could not connect.
    """

    def __init__(self, settings: Settings) -> None:
        from rtde_receive import RTDEReceiveInterface

        self._rtde: Any = RTDEReceiveInterface(settings.host, -1.0, VARIABLES)

    def connected(self) -> bool:
        return bool(self._rtde.isConnected())

    def read_new(self, last: UrState | None) -> UrState | None:
        """The newest package if it is another than `last`; all its values of one moment.

        ur_rtde hands out single values and may receive between two of them, hence the second look
        at the time stamp.
        """
        rtde = self._rtde
        for _ in range(READS):
            stamp_s = rtde.getTimestamp()
            if last is not None and stamp_s == last.timestamp_s:
                return None
            pose, wrench = rtde.getActualTCPPose(), rtde.getActualTCPForce()
            if len(pose) != 6 or len(wrench) != 6:  # nothing received so far
                return None
            state = UrState(
                stamp_s,
                tuple(pose),
                tuple(wrench),
                rtde.getRobotMode(),
                rtde.getSafetyMode(),
                rtde.getRuntimeState(),
                rtde.getSafetyStatusBits(),
            )
            if rtde.getTimestamp() == stamp_s or stamp_s != stamp_s:
                return state
        return None


class ControlPort:
    """RTDEControlInterface: position targets, stop, watchdog.

    From then on this process cannot open another file or socket. ur_rtde's receiving thread would
    reconnect on its own after a lost connection and start its program again, in a race with whoever
    ends the process; so it is left without the means.

    Raises:
        RuntimeError: ur_rtde could not connect or start its program.
    """

    def __init__(self, settings: Settings) -> None:
        from rtde_control import RTDEControlInterface as Rtde

        flags = Rtde.FLAG_UPLOAD_SCRIPT | Rtde.FLAG_NO_EXT_FT
        if settings.upper_registers:
            flags |= Rtde.FLAG_UPPER_RANGE_REGISTERS
        self._settings = settings
        self._rtde: Any = Rtde(settings.host, -1.0, flags)
        resource.setrlimit(resource.RLIMIT_NOFILE, (NO_MORE_FILES, NO_MORE_FILES))

    def connected(self) -> bool:
        return bool(self._rtde.isConnected())

    def prepare(self) -> bool:
        """TCP and payload as configured, then the watchdog; to be repeated after every upload."""
        settings = self._settings
        if settings.tcp_offset_m is not None and not self._rtde.setTcp(
            [*settings.tcp_offset_m, 0.0, 0.0, 0.0]
        ):
            return False
        if settings.payload_mass_kg is not None and not self._rtde.setPayload(
            settings.payload_mass_kg, list(settings.payload_cog_m)
        ):
            return False
        return bool(self._rtde.setWatchdog(settings.watchdog_hz))

    def kick(self) -> bool:
        return bool(self._rtde.kickWatchdog())

    def servo(self, pose: list[float], period_s: float) -> bool:
        """One position target; the controller's program repeats it until the next."""
        settings = self._settings
        return bool(
            self._rtde.servoL(pose, 0.0, 0.0, period_s, settings.lookahead_s, settings.gain)
        )

    def stop_servo(self, deceleration_m_s2: float) -> bool:
        return bool(self._rtde.servoStop(deceleration_m_s2))

    def end_program(self) -> None:
        self._rtde.stopScript()

    def program_runs(self) -> bool:
        """Whether ur_rtde's control interface, on a connection of its own, sees the program run.

        It refuses every command until then, which may be later than `ReceivePort` sees it.
        """
        return bool(self._rtde.isProgramRunning())

    def upload(self) -> bool:
        """Send the control program again; True says only that it was sent."""
        try:
            return bool(self._rtde.reuploadScript())
        except RuntimeError:
            return False
