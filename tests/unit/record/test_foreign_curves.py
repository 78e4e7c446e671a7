"""Files as other machines write them: one true curve in sixty forms, read in SI or refused with its
place and a remedy that works."""

from __future__ import annotations

import io
import json
import re
import shlex
import zipfile
from collections.abc import Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import openpyxl
import pytest
from typer.testing import CliRunner

from stepload.cli.main import app
from stepload.errors import BadInputError
from stepload.record.curve_mapping import CurveMapping
from stepload.record.curves import read_curve

K, K_S = 6.57e8, 3.49e6
UP = np.linspace(0.0, 300.0, 81)
FORCE = np.concatenate([np.zeros(20), UP, UP[-2::-2]])
DEPTH = (FORCE / K) ** (2.0 / 3.0)
TRAVEL = DEPTH + FORCE / K_S
TRAVEL[:20] = np.linspace(-30e-6, -1e-6, 20)
DEPTH[:20] = np.linspace(-30e-6, -1e-6, 20)
TIME = np.arange(len(FORCE)) / 10.0
START = datetime(2026, 11, 28, 10, 59, 58)
ROWS = len(FORCE)
POUND = 4.4482216152605


def grouped(value: float, digits: int, mark: str, decimal: str) -> str:
    return f"{value:,.{digits}f}".replace(",", "\0").replace(".", decimal).replace("\0", mark)


def table(
    names: Sequence[str], *columns: Any, sep: str = ";", decimal: str = ".", units: str = "",
    head: str = "", foot: str = "", digits: int = 6, end: str = "\n", quote: bool = False,
) -> str:  # fmt: skip
    """A table as text; columns of texts stay as they are."""
    cells = [
        [each if isinstance(each, str) else f"{each:.{digits}f}".replace(".", decimal)
         for each in column] for column in columns
    ]  # fmt: skip
    mark = '"' if quote else ""
    rows = [sep.join(f"{mark}{cell}{mark}" for cell in row) for row in zip(*cells, strict=True)]
    top = [sep.join(f"{mark}{name}{mark}" for name in names)] if names else []
    return head + end.join([*top, *([units] if units else []), *rows]) + end + foot


MM, UM, KN, MN_ = TRAVEL * 1e3, DEPTH * 1e6, FORCE / 1e3, FORCE * 1e3
NAMES = ("Time (s)", "Position (mm)", "Force (N)")
PLAIN = table(NAMES, TIME, MM, FORCE, sep=",")
LOGGER = PLAIN.splitlines()
BODY = "\n".join(LOGGER[1:]) + "\n"


def other(times: Sequence[str], name: str) -> str:
    return table((name, "Position (mm)", "Force (N)"), times, MM, FORCE)


def clock(form: str) -> str:
    return other([(START + timedelta(hours=13, seconds=t)).strftime(form) for t in TIME], "Time")


def book(*sheets: tuple[str, Sequence[Sequence[Any]]], hide: str = "") -> bytes:
    made = openpyxl.Workbook()
    made.remove(made.active)
    for title, rows in sheets:
        sheet = made.create_sheet(title)
        for row in rows:
            sheet.append(list(row))
        if title == hide:
            sheet.sheet_state = "hidden"
    out = io.BytesIO()
    made.save(out)
    return out.getvalue()


XLSX_ROWS = [*zip(TIME.tolist(), MM.tolist(), FORCE.tolist(), strict=True)]
XLSX = [["Report"], ["Machine", "A"], ["Time (s)", "Position (mm)", "Load (N)"], *XLSX_ROWS]


def words(time: str, travel: str, force: str) -> str:
    return table((f"{time} (s)", f"{travel} [mm]", f"{force} [N]"), TIME, MM, FORCE)


class File(NamedTuple):
    """A file: its text or bytes, options, the role of the travel and the signs in the file."""

    name: str
    data: str | bytes
    options: str = ""
    role: str = "position"
    travel: float = 1.0
    force: float = 1.0


