"""A UR controller on a loopback address that ur_rtde cannot tell from the real one."""

from __future__ import annotations

import ipaddress
import sys
from collections.abc import Callable, Mapping, Sequence

from stepload_drivers.streamed import prefer_this_thread
from stepload_verify.emulators.physics import Tool
from stepload_verify.emulators.ur_controller import UrController
from stepload_verify.emulators.ur_robot import Robot
from stepload_verify.emulators.ur_server import UrServer
from stepload_verify.emulators.ur_variables import Version
from stepload_verify.emulators.ur_world import Axis, FreeAirAxis


def parse_version(text: str) -> Version:
    """ "5.12" or "5.12.6.1102099" to four numbers.

    Raises:
        ValueError: not one to four numbers with dots between.
    """
    parts = [int(part) for part in text.split(".")]
    if not 1 <= len(parts) <= 4:
        raise ValueError(f"version {text!r}: expected like 5.12 or 5.12.6.0")
    major, minor, bugfix, build = parts + [0] * (4 - len(parts))
    return (major, minor, bugfix, build)


def run_ur_emulator(
    host: str = "127.0.0.1",
    *,
    version: Version = (5, 12, 6, 0),
    direction: tuple[float, ...] = (0.0, 0.0, -1.0),
    axis: Axis | None = None,
    tool: Tool | None = None,
    serial_number: str = "20235500001",
    model: str = "UR5",
    commands: Sequence[str] = (),
    protective_stop_ends_program: bool = False,
    until_eof: bool = False,
    others: Mapping[str, Callable[[str], str]] | None = None,
) -> None:
    """Serve ports 29999 and 30001–30004 of `host` until told to quit; commands on standard input.

    Args:
        host: an address of 127.0.0.0/8; the protocol fixes the ports, so each emulator needs its
            own.
        tool: what acts on the tool, shared with the sensors that feel it.
        direction: approach direction, base frame; `axis` moves along it.
        axis: physics along the approach direction; free air when not given.
        commands: lines as on standard input (see `ur_faults.HELP`), carried out at the start.
        until_eof: also end when standard input closes.
        others: who takes the rest of a command line that begins with their name.

    Raises:
        ValueError: not a loopback address, or a command that is none.
        OSError: a port is taken.
    """
    if not ipaddress.ip_address(host).is_loopback:
        raise ValueError(f"host {host}: emulators serve 127.0.0.0/8 only")
    period_s = 0.008 if version[0] == 3 else 0.002
    robot = Robot(axis if axis is not None else FreeAirAxis(), direction, period_s, tool)
    controller = UrController(
        robot,
        version=version,
        serial_number=serial_number,
        model=model,
        protective_stop_ends_program=protective_stop_ends_program,
    )
    server = UrServer(controller, host, until_eof=until_eof, others=others)

    def ready() -> None:
        prefer_this_thread()  # a controller keeps its period
        for line in commands:
            server.command(line)
        sys.stdout.write(f"ready: UR {version[0]}.{version[1]} on {host}\n")
        sys.stdout.flush()

    server.run(ready)
