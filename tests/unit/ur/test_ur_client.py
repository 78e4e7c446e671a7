"""Sockets with time-outs of our own: RTDE, dashboard and script ports against fake peers."""

from __future__ import annotations

import struct
from contextlib import closing

import pytest
from ur_fakes import HOME

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import client, frames
from stepload_drivers.ur.client import RtdeClient, dashboard, send_script
from stepload_drivers.ur.frames import encode
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING
from stepload_drivers.ur.watch import RemoteCheck

HOST = "10.0.0.2"
TYPES = b"DOUBLE,VECTOR6D,VECTOR6D,INT32,INT32,UINT32,UINT32"


class FakeSocket:
    """A peer that answers what was sent, after `delay_s` each."""

    def __init__(self, clock, answer, greeting=b"", delay_s=0.01) -> None:
        self.clock, self.answer, self.delay_s = clock, answer, delay_s
        self.waiting = [greeting] if greeting else []
        self.got: list[bytes] = []
        self.closed = False
        self.timeout_s = 0.0

    def setsockopt(self, *_) -> None:
        pass

    def settimeout(self, timeout_s: float) -> None:
        self.timeout_s = timeout_s

    def sendall(self, data: bytes) -> None:
        self.got.append(data)
        self.waiting += self.answer(data)

    def recv(self, size: int) -> bytes:
        if not self.waiting or self.delay_s > self.timeout_s:
            self.clock.sleep(self.timeout_s)
            raise TimeoutError
        self.clock.sleep(self.delay_s)
        return self.waiting.pop(0)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def peers(clock, monkeypatch):
    """Sockets by port; a port without one refuses. `asked` notes port and time-out."""
    made: dict[int, FakeSocket] = {}
    requested: list[tuple[int, float]] = []

    def connect(address, timeout):
        requested.append((address[1], timeout))
        if address[1] not in made:
            raise ConnectionRefusedError("refused")
        return made[address[1]]

    monkeypatch.setattr(client.socket, "create_connection", connect)
    made_and_asked = type("Peers", (), {"made": made, "requested": requested})
    return made_and_asked


def package(stamp_s=1.0, pose=HOME) -> bytes:
    values = (stamp_s, *pose, *(0.0,) * 6, ROBOT_RUNNING, 1, PLAYING, 1)
    return encode(frames.DATA, b"\x01" + struct.pack(">d12d2i2I", *values))


def controller(*packages: bytes, version=(5, 12, 6, 0), accepts=b"\x01", types=TYPES):
    def answer(data: bytes) -> list[bytes]:
        kind = data[2]
        if kind == frames.REQUEST_PROTOCOL_VERSION:
            return [encode(kind, accepts)]
        if kind == frames.GET_VERSION:
            return [encode(kind, struct.pack(">4I", *version))]
        if kind == frames.SETUP_INPUTS:
            return [encode(kind, b"\x01INT32,IN_USE")]
        if kind == frames.SETUP_OUTPUTS:
            return [encode(kind, b"\x01" + types)]
        return [encode(kind, accepts), *packages]

    return answer


@pytest.fixture
def rtde(peers, clock):
    def make(*packages, delay_s=0.01, **options):
        peers.made[client.RTDE] = FakeSocket(
            clock, controller(*packages, **options), delay_s=delay_s
        )
        return closing(RtdeClient(HOST, clock.now_s + 1.0))

    return make


def test_version_inputs_and_a_package(rtde, peers):
    with rtde(package()) as connection:
        assert connection.version() == (5, 12, 6, 0)
        assert connection.taken_inputs(["a", "b"]) == ["b"]
        connection.start(125.0)
        assert connection.read().pose == HOME
    assert peers.made[client.RTDE].closed


def test_a_package_that_cannot_be_true_is_an_error(rtde):
    with rtde(package(stamp_s=float("nan"))) as connection:
        connection.start(125.0)
        with pytest.raises(DeviceError) as caught:
            connection.read()
    assert caught.value.code == FaultCode.NOT_FINITE


def test_what_has_arrived_is_taken_at_once_and_silence_is_not_an_error(rtde, clock):
    both = package(stamp_s=1.0) + encode(ord("M"), b"x") + package(stamp_s=2.0)
    with rtde(both, package(stamp_s=3.0), delay_s=0.001) as connection:
        connection.start(500.0)
        assert [state.timestamp_s for state in connection.arrived(0.05)] == [1.0, 2.0]
        assert [state.timestamp_s for state in connection.arrived(0.05)] == [3.0]
        began_s = clock.now_s
        assert connection.arrived(0.05) == []
        assert clock.now_s - began_s == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("last", "code"),
    [(b"", FaultCode.NOT_CONNECTED), (package(stamp_s=float("inf")), FaultCode.NOT_FINITE)],
)
def test_a_lost_connection_or_a_package_that_cannot_be_true_ends_it(rtde, last, code):
    with rtde(last) as connection:
        connection.start(500.0)
        with pytest.raises(DeviceError) as caught:
            connection.arrived(0.05)
    assert caught.value.code == code


