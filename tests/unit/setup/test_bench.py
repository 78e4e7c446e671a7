"""Devices of a step: what is heard of them is new and sound, and the arm is stopped at the end."""

from __future__ import annotations

import math

import pytest
from bench_fakes import FakeArm, FakeSensor, Rig, sound

from stepload.errors import DeviceError
from stepload.rig.samples import ForceSample
from stepload.setup import bench
from stepload.setup.bench import FORCE, Bench, listen
from stepload.setup.yaml_keys import Value


def bench_of(rig, sensor=None, arm=None):
    sensors = {FORCE: sensor or FakeSensor(rig, sound)}
    return Bench(arm or FakeArm(rig), sensors, rig.clock, {})


class Told(FakeSensor):
    """A sensor that tells what stands in `queue`, and that its readings are `status`."""

    def __init__(self, rig, queue=(), status=0):
        super().__init__(rig, sound)
        self.queue, self.status = list(queue), status

    def drain(self):
        told, self.queue = self.queue, []
        return told


def reading(force_n=0.0, status=0):
    return ForceSample(1, 0.0, 0.0, status, (0.0, 0.0, force_n, 0.0, 0.0, 0.0), math.nan)


def test_what_came_in_before_is_not_heard():
    received = listen(bench_of(Rig(), Told(Rig(), [reading(50.0)] * 9)), 0.1)
    assert received.force[FORCE] == []
    with pytest.raises(DeviceError, match=r"rig\.force: no data come in"):
        received.forces_n(FORCE)


def test_one_reading_that_the_sensor_calls_bad_is_one_too_many():
    received = listen(bench_of(Rig()), 0.1)
    assert len(received.forces_n(FORCE)) > 40
    received.force[FORCE][7] = reading(status=4)
    with pytest.raises(DeviceError, match="calls its readings bad"):
        received.forces_n(FORCE)


class Device:
    """Says what is done to it."""

    def __init__(self, name, log, deaf=False):
        self.name, self.log, self.deaf = name, log, deaf

    def open(self, timeout_s):
        self.log.append(f"{self.name} open")
        if self.deaf:
            raise DeviceError("nobody answers", code="not_connected", hint="power")

    def safe(self, timeout_s):
        self.log.append(f"{self.name} safe")
        raise DeviceError("not confirmed", code="refused_command", hint="")

    def close(self):
        self.log.append(f"{self.name} close")


VALUES = {"force.driver": Value("fake", ""), "arm.driver": Value("fake", "")}


def opening(monkeypatch, **deaf):
    log = []
    monkeypatch.setattr(
        bench, "_made", lambda group, key, values: Device(key, log, deaf.get(key, False))
    )
    return log


def test_whatever_ends_a_step_the_arm_is_told_to_stop_and_all_is_closed(monkeypatch):
    log = opening(monkeypatch)
    with pytest.raises(KeyboardInterrupt), bench.opened(VALUES, True):
        raise KeyboardInterrupt
    assert log == ["force open", "arm open", "arm safe", "arm close", "force close"]


def test_a_device_that_does_not_open_is_closed_with_those_before_it(monkeypatch):
    log = opening(monkeypatch, arm=True)
    with pytest.raises(DeviceError, match="nobody answers"), bench.opened(VALUES, True):
        pytest.fail("opened")
    assert log == ["force open", "arm open", "arm close", "force close"]
