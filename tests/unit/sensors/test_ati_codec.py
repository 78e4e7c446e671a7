"""NETCANOEM messages against a real capture and the synthetic calibration."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload_drivers.ati import codec
from stepload_drivers.ati.codec import Calibration, Op
from stepload_verify.emulators.ati import gauge_frames

h = bytes.fromhex


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


def test_saturation_is_the_end_stop_itself():
    assert codec.saturated((0, 0, 32767, 0, 0, 0))
    assert codec.saturated((0, 0, -32768, 0, 0, 0))
    assert not codec.saturated((0, 0, 32766, -32767, 0, 0))


@given(st.integers(0, 0xFFFF), st.lists(st.integers(-32768, 32767), min_size=6, max_size=6))
def test_gauge_frames_are_read_back(status, counts):
    assert codec.gauges(*gauge_frames(status, counts)) == (status, tuple(counts))
