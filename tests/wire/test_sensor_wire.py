"""Sensor drivers and their emulators when all is well: settings, values, nothing lost."""

import math
import socket
import statistics

import pytest

from stepload.errors import DeviceError
from stepload.rig import usb
from stepload.rig.faults import FaultCode
from stepload_drivers.ati.net import AtiNet
from stepload_drivers.ati.rdt import Record
from stepload_drivers.ati.sensor import AtiCan
from stepload_drivers.bota.sensor import BotaSerial
from stepload_drivers.line.force import LineSerial
from stepload_drivers.robotous.sensor import RobotousCan, RobotousUart
from stepload_verify.emulators.ati_net import encode
from stepload_verify.emulators.catalog import driver_options

TCP = {"transport": "socketcand"}
SENSORS = [
    ("robotous_uart", {}),
    ("robotous_can", {}),
    ("robotous_can", TCP),
    ("bota_serial", {}),
    ("ati_can", {}),
    ("ati_can", TCP),
    ("ati_net", {}),
    ("ati_net", {"rate_hz": 7000.0, "units": "lbf"}),
    ("line_serial", {"unit": "lbf"}),
    ("line_serial", {"request": "?\\r", "unit": "mN"}),
]


@pytest.mark.parametrize(("name", "device"), SENSORS)
def test_every_sample_arrives_once(emulated, name, device):
    with emulated(name, device=device) as pair:
        assert pair.until(lambda: len(pair.samples) > 0.5 * pair.driver.rate_hz)
        health = pair.driver.health()
        assert pair.driver.fault() is None
        assert health.lost == 0
        assert health.errors == {}
        numbers = [sample.sequence for sample in pair.samples]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
        stamps = [sample.device_time_s for sample in pair.samples]
        if math.isfinite(stamps[0]):
            rate_hz = (len(stamps) - 1) / (stamps[-1] - stamps[0])
            assert rate_hz == pytest.approx(pair.driver.rate_hz, rel=0.1)


@pytest.mark.parametrize(("name", "device"), SENSORS)
def test_force_comes_through_in_newton(emulated, name, device):
    with emulated(name, device=device, peak_n=0.0) as pair:
        pair.emulator.board.switch_on("offset", 50.0)
        pair.run(0.05)
        pair.samples.clear()
        pair.run(0.2)
        axes = zip(*(sample.wrench for sample in pair.samples), strict=True)
        means = [statistics.fmean(axis) for axis in axes]
        assert means == pytest.approx([0.0, 0.0, 50.0, 0.0, 0.0, 0.0], abs=0.05)


@pytest.mark.parametrize("name", ["robotous_uart", "line_serial", "ati_net"])
def test_bias_is_the_devices_own_zero(emulated, name):
    with emulated(name, peak_n=0.0) as pair:
        pair.emulator.board.switch_on("offset", 30.0)
        pair.run(0.05)
        assert pair.driver.bias(1.0) is True
        pair.run(0.1)
        pair.samples.clear()
        pair.run(0.1)
        assert abs(statistics.fmean(s.wrench[2] for s in pair.samples)) < 0.3


@pytest.mark.parametrize(("name", "device"), [("robotous_uart", {}), ("robotous_can", TCP)])
def test_rft_that_still_streams_from_last_time_is_opened(emulated, name, device):
    with emulated(name, device=device) as pair:
        pair.driver._link.close()  # as if the program had been killed: no stop is sent
        pair.driver._link = None
        pair.driver.close()
        assert pair.emulator.device.period_s is not None
        again = type(pair.driver)(**driver_options(pair.emulator))
        try:
            assert again.open(2.0).model == "RFT64-SB01"
        finally:
            again.close()


def test_a_net_box_sends_to_one_client_and_a_new_one_takes_it(emulated):
    with emulated("ati_net") as pair:
        again = AtiNet(**driver_options(pair.emulator))
        try:
            again.open(5.0)
            assert pair.until(lambda: pair.driver.fault() is not None)
            assert pair.driver.fault().code is FaultCode.STALE
            assert "answers on its pages" in pair.driver.fault().message
            pair.driver.close()
            before = again.health().received
            assert pair.until(lambda: again.health().received > before + 10)
            assert again.fault() is None
        finally:
            again.close()