HYSITRON = table(
    ("Time (s)", "Pd (µm)", "Fn (µN)", "FnRef (µN)", "SegmentID"), TIME, UM, FORCE * 1e6,
    FORCE * 1e6 + 1.0, ["1"] * ROWS, sep="\t", head="Results\nEIT\t2.1 GPa\n\nMeasured values\n",
)  # fmt: skip
GAUGE = "2026-11-28\n" + "".join(
    f"{a:+010.4f},N,{b:+.6f},mm\n" for a, b in zip(FORCE, MM, strict=True)
)
MIXED = "".join(
    f"{a * (1e3 if a < 1 else 1.0):+.4f},{'mN' if a < 1 else 'N'},{b:+.6f},mm\n"
    for a, b in zip(FORCE, MM, strict=True)
)
ROS = table(
    ("%time", "field.header.stamp", "field.wrench.force.x", "field.wrench.force.z",
     "field.wrench.torque.z", "field.pose.position.z"),
    [f"{1764327600000000000 + i * 100000000}" for i in range(ROWS)],
    [f"{1764327600000000000 + i * 100000000}" for i in range(ROWS)],
    0.0 * FORCE, -FORCE, 0.0 * FORCE, -TRAVEL, sep=",", digits=9,
)  # fmt: skip
BLUEHILL = table(
    ("Time", "Extension", "Load"), TIME, -MM, -KN, sep=",", units='"(s)","(mm)","(kN)"', quote=True,
    head='"Specimen label","7"\n"Geometry","Circular"\n\n', digits=7,
)  # fmt: skip
TESTXPERT = table(
    ("Prüfzeit", "Standardweg", "Standardkraft"), TIME, MM, FORCE, units="s;mm;N", decimal=",",
    head="Prüfer;Müller\n", end="\r\n",
)  # fmt: skip
MEAN = "Mean;1.0;2.0;150.0\nStd. Dev.;0.1;0.2;3.0\nMaximum;16;0.1;300\n"
SHIFTED = np.concatenate([TIME[:50], TIME[50:] + 3600.0])

