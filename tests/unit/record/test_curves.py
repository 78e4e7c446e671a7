"""CSV curves: what is accepted, and that every refusal names its place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stepload.errors import BadInputError
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
        (
            GOOD.replace("force_n", "foce_n"),
            ":1:1: no column for the force (force_n); is 'foce_n'",
        ),
        (
            GOOD.replace("position_m", "way_mm"),
            ":1:1: no column for the travel (position_m); columns",
        ),
        (GOOD.replace("time_s", "force_n"), ":1:1: 2 specimens beside each other"),
        (GOOD.replace("time_s", "displacement_m"), ":1:1: both 'position_m' and"),
        ("displacement_m\n1\n2\n3\n", ":1:1: no column for the force (force_n); columns: 1"),
        (GOOD.replace("2.5", "nan"), ":3:10: 'nan' is not a finite number; 1 of 3 rows lack"),
        (GOOD.replace("2.5", "inf"), ":3:10: 'inf' is not"),
        (GOOD.replace("2.5", ""), ":3:10: '' is not"),
        (GOOD.replace("2.5", "1e999"), ":3:10: '1e999' is not"),
        (GOOD.replace("2.5", "1_0"), ":3:10: force_n: '1_0' is not"),
        (GOOD.replace("1e-6", "=A1"), ":3:5: position_m: '=A1' is not"),
        (GOOD.replace("1e-6", "\x00"), ":3:5: position_m: '\\x00' is not"),
        (GOOD.replace("0.1,1e-6", "0.1;1e-6"), ":3:1: 2 cells, the header has 3"),
        (GOOD.replace("0.2,", "0.05,"), ":4:1: 2 tests in one file: 1 at line 2, 2 at line 4"),
        (GOOD.rsplit("\n", 2)[0], ":3:1: 2 rows, at least 3"),
        (GOOD + "9" * 5000, ":5:4096: a line of more than 4096"),
        ("9" * 5000 + GOOD, ":1:4096: a line of more than 4096"),
    ],
)
def test_refusals_name_the_place(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BadInputError) as caught:
        read_curve(write(tmp_path, text))
    assert message in caught.value.message


ROWS = "".join(f"{i * 0.1:.1f},{i * 1e-6:.9g},{i * 2.5:.6g}\n" for i in range(100))
HEAD = "time_s,position_m,force_n\n"


def test_rows_without_a_number_are_dropped_counted_and_said(tmp_path: Path) -> None:
    lines = ROWS.splitlines()
    lines[10], lines[20], lines[30] = "1,nan,25", "2,2e-5,", ",,"
    got = read_curve(write(tmp_path, HEAD + "\n".join(lines)))
    assert len(got.force_n) == 97
    assert 25.0 not in got.force_n
    assert got.reading is not None
    (left,) = got.reading.left_out
    assert (left.lines, left.first_line, left.text) == (3, 12, "nan")
    lines[40:43] = 3 * ["NaN,NaN,NaN"]
    with pytest.raises(BadInputError, match=r":12:3: 'nan' .* 6 of 100 rows lack a number"):
        read_curve(write(tmp_path, HEAD + "\n".join(lines)))


@pytest.mark.parametrize("where", ["{error};{i};{i}", "{i};{i};{error}"])
def test_an_error_of_a_spreadsheet_is_no_comment(tmp_path: Path, where: str) -> None:
    lines = [f"{i};{i};{i}" for i in range(1, 101)]
    lines[50:] = [where.format(i=i, error=e) for i, e in enumerate(["#N/A", "#REF!"] * 25, 51)]
    path = write(tmp_path, "time_s;displacement_m;force_n\n" + "\n".join(lines))
    with pytest.raises(BadInputError, match=r":52:\d: '#N/A' .* 50 of 100 rows lack a number"):
        read_curve(path)


def test_commas_that_may_group_thousands_are_asked_about(tmp_path: Path) -> None:
    head = "displacement_m;force_n\n"
    forces = ["998", "1,906", "2,003", "141,535"]

    def rows(forces: list[str]) -> Path:
        return write(tmp_path, head + "".join(f"{i};{text}\n" for i, text in enumerate(forces)))

    with pytest.raises(BadInputError, match=r":3:1: force_n: '1,906' may be 1906 or 1\.906"):
        read_curve(rows(forces))
    for decimal in ("0,125", "1,5"):  # a comma that begins decimals: all do
        assert read_curve(rows([*forces, decimal])).force_n[1] == 1.906
    assert read_curve(rows([*forces, "1,234,567"])).force_n[1] == 1906.0  # it cannot be a decimal


def test_an_instrument_writes_above_its_columns(tmp_path: Path) -> None:
    text = (
        "Mon Apr 29 10:41:06 2019\n\nNumber of Points = 3\nTest: load, hold, unload\n"
        "Depth (nm)\tLoad (µN)\tTime (s)\tDepth (V)\tLoad (V)\n"
        "0.5\t1\t0\t-1\t0.48\n1.5\t10\t0.005\t-1\t0.48\n2.5\t20\t0.01\t-1\t0.48\n"
    )
    for encoding in ("utf-8", "cp1252"):
        got = read_curve(write(tmp_path, text, encoding))
        assert got.displacement_m == pytest.approx([0.5e-9, 1.5e-9, 2.5e-9])
        assert got.force_n == pytest.approx([1e-6, 10e-6, 20e-6])
        assert got.time_s == pytest.approx([0.0, 0.005, 0.01])
        assert got.reading is not None
        assert got.reading.names_line == 5
        read = {each.role: (each.name, each.unit) for each in got.reading.columns}
        assert read["force_n"] == ("Load (µN)", "µN")


@pytest.mark.parametrize(
    "text",
    [
        "# displacement_m,force_n\n0,0\n1e-6,2.5\n2e-6,7\n",
        "displacement_m force_n\n0 0\n1e-6   2.5\n 2e-6 7\n",
        "Time,Displacement,Load\n(s),(mm),(kN)\n0,0,0\n1,0.001,0.0025\n2,0.002,0.007\n",
        "Displacement [mm],Load [kN],\n0,0,\n0.001,0.0025,\n0.002,0.007,\n",
    ],
)
def test_headers_in_other_places(tmp_path: Path, text: str) -> None:
    got = read_curve(write(tmp_path, text))
    assert got.displacement_m == pytest.approx([0.0, 1e-6, 2e-6])
    assert got.force_n == pytest.approx([0.0, 2.5, 7.0])


def test_lateral_forces_are_kept(tmp_path: Path) -> None:
    text = "time_s,position_m,Fx [mN],Fy [mN],Fz [N]\n0,0,1,2,0\n1,1e-6,3,4,1\n2,2e-6,5,6,2\n"
    got = read_curve(write(tmp_path, text))
    assert got.lateral_n == pytest.approx(np.array([[1e-3, 3e-3, 5e-3], [2e-3, 4e-3, 6e-3]]))
    assert got.force_n == pytest.approx([0.0, 1.0, 2.0])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200), st.booleans())
def test_any_bytes_are_read_or_refused(tmp_path: Path, data: bytes, with_header: bool) -> None:
    path = tmp_path / "any.csv"
    path.write_bytes((b"displacement_m,force_n\n" if with_header else b"") + data)
    try:
        got = read_curve(path)
    except BadInputError:
        return
    assert np.isfinite(got.force_n).all()
