"""CSV curves: what is accepted, and that every refusal names its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stepload.errors import BadInputError
from stepload.record import curves
from stepload.record.curves import read_curve

GOOD = "time_s,position_m,force_n\n0,0,0\n0.1,1e-6,2.5\n0.2,2e-6,7\n"


def write(tmp_path: Path, text: str, encoding: str = "utf-8") -> Path:
    path = tmp_path / "curve.csv"
    path.write_bytes(text.encode(encoding))
    return path


def test_time_position_force(tmp_path: Path) -> None:
    got = read_curve(write(tmp_path, GOOD))
    assert got.displacement_m is None
    assert got.time_s is not None
    assert got.position_m is not None
    np.testing.assert_array_equal(got.time_s, [0, 0.1, 0.2])
    np.testing.assert_array_equal(got.position_m, [0, 1e-6, 2e-6])
    np.testing.assert_array_equal(got.force_n, [0, 2.5, 7])


@pytest.mark.parametrize(
    "text",
    [
        "displacement_m, force_n\n0, 0\n1e-6, 2.5\n2e-6, 7\n",
        "\ufeffdisplacement_m,force_n\r\n0,0\r\n1e-6,2.5\r\n2e-6,7",
        "# rig 3\nforce_n;note;displacement_m\n0;a;0\n\n2,5;b;1e-6\n# x\n7;c;0,000002\n",
        '"displacement_m"\t"force_n"\n0\t0\n"1e-6"\t2.5\n2e-6\t7\n',
    ],
)
def test_the_same_curve_in_other_dialects(tmp_path: Path, text: str) -> None:
    got = read_curve(write(tmp_path, text))
    assert got.position_m is None
    assert got.displacement_m is not None
    np.testing.assert_array_equal(got.displacement_m, [0, 1e-6, 2e-6])
    np.testing.assert_array_equal(got.force_n, [0, 2.5, 7])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", ":1:1: the file is empty"),
        (GOOD.replace("force_n", "force_N"), ":1:1: no column 'force_n'; is 'force_N' meant?"),
        (GOOD.replace("position_m", "pos_mm"), ":1:1: no column 'position_m'"),
        (GOOD.replace("time_s", "force_n"), ":1:1: the column 'force_n' is there 2 times"),
        (GOOD.replace("time_s", "displacement_m"), ":1:1: both 'position_m' and"),
        ("displacement_m\n1\n2\n3\n", ":1:1: no column 'force_n' among displacement_m"),
        (GOOD.replace("2.5", "nan"), ":3:10: force_n: 'nan' is not a finite number"),
        (GOOD.replace("2.5", "inf"), ":3:10: force_n: 'inf' is not"),
        (GOOD.replace("2.5", "1e999"), ":3:10: force_n: '1e999' is not"),
        (GOOD.replace("2.5", "1_0"), ":3:10: force_n: '1_0' is not"),
        (GOOD.replace("1e-6", "=A1"), ":3:5: position_m: '=A1' is not"),
        (GOOD.replace("1e-6", "\x00"), ":3:5: position_m: '\\x00' is not"),
        (GOOD.replace("0.1,1e-6", "0.1;1e-6"), ":3:1: 2 cells, the header has 3"),
        (GOOD.replace("0.2,", "0.05,"), ":4:1: time_s goes back from 0.1 to 0.05"),
        (GOOD.rsplit("\n", 2)[0], ":3:1: 2 rows, at least 3"),
        (GOOD + "9" * 5000, ":5:4096: a line of more than 4096"),
    ],
)
def test_refusals_name_the_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BadInputError) as caught:
        read_curve(write(tmp_path, text))
    assert message in caught.value.message


def test_not_text(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="not UTF-8"):
        read_curve(write(tmp_path, GOOD + "ü", "latin-1"))


def test_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(curves, "MAX_BYTES", 10)
    with pytest.raises(BadInputError, match="limit 10"):
        read_curve(write(tmp_path, GOOD))


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="no such file"):
        read_curve(tmp_path / "absent.csv")


@settings(
    max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_read_or_refused(tmp_path: Path, data: bytes, with_header: bool) -> None:
    path = tmp_path / "any.csv"
    path.write_bytes((b"displacement_m,force_n\n" if with_header else b"") + data)
    try:
        got = read_curve(path)
    except BadInputError:
        return
    assert np.isfinite(got.force_n).all()
