"""The Net F/T driver in virtual time: counters, clock, flags, silence, a second client."""

import itertools
import math

import pytest
from ati_page import PAGE
from driver_time import Clock
from read_sensor import connect, look, read

from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.ati import net
from stepload_drivers.ati.net import AtiNet
from stepload_drivers.ati.rdt import Command, Record, request
from stepload_verify.emulators.ati_net import encode

HOST = "10.0.0.9"


class Box:
    """Sends a record a millisecond once it is asked; stands in for the socket."""

    def __init__(self, clock):
        self._clock = clock
        self.every = 7
        self.requested, self.closed = [], False
        self.rdt, self.ft = 0, 1000
        self.status = 0
        self.deaf = self.silent = False
        self.next_s = math.inf
        self.keep = lambda number: [number]
        self.fz = lambda number: -30_000_000 + number % 1000

    def send(self, data):
        self.requested.append(data)
        if data == request(Command.START) and not self.deaf:
            self.rdt, self.next_s = 0, self._clock.now_s + 0.001

    def record(self):
        counts = (100, 200, self.fz(self.rdt), 1, 2, 3)
        return encode(Record(self.rdt % 2**32, self.ft % 2**32, self.status, counts))

    def receive(self, timeout_s):
        if self.silent or self.next_s > self._clock.now_s + timeout_s:
            self._clock.sleep(timeout_s)
            return []
        self._clock.sleep(max(1e-9, self.next_s - self._clock.now_s))
        self.rdt += 1
        self.ft += self.every
        self.next_s += 0.001
        return [self.record() for _ in self.keep(self.rdt)]

    def close(self):
        self.closed = True


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed, net)
    return clock


@pytest.fixture
def device(clock, monkeypatch):
    device = Box(clock)
    device.page, device.alive = PAGE, True
    monkeypatch.setattr(net, "UdpLink", lambda host, port: device)
    monkeypatch.setattr(net.box, "fetch", lambda host, port, name, deadline: device.page)
    monkeypatch.setattr(net.box, "answers", lambda host, port: device.alive)
    return device


@pytest.fixture
def sensor(device):
    sensor = AtiNet(host=HOST)
    connect(sensor)
    return sensor


def fault(sensor):
    return sensor.fault().code if sensor.fault() else None


def test_who_answers_and_how_fast(device):
    sensor = AtiNet(host=HOST, serial_number="FT27462")
    identity = connect(sensor)
    assert (identity.driver, identity.serial_number) == ("ati_net", "FT27462")
    assert sensor.rate_hz == pytest.approx(1000.0)


def test_samples_are_newton_with_the_devices_time(sensor, clock):
    samples = read(sensor, clock, 0.05)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert samples[0].wrench[:3] == pytest.approx((1e-4, 2e-4, -30.0), abs=1e-3)
    steps = [b.device_time_s - a.device_time_s for a, b in itertools.pairwise(samples)]
    assert steps == pytest.approx([0.001] * len(steps))
    assert samples[-1].receive_time_s == pytest.approx(clock.now_s)
    assert fault(sensor) is None
    assert sensor.health().errors == {}


def test_repeated_and_overtaken_records_are_dropped(sensor, device, clock):
    device.keep = lambda number: [number, number]
    samples = read(sensor, clock, 0.02)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert sensor.health().errors == {"repeated": len(samples)}
    device.keep = lambda number: [number]
    device.ft -= 14
    device.rdt -= 2
    assert look(sensor, clock) == []
    assert sensor.health().errors["out_of_order"] == 1


def test_a_stream_begun_anew_counts_its_loss_by_the_measurements(sensor, device, clock):
    read(sensor, clock, 0.01)
    device.rdt, device.ft = 0, device.ft + 3 * 7
    before = sensor.health().lost
    samples = look(sensor, clock)
    assert len(samples) == 1
    assert sensor.health().lost - before == 3
    assert sensor.health().errors == {"begun_anew": 1}


@pytest.mark.parametrize("every", [0, 3 * 7000, -3 * 7000])
def test_a_clock_that_stands_or_jumps_is_a_fault(sensor, device, clock, every):
    read(sensor, clock, 0.01)
    device.every = every
    look(sensor, clock)
    assert fault(sensor) is FaultCode.CLOCK


def test_a_clock_of_another_pace_than_told_is_a_fault(device, clock):
    device.page = PAGE.replace("<runrate>7000<", "<runrate>5000<")
    sensor = AtiNet(host=HOST)
    connect(sensor)
    read(sensor, clock, 3.0)
    assert fault(sensor) is FaultCode.CLOCK


@pytest.mark.parametrize(
    ("status", "code", "flag"),
    [
        (0x80020000, FaultCode.OVERLOAD, Status.SATURATED),
        (0x90000000, FaultCode.DEVICE_REPORTS, Status.DEVICE_FAULT),
        (0x80000000, FaultCode.DEVICE_REPORTS, Status.DEVICE_FAULT),
        (0x00000010, FaultCode.DEVICE_REPORTS, Status.DEVICE_FAULT),
    ],
)
def test_status_bits_are_faults_and_flags(sensor, device, clock, status, code, flag):
    read(sensor, clock, 0.01)
    device.status = status
    (sample,) = look(sensor, clock)
    assert sample.status == flag
    assert fault(sensor) is code


def test_beyond_the_calibrated_range_is_overload(sensor, device, clock):
    device.fz = lambda number: -991_000_000
    (sample,) = look(sensor, clock)
    assert sample.status == Status.OVERRANGE
    assert fault(sensor) is FaultCode.OVERLOAD


def test_a_stream_that_another_client_took_is_told(sensor, device, clock):
    read(sensor, clock, 0.05)
    device.silent = True
    read(sensor, clock, 0.3)
    assert sensor.fault().code is FaultCode.STALE
    assert "answers on its pages" in sensor.fault().message
    assert "another program" in sensor.fault().hint
    sensor.close()
    assert request(Command.STOP) not in device.requested  # it would stop the other one's stream
