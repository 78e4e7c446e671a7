"""The sensor in the flange of an e-Series arm as a force sensor, in virtual time."""

from __future__ import annotations

import pytest
from driver_time import Clock
from read_sensor import connect, look, read
from ur_fakes import HOME

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload.rig.samples import Status
from stepload_drivers import stream as stream_module
from stepload_drivers import streamed
from stepload_drivers.ur import force
from stepload_drivers.ur.force import UrForce
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState

HOST = "10.0.0.2"


class Controller:
    """A package every 2 ms of the clock, two at once; what it tells can be changed."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.told_version, self.started_hz, self.closed = (5, 12, 6, 0), 0.0, False
        self.identity = ["20235500001", "UR10"]
        self.stamp_s, self.step_s = 1000.0, 0.002
        self.force_n = lambda: 1.0 + (self.stamp_s * 500.0) % 7.0
        self.robot_mode = ROBOT_RUNNING
        self.error: DeviceError | None = None

    def version(self) -> tuple[int, ...]:
        return self.told_version

    def start(self, rate_hz: float) -> None:
        self.started_hz = rate_hz

    def arrived(self, timeout_s: float) -> list[UrState]:
        self._clock.sleep(0.004)
        if self.error is not None:
            raise self.error
        return [self._package(), self._package()]

    def _package(self) -> UrState:
        self.stamp_s += self.step_s
        wrench = (0.1, 0.2, self.force_n(), 0.01, 0.02, 0.03)
        return UrState(self.stamp_s, HOME, wrench, self.robot_mode, 1, PLAYING, 1)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def controller(clock, monkeypatch) -> Controller:
    clock.install(monkeypatch, stream_module, streamed, force)
    controller = Controller(clock)
    monkeypatch.setattr(force, "RtdeClient", lambda host, deadline_s: controller)
    monkeypatch.setattr(force, "dashboard", lambda host, words, deadline_s: controller.identity)
    return controller


@pytest.fixture
def sensor(controller) -> UrForce:
    sensor = UrForce(host=HOST)
    connect(sensor)
    return sensor


def fault(sensor: UrForce) -> FaultCode | None:
    found = sensor.fault()
    return found.code if found else None


def test_samples_carry_the_controllers_clock(sensor, clock):
    samples = read(sensor, clock, 0.1)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert samples[0].wrench[:2] == (0.1, 0.2)
    assert samples[1].receive_time_s - samples[0].receive_time_s == pytest.approx(0.002)
    assert samples[-1].receive_time_s == pytest.approx(clock.now_s)
    assert fault(sensor) is None


@pytest.mark.parametrize("version", [(3, 15, 4, 0), (5, 3, 0, 0), (10, 7, 0, 0)])
def test_controllers_without_such_a_sensor_are_refused(controller, version):
    controller.told_version = version
    with pytest.raises(DeviceError, match="not supported") as caught:
        connect(UrForce(host=HOST))
    assert caught.value.code == FaultCode.UNSUPPORTED


@pytest.mark.parametrize(("model", "range_n"), [("UR3", 30.0), ("UR5", 50.0), ("UR10", 100.0)])
def test_a_reading_of_the_models_range_is_an_overload(controller, clock, model, range_n):
    controller.identity[1] = model
    sensor = UrForce(host=HOST)
    connect(sensor)
    controller.force_n = lambda: -range_n + 0.1
    assert look(sensor, clock)[0].status == 0
    controller.force_n = lambda: -range_n
    assert look(sensor, clock)[0].status == Status.OVERRANGE
    assert fault(sensor) is FaultCode.OVERLOAD


def test_lost_packages_are_counted_by_the_controllers_clock(sensor, controller, clock):
    read(sensor, clock, 0.02)
    controller.stamp_s += 0.006
    look(sensor, clock)
    assert sensor.health().lost == 3


def test_the_same_package_again_is_no_sample_and_goes_stale(sensor, controller, clock):
    read(sensor, clock, 0.02)
    controller.step_s = 0.0
    assert read(sensor, clock, 0.2) == []
    assert sensor.health().errors["repeated"] > 10
    assert fault(sensor) is FaultCode.STALE


@pytest.mark.parametrize("step_s", [3.0, -0.01])
def test_a_clock_that_jumps_is_a_fault(sensor, controller, clock, step_s):
    read(sensor, clock, 0.02)
    controller.stamp_s += step_s
    look(sensor, clock)
    assert fault(sensor) is FaultCode.CLOCK


def test_forces_that_stand_still_are_a_fault(sensor, controller, clock):
    controller.force_n = lambda: 4.0
    read(sensor, clock, 0.4)
    assert fault(sensor) is FaultCode.STALE


def test_an_arm_without_power_has_no_sensor(sensor, controller, clock):
    controller.robot_mode = 3
    assert look(sensor, clock)[0].status == Status.DEVICE_FAULT
    assert fault(sensor) is FaultCode.DEVICE_REPORTS
