"""Emulated sensors by the name of the driver that reads them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from stepload_verify.emulators.ati import AtiDevice
from stepload_verify.emulators.ati_net import NetBox
from stepload_verify.emulators.bota import BotaDevice
from stepload_verify.emulators.canwire import can_wire
from stepload_verify.emulators.emulator import Emulator
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.gauge import GaugeDevice
from stepload_verify.emulators.line import LineCell
from stepload_verify.emulators.physics import WrenchSource
from stepload_verify.emulators.rdtwire import RdtWire
from stepload_verify.emulators.robotous import RftCan, RftCore, RftUart
from stepload_verify.emulators.wire import PtyWire


def bota(source: WrenchSource, board: FaultBoard, **options: Any) -> Emulator:
    """Bota serial sensor on a pty; options of `BotaDevice`."""
    return Emulator(BotaDevice(source, board, **options), PtyWire(), board)


def robotous_uart(source: WrenchSource, board: FaultBoard, **options: Any) -> Emulator:
    """RFT on a pty; options of `RftCore`."""
    return Emulator(RftUart(RftCore(source, board, **options)), PtyWire(), board)


def robotous_can(
    source: WrenchSource,
    board: FaultBoard,
    transport: str = "slcan",
    port: int = 0,
    **options: Any,
) -> Emulator:
    """RFT on CAN; options of `RftCore`."""
    wire, protocol = can_wire(transport, port)
    return Emulator(RftCan(RftCore(source, board, **options), protocol), wire, board)


def ati(
    source: WrenchSource,
    board: FaultBoard,
    transport: str = "slcan",
    port: int = 0,
    **options: Any,
) -> Emulator:
    """NETCANOEM on CAN; options of `AtiDevice`."""
    wire, protocol = can_wire(transport, port)
    return Emulator(AtiDevice(source, board, protocol, **options), wire, board)


def ati_net(source: WrenchSource, board: FaultBoard, **options: Any) -> Emulator:
    """Net F/T on UDP and HTTP ports of loopback; options of `NetBox`."""
    box, wire = NetBox(source, board, **options), RdtWire()
    box.options = {
        "host": "127.0.0.1", "port": wire.port, "http_port": wire.serve_page(box.page),
    }  # fmt: skip
    return Emulator(box, wire, board)


def gauge(source: WrenchSource, board: FaultBoard, **options: Any) -> Emulator:
    """Digital gauge on a pty; options of `GaugeDevice`."""
    return Emulator(GaugeDevice(source.physics, board, **options), PtyWire(), board)


def line(source: WrenchSource, board: FaultBoard, **options: Any) -> Emulator:
    """Load cell with lines of text on a pty; options of `LineCell`."""
    return Emulator(LineCell(source, board, **options), PtyWire(), board)


EMULATORS: Mapping[str, Callable[..., Emulator]] = {
    "bota_serial": bota,
    "robotous_uart": robotous_uart,
    "robotous_can": robotous_can,
    "ati_can": ati,
    "ati_net": ati_net,
    "gauge_serial": gauge,
    "line_serial": line,
}
GAUGES = ("gauge_serial",)
"""Those that measure displacement; the others measure force."""
CAN_SENSORS = ("robotous_can", "ati_can")


def driver_options(emulator: Emulator) -> dict[str, object]:
    """Options with which the driver reaches `emulator`."""
    address = emulator.address
    if isinstance(emulator.device, RftCan | AtiDevice):
        interface = "slcan" if address.startswith("/dev/") else "socketcand"
        return {"interface": interface, "channel": address}
    if isinstance(emulator.device, NetBox):
        return dict(emulator.device.options)
    if isinstance(emulator.device, LineCell):
        return {"port": address, **emulator.device.options}
    return {"port": address}
