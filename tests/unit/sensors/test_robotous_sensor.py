"""The RFT driver in virtual time: dialogue, stamps, counters, overload."""

import math

import pytest
from driver_time import Clock
from read_sensor import connect, look, read

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.robotous import sensor as rft_module
from stepload_drivers.robotous.codec import Command
from stepload_drivers.robotous.sensor import Errors, RobotousUart


class Device:
    """A link to an RFT64-SB01 (50 counts per N, 2000 per N·m)."""

    def __init__(self, clock):
        self.clock = clock
        self.sent = []
        self.texts = {Command.MODEL: "RFT64-SB01", Command.SERIAL: "S1", Command.FIRMWARE: "1.0"}
        self.replies = {
            Command.SET_FILTER: (1,), Command.GET_FILTER: (0, 0), Command.SET_RATE: (1,),
            Command.GET_RATE: (8,),
        }  # fmt: skip
        self.deaf_for = {}
        self.waiting = []
        self.counters = Errors(0, 0, 0)
        self.streams = False
        self.number = 0
        self.next_s = math.inf
        self.overload = 0
        self.count = lambda: 100 + self.number % 7
        self.closed = False

    def send(self, command):
        name = Command(command[0])
        self.sent.append(tuple(command))
        if self.deaf_for.get(name, 0) > 0:
            self.deaf_for[name] -= 1
        elif name in self.texts:
            self.waiting.append(bytes((name,)) + self.texts[name].encode().ljust(15, b"\0"))
        elif name in self.replies:
            self.waiting.append(bytes((name, *self.replies[name])).ljust(16, b"\0"))
        elif name is Command.START:
            self.streams, self.next_s = True, self.clock.now_s + 0.001
        elif name is Command.STOP:
            self.streams = False

    def payload(self):
        self.number += 1
        z = self.count() & 0xFFFF
        values = bytes(4) + bytes((z >> 8, z & 0xFF)) + bytes(6)
        return bytes((Command.START,)) + values + bytes((self.overload,)) + bytes(2)

    def receive(self):
        self.clock.sleep(0.001)
        payloads, self.waiting = self.waiting, []
        while self.streams and self.next_s <= self.clock.now_s:
            payloads.append(self.payload())
            self.next_s += 0.001
        return payloads

    def discard_input(self):
        self.waiting = []

    def errors(self):
        return self.counters

    def close(self):
        self.closed = True


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed, rft_module)
    return clock


@pytest.fixture
def device(clock, monkeypatch):
    device = Device(clock)
    monkeypatch.setattr(RobotousUart, "_open_link", lambda self, deadline: device)
    return device


@pytest.fixture
def sensor(device):
    sensor = RobotousUart(port="p")
    connect(sensor)
    return sensor


def test_what_the_sensor_says_is_its_identity_and_it_is_stopped_first(device):
    identity = connect(RobotousUart(port="p", serial_number="S1"))
    assert (identity.model, identity.serial_number) == ("RFT64-SB01", "S1")
    assert identity.calibration_revision == "dividers 50/N 2000/Nm"
    assert device.sent[0][0] == Command.STOP
    assert device.sent[-1][0] == Command.START


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (lambda d: d.texts.update({Command.SERIAL: "S2"}), FaultCode.WRONG_DEVICE),
        (lambda d: d.texts.update({Command.MODEL: "RFT999"}), FaultCode.UNSUPPORTED),
        (lambda d: d.replies.update({Command.SET_RATE: (0, 2)}), FaultCode.REFUSED_COMMAND),
        (lambda d: d.replies.update({Command.GET_RATE: (5,)}), FaultCode.REFUSED_COMMAND),
        (lambda d: d.replies.update({Command.GET_FILTER: (1, 3)}), FaultCode.REFUSED_COMMAND),
        (lambda d: d.deaf_for.update({Command.MODEL: 2}), FaultCode.NOT_CONNECTED),
    ],
)
def test_a_sensor_that_is_not_as_wanted_is_refused(device, spoil, code):
    spoil(device)
    with pytest.raises(DeviceError) as caught:
        connect(RobotousUart(port="p", serial_number="S1"))
    assert caught.value.code == code


def test_samples_are_newton_by_the_models_divider_stamped_a_period_apart(sensor, clock):
    samples = read(sensor, clock, 0.05)
    assert samples[0].wrench[2] == pytest.approx(101 / 50)
    assert samples[0].status == 0
    assert math.isnan(samples[0].device_time_s)
    assert samples[-1].receive_time_s == pytest.approx(clock.now_s)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    clock.sleep(0.01)
    burst = look(sensor, clock)
    assert len(burst) == 11
    assert burst[0].receive_time_s == pytest.approx(clock.now_s - 0.010)


def test_torn_pairs_are_lost_samples_and_damage_counts(sensor, device, clock):
    before = read(sensor, clock, 0.02)[-1].sequence
    device.counters = Errors(damaged=2, skipped=7, orphans=3)
    after = look(sensor, clock)[0].sequence
    health = sensor.health()
    assert after - before == 4
    assert health.lost == 3
    assert health.errors == {"damaged": 2, "skipped_bytes": 7, "orphans": 3}


def test_a_frozen_value_is_a_fault_and_a_filtered_one_gets_its_time(device, clock):
    device.count = lambda: 100
    for cutoff_hz, parameter, limit_s in ((0.0, 0, 0.05), (2.0, 13, 0.5)):
        device.replies[Command.GET_FILTER] = (1, parameter) if parameter else (0, 0)
        sensor = RobotousUart(port="p", filter=cutoff_hz)
        connect(sensor)
        read(sensor, clock, 0.9 * limit_s)
        assert sensor.fault() is None
        read(sensor, clock, 0.2 * limit_s)
        assert sensor.fault().code is FaultCode.STALE


def test_the_stream_ends_with_close(sensor, device):
    sensor.close()
    assert device.closed
    assert not device.streams