def test_datagrams_of_strangers_are_not_taken(emulated):
    with emulated("ati_net") as pair:
        own = pair.driver._link._sock.getsockname()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            for number in range(100):
                stranger.sendto(encode(Record(number, number, 0, (10**9,) * 6)), own)
        pair.run(0.1)
        assert pair.driver.fault() is None
        assert max(sample.wrench[0] for sample in pair.samples) < 1.0


@pytest.mark.parametrize(
    ("fault", "magnitude", "code"),
    [
        ("overrange", 2.0, FaultCode.OUT_OF_RANGE),
        ("nan", 1.0, FaultCode.CORRUPT),
        ("silent", 1.0, FaultCode.STALE),
        ("unplug", 1.0, FaultCode.NOT_CONNECTED),
    ],
)
def test_gauge_faults(emulated, fault, magnitude, code):
    with emulated("gauge_serial", device={"rate_hz": 100.0}, rate=100.0, range=0.02) as pair:
        pair.emulator.board.switch_on(fault, magnitude)
        assert pair.until(lambda: pair.driver.fault() is not None)
        assert pair.driver.fault().code is code


def test_gauge_at_rest_is_not_frozen(emulated):
    with emulated("gauge_serial", device={"rate_hz": 100.0}, rate=100.0) as pair:
        pair.emulator.board.switch_on("freeze")
        pair.run(0.4)
        assert pair.driver.fault() is None


def test_a_port_is_never_shared(emulated):
    with emulated("bota_serial") as pair:
        with pytest.raises(DeviceError, match="lock") as caught:
            BotaSerial(port=pair.emulator.address).open(1.0)
        assert caught.value.code == FaultCode.NOT_CONNECTED
        pair.run(0.1)
        assert pair.driver.fault() is None


def test_a_server_that_says_nothing_is_given_up_in_time():
    with socket.create_server(("127.0.0.1", 0)) as server:
        channel = f"127.0.0.1:{server.getsockname()[1]}/can0"
        sensor = RobotousCan(interface="socketcand", channel=channel)
        with pytest.raises(DeviceError) as caught:
            sensor.open(0.3)
        assert caught.value.code == FaultCode.NOT_CONNECTED


@pytest.fixture
def slow_adapter(monkeypatch, tmp_path):
    """Makes every port look like a USB adapter with the factory's latency timer."""

    def install(port):
        folder = tmp_path / port.rsplit("/", 1)[1]
        folder.mkdir(exist_ok=True)
        (folder / "latency_timer").write_text("16\n")
        monkeypatch.setattr(usb, "USB_SERIAL", tmp_path)

    return install


def test_slow_usb_adapter_is_refused_without_a_device_clock(emulated, slow_adapter):
    for name in ("robotous_uart", "robotous_can", "line_serial"):
        with emulated(name, open_it=False) as pair:
            slow_adapter(pair.emulator.address)
            with pytest.raises(DeviceError, match="16 ms") as caught:
                pair.driver.open(1.0)
            assert caught.value.code == FaultCode.UNSUPPORTED


@pytest.mark.parametrize(
    "make",
    [
        lambda: BotaSerial(port="/dev/nowhere"),
        lambda: RobotousUart(port="/dev/nowhere"),
        lambda: LineSerial(port="/dev/nowhere", range=1.0, rate=1.0, unit="N"),
        lambda: RobotousCan(channel="/dev/nowhere", interface="slcan"),
        lambda: RobotousCan(channel="127.0.0.1:9/can0", interface="socketcand"),
        lambda: AtiNet(host="127.0.0.1", http_port=9),
        lambda: AtiNet(host="no.such.host.invalid"),
        lambda: AtiCan(channel="nowhere", interface="no_such_interface"),
    ],
)
def test_missing_ports_are_not_connected(make):
    with pytest.raises(DeviceError) as caught:
        make().open(0.5)
    assert caught.value.code == FaultCode.NOT_CONNECTED