GOOD = [
    File("bluehill", BLUEHILL, travel=-1.0, force=-1.0),
    File("testxpert", TESTXPERT.encode("cp1252")),
    File("mts", table(("Time", "Crosshead", "Load"), TIME, MM, KN, sep="\t", units="s\tmm\tkN",
                      head="Test\tA\nOperator\tB\n\n", digits=7)),
    File("anton paar, one force", HYSITRON.replace("FnRef (µN)", "Reserve"), role="displacement"),
    File("hysitron, stated", HYSITRON, '--columns "force=Fn (µN)"', "displacement"),
    File("hand gauge", GAUGE),
    File("hand gauge, unit of the display changes", MIXED),
    File("texture, gf", table(("Force(gf)", "Distance(mm)"), FORCE / 9.80665e-3, MM, sep=",")),
    File("texture, kgf", table(("Force(kgf)", "Distance(mm)"), FORCE / 9.80665, MM)),
    File("lbf and in", table(("Load (lbf)", "Travel (in)"), FORCE / POUND, MM / 25.4, digits=8)),
    File("ozf", table(("Load [ozf]", "Travel [mm]"), FORCE / POUND * 16.0, MM)),
    File("kg that is kgf", table(("Load (kg)", "Travel (mm)"), FORCE / 9.80665, MM),
         "--units force=kgf"),
    File("sep=", "sep=;\n" + table(NAMES, TIME, MM, FORCE, decimal=",")),
    File("utf-16", table(NAMES, TIME, MM, FORCE, sep="\t").encode("utf-16")),
    File("utf-16, stated", PLAIN.encode("utf-16-le"), "--encoding utf-16-le"),
    File("utf-8 with mark", PLAIN.encode("utf-8-sig")),
    File("cp1252 µ", table(("Weg (µm)", "Kraft (N)"), TRAVEL * 1e6, FORCE).encode("cp1252")),
    File("cp850 µ", table(("Weg (µm)", "Kraft (N)"), TRAVEL * 1e6, FORCE).encode("cp850")),
    File("shift-jis", words("時間", "ストローク", "荷重").encode("cp932")),
    File("gb18030", words("时间", "行程", "力").encode("gb18030")),
    File("german", words("Zeit", "Traversenweg", "Prüfkraft")),
    File("french", words("Temps", "Déplacement", "Force"), role="displacement"),
    File("spanish", words("Tiempo", "Carrera", "Fuerza")),
    File("italian", words("Tempo", "Corsa", "Forza")),
    File("portuguese", words("Tempo", "Posição", "Força")),
    File("dutch", words("Tijd", "Verplaatsing", "Kracht"), role="displacement"),
    File("polish, cp1250", words("Czas", "Położenie", "Siła").encode("cp1250")),
    File("japanese", words("時間", "変位", "試験力"), role="displacement"),
    File("chinese", words("时间", "位移", "载荷"), role="displacement"),
    File("thousands, quoted", table(("Position (nm)", "Force (mN)"),
         [grouped(x, 1, ",", ".") for x in TRAVEL * 1e9],
         [grouped(x, 2, ",", ".") for x in MN_], sep=",", quote=True)),
    File("thousands, german", table(("Weg (nm)", "Kraft (mN)"),
         [grouped(x, 1, ".", ",") for x in TRAVEL * 1e9],
         [grouped(x, 2, ".", ",") for x in MN_])),
    File("thousands, swiss", table(("Weg (nm)", "Kraft (mN)"),
         [grouped(x, 1, "'", ".") for x in TRAVEL * 1e9],
         [grouped(x, 2, "\u2019", ".") for x in MN_])),
    File("thousands, french", table(("Course (nm)", "Force (mN)"),
         [grouped(x, 1, "\u202f", ",") for x in TRAVEL * 1e9],
         [grouped(x, 2, "\u00a0", ",") for x in MN_])),
    File("xlsx, names in row 3", book(("Data", XLSX))),
    File("xlsx, sheet", book(("Info", [["x"]]), ("Data", XLSX)), "--sheet Data"),
    File("xlsx, other sheet hidden", book(("Old", XLSX), ("Data", XLSX), hide="Old")),
    File("xlsx, thousands as numbers", book(("Data", [["Position (mm)", "Force (mN)"],
         *zip(MM.tolist(), np.round(MN_).tolist(), strict=True)]))),
    File("iso time", other([(START + timedelta(seconds=t)).isoformat() for t in TIME], "Stamp")),
    File("clock past midnight", other([(START + timedelta(hours=13, seconds=t)).strftime(
         "%H:%M:%S.%f") for t in TIME], "Time")),
    File("german date", other([(START + timedelta(seconds=t)).strftime("%d.%m.%Y %H:%M:%S,%f")
                               for t in TIME], "Zeit")),
    File("ms since 1970", other([str(1764327600000 + round(1e3 * t)) for t in TIME], "timestamp"),
         "--units time=ms"),
    File("names every 40 rows", "\n".join(line for i, line in enumerate(LOGGER[1:])
         for line in ([LOGGER[0]] if i % 40 == 0 else []) + [line]) + "\n"),
    File("cycle column", table(("Cycle", *NAMES), ["1"] * ROWS, TIME, MM, FORCE)),
    File("statistics at the foot", table(("No.", "Position (mm)", "Force (N)", "T"),
         [str(i) for i in range(ROWS)], MM, FORCE, TIME, foot="\n" + MEAN)),
    File("clock jumps ahead", table(NAMES, SHIFTED, MM, FORCE)),
    File("a note that is a unit", table((*NAMES[1:], "Note"), MM, FORCE, ["m"] * ROWS)),
    File("a column of units", table(("Weg", "Einheit", "Kraft", "Einheit"), MM, ["mm"] * ROWS, KN,
         ["kN"] * ROWS, digits=7)),
    File("a foot with a point", table(NAMES[1:], MM, FORCE, decimal=",", foot="End;1.5 mm tip\n")),
    File("ros", ROS, "--columns time=field.header.stamp --units time=ns,force=N,position=m",
         travel=-1.0, force=-1.0),
    File("numpy, no names", table((), TIME, MM, FORCE, sep=" "),
         '--columns "time=1, position=2, force=3" --units time=s,position=mm,force=N'),
]  # fmt: skip


