"""Versions, options, scripts and messages: the parts of the driver without a socket."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import wire
from stepload_drivers.ur.direct_control import retract_script
from stepload_drivers.ur.preflight import check_version
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import UrState
from stepload_verify.emulators.ur_program import UserScript
from stepload_verify.emulators.ur_robot import Robot
from stepload_verify.emulators.ur_world import FreeAirAxis

FLOAT = st.floats(allow_nan=False)
INT = st.integers(-(2**31), 2**31 - 1)
STATES = st.builds(
    UrState,
    FLOAT,
    st.tuples(*[FLOAT] * 6),
    st.tuples(*[FLOAT] * 6),
    INT,
    INT,
    INT,
    st.integers(0, 2**32 - 1),
)


@pytest.mark.parametrize(
    "version", [(3, 4, 0, 0), (3, 15, 8, 0), (5, 4, 0, 0), (5, 12, 6, 0), (5, 23, 1, 0)]
)
def test_supported_versions(version):
    check_version(version, upper_registers=False)


@pytest.mark.parametrize(
    ("version", "says"),
    [
        ((1, 8, 0, 0), "3.4 is the oldest"),
        ((3, 3, 9, 9), "3.4 is the oldest"),
        ((4, 0, 0, 0), "3.4 is the oldest"),
        ((5, 0, 0, 0), "crashes"),
        ((5, 3, 9, 9), "PolyScope 5.3.9.9 is not supported.*crashes"),
        ((6, 0, 0, 0), "PolyScope X"),
        ((10, 7, 0, 0), "PolyScope X"),
    ],
)
def test_unsupported_versions(version, says):
    with pytest.raises(DeviceError, match=says) as caught:
        check_version(version, upper_registers=False)
    assert caught.value.code == FaultCode.UNSUPPORTED
    assert caught.value.hint


def test_approach_gets_length_one_and_settings_cross_as_json():
    settings_ = Settings(host="127.0.0.2", approach=[0, 3, 4], tcp_offset=[0, 0, 1])
    assert settings_.approach == pytest.approx((0.0, 0.6, 0.8))
    assert Settings.from_json(settings_.to_json()) == settings_


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({}, "host"),
        ({"host": "h", "hoost": 1}, "hoost"),
        ({"host": "h", "approach": [0, 0, 0]}, "without length"),
        ({"host": "h", "approach": [0, math.nan, 1]}, "three plain numbers"),
        ({"host": "h", "max_age": math.nan}, "max_age"),
        ({"host": "h", "gain": 99.0}, "gain"),
        ({"host": "h", "wrench_sign": "plus"}, "wrench_sign"),
    ],
)
def test_options_that_cannot_be_used(options, says):
    with pytest.raises(ValidationError, match=says):
        Settings(**options)


@given(FLOAT, STATES)
def test_samples_survive_the_way_between_processes(receive_time_s, state):
    assert wire.unpack_sample(wire.pack_sample(receive_time_s, state)) == (receive_time_s, state)


@given(st.binary(max_size=200))
def test_other_messages_are_no_samples(message):
    with pytest.raises(ValueError, match="not a sample"):
        wire.unpack_sample(message)


def test_retract_script_is_a_complete_program_without_exponents():
    script = retract_script((0.0, -0.6, 0.8), 0.00001, 0.0005)
    assert script.startswith("def stepload_retract():\n")
    assert script.endswith("\nend\n")
    assert "p[-0.000000000, 0.000006000, -0.000008000, 0, 0, 0]" in script
    assert "e-" not in script


def test_retract_script_moves_the_emulated_arm_back():
    robot = Robot(FreeAirAxis(), (0.0, 0.0, -1.0), 0.002)
    program = UserScript(retract_script((0.0, 0.0, -1.0), 0.003, 0.05), robot)
    while program.tick():
        robot.tick()
    assert robot.position_m == pytest.approx(-0.003, abs=3e-5)
