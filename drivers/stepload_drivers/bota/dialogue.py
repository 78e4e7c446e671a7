"""The ASCII side of a Bota serial sensor: commands, replies, boot text."""

from __future__ import annotations

import logging
import re
import time

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.serialport import SerialPort
from stepload_drivers.streamed import Deadline

CHARACTER_S = 0.005
"""Pause after each character: the device's input buffer holds 64 bytes and is emptied slowly."""

RESET = "#"
CONFIGURE = "C"
RUN = "R"
_log = logging.getLogger(__name__)
_BANNER = re.compile(
    rb"name: (?P<name>[^\r\n]*)[\r\n]+.*?S/N: (?P<serial>[^\r\n]*)[\r\n]+"
    rb".*?FW version: (?P<firmware>[^\r\n]*)[\r\n]",
    re.DOTALL,
)


def communication_command(baud_code: int) -> str:
    """No temperature compensation, calibrated values, binary frames."""
    return f"c,0,1,0,{baud_code}"


def filter_command(sinc: int, *, fir: bool) -> str:
    """Sinc length (sets the rate), no chopping, no fast filter, FIR filter on or off."""
    return f"f,{sinc},0,0,{0 if fir else 1}"


def send(port: SerialPort, command: str) -> None:
    """Send `command` character by character."""
    _log.debug("%s <- %s", port.path, command)
    for character in command:
        port.write(character.encode("ascii"))
        time.sleep(CHARACTER_S)


def ask(port: SerialPort, command: str, deadline: Deadline) -> None:
    """Send `command` and wait for its reply `r,0,<letter>,0`, which may come amid binary frames.

    Raises:
        DeviceError: refused, or no reply in time.
    """
    reply = re.compile(rb"r,\d+,%c,(\d+)" % command[0].encode("ascii"))
    send(port, command)
    refusal = int(_heard(port, reply, 64, f"reply to {command!r}", deadline)[1])
    if refusal:
        raise DeviceError(
            f"{port.path}: sensor refused {command!r} with code {refusal}",
            code=FaultCode.REFUSED_COMMAND,
            hint="check that the firmware knows this setting",
        )


def reset(port: SerialPort, deadline: Deadline) -> tuple[str, str, str]:
    """Restart the sensor; product name, serial number and firmware version from its boot text.

    Raises:
        DeviceError: no boot text in time.
    """
    port.discard_input()
    send(port, RESET)
    match = _heard(port, _BANNER, 4096, "boot text of the sensor", deadline)
    name, serial_number, firmware = (
        match[group].decode("ascii", "replace").strip() for group in ("name", "serial", "firmware")
    )
    return name, serial_number, firmware


def _heard(
    port: SerialPort, pattern: re.Pattern[bytes], longest: int, what: str, deadline: Deadline
) -> re.Match[bytes]:
    """Read until `pattern`, of at most `longest` bytes and one read, is found."""
    heard = b""
    while True:
        deadline.left_s(f"{port.path}: {what}")
        heard = heard[-longest:] + port.read()
        if match := pattern.search(heard):
            _log.debug("%s -> %r", port.path, match[0])
            return match
