"""Fault codes: what a device latches, what a run is stopped for, what a program branches on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from stepload.errors import DeviceError


class FaultCode(StrEnum):
    """Why a device is not usable. Values are stable: they are written to records."""

    NOT_CONNECTED = "not_connected"
    """No answer at open, or the link was closed or unplugged."""
    STALE = "stale"
    """No new sample within the age limit, whatever the link claims."""
    CORRUPT = "corrupt"
    """Too many frames failed their checksum or plausibility check."""
    NOT_FINITE = "not_finite"
    """NaN or infinity in a sample."""
    OUT_OF_RANGE = "out_of_range"
    """A value no sound device would send."""
    OVERLOAD = "overload"
    """Beyond the rated load, or a gauge saturated."""
    DEVICE_REPORTS = "device_reports"
    """A fault bit of the device itself."""
    REFUSED_COMMAND = "refused_command"
    """The device said no, or said nothing, to a command."""
    WRONG_DEVICE = "wrong_device"
    """Another model, serial number or firmware than the rig file says."""
    UNSUPPORTED = "unsupported"
    """A controller, firmware or setting this driver does not support."""
    PROTECTIVE_STOP = "protective_stop"
    EMERGENCY_STOP = "emergency_stop"
    SAFEGUARD_STOP = "safeguard_stop"
    PROGRAM_STOPPED = "program_stopped"
    """The program on the controller that carries out our commands was ended, not known by whom."""
    WATCHDOG_STOP = "watchdog_stop"
    """The arm's own watchdog ended that program because our commands did not come."""
    NOT_REMOTE = "not_remote"
    """The controller is in local control."""
    SETTING_CHANGED = "setting_changed"
    """Somebody changed a setting of the device that the run relies on."""
    CLOCK = "clock"
    """The device's clock jumped, stands still or runs away from the host's."""
    DRIVER = "driver"
    """The driver's own process or thread died or hangs."""


TAKEN_OVER = frozenset(
    {
        FaultCode.PROTECTIVE_STOP,
        FaultCode.EMERGENCY_STOP,
        FaultCode.SAFEGUARD_STOP,
        FaultCode.PROGRAM_STOPPED,
        FaultCode.NOT_REMOTE,
    }
)
"""A person, or a safety system, has the arm now or may have it: nothing moves it any more, not even
a retract, until a person starts anew."""

NO_ANSWER = frozenset({FaultCode.NOT_CONNECTED, FaultCode.STALE})
"""The device does not answer now; what was asked of it can be asked again."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A latched fault of one device.

    Args:
        code: what programs branch on.
        message: what is wrong, with value, unit and limit.
        hint: what to do.
        time_s: host monotonic time of the first occurrence.
    """

    code: FaultCode
    message: str
    hint: str
    time_s: float

    def error(self, before: str = "") -> DeviceError:
        """The same as an error; `before` says what was not done for it."""
        return DeviceError(f"{before}{self.message}", code=self.code, hint=self.hint)
