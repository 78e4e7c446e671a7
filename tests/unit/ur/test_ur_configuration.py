"""What the controller tells of its configuration, by version, over a connection of its own."""

from __future__ import annotations

import math

import pytest

from stepload_drivers.ur import client
from stepload_drivers.ur.configuration import ConfigurationClient
from stepload_verify.emulators.ur_controller import UrController
from stepload_verify.emulators.ur_robot import Robot
from stepload_verify.emulators.ur_session import Session
from stepload_verify.emulators.ur_world import FreeAirAxis

HOST = "127.0.0.2"
JOINTS = (0.0, -math.pi / 2, math.pi / 2, 0.0, -math.pi / 2, 0.0)


class Socket:
    """The client's end of a connection to an emulated controller; no time passes."""

    def __init__(self, controller: UrController) -> None:
        self.session = Session(controller)
        self.waiting = b""
        self.closed = False

    def setsockopt(self, *_) -> None: ...

    def settimeout(self, timeout_s: float) -> None: ...

    def setblocking(self, blocking: bool) -> None: ...

    def sendall(self, data: bytes) -> None:
        self.waiting += self.session.feed(data)

    def send_package(self) -> None:
        while not (package := self.session.package()):
            pass
        self.waiting += package

    def recv(self, size: int) -> bytes:
        if not self.waiting:
            if self.session._started:
                raise BlockingIOError
            raise TimeoutError
        data, self.waiting = self.waiting[:size], self.waiting[size:]
        return data

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def connect(clock, monkeypatch):
    """Connects to an emulated controller of a version; returns client, socket and controller."""

    def make(version=(5, 12, 6, 0)):
        period_s = 0.008 if version[0] == 3 else 0.002
        controller = UrController(Robot(FreeAirAxis(), (0.0, 0.0, -1.0), period_s), version=version)
        socket = Socket(controller)
        monkeypatch.setattr(client.socket, "create_connection", lambda *_, **__: socket)
        return ConfigurationClient(HOST, clock.now_s + 1.0), socket, controller

    return make


def test_everything_is_told_by_a_controller_that_has_it(connect):
    connection, socket, controller = connect()
    for line in ("payload 1.5 0 0.01 0.05", "tcp 0 0 0.1", "slider 0.5"):
        controller.command(line)
    assert connection.configuration is None
    assert connection.poll() is False
    socket.send_package()
    assert connection.poll() is True
    configuration = connection.configuration
    assert configuration.joints_rad == JOINTS
    assert configuration.tcp_offset == (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    assert (configuration.payload_kg, configuration.payload_cog_m) == (1.5, (0.0, 0.01, 0.05))
    assert configuration.speed_fraction == 0.5
    assert configuration.held_pose == controller.value("target_TCP_pose")


@pytest.mark.parametrize(
    ("version", "payload", "tcp"),
    [
        ((3, 4, 0, 0), False, False),
        ((3, 11, 0, 0), True, False),
        ((3, 12, 0, 0), True, True),
        ((5, 4, 0, 0), False, False),
        ((5, 5, 0, 0), False, False),
        ((5, 5, 1, 0), True, True),
        ((5, 23, 0, 0), True, True),
    ],
)
def test_what_a_controller_lacks_is_none_and_the_rest_is_told(connect, version, payload, tcp):
    connection, socket, _ = connect(version)
    socket.send_package()
    configuration = connection.first()
    assert configuration.joints_rad == JOINTS
    assert configuration.speed_fraction == 1.0
    assert (configuration.payload_kg is not None) is payload
    assert (configuration.payload_cog_m is not None) is payload
    assert (configuration.tcp_offset is not None) is tcp


@pytest.mark.parametrize("fault", ["nan on", "random on", "short on", "payload 1000"])
def test_what_cannot_be_true_is_passed_over(connect, fault):
    connection, socket, controller = connect()
    socket.send_package()
    connection.poll()
    known = connection.configuration
    controller.command(fault)
    socket.send_package()
    assert connection.poll() is False
    assert connection.configuration is known


@pytest.mark.parametrize("data", [b"", b"\x00\x01U", b"no RTDE at all"])
def test_a_connection_that_is_lost_shows_by_its_age_alone(connect, clock, monkeypatch, data):
    connection, socket, _ = connect()
    socket.send_package()
    connection.poll()
    seen_s = connection.seen_s
    clock.sleep(1.0)
    monkeypatch.setattr(socket, "recv", lambda size: data)
    assert connection.poll() is False
    assert connection.seen_s == seen_s
