"""What is latched, counted and handed over between reader and engine."""

import time

from stepload.rig.faults import FaultCode
from stepload_drivers.stream import FROZEN_COUNT, Stream


def stream(**options):
    return Stream("thing", 1e-3, **{"stale_s": 0.5, **options})


def test_drain_gives_each_sample_once_in_order():
    s = stream()
    s.put([1, 2], time.monotonic())
    s.put([3], time.monotonic())
    assert s.drain() == [1, 2, 3]
    assert s.drain() == []
    assert s.health().received == 3


def test_first_fault_wins():
    s = stream()
    s.latch(FaultCode.OVERLOAD, "a", "b")
    s.latch(FaultCode.STALE, "c", "d")
    assert s.fault().code is FaultCode.OVERLOAD


def test_stale_is_a_fault_without_any_event():
    s = stream(stale_s=0.02)
    s.put([1], time.monotonic() - 0.03)
    s.looked(time.monotonic())
    assert s.fault().code is FaultCode.STALE
    s.put([2], time.monotonic())
    assert s.fault().code is FaultCode.STALE


def test_a_stalled_host_is_not_a_stale_device():
    s = stream(stale_s=0.02)
    now_s = time.monotonic()
    s.put([1], now_s - 1.0)
    s.looked(now_s - 1.0)
    assert s.fault() is None


def test_a_reader_that_hangs_is_a_fault():
    s = stream(stale_s=0.02)
    s.put([1], time.monotonic() - 3.0)
    s.looked(time.monotonic() - 3.0)
    assert s.fault().code is FaultCode.DRIVER


def test_identical_readings_are_a_fault_after_their_time():
    s = stream(frozen_s=0.05, value_of=lambda sample: sample)
    now_s = time.monotonic()
    s.put([7.0] * 40, now_s)
    assert s.fault() is None
    s.put([7.0] * 20, now_s + 0.06)
    assert s.fault().code is FaultCode.STALE
    assert "same to the last bit" in s.fault().message


def test_a_few_identical_readings_of_a_slow_sensor_are_none():
    s = Stream("thing", 0.1, stale_s=5.0, frozen_s=0.05, value_of=lambda sample: sample)
    now_s = time.monotonic()
    for index in range(FROZEN_COUNT - 1):
        s.put([7.0], now_s + 0.1 * index)
    assert s.fault() is None


def test_single_damaged_frames_are_counted_many_in_a_second_stop():
    s = stream()
    s.corrupt("checksum", 5)
    assert s.fault() is None
    s.corrupt("checksum", 15)
    assert s.fault().code is FaultCode.CORRUPT
    assert s.health().errors == {"checksum": 20}


def test_nobody_drains_is_a_fault_not_endless_memory():
    s = Stream("thing", 1.0, stale_s=1e3)
    for _ in range(100):
        s.put([1], time.monotonic())
    assert s.fault().code is FaultCode.DRIVER
    assert len(s.drain()) < 70
