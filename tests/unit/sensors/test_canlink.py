"""An open CAN bus without an adapter: what is data, what is an error, what is refused."""

import socket
import threading

import can
import pytest

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers import canbus
from stepload_drivers.canbus import CanLink, FastSlcan, slcanBus


class Bus:
    """A python-can bus that delivers `waiting`; `fails` is raised by every call."""

    def __init__(self, **options):
        self.options = options
        self.waiting, self.sent, self.fails = [], [], None

    def recv(self, timeout):
        if self.fails:
            raise self.fails
        return self.waiting.pop(0) if self.waiting else None

    def send(self, message, timeout):
        if self.fails:
            raise self.fails
        self.sent.append((message.arbitration_id, bytes(message.data), message.is_extended_id))

    def shutdown(self):
        if self.fails:
            raise self.fails


@pytest.fixture
def link(monkeypatch):
    monkeypatch.setattr(canbus.can, "Bus", Bus)
    return CanLink("virtual", "c", 500_000, 1.0)


def message(**options):
    return can.Message(arbitration_id=5, data=b"", is_extended_id=False, **options)


def test_only_data_frames_are_data(link):
    link._bus.waiting = [message(is_error_frame=True), message(is_remote_frame=True), message()]
    assert [frame.id for frame in link.receive()] == [5]
    assert link._bus.options["bitrate"] == 500_000


@pytest.mark.parametrize("error", [can.CanOperationError("gone"), OSError("gone")])
def test_an_adapter_that_is_gone_is_not_connected(link, error):
    link._bus.fails = error
    for call in (link.receive, lambda: link.send(1, b"")):
        with pytest.raises(DeviceError) as caught:
            call()
        assert caught.value.code == FaultCode.NOT_CONNECTED
    link.close()


def test_an_slcan_adapter_is_opened_for_us_alone_before_it_is_sent_anything(monkeypatch):
    order = []

    class Port:
        exclusive = False

        def __init__(self, channel, exclusive):
            order.append(("probed", channel, exclusive))

        def close(self):
            order.append("closed")

    def open_bus(self, channel, **options):
        order.append("opened")
        self.serialPortOrig = type("Port", (), {"exclusive": False})

    monkeypatch.setattr(canbus.serial, "Serial", Port)
    monkeypatch.setattr(slcanBus, "__init__", open_bus)
    monkeypatch.setattr(slcanBus, "__del__", lambda self: None, raising=False)
    bus = FastSlcan("/dev/ttyACM0")
    assert order == [("probed", "/dev/ttyACM0", True), "closed", "opened"]
    assert bus.serialPortOrig.exclusive is True


def test_damaged_slcan_lines_are_counted():
    bus = FastSlcan.__new__(FastSlcan)
    bus.damaged, bus._read_s, bus.early_s = 0, 1.0, 0.0
    for line, frame_id in (("t0018AABB", None), ("t0012AABB", 1), ("z", None), ("x", None)):
        bus._read = lambda timeout, line=line: line
        got, _ = bus._recv_internal(0.0)
        assert (got.arbitration_id if got else None) == frame_id
    assert bus.damaged == 2
    bus._is_shutdown = True


def test_a_bus_on_which_a_device_sends_already_is_opened():
    """Its frames come glued to the answer of the server."""

    def serve(server):
        for _ in range(2):  # the greeting is tried first, on a connection of its own
            peer, _ = server.accept()
            with peer:
                peer.sendall(b"< hi >")
                if peer.recv(64) and peer.sendall(b"< ok >") is None and peer.recv(64):
                    peer.sendall(b"< ok >< frame 005 1.0 AA >")
                    peer.recv(64)

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=serve, args=(server,), daemon=True).start()
        link = CanLink("socketcand", f"127.0.0.1:{server.getsockname()[1]}/can0", 1_000_000, 1.0)
        try:
            assert [(frame.id, frame.data) for frame in link.receive(2.0)] == [(5, b"\xaa")]
        finally:
            link.close()
