"""What each sensor driver reports for each fault of its device or its wire."""

import itertools

import pytest

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status

UART, BOTA, CAN, ATI = "robotous_uart", "bota_serial", "robotous_can", "ati_can"
LINE, NET = "line_serial", "ati_net"
TCP = {"transport": "socketcand"}

LATCHED = [
    (BOTA, {}, "bit_flip", 0.3, FaultCode.CORRUPT),
    (BOTA, {}, "noise", 0.3, FaultCode.CORRUPT),
    (BOTA, {}, "cut", 0.3, FaultCode.CORRUPT),
    (BOTA, {}, "silent", 1.0, FaultCode.STALE),
    (BOTA, {}, "freeze", 1.0, FaultCode.STALE),
    (BOTA, {}, "zero", 1.0, FaultCode.STALE),
    (BOTA, {}, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (BOTA, {}, "overrange", 2.0, FaultCode.OVERLOAD),
    (BOTA, {}, "status", 2.0, FaultCode.DEVICE_REPORTS),
    (BOTA, {}, "nan", 1.0, FaultCode.NOT_FINITE),
    (BOTA, {}, "clock_stop", 1.0, FaultCode.CLOCK),
    (BOTA, {}, "clock_jump", 30.0, FaultCode.CLOCK),
    (UART, {}, "bit_flip", 0.3, FaultCode.CORRUPT),
    (UART, {}, "noise", 0.3, FaultCode.CORRUPT),
    (UART, {}, "silent", 1.0, FaultCode.STALE),
    (UART, {}, "freeze", 1.0, FaultCode.STALE),
    (UART, {}, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (UART, {}, "overrange", 2.0, FaultCode.OVERLOAD),
    (CAN, {}, "torn", 0.3, FaultCode.CORRUPT),
    (CAN, {}, "noise", 0.3, FaultCode.CORRUPT),
    (CAN, {}, "zero", 1.0, FaultCode.STALE),
    (CAN, {}, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (CAN, TCP, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (CAN, TCP, "silent", 1.0, FaultCode.STALE),
    (ATI, {}, "overrange", 3.0, FaultCode.OVERLOAD),
    (ATI, {}, "status", 6.0, FaultCode.DEVICE_REPORTS),
    (ATI, {}, "torn", 0.5, FaultCode.CORRUPT),
    (ATI, {}, "drop", 1.0, FaultCode.STALE),
    (ATI, {}, "freeze", 1.0, FaultCode.STALE),
    (ATI, {}, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (ATI, TCP, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (NET, {}, "overrange", 2.0, FaultCode.OVERLOAD),
    (NET, {}, "status", 17.0, FaultCode.OVERLOAD),
    (NET, {}, "status", 28.0, FaultCode.DEVICE_REPORTS),
    (NET, {}, "cut", 0.3, FaultCode.CORRUPT),
    (NET, {}, "silent", 1.0, FaultCode.STALE),
    (NET, {}, "second_client", 1.0, FaultCode.STALE),
    (NET, {}, "restart", 1.0, FaultCode.STALE),
    (NET, {}, "freeze", 1.0, FaultCode.STALE),
    (NET, {}, "zero", 1.0, FaultCode.STALE),
    (NET, {}, "unplug", 1.0, FaultCode.STALE),
    (NET, {}, "clock_stop", 1.0, FaultCode.CLOCK),
    (NET, {}, "clock_jump", 30.0, FaultCode.CLOCK),
    (LINE, {}, "noise", 1.0, FaultCode.CORRUPT),
    (LINE, {}, "nan", 1.0, FaultCode.CORRUPT),
    (LINE, {}, "silent", 1.0, FaultCode.STALE),
    (LINE, {}, "freeze", 1.0, FaultCode.STALE),
    (LINE, {}, "unplug", 1.0, FaultCode.NOT_CONNECTED),
    (LINE, {}, "overrange", 2.0, FaultCode.OVERLOAD),
    (LINE, {"request": "?\\r"}, "silent", 1.0, FaultCode.STALE),
]


@pytest.mark.parametrize(
    ("name", "device", "fault", "magnitude", "code"),
    LATCHED,
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_fault_is_latched_with_its_code(emulated, name, device, fault, magnitude, code):
    with emulated(name, device=device) as pair:
        pair.run(0.05)
        assert pair.driver.fault() is None
        pair.emulator.board.switch_on(fault, magnitude)
        assert pair.until(lambda: pair.driver.fault() is not None)
        latched = pair.driver.fault()
        assert latched.code is code, latched.message
        assert latched.hint
        pair.emulator.board.clear()
        pair.run(0.05)
        assert pair.driver.fault() == latched


def test_samples_in_overload_are_flagged_one_by_one(emulated):
    with emulated(UART) as pair:
        pair.run(0.1)
        pair.emulator.board.switch_on("overrange", 2.0)
        assert pair.until(lambda: pair.driver.fault() is not None)
        pair.run(0.05)
        rated_n = 200.0
        for sample in pair.samples:
            assert bool(sample.status & Status.OVERRANGE) == (sample.wrench[2] > 1.2 * rated_n)


def test_no_value_is_repeated_after_an_unplug(emulated):
    with emulated(BOTA) as pair:
        pair.emulator.board.switch_on("unplug")
        assert pair.until(lambda: pair.driver.fault() is not None)
        pair.driver.drain()
        pair.samples.clear()
        pair.run(0.05)
        assert pair.samples == []


COUNTED = [
    (BOTA, "status", 0.0, "app_took_too_long"),
    (BOTA, "noise", 0.01, "checksum"),
    (BOTA, "bit_flip", 0.01, "checksum"),
    (UART, "cut", 0.01, "damaged"),
    (CAN, "torn", 0.01, "orphans"),
    (CAN, "cut", 0.01, "damaged"),
    (ATI, "status", 14.0, "status_bits"),
    (ATI, "drop", 0.02, "timeouts"),
    (ATI, "torn", 0.01, "orphans"),
    (NET, "cut", 0.01, "length"),
    (NET, "status", 16.0, "status_bits"),
]


@pytest.mark.parametrize(("name", "fault", "magnitude", "error"), COUNTED)
def test_rare_damage_is_counted_and_survived(emulated, name, fault, magnitude, error):
    with emulated(name) as pair:
        pair.run(0.05)
        pair.emulator.board.switch_on(fault, magnitude)
        assert pair.until(lambda: pair.driver.health().errors.get(error, 0) > 0)
        pair.emulator.board.clear()
        before = pair.driver.health().received
        assert pair.until(lambda: pair.driver.health().received > before + 50)
        assert pair.driver.fault() is None


@pytest.mark.parametrize("name", [BOTA, NET])
def test_every_dropped_frame_is_counted(emulated, name):
    with emulated(name) as pair:
        pair.run(0.1)
        pair.emulator.board.switch_on("drop", 0.05)
        pair.run(0.5)
        pair.emulator.board.clear()
        pair.run(0.1)
        dropped = pair.emulator.spoiled
        assert dropped > 0
        assert pair.driver.health().lost == dropped
        first, last = pair.samples[0], pair.samples[-1]
        assert last.sequence - first.sequence + 1 == len(pair.samples) + dropped


def test_ati_late_answers_do_not_shift_the_pairs(emulated):
    with emulated(ATI) as pair:
        pair.run(0.1)
        pair.emulator.board.switch_on("late", 0.03)
        assert pair.until(lambda: pair.driver.health().errors.get("resyncs", 0) > 0)
        pair.emulator.board.clear()
        before = pair.driver.health().received
        assert pair.until(lambda: pair.driver.health().received > before + 100)
        assert pair.driver.health().lost > 0
        assert pair.driver.fault() is None


@pytest.mark.parametrize(("name", "tick_s"), [(BOTA, 1e-6), (NET, 1 / 7000.0)])
def test_the_device_clock_goes_on_over_its_wrap(emulated, name, tick_s):
    with emulated(name, faults=("wrap",)) as pair:
        pair.run(1.3)
        times = [sample.device_time_s for sample in pair.samples]
        assert times[0] < 2**32 * tick_s < times[-1]
        steps = [b - a for a, b in itertools.pairwise(times)]
        assert max(steps) < 2e-3
        assert pair.driver.fault() is None


def test_zero_drift_comes_through_unchanged(emulated):
    with emulated(BOTA, peak_n=0.0) as pair:
        pair.emulator.board.switch_on("drift", 6000.0)
        pair.run(0.3)
        force_n = [sample.wrench[2] for sample in pair.samples]
        assert force_n[-1] - force_n[0] > 10.0


@pytest.mark.parametrize("name", [UART, CAN, BOTA, ATI, NET])
def test_another_serial_number_is_refused(emulated, name):
    with emulated(name, open_it=False, serial_number="SOMEONE ELSE") as pair:
        with pytest.raises(DeviceError, match="SOMEONE ELSE") as caught:
            pair.driver.open(2.0)
        assert caught.value.code == FaultCode.WRONG_DEVICE


def test_rft_of_unknown_model_is_refused_because_its_divider_is_unknown(emulated):
    with emulated(UART, faults=("wrong_model",), open_it=False) as pair:
        with pytest.raises(DeviceError, match="RFT76-HA01") as caught:
            pair.driver.open(2.0)
        assert caught.value.code == FaultCode.UNSUPPORTED