class Broken(NamedTuple):
    """A file that is refused: where, the words that its remedy leaves open, and what then holds."""

    name: str
    data: str | bytes
    place: str
    fill: tuple[str, ...] = ()
    options: str = ""
    remedy: bool = True


def specimens(count: int) -> str:
    return table(NAMES, np.tile(TIME, count), np.tile(MM, count), np.tile(FORCE, count))


BROKEN = [
    Broken("two forces", HYSITRON, ":5:1"),
    Broken("no unit", table(("time_s", "disp", "force"), TIME, MM, FORCE), ":1:1", ("N",),
           "--units displacement=mm"),
    Broken("force in kg", table(("Load (kg)", "Travel (mm)"), FORCE, MM), ":1:1", ("kgf",)),
    Broken("grouped or decimal", table(("Position (mm)", "Force (mN)"), MM,
           [grouped(round(x), 0, ",", ".") for x in MN_]), ":23:1"),
    Broken("point that groups", table(("Position (mm)", "Force (mN)"), MM,
           [grouped(round(x), 0, ".", ",") for x in MN_], decimal=","), ":23:1"),
    Broken("under each other", specimens(3), f":{ROWS + 2}:1"),
    Broken("beside each other", table(NAMES[1:] * 2, MM, FORCE, MM, FORCE), ":1:1"),
    Broken("two sheets", book(("A", XLSX), ("B", XLSX)), ":1:1"),
    Broken("no names", BODY, ":1:1", ("3", "2"), "--units force=N,position=mm"),
    Broken("utf-16 without mark", PLAIN.encode("utf-16-le"), ":1:1"),
    Broken("am and pm", clock("%I:%M:%S.%f %p"), ":2:1"),
    Broken("day or month", clock("%m/%d/%Y %H:%M:%S.%f"), ":2:1"),
    Broken("minutes and seconds", clock("%M:%S.%f"), ":2:1"),
    Broken("a unit against the file's", table(("Position (mm)", "Force (kN)"), MM, KN), ":1:1", (),
           "--units force=N"),
    Broken("a factor", table(("Position (mm)", "Force*10 (N)"), MM, FORCE), ":1:1", ("daN",)),
    Broken("no unit of ROS", ROS, ":1:1", ("ns", "N", "m"), "--columns time=%time"),
    Broken("no unit at all", table(("time", "way", "disp", "load"), TIME, MM, MM, FORCE), ":1:1",
           ("s", "mm", "N")),
    Broken("mixed marks", table(NAMES, [f"{t:.1f}" for t in TIME], MM, FORCE, decimal=","), ":2:5",
           remedy=False),
    Broken("errors of a spreadsheet", re.sub(r"(?m)^1\d\.\d*,", "#N/A,", PLAIN), ":102:1",
           remedy=False),
]  # fmt: skip


def save(tmp_path: Path, data: str | bytes) -> Path:
    raw = data.encode() if isinstance(data, str) else data
    path = tmp_path / ("a file.xlsx" if raw.startswith(b"PK") else "a file.csv")
    path.write_bytes(raw)
    return path


def mapping(options: str) -> CurveMapping:
    given = dict(zip(*[iter(shlex.split(options))] * 2, strict=True))
    return CurveMapping.of({key.removeprefix("--"): text for key, text in given.items()})


@pytest.mark.parametrize("file", GOOD, ids=lambda file: file.name)
def test_a_file_of_another_machine_is_read(tmp_path: Path, file: File) -> None:
    path = save(tmp_path, file.data)
    got = read_curve(path, mapping(file.options))
    truth = {"position": TRAVEL, "displacement": DEPTH}[file.role]
    if file.role == "displacement" and got.perhaps_machine:
        truth = TRAVEL  # the crosshead's
    found = got.position_m if file.role == "position" else got.displacement_m
    assert found == pytest.approx(file.travel * truth, abs=2e-9)
    assert got.force_n == pytest.approx(file.force * FORCE, abs=2e-3)
    if got.time_s is not None and file.name != "clock jumps ahead":
        assert got.time_s - got.time_s[0] == pytest.approx(TIME, abs=1e-5)
    reading = got.reading
    assert reading is not None
    assert reading.rows == ROWS
    again = read_curve(path, reading.mapping)  # what a look prints to keep
    assert again.force_n == pytest.approx(got.force_n, rel=1e-15)
    assert again.perhaps_machine == got.perhaps_machine


