"""What is plugged into this computer that a force sensor could be reached through."""

from __future__ import annotations

import logging
from contextlib import suppress

NO_ADAPTERS = ("virtual", "udp_multicast", "serial", "socketcand")
"""Not plugged in, or any serial port; the last one listens to the network for four seconds."""


def serial_ports() -> list[str]:
    """Serial ports, each with its adapter's description; those without an adapter last."""
    from serial.tools import list_ports

    found = sorted(list_ports.comports(), key=lambda port: (port.vid is None, port.device))
    return [f"{port.device} ({port.description})" for port in found]


def can_adapters() -> list[str]:
    """CAN adapters that python-can sees, as interface and channel; virtual ones left out."""
    import can

    logging.getLogger("can").setLevel(logging.CRITICAL)  # it names every library that is not there
    asked = sorted(can.VALID_INTERFACES - set(NO_ADAPTERS))
    found: list[str] = []
    with suppress(Exception):  # an adapter's library that is half installed fails in its own way
        found += [
            f"{seen['interface']} {seen['channel']}"
            for seen in can.detect_available_configs(interfaces=asked)
        ]
    return found
