"""Load cells and gauges with lines of text, in virtual time: stamps, counts, faults, commands."""

import itertools
import math

import pytest
from driver_time import Clock, FakePort

from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.gauge.sensor import GaugeSerial
from stepload_drivers.line import sensor as line_module
from stepload_drivers.line.force import LineSerial
from stepload_drivers.streamed import Deadline
from stepload_drivers.units import UNITS_N

PERIOD_S = 0.01


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed, line_module)
    return clock


class Bench:
    """A driver on a fake port, read without a thread."""

    def __init__(self, monkeypatch, clock, kind, **options):
        self.clock, self.port = clock, FakePort(clock)
        self.requested = []
        monkeypatch.setattr(line_module, "SerialPort", self.opened)
        self.driver = kind(port="cell", **options)
        self.identity = self.driver._connect(Deadline(1.0))
        self.stream = self.driver._stream = self.driver._new_stream()

    def opened(self, path, baud, *, refuse_latency):
        self.requested.append((path, baud, refuse_latency))
        return self.port

    def read(self, seconds=0.0):
        """Look as the reader thread does, for `seconds`; what came."""
        end_s = self.clock.now_s + seconds
        while True:
            began_s = self.clock.now_s
            self.driver._read(self.stream)
            self.stream.looked(began_s)
            if self.clock.now_s >= end_s:
                return self.driver.drain()

    def lines(self, *texts, begin=b"\r"):
        """Each line a period after the one before."""
        for number, text in enumerate(texts):
            self.port.arrives(
                (number + 1) * PERIOD_S, (begin if not number else b"") + text + b"\r"
            )
        return self.read(len(texts) * PERIOD_S)


@pytest.fixture
def cell(monkeypatch, clock):
    def make(**options):
        options = {"range": 100.0, "rate": 1.0 / PERIOD_S, "unit": "N", **options}
        return Bench(monkeypatch, clock, LineSerial, **options)

    return make


@pytest.fixture
def gauge(monkeypatch, clock):
    return lambda **options: Bench(
        monkeypatch, clock, GaugeSerial, **{"rate": 1.0 / PERIOD_S, **options}
    )


@pytest.mark.parametrize("unit", UNITS_N)
def test_a_reading_is_one_sample_in_newton_along_z(cell, clock, unit):
    bench = cell(unit=unit, range=1e5)
    started_s = clock.now_s
    first, second = bench.lines(b"+2.5", b"-3.0")
    assert first.wrench == pytest.approx((0, 0, 2.5 * UNITS_N[unit], 0, 0, 0))
    assert second.wrench[2] == pytest.approx(-3.0 * UNITS_N[unit])
    assert (first.sequence, second.sequence) == (1, 2)
    assert (first.receive_time_s, second.receive_time_s) == pytest.approx(
        (started_s + PERIOD_S, started_s + 2 * PERIOD_S)
    )
    assert math.isnan(first.device_time_s)
    assert first.status == 0


def test_the_port_is_opened_as_the_plan_says_and_old_bytes_are_thrown_away(cell, gauge):
    bench = cell(baud=19200, model="LC", serial_number="7")
    assert bench.requested == [("cell", 19200, True)]  # no clock: an adapter with bursts is refused
    assert bench.port.discarded == 1
    assert (bench.identity.driver, bench.identity.model) == ("line_serial", "LC")
    assert bench.identity.serial_number == "7"
    assert gauge().requested == [("cell", 9600, False)]


def test_a_burst_is_spread_back_over_its_periods(cell, clock):
    bench = cell()
    bench.lines(b"1")
    bench.port.arrives(5 * PERIOD_S, b"1\r2\r3\r")
    samples = bench.read(6 * PERIOD_S)
    now_s = clock.now_s
    stamps = [sample.receive_time_s for sample in samples]
    assert stamps[-1] <= now_s
    steps_s = [b - a for a, b in itertools.pairwise(stamps)]
    assert steps_s == pytest.approx([PERIOD_S] * 2)


@pytest.mark.parametrize("force", [b"100.0", b"-100.0", b"250"])
def test_a_reading_of_the_rated_load_is_flagged_and_latched(cell, force):
    bench = cell()
    good, bad = bench.lines(b"99.9", force)
    assert good.status == 0
    assert bad.status == Status.OVERRANGE
    assert bench.driver.fault().code is FaultCode.OVERLOAD


@pytest.mark.parametrize("reading", [b"2.1", b"-2.1"])
def test_a_gauge_beyond_its_range_is_flagged_and_latched(gauge, reading):
    bench = gauge(range=2e-3)
    good, bad = bench.lines(b"2.0", reading)
    assert good.displacement_m == pytest.approx(2e-3)
    assert (good.status, bad.status) == (0, Status.OVERRANGE)
    assert bench.driver.fault().code is FaultCode.OUT_OF_RANGE


def test_a_slow_cell_has_five_periods(cell):
    bench = cell(rate=10.0)
    bench.lines(b"1")
    bench.read(0.45)
    assert bench.driver.fault() is None
    bench.read(0.15)
    assert bench.driver.fault().code is FaultCode.STALE


def test_a_frozen_cell_is_a_fault_and_a_gauge_at_rest_is_none(cell, gauge):
    bench = cell(frozen=0.5)
    bench.lines(*[b"1.25"] * 50)
    assert bench.driver.fault() is None
    bench.lines(*[b"1.25"] * 5, begin=b"")
    assert bench.driver.fault().code is FaultCode.STALE
    bench = gauge()
    bench.lines(*[b"1.25"] * 200)
    assert bench.driver.fault() is None


def test_lost_lines_show_in_sequence_and_health(cell):
    bench = cell()
    numbers = []
    for index in range(200):
        bench.port.arrives(PERIOD_S, b"\r%d.5\r" % (index % 7) if index != 120 else b"")
        numbers += [sample.sequence for sample in bench.read()]
    assert bench.driver.health().lost == 1
    assert numbers[-1] == 200


def test_requests_go_out_at_the_rate_and_a_missing_answer_is_a_lost_sample(cell, clock):
    bench = cell(request=r"?\r", max_age=1.0)
    bench.port.arrives(0.004, b"1.0\r")
    (first,) = bench.read()
    bench.read(0.06)
    requested_s = [time_s - bench.port.written[0][0] for time_s, data in bench.port.written]
    assert {data for _, data in bench.port.written} == {b"?\r"}
    assert requested_s[1] >= 0.999 * PERIOD_S
    assert len(requested_s) == 3
    bench.port.arrives(0.001, b"2.0\r")
    (second,) = bench.read()
    health = bench.driver.health()
    assert health.errors["timeouts"] == health.lost == second.sequence - first.sequence - 1


def test_bias_sends_the_zero_command_where_there_is_one(cell):
    bench = cell(zero=r"Z\r")
    assert bench.driver.bias(1.0) is True
    assert [data for _, data in bench.port.written] == [b"Z\r"]
    bench.driver._disconnect()
    assert bench.driver.bias(1.0) is False
    bench = cell()
    assert bench.driver.bias(1.0) is False
    assert bench.port.written == []