@pytest.mark.parametrize("file", BROKEN, ids=lambda file: file.name)
def test_a_broken_file_is_refused_with_a_remedy(tmp_path: Path, file: Broken) -> None:
    path = save(tmp_path, file.data)
    with pytest.raises(BadInputError) as caught:
        read_curve(path, mapping(file.options))
    assert f"{path}{file.place}:" in caught.value.message
    if not file.remedy:
        return
    words = shlex.split(caught.value.hint, comments=True)
    assert words[:3] == ["stepload", "identify", str(path)]
    open_ones = iter(file.fill)
    filled = [re.sub(r"\?", lambda _: next(open_ones), word) for word in words[3:]]
    done = CliRunner().invoke(app, ["identify", str(path), *filled, "--look", "--json"])
    assert done.exit_code == 0, done.exception
    (curve,) = json.loads(done.stdout)["curves"]
    assert curve["rows"] == ROWS
    assert {column["role"] for column in curve["columns"]} >= {"force_n"}


def changed(data: bytes, old: bytes, new: bytes) -> bytes:
    """A workbook with another text in its first sheet."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as read, zipfile.ZipFile(out, "w") as write:
        for name in read.namelist():
            part = read.read(name)
            write.writestr(name, part.replace(old, new, 1) if "sheet1" in name else part)
    return out.getvalue()


FORMULAS = [("Position (mm)", "Force (N)"), *((x, f"=A{i}") for i, x in enumerate(MM.tolist(), 2))]
ONE = [f"{x:.4f}" for x in FORCE]
ONE[60] = "0.15 kN"
NASTY = [
    ("name and row differ", table(NAMES, TIME, MM, KN, units="s;mm;kN"), ":1:1"),
    ("units of another order", table(("Time", "Position", "Force"), TIME, MM, KN, units="kN;mm;s"),
     ":1:1"),
    ("name and cells differ", table(NAMES, TIME, MM, [f"{x:.7f} kN" for x in KN]), ":1:1"),
    ("a unit in one cell", table(NAMES, TIME, MM, ONE), ":62:19"),
    ("strain", table(("Strain (%)", "Force (N)"), MM, FORCE), ":1:1"),
    ("a factor in the name", table(("Position (mm)", "Force (x10 N)"), MM, FORCE), ":1:1"),
    *((f"a factor: {name}", table(("Position (mm)", name), MM, FORCE), ":1:1")
      for name in ("Force*10 N", "Force x10 (N)", "Force (N)/2", "Force 10 N", "Force m N",
                   "Force [N] (1e-3 N)")),
    ("rows behind a mark", table(NAMES, ["#1"] * 40 + [f"{t}" for t in TIME[40:]], MM, FORCE),
     ":2:1"),
    ("specimens by a column", table(("Specimen", *NAMES), [*"A" * ROWS, *"B" * ROWS],
     range(2 * ROWS), np.tile(MM, 2), np.tile(FORCE, 2)), f":{ROWS + 2}:1"),
    ("specimens mixed", table(("Specimen no", *NAMES), ["1", "2"] * ROWS, range(2 * ROWS),
     np.repeat(MM, 2), np.repeat(FORCE, 2)), ":3:1"),
    ("other units below", table(("Time", "Position", "Force"), TIME, MM, FORCE, units="s;mm;N")
     + table(("Time", "Position", "Force"), TIME, MM, KN, units="s;mm;kN"), f":{ROWS + 4}:1"),
    ("mark of another code page", table(("Weg (Âµm)", "Kraft (N)"), MM, FORCE), ":1:1"),
    ("decimal commas between commas", table(NAMES, TIME, MM, FORCE, sep=",", decimal=","), ":2:1"),
    ("numbers below statistics", PLAIN + "Mean,1,2\n" + BODY, f":{ROWS + 3}:1"),
    ("a second table", table(NAMES, TIME, MM, FORCE) + table(("Weg (mm)", "Kraft (N)"), MM, FORCE),
     f":{ROWS + 3}:1"),
    ("formulas without values", book(("Data", FORMULAS)), ":2:8"),
    ("entities", changed(book(("Data", XLSX)), b"<worksheet",
     b'<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><worksheet'), ":1:1"),
    ("half a workbook", book(("Data", XLSX))[:3000], ":1:1"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "data", "place"), NASTY, ids=[name for name, *_ in NASTY])
def test_no_false_number_comes_of_it(
    tmp_path: Path, name: str, data: str | bytes, place: str
) -> None:
    path = save(tmp_path, data)
    with pytest.raises(BadInputError) as caught:
        read_curve(path)
    assert f"{path}{place}:" in caught.value.message


BESIDE = table(("Position (mm)", "Force (N)") * 2, MM, FORCE, 2.0 * MM, FORCE)
KEPT = [
    ("decimal mark", table(NAMES, TIME, MM, FORCE, digits=3, decimal=","), {"decimal": "."}),
    ("unit", table(("Position", "Force"), MM, KN, units="mm;kN"), {"units": (("force", "N"),)}),
    ("unit in the name", table(("Position (mm)", "Force (kN)"), MM, KN),
     {"units": (("force", "N"),)}),
    ("unit, columns by number", table(("Position (mm)", "Force (kN)"), MM, KN),
     {"columns": (("position", "1"), ("force", "2")), "units": (("force", "N"),)}),
    ("specimen", BESIDE, {"columns": (("force", "4"),), "specimen": "1"}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "stated"), KEPT, ids=[name for name, *_ in KEPT])
def test_what_is_stated_does_not_contradict_the_file(
    tmp_path: Path, name: str, text: str, stated: dict[str, Any]
) -> None:
    with pytest.raises(BadInputError):
        read_curve(save(tmp_path, text), CurveMapping(**stated))


def test_a_wrong_unit_in_the_file_is_overruled_where_both_are_stated(tmp_path: Path) -> None:
    stated = mapping("--units 'force=kN not N'")
    path = save(tmp_path, table(("Position (mm)", "Force (N)"), MM, KN))
    found = read_curve(path, stated)
    assert found.force_n == pytest.approx(FORCE, abs=1e-3)
    assert found.reading is not None
    kept = found.reading.mapping
    assert read_curve(path, kept).force_n == pytest.approx(FORCE, abs=1e-3)
    other = save(tmp_path, table(("Position (mm)", "Force (mN)"), MM, MN_))
    with pytest.raises(BadInputError):
        read_curve(other, stated)


LEFT = {
    "text": table(NAMES, TIME, MM, FORCE, foot="End of test\nPeak force;300.0;N\n"),
    "statistics": table(NAMES, TIME, MM, FORCE, foot=";Mean;150.0\n"),
    "cut off": table(NAMES, TIME, MM, FORCE) + "16.1;0.0",
    "comments": PLAIN.replace("\n10.0", "\n# paused\n10.0"),
    "of another table": "Force (N);Position (mm)\n300;0.1\n\n" + table(NAMES, TIME, MM, FORCE),
    "units again": table(NAMES, TIME, MM, FORCE, units="s;mm;N").replace(
        "\n10.0", "\ns;mm;N\n10.0"
    ),
}


@pytest.mark.parametrize("reason", LEFT)
def test_what_is_no_row_is_counted_with_its_reason(tmp_path: Path, reason: str) -> None:
    reading = read_curve(save(tmp_path, LEFT[reason])).reading
    assert reading is not None
    assert reading.rows == ROWS
    assert [each.reason for each in reading.left_out] == [reason]


def test_a_workbook_that_unpacks_to_too_much_is_refused_before_it_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stepload.record.curve_text.MAX_UNZIPPED", 1 << 20)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as write:
        write.writestr("xl/worksheets/sheet1.xml", bytes(1 << 21))
    with pytest.raises(BadInputError, match=f"{1 << 21} bytes unzipped, limit {1 << 20}"):
        read_curve(save(tmp_path, out.getvalue()))


def test_every_specimen_and_all_of_them_can_be_read(tmp_path: Path) -> None:
    path = save(tmp_path, specimens(3))
    starts = []
    for number in "123":
        reading = read_curve(path, CurveMapping(specimen=number)).reading
        assert reading is not None
        starts.append((reading.first_line, reading.rows))
    assert starts == [(2 + at * ROWS, ROWS) for at in range(3)]
    whole = read_curve(path, CurveMapping(specimen="all"))
    assert (len(whole.force_n), whole.time_s) == (3 * ROWS, None)
    beside = save(tmp_path, table(NAMES[1:] * 2, MM, FORCE, 2.0 * MM, 3.0 * FORCE))
    with pytest.raises(BadInputError) as caught:
        read_curve(beside, mapping("--columns force=4"))
    assert "force=4, position=3" in caught.value.hint
    second = read_curve(beside, mapping("--columns position=3,force=4"))
    assert second.force_n == pytest.approx(3.0 * FORCE)


def test_a_fast_retract_is_no_second_specimen(tmp_path: Path) -> None:
    travel, force = np.append(MM[:101], [MM[0]] * 9), np.append(FORCE[:101], [0.0] * 9)
    assert len(read_curve(save(tmp_path, table(NAMES[1:], travel, force))).force_n) == 110
    again = table(NAMES[1:], np.tile(MM[:101], 2), np.tile(FORCE[:101], 2))
    with pytest.raises(BadInputError, match="2 tests in one file"):
        read_curve(save(tmp_path, again))


@pytest.mark.parametrize("slow", [1, 2])
def test_a_channel_that_stands_between_its_values_is_read_where_it_is_new(
    tmp_path: Path, slow: int
) -> None:
    columns = [TIME, MM, FORCE]
    columns[slow] = np.repeat(columns[slow][::4], 4)[:ROWS]
    curve = read_curve(save(tmp_path, table(NAMES, *columns)))
    assert curve.position_m == pytest.approx(TRAVEL[::4], abs=1e-9)
    assert curve.force_n == pytest.approx(FORCE[::4], abs=1e-6)
    assert "every 4 rows" in curve.reading.notes[0]


def test_a_mapping_is_kept_for_the_next_files(tmp_path: Path) -> None:
    path, kept = save(tmp_path, HYSITRON), tmp_path / "machine.yaml"
    look = ["identify", str(path), "--columns", "force=Fn (µN)", "--look"]
    shown = CliRunner().invoke(app, look).stdout
    kept.write_text(shown.partition("FILE.yaml:\n")[2])
    done = CliRunner().invoke(app, ["identify", str(path), "--mapping", str(kept), "--json"])
    assert done.exit_code == 0
    told = json.loads(done.stdout)["reading"]
    assert {each["role"]: each["name"] for each in told["columns"]}["force_n"] == "Fn (µN)"
    compared = ["compare", "--curve", f"A={path}", "--mapping", f"A={kept}", "--look", "--json"]
    (look_at,) = json.loads(CliRunner().invoke(app, compared).stdout)["curves"]
    assert look_at["columns"] == told["columns"]
    kept.write_text('columns: "force=Fn (µN)"\nunits: "force=kg, displacement=µm"\ndecimal: ":"\n')
    broken = CliRunner().invoke(app, ["identify", str(path), "--mapping", str(kept)])
    assert isinstance(broken.exception, BadInputError)
    for place in (":2:8:", ":3:10:"):
        assert f"{kept}{place}" in broken.exception.message
    kept.write_text('columns: "force=Fn (µN)"\n')  # a unit is mandatory
    broken = CliRunner().invoke(app, ["identify", str(path), "--mapping", str(kept)])
    assert f"{kept}:1:1:" in str(broken.exception)
