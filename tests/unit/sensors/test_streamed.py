"""What all stream drivers share: open, the reader thread's end, close; and the serial port."""

from types import SimpleNamespace

import pytest
import serial
from driver_time import Clock

from stepload.errors import DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload_drivers import serialport, streamed
from stepload_drivers import stream as stream_module
from stepload_drivers.serialport import SerialPort
from stepload_drivers.stream import BACKLOG_S, READER_S, Stream
from stepload_drivers.streamed import Deadline, Streamed, require_serial_number


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    clock.install(monkeypatch, stream_module, streamed)
    monkeypatch.setattr(streamed, "prefer_this_thread", lambda: None)
    return clock


class Sensor(Streamed[int], ForceSensor):
    """Puts one sample, then does what the test wants."""

    def __init__(self, then=None):
        self.then = then or (lambda stream: None)
        self.given_back = 0

    def _connect(self, deadline):
        return Identity("d", "m", "s", "f", "c")

    def _new_stream(self):
        return Stream("thing", 1e-3, stale_s=0.1)

    def _read(self, stream):
        stream.put([1], streamed.time.monotonic())
        self.then(stream)

    def _disconnect(self):
        self.given_back += 1
        raise OSError("unplugged already")


@pytest.fixture
def in_thread(monkeypatch):
    """Readers run in the caller's thread when they are started."""
    reader = streamed.Reader

    def make(sensor, stream):
        made = reader(sensor, stream)
        return SimpleNamespace(start=made.run, stop=made._halt.set)

    monkeypatch.setattr(streamed, "Reader", make)


def dies_of(error):
    def then(stream):
        raise error

    return then


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (DeviceError("unplugged", code=FaultCode.NOT_CONNECTED), FaultCode.NOT_CONNECTED),
        (ZeroDivisionError("oops"), FaultCode.DRIVER),
    ],
)
def test_whatever_the_reader_dies_of_is_the_fault_and_open_gives_the_port_back(
    clock, in_thread, error, code
):
    sensor = Sensor(dies_of(error))
    with pytest.raises(DeviceError) as caught:
        sensor.open(1.0)
    assert caught.value.code == code
    assert sensor.given_back == 2  # before, in case it was open; and after


def test_a_connection_that_fails_or_is_interrupted_is_closed(clock):
    for error in (DeviceError("no", code=FaultCode.NOT_CONNECTED), KeyboardInterrupt()):
        sensor = Sensor()
        sensor._connect = lambda deadline, error=error: dies_of(error)(None)
        with pytest.raises(type(error)):
            sensor.open(1.0)
        assert sensor.given_back == 2


def test_a_deadline_tells_what_was_waited_for(clock):
    deadline = Deadline(0.5)
    assert deadline.left_s("x") == pytest.approx(0.5)
    assert deadline.running
    clock.sleep(0.5)
    assert not deadline.running
    with pytest.raises(DeviceError, match=r"the banner: not there within 0.5 s"):
        deadline.left_s("the banner")


def test_another_serial_number_is_another_device():
    require_serial_number("s", "7", "7")
    require_serial_number("s", "7", "")
    with pytest.raises(DeviceError) as caught:
        require_serial_number("s", "7", "8")
    assert caught.value.code == FaultCode.WRONG_DEVICE


# the stream, in virtual time


def test_staleness_counts_up_to_the_last_look_and_at_the_limit(clock):
    stream = Stream("thing", 1e-3, stale_s=0.1)
    stream.put([1], clock.now_s)
    clock.sleep(0.099)
    stream.looked(clock.now_s)
    assert stream.fault() is None
    clock.sleep(0.011)
    assert stream.fault() is None
    stream.looked(clock.now_s)
    assert stream.fault().code is FaultCode.STALE
    assert stream.fault().time_s == clock.now_s


def test_a_reader_that_looks_no_more_is_a_fault_at_its_limit(clock):
    stream = Stream("thing", 1e-3, stale_s=10.0)
    stream.put([1], clock.now_s)
    stream.looked(clock.now_s)
    clock.sleep(0.9 * READER_S)
    assert stream.fault() is None
    clock.sleep(0.2 * READER_S)
    assert stream.fault().code is FaultCode.DRIVER


def test_damaged_frames_are_a_fault_only_within_their_window(clock):
    stream = Stream("thing", 0.1, stale_s=10.0)
    for _ in range(20):
        stream.corrupt("checksum")
        clock.sleep(0.26)
    assert stream.fault() is None
    for _ in range(5):
        stream.corrupt("checksum")
    assert stream.fault().code is FaultCode.CORRUPT
    assert stream.health().errors == {"checksum": 25}


def test_what_nobody_drains_is_lost_and_counted(clock):
    stream = Stream("thing", 1.0, stale_s=1e3)
    for _ in range(100):
        stream.put([1], clock.now_s)
    held = len(stream.drain())
    assert BACKLOG_S <= held <= BACKLOG_S + 3
    assert stream.health().lost == 100 - held
    assert stream.fault().code is FaultCode.DRIVER


# the serial port


class Tty:
    """A pyserial port; `fails` is raised by what is called next."""

    def __init__(self, path, baud, **options):
        self.options = {"path": path, "baud": baud, **options}
        self.fails = None
        self.closed = False
        self.in_waiting = 3
        self.written = b""

    def _check(self):
        if self.fails is not None:
            raise self.fails

    def fileno(self):
        self._check()
        return 7

    def read(self, size):
        self._check()
        return b"abc"[:size]

    def write(self, data):
        self._check()
        self.written += data

    def reset_input_buffer(self):
        self._check()

    def set_low_latency_mode(self, on):
        raise ValueError("a pty")

    def close(self):
        self.closed = True


@pytest.fixture
def tty(monkeypatch):
    made = []

    def make(*arguments, **options):
        made.append(Tty(*arguments, **options))
        return made[-1]

    monkeypatch.setattr(serialport.serial, "Serial", make)
    monkeypatch.setattr(
        serialport, "select", SimpleNamespace(select=lambda *arguments: (["there"], [], []))
    )
    return made


def test_a_port_is_opened_for_us_alone(tty):
    port = SerialPort("/dev/x", 9600, refuse_latency=True)
    assert tty[0].options["exclusive"] is True
    assert (tty[0].options["path"], tty[0].options["baud"]) == ("/dev/x", 9600)
    assert port.read() == b"abc"
    port.write(b"z")
    assert tty[0].written == b"z"


@pytest.mark.parametrize("error", [serial.SerialException("gone"), OSError("gone"), TypeError()])
@pytest.mark.parametrize("call", ["read", "write", "discard_input"])
def test_a_port_that_goes_away_is_not_connected(tty, error, call):
    if call == "discard_input" and isinstance(error, TypeError):
        return
    port = SerialPort("/dev/x", 9600, refuse_latency=True)
    tty[0].fails = error
    arguments = (b"z",) if call == "write" else ()
    with pytest.raises(DeviceError) as caught:
        getattr(port, call)(*arguments)
    assert caught.value.code == FaultCode.NOT_CONNECTED


@pytest.mark.parametrize("error", [serial.SerialException("busy"), OSError(), ValueError("baud")])
def test_a_port_that_cannot_be_opened_is_not_connected(monkeypatch, error):
    def refuse(*arguments, **options):
        raise error

    monkeypatch.setattr(serialport.serial, "Serial", refuse)
    with pytest.raises(DeviceError) as caught:
        SerialPort("/dev/x", 9600, refuse_latency=True)
    assert caught.value.code == FaultCode.NOT_CONNECTED