def test_silence_ends_at_the_deadline(rtde, clock):
    began_s = clock.now_s
    with rtde() as connection:
        connection.start(125.0)
        with pytest.raises(DeviceError, match="no answer in time"):
            connection.read()
    assert clock.now_s - began_s == pytest.approx(1.0)


def test_a_peer_that_drips_other_frames_for_ever_ends_at_the_deadline(rtde, clock):
    began_s = clock.now_s
    with rtde(*[encode(ord("M"), b"x")] * 500) as connection:
        connection.start(125.0)
        with pytest.raises(DeviceError, match="in time"):
            connection.read()
    assert clock.now_s - began_s < 1.1


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"accepts": b"\x00"}, FaultCode.UNSUPPORTED),
        ({"types": b"DOUBLE,NOT_FOUND"}, FaultCode.UNSUPPORTED),
    ],
)
def test_a_controller_without_what_is_needed_is_unsupported(rtde, options, code):
    def ask():
        with rtde(**options) as connection:
            connection.version()
            connection.start(125.0)

    with pytest.raises(DeviceError) as caught:
        ask()
    assert caught.value.code == code


def test_no_connection_is_tried_past_the_deadline(peers, clock):
    with pytest.raises(DeviceError, match="no time left"):
        RtdeClient(HOST, clock.now_s)
    assert peers.requested == []
    with pytest.raises(DeviceError, match="cannot connect"):
        RtdeClient(HOST, clock.now_s + 0.3)
    assert peers.requested == [(client.RTDE, pytest.approx(0.3))]
    with pytest.raises(DeviceError):
        RtdeClient(HOST, clock.now_s + 30.0)
    assert peers.requested[-1][1] == client.CONNECT_LIMIT_S


def test_a_dashboard_that_says_nothing_is_given_up_in_time(peers, clock):
    peers.made[client.DASHBOARD] = FakeSocket(clock, lambda data: [])
    began_s = clock.now_s
    with pytest.raises(DeviceError, match="no answer in time"):
        dashboard(HOST, ["stop"], clock.now_s + 0.5)
    assert clock.now_s - began_s == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("reply", "remote"),
    [(b"false\n", False), (b"True\n", True), (b"could not understand\n", None), (b"", None)],
)
def test_remote_control_is_asked_for_on_a_connection_made_before(peers, clock, reply, remote):
    server = FakeSocket(clock, lambda data: [reply] if reply else [], b"Connected: UR\n")
    peers.made[client.DASHBOARD] = server
    check = RemoteCheck(HOST)
    assert server.got == []
    del peers.made[client.DASHBOARD]
    while not check.done():
        pass
    assert check.remote is remote
    assert server.got == [b"is in remote control\n"]


def settled(check):
    while check._asking:
        pass
    return check.remote


def test_remote_control_is_asked_for_every_second_on_the_same_connection(peers, clock):
    replies = [b"true\n", b"false\n", b"true\n"]
    server = FakeSocket(clock, lambda data: [replies.pop(0)], b"Connected: UR\n")
    peers.made[client.DASHBOARD] = server
    check = RemoteCheck(HOST)
    seen = []
    for _ in range(300):
        clock.sleep(0.01)
        check.poll()
        seen.append(settled(check))
        if not replies:
            break
    assert [seen[0], seen[150], seen[-1]] == [None, True, True]
    assert False in seen
    assert len(peers.requested) == 1


@pytest.mark.parametrize("reply", [b"could not understand\n", None])
def test_a_dashboard_that_does_not_say_is_asked_once(peers, clock, reply):
    server = FakeSocket(clock, lambda data: [reply] if reply else [], b"Connected: UR\n")
    peers.made[client.DASHBOARD] = server
    check = RemoteCheck(HOST)
    for _ in range(50):
        clock.sleep(0.1)
        check.poll()
        assert settled(check) is None
    assert server.got == [b"is in remote control\n"]


@pytest.mark.parametrize("port", client.SCRIPT_PORTS)
def test_a_script_goes_whole_to_the_first_port_that_takes_it(peers, clock, port):
    peers.made[port] = FakeSocket(clock, lambda data: [b"state"] * 3)
    send_script(HOST, "def x():\nend\n", clock.now_s + 1.0)
    assert peers.made[port].got == [b"def x():\nend\n"]
    assert [requested for requested, _ in peers.requested] == list(
        client.SCRIPT_PORTS[: client.SCRIPT_PORTS.index(port) + 1]
    )
