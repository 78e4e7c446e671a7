"""The sensor in the flange, read from an emulated controller beside no arm at all."""

from __future__ import annotations

import statistics
import time

import pytest
from long_ones import long_rows

from stepload.rig.faults import FaultCode
from stepload_drivers.ur.force import UrForce

TOUCHING = {"surface_m": -1e-5}
BOUND_S = 10.0


@pytest.fixture
def make_sensor():
    made = []

    def make(host, **options):
        made.append(UrForce(host=host, **options))
        return made[-1]

    yield make
    for sensor in made:
        sensor.close()


def test_the_plate_pushes_the_tool_in_newton(start_emulator, make_sensor):
    emulator = start_emulator(world=TOUCHING)
    sensor = make_sensor(emulator.host)
    sensor.open(5.0)
    time.sleep(0.6)
    samples = sensor.drain()
    contact_n = emulator.state()["contact_n"]
    assert contact_n > 5.0
    assert statistics.fmean(s.wrench[2] for s in samples) == pytest.approx(contact_n, abs=1.5)
    assert [s.sequence for s in samples] == list(range(1, len(samples) + 1))
    assert sensor.fault() is None


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("freeze on", FaultCode.STALE),
        ("nan on", FaultCode.NOT_FINITE),
        ("emergency-stop", FaultCode.DEVICE_REPORTS),
        *long_rows([("repeat on", FaultCode.STALE), ("drop", FaultCode.NOT_CONNECTED)]),
    ],
)
def test_faults_of_the_controller_are_faults_of_its_sensor(
    start_emulator, make_sensor, command, code
):
    emulator = start_emulator(world={"surface_m": 1.0})
    sensor = make_sensor(emulator.host)
    sensor.open(5.0)
    emulator.command(command)
    give_up_s = time.monotonic() + BOUND_S
    while sensor.fault() is None and time.monotonic() < give_up_s:
        time.sleep(0.01)
    assert sensor.fault().code is code
