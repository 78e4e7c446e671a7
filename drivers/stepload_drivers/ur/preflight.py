"""What must be true of a controller before ur_rtde may touch it.

ur_rtde's constructors hang for good on a silent controller and crash on old ones, so everything
they rely on is asked first, with time-outs of our own.
"""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass
from importlib.util import find_spec

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.client import RtdeClient, Version, dashboard
from stepload_drivers.ur.configuration import read_configuration, slow_problem
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import safety_problem

OLDEST: Version = (3, 4, 0, 0)
OLDEST_E_SERIES: Version = (5, 4, 0, 0)
WHEELS = "3.11 and 3.12"
"""Versions of Python for which ur-rtde 1.6.5 has wheels; so does pyproject.toml."""
SUPPORTED = "3.4 to 3.15 or 5.4 to 5.x"
UPPER_OFFSET = 24
INTEGERS_USED, DOUBLES_USED = 8, 18


@dataclass(frozen=True, slots=True)
class Controller:
    """Identity of the controller. `serial_number` and `model` are empty where it has none."""

    version: Version
    serial_number: str
    model: str

    @property
    def period_s(self) -> float:
        """Control period: 2 ms on e-Series, 8 ms on CB3."""
        return 0.008 if self.version[0] == 3 else 0.002

    @property
    def firmware(self) -> str:
        return "PolyScope " + ".".join(map(str, self.version))


def check_library() -> None:
    """Refuse where ur_rtde is missing. It is looked for only: it is loaded in a process of its own.

    Raises:
        DeviceError: UNSUPPORTED, with the versions of Python that have wheels.
    """
    if find_spec("rtde_control") is None:
        raise _unsupported(
            "ur-rtde is not installed",
            f"its wheels are for Python {WHEELS}; this is Python {sys.version.split()[0]}",
        )


def check_version(version: Version, *, upper_registers: bool) -> None:
    """Refuse what ur_rtde 1.6.5 cannot drive.

    Raises:
        DeviceError: UNSUPPORTED, with what to do.
    """
    text = ".".join(map(str, version))
    if version[0] >= 6:
        raise _unsupported(
            f"PolyScope {text} is not supported: PolyScope X has no dashboard and no script port",
            f"use an e-Series or CB3 controller with PolyScope {SUPPORTED}",
        )
    if version < OLDEST or version[0] == 4:
        raise _unsupported(
            f"PolyScope {text} is not supported, 3.4 is the oldest that is",
            "update the controller's software",
        )
    if (5, 0, 0, 0) <= version < OLDEST_E_SERIES:
        raise _unsupported(
            f"PolyScope {text} is not supported: with 5.0 to 5.3 ur_rtde 1.6.5 takes its "
            "connection for lost at the first command and crashes",
            "update the controller's software to PolyScope 5.4 or later",
        )
    if upper_registers and version >= (5, 23, 0, 0):
        raise _unsupported(
            f"upper_registers does not work with PolyScope {text} (defect of ur_rtde 1.6.5)",
            "free registers 0 to 23 of the fieldbus, or stay below PolyScope 5.23",
        )


def _unsupported(message: str, hint: str) -> DeviceError:
    return DeviceError(message, code=FaultCode.UNSUPPORTED, hint=hint)


def register_names(*, upper_registers: bool) -> list[str]:
    """Input registers that ur_rtde's recipes use."""
    first = UPPER_OFFSET if upper_registers else 0
    integers = [f"input_int_register_{first + i}" for i in range(INTEGERS_USED)]
    return integers + [f"input_double_register_{first + i}" for i in range(DOUBLES_USED)]


def preflight(settings: Settings, deadline_s: float) -> Controller:
    """Ask version, registers, data, speed slider, identity, remote control; ends by `deadline_s`.

    Raises:
        DeviceError: NOT_CONNECTED, UNSUPPORTED (no ur_rtde, version, slider below 100 %),
            WRONG_DEVICE, NOT_REMOTE, REFUSED_COMMAND (registers taken), or the stop that is in
            force.
    """
    check_library()
    with contextlib.closing(RtdeClient(settings.host, deadline_s)) as rtde:
        version = rtde.version()
        check_version(version, upper_registers=settings.upper_registers)
        names = register_names(upper_registers=settings.upper_registers)
        if taken := rtde.taken_inputs(names):
            raise DeviceError(
                f"{settings.host}: input registers in use by another client or fieldbus: "
                f"{taken[0]} and {len(taken) - 1} more",
                code=FaultCode.REFUSED_COMMAND,
                hint="stop the other program, switch EtherNet/IP, PROFINET and MODBUS off, "
                "or set upper_registers: true",
            )
        rtde.start(125.0)
        if problem := safety_problem(rtde.read()):
            raise problem.error(f"{settings.host}: ")
    if problem := slow_problem(read_configuration(settings.host, deadline_s)):
        raise problem.error(f"{settings.host}: ")
    serial_number, model = _identity(settings, version, deadline_s)
    return Controller(version, serial_number, model)


def _identity(settings: Settings, version: Version, deadline_s: float) -> tuple[str, str]:
    asks_remote = version >= (5, 6, 0, 0)
    commands = ["get serial number", "get robot model"]
    if asks_remote:
        commands.append("is in remote control")
    replies = dashboard(settings.host, commands, deadline_s)
    serial_number = replies[0] if replies[0].isalnum() else ""
    model = replies[1] if replies[1].isalnum() else ""
    if asks_remote and replies[2].lower() != "true":
        raise DeviceError(
            f"{settings.host}: the controller is in local control",
            code=FaultCode.NOT_REMOTE,
            hint="switch the pendant to remote control (Settings, System, Remote Control first)",
        )
    if settings.serial_number and serial_number != settings.serial_number:
        found = serial_number or "one that does not tell its serial number"
        raise DeviceError(
            f"{settings.host}: expected controller {settings.serial_number}, found {found}",
            code=FaultCode.WRONG_DEVICE,
            hint="correct the address or the serial number in the rig file",
        )
    return serial_number, model
