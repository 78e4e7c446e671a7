"""The Bota driver in virtual time: dialogue, clock, flags, faults."""

import math

import pytest
from driver_time import Clock, FakePort
from read_sensor import connect, read

from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.bota import sensor as bota_module
from stepload_drivers.bota import sensor as dialogue
from stepload_drivers.bota.codec import Frame, FrameStatus
from stepload_drivers.bota.sensor import BotaSerial
from stepload_verify.emulators.bota import encode

BANNER = b"App Init\r\nname: SensONE\r\nS/N: B7\r\nFW version: 1.2\r\n"


class Sensor(FakePort):
    """Answers the dialogue, then streams a frame a period while `streams`."""

    def __init__(self, clock):
        super().__init__(clock)
        self.period_s = 0.001
        self.refuses = ""
        self.streams = False
        self.next_s = math.inf
        self.sent = 0
        self.clock_us = lambda: round(self.sent * self.period_s * 1e6)
        self.frame = lambda: Frame(0, (0.1, 0.2, -30.0 + 1e-3 * self.sent, 0, 0, 0),
                                   self.clock_us(), 25.0)  # fmt: skip
        self.spoil = lambda data: data
        self.received = ""

    def write(self, data):
        super().write(data)
        self.received += data.decode()
        if self.received.endswith("#"):
            self.streams = False
            self.arrives(0.01, BANNER)
        elif self.received.endswith("C"):
            self.reply("C")
        elif self.received.endswith("c,0,1,0,4"):
            self.reply("c")
        elif "f," in self.received and self.received.endswith(("0,0,1", "0,0,0")):
            self.reply("f")
        elif self.received.endswith("R"):
            self.reply("R")
            self.streams, self.next_s = True, self._clock.now_s + 0.01

    def reply(self, letter):
        self.received = ""
        self.arrives(0.001, f"r,0,{letter},{1 if letter == self.refuses else 0}".encode())

    def read(self, timeout_s=0.05):
        end_s = self._clock.now_s + timeout_s
        while self.streams and self.next_s <= end_s and not self.arriving:
            self.sent += 1
            self.arriving.append((self.next_s, self.spoil(encode(self.frame()))))
            self.next_s += self.period_s
        return super().read(timeout_s)


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed, bota_module, dialogue)
    return clock


@pytest.fixture
def device(clock, monkeypatch):
    device = Sensor(clock)
    monkeypatch.setattr(bota_module, "SerialPort", lambda path, baud, refuse_latency: device)
    return device


@pytest.fixture
def sensor(device):
    sensor = BotaSerial(port="p")
    connect(sensor)
    return sensor


def fault(sensor):
    return sensor.fault().code if sensor.fault() else None


def test_identity_and_rate_are_the_devices_own(device):
    sensor = BotaSerial(port="p", serial_number="B7")
    identity = connect(sensor)
    assert (identity.model, identity.serial_number, identity.firmware) == ("SensONE", "B7", "1.2")
    assert sensor.rate_hz == 1000.0


def test_samples_have_force_and_both_times(sensor, device, clock):
    samples = read(sensor, clock, 0.05)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert samples[-1].wrench[2] == pytest.approx(-30.0 + 1e-3 * device.sent)
    assert samples[-1].device_time_s == pytest.approx(device.sent * 1e-3)
    assert samples[-1].receive_time_s == pytest.approx(clock.now_s)
    assert samples[-1].temperature_c == 25.0
    assert {s.status for s in samples} == {0}
    assert sensor.health().lost == 0


@pytest.mark.parametrize("speed_and_jump_us", [(0, 0), (1000, 2_100_000)])
def test_a_clock_that_stands_or_jumps_is_a_fault(device, clock, speed_and_jump_us):
    sensor = BotaSerial(port="p", max_age=5.0)  # the watch over both clocks would come late
    connect(sensor)
    read(sensor, clock, 0.01)
    at, (speed, jump_us) = device.sent, speed_and_jump_us
    device.clock_us = lambda: at * 1000 + speed * (device.sent - at) + jump_us
    read(sensor, clock, 0.005)
    assert fault(sensor) is FaultCode.CLOCK


@pytest.mark.parametrize("factor", [0.7, 1.3])
def test_a_clock_that_runs_away_from_the_hosts_is_a_fault(sensor, device, clock, factor):
    read(sensor, clock, 0.5)
    at = device.sent
    device.clock_us = lambda: round((at + factor * (device.sent - at)) * 1000)
    read(sensor, clock, 1.0)
    assert fault(sensor) is None
    read(sensor, clock, 1.0)
    assert fault(sensor) is FaultCode.CLOCK


@pytest.mark.parametrize(
    ("word", "status", "code"),
    [
        (FrameStatus.OVERRANGE, Status.OVERRANGE, FaultCode.OVERLOAD),
        (FrameStatus.INVALID, Status.INVALID, FaultCode.DEVICE_REPORTS),
        (FrameStatus.RAW, Status.INVALID, FaultCode.DEVICE_REPORTS),
        (FrameStatus.APP_TOOK_TOO_LONG, 0, None),
    ],
)
def test_status_bits_flag_the_sample_and_latch(sensor, device, clock, word, status, code):
    device.frame = lambda: Frame(word, (0, 0, 1.0 + device.sent, 0, 0, 0), device.clock_us(), 25.0)
    assert {s.status for s in read(sensor, clock, 0.005)} == {int(status)}
    assert fault(sensor) is code
    if code is None:
        assert sensor.health().errors["app_took_too_long"] > 0
