"""NETCANOEM messages against a real capture and the synthetic calibration."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload_drivers.ati import codec
from stepload_drivers.ati.codec import Calibration, Op
from stepload_verify.emulators.ati import gauge_frames

h = bytes.fromhex


def test_real_capture_gauges():
    status, counts = codec.gauges(h("40000012FE3AE6A8"), h("04FAFA930143"))
    assert status == 0x4000
    assert codec.status_text(status) == "CAN bus error"
    assert counts == (18, 1274, -454, -1389, -6488, 323)
    _, counts = codec.gauges(h("40000043FE77E6EE"), h("0569FAE00183"))
    assert counts == (67, 1385, -393, -1312, -6418, 387)


def test_real_capture_matrix_row():
    row = codec.matrix_row(
        {
            Op.MATRIX: h("3F40256AC1DAD5F4"),
            Op.MATRIX_2: h("3FF85F58C1CCED0E"),
            Op.MATRIX_3: h("3F9FF9FCC1DD29AD"),
        }
    )
    expected = (0.750571, -27.354469, 1.940410, -25.615749, 1.249816, -27.645350)
    assert row == pytest.approx(expected, abs=1e-6)
    rows = [row] + [(0.0,) * 6] * 5
    calibration = Calibration.from_device(rows, 1_000_000, 1_000_000, 1.0, 1.0)
    first = calibration.wrench((18, 1274, -454, -1389, -6488, 323))
    assert first[0] == pytest.approx(-0.0171750105, abs=1e-9)
    second = calibration.wrench((67, 1385, -393, -1312, -6418, 387))
    assert second[0] == pytest.approx(-0.0237104416, abs=1e-9)


def synthetic():
    rows = [
        (0, 0, 2000, 0, 0, 0),
        (0, 0, 0, 0, 2000, 0),
        (1000,) * 6,
        (0, 100, 0, 0, 0, 0),
        (0, 0, 0, 100, 0, 0),
        (0, 0, 0, 0, 0, 100),
    ]
    return rows, struct.unpack(">II", h("000F4240000F4240"))


def test_synthetic_sample():
    rows, counts = synthetic()
    calibration = Calibration.from_device(rows, *counts, 1.0, 1.0)
    status, gauges = codec.gauges(h("0000F44801F4FF06"), h("0078FFB0003C"))
    assert status == 0
    assert gauges == (-3000, 120, 500, -80, -250, 60)
    expected = (1.0, -0.5, -2.65, 0.012, -0.008, 0.006)
    assert calibration.wrench(gauges) == pytest.approx(expected, abs=1e-12)


def test_units_scale_force_and_torque_apart():
    rows, counts = synthetic()
    gauges = (-3000, 120, 500, -80, -250, 60)
    newton = Calibration.from_device(rows, *counts, 1.0, 1.0).wrench(gauges)
    pound, inch = codec.FORCE_UNITS_N[1][1], codec.TORQUE_UNITS_NM[4][1]
    other = Calibration.from_device(rows, *counts, pound, inch).wrench(gauges)
    assert other[2] == pytest.approx(4.4482216 * newton[2], rel=1e-7)
    assert other[3] == pytest.approx(1e-3 * newton[3], rel=1e-12)


def test_saturation_is_the_end_stop_itself():
    assert codec.saturated((0, 0, 32767, 0, 0, 0))
    assert codec.saturated((0, 0, -32768, 0, 0, 0))
    assert not codec.saturated((0, 0, 32766, -32767, 0, 0))


def test_ids():
    assert codec.frame_id(0x20, Op.GAUGES) == 0x200
    assert codec.frame_id(0x7F, Op.MATRIX_3) == 0x7F4


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 0xFFFF), st.lists(st.integers(-32768, 32767), min_size=6, max_size=6))
def test_gauge_frames_are_read_back(status, counts):
    assert codec.gauges(*gauge_frames(status, counts)) == (status, tuple(counts))
