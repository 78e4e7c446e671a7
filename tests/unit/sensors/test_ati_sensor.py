"""The NETCANOEM driver in virtual time: dialogue, units, status word, saturation, counters."""

import math
import struct

import pytest
from driver_time import Clock
from read_sensor import connect, read

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.ati import sensor as ati_module
from stepload_drivers.ati.codec import GAUGE_HIGH, GAUGE_LOW, Op
from stepload_drivers.ati.sensor import AtiCan
from stepload_drivers.framing import CanFrame
from stepload_verify.emulators.ati import gauge_frames

BASE = 0x20


class Bus:
    """A NETCANOEM whose Fz is gauge 0 over 1000, in its force unit."""

    def __init__(self, clock):
        self.clock = clock
        self.where, self.damaged, self.closed = "bus", 0, False
        self.firmware, self.serial = (3, 8, 1), b"FT012345"
        self.units, self.counts_per_unit = (2, 3), (1000, 1000)
        self.matrix, self.late_rows = 1.0, 0
        self.status, self.silent = 0, False
        self.counts = [2000, 0, 0, 0, 0, 0]
        self.slot = None
        self.waiting: list[tuple[float, CanFrame]] = []
        self.noise = True

    def answer(self, op, data):
        at_s = self.clock.now_s + 0.0003
        self.waiting.append((at_s, CanFrame(BASE << 4 | op, data, at_s)))

    def send(self, identifier, data):
        op = Op(identifier & 0xF)
        if self.silent:
            return
        if op is Op.GAUGES:
            if self.noise:
                self.counts[1] = (self.counts[1] + 1) % 5
            for answer_op, half in zip(
                (Op.GAUGES, Op.GAUGES_2), gauge_frames(self.status, self.counts), strict=True
            ):
                self.answer(answer_op, half)
        elif op is Op.MATRIX:
            axis = max(0, data[0] - self.late_rows)
            z = struct.pack(">ff", self.matrix if axis == 2 else 0.0, 0.0)
            name = struct.pack(">ff", 0.0, axis)  # of gauge 5, which reads 0
            for answer_op, half in ((2, z), (3, bytes(8)), (4, name)):
                self.answer(answer_op, half)
        else:
            self.answer(op, {
                Op.FIRMWARE: struct.pack(">BBH", *self.firmware), Op.SERIAL: self.serial,
                Op.CALIBRATION: data if self.slot is None else bytes((self.slot,)),
                Op.COUNTS: struct.pack(">II", *self.counts_per_unit), Op.UNITS: bytes(self.units),
            }[op])  # fmt: skip

    def receive(self, timeout_s=0.1):
        end_s = self.clock.now_s + timeout_s
        if self.waiting and self.waiting[0][0] <= end_s:
            self.clock.sleep(self.waiting[0][0] - self.clock.now_s)
        else:
            self.clock.sleep(timeout_s)
        due = [frame for at_s, frame in self.waiting if at_s <= self.clock.now_s]
        self.waiting = self.waiting[len(due) :]
        return due

    def discard_input(self):
        self.waiting = []

    def close(self):
        self.closed = True


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed, ati_module)
    return clock


@pytest.fixture
def bus(clock, monkeypatch):
    bus = Bus(clock)
    monkeypatch.setattr(ati_module, "CanLink", lambda *arguments: bus)
    return bus


@pytest.fixture
def sensor(bus):
    sensor = AtiCan(channel="c")
    connect(sensor)
    return sensor


@pytest.mark.parametrize(("unit", "newton"), [(2, 2.0), (1, 8.896443230521), (5, 19.6133)])
def test_force_is_newton_by_the_devices_own_unit(bus, clock, unit, newton):
    bus.units = (unit, 3)
    sensor = AtiCan(channel="c")
    identity = connect(sensor)
    assert (identity.serial_number, identity.firmware) == ("FT012345", "3.8.1")
    assert read(sensor, clock, 0.02)[-1].wrench[2] == pytest.approx(newton)


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        ({"serial": b"FT000000"}, FaultCode.WRONG_DEVICE),
        ({"slot": 3}, FaultCode.REFUSED_COMMAND),
        ({"units": (9, 3)}, FaultCode.OUT_OF_RANGE),
        ({"units": (2, 9)}, FaultCode.OUT_OF_RANGE),
        ({"counts_per_unit": (0, 1000)}, FaultCode.OUT_OF_RANGE),
        ({"matrix": math.nan}, FaultCode.NOT_FINITE),
        ({"matrix": math.inf}, FaultCode.NOT_FINITE),
        ({"late_rows": 1}, FaultCode.CORRUPT),
        ({"status": 1 << 6}, FaultCode.DEVICE_REPORTS),
        ({"silent": True}, FaultCode.NOT_CONNECTED),
    ],
)
def test_a_device_that_is_not_as_wanted_is_refused(bus, spoil, code):
    for name, value in spoil.items():
        setattr(bus, name, value)
    with pytest.raises(DeviceError) as caught:
        connect(AtiCan(channel="c", serial_number="FT012345"))
    assert caught.value.code == code


def test_samples_come_at_the_polling_rate_stamped_when_they_came(sensor, clock):
    samples = read(sensor, clock, 0.2)
    assert len(samples) == pytest.approx(100, abs=3)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert {s.status for s in samples} == {0}
    assert samples[-1].receive_time_s <= clock.now_s
    assert sensor.health().lost == 0


@pytest.mark.parametrize("count", [GAUGE_LOW, GAUGE_HIGH])
@pytest.mark.parametrize("gauge", [0, 5])
def test_a_gauge_at_its_end_stop_is_flagged_and_latched(sensor, bus, clock, count, gauge):
    bus.noise = False
    bus.counts[gauge] = count
    assert {s.status for s in read(sensor, clock, 0.01)} == {int(Status.SATURATED)}
    assert sensor.fault().code is FaultCode.OVERLOAD


@pytest.mark.parametrize("bit", range(1, 8))
def test_critical_bits_are_flagged_and_latched(sensor, bus, clock, bit):
    bus.status = 1 << bit
    assert {s.status for s in read(sensor, clock, 0.01)} == {int(Status.DEVICE_FAULT)}
    assert sensor.fault().code is FaultCode.DEVICE_REPORTS


def test_unanswered_questions_are_lost_samples(sensor, bus, clock):
    samples = read(sensor, clock, 0.02)
    bus.silent = True
    samples += read(sensor, clock, 0.03)
    bus.silent = False
    samples += read(sensor, clock, 0.06)
    health = sensor.health()
    assert health.lost == samples[-1].sequence - len(samples) > 0
    assert health.errors["timeouts"] == health.lost
    assert health.errors["resyncs"] >= 1
