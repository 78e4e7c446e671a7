"""`stepload runs` and `stepload export`: a directory of runs as one table, a run as files."""

from __future__ import annotations

import csv
import errno
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from long_ones import long
from real_runs import in_process

import stepload
from stepload.data import catalog, export
from stepload.data.export import Format, write_tables
from stepload.errors import BadInputError
from stepload.record.reader import read_recording
from stepload.record.summary import read_summary


@pytest.fixture
def place(tmp_path: Path, quick_run: Path, cycles_run: Path) -> Path:
    """A directory with two runs, an unfinished one, and what is no run at all."""
    root = tmp_path / "runs"
    for name, made in (("a", quick_run), ("b", cycles_run)):
        (root / name).mkdir(parents=True)
        shutil.copy(made / "run.mcap", root / name)
    data = (quick_run / "run.mcap").read_bytes()
    (root / "c").mkdir()
    (root / "c" / "run.mcap.part").write_bytes(data[: len(data) // 3])
    (root / "d").mkdir()
    (root / "d" / "run.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 100)
    (root / "notes.txt").write_text("nothing")
    return root


def test_a_summary_says_what_the_whole_record_says(cycles_run: Path) -> None:
    summary, whole = read_summary(cycles_run / "run.mcap"), read_recording(cycles_run / "run.mcap")
    assert summary.metadata == whole.metadata
    assert summary.outcome == whole.outcome
    assert summary.results == whole.results
    assert not summary.partial


def test_every_run_has_a_row(place: Path) -> None:
    said = in_process("runs", place, "--json")
    assert said.returncode == 0
    rows = {Path(row["path"]).parent.name: row for row in json.loads(said.stdout)["runs"]}
    assert sorted(rows) == ["a", "b", "c", "d"]
    assert rows["b"]["plan"] == "cycles"
    assert rows["b"]["status"] == "completed"
    assert rows["b"]["simulated"] is True
    low, chord, high = (rows["b"][f"{name}_n_per_m"] for name in ("low", "chord", "high"))
    assert low < chord < high
    assert rows["c"]["status"] == "unfinished"
    assert rows["c"]["run_id"] == rows["a"]["run_id"]
    assert rows["d"]["problem"]
    for shown in ("plastic", "not read: ", "simulated,", "completed", "unfinished"):
        assert shown in " ".join(in_process("runs", place).stdout.split())


def test_rows_are_chosen_and_sorted(place: Path) -> None:
    said = in_process("runs", place, "--where", "plan=CYC", "--json")
    assert [row["plan"] for row in json.loads(said.stdout)["runs"]] == ["cycles"]
    falling = in_process("runs", place, "--sort", "peak_force_n", "--falling", "--json")
    peaks = [row["peak_force_n"] for row in json.loads(falling.stdout)["runs"]]
    numbers = [peak for peak in peaks if isinstance(peak, float)]
    assert len(numbers) == 2
    assert peaks[:2] == sorted(numbers, reverse=True)
    for words in (("--sort", "colour"), ("--where", "colour=red"), ("--where", "red")):
        refused = in_process("runs", place, *words)
        assert refused.returncode == 2
        assert "->" in refused.stderr


def test_the_catalogue_is_a_frame(place: Path, tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    frame = stepload.catalog(place)
    assert len(frame) == 4
    assert str(frame["started"].dtype).startswith("datetime64")
    assert frame["chord_n_per_m"].notna().sum() >= 1
    pytest.importorskip("pyarrow")
    file = tmp_path / "runs.parquet"
    assert in_process("runs", place, "--parquet", file).returncode == 0
    assert len(__import__("pyarrow.parquet").parquet.read_table(file)) == 4
    over = in_process("runs", place, "--parquet", place / "a" / "run.mcap")
    assert over.returncode == 2
    assert "there already" in over.stderr
    assert len(catalog.rows(place)) == 4


def test_a_run_is_found_by_its_id(place: Path) -> None:
    wanted = stepload.open(place / "b").run_id
    assert catalog.find_run(wanted[:8], place) == place / "b" / "run.mcap"
    with pytest.raises(BadInputError, match="2 runs"):  # the run and its unfinished copy
        catalog.find_run(stepload.open(place / "a").run_id, place)
    with pytest.raises(BadInputError, match="no run in"):
        catalog.find_run("0123456789ab", place)


@pytest.mark.parametrize(
    "verb", [("identify",), *long([("replay",), ("snippet", "--for", "mujoco", "--mass", "1 kg")])]
)
def test_verbs_that_take_a_run_take_its_id(
    place: Path, verb: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STEPLOAD_RUNS", str(place))
    wanted = stepload.open(place / "b").run_id
    by_id = in_process(verb[0], wanted, *verb[1:], "--json")
    assert by_id.returncode == 0, by_id.stderr
    assert by_id.stdout == in_process(verb[0], place / "b", *verb[1:], "--json").stdout
    unknown = in_process(verb[0], "0123456789ab", *verb[1:])
    assert unknown.returncode == 2
    assert "no run in" in unknown.stderr


def test_runs_are_compared_by_their_ids(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "c" / "run.mcap.part").unlink()
    monkeypatch.setenv("STEPLOAD_RUNS", str(place))
    one, other = (stepload.open(place / name).run_id for name in "ab")
    assert in_process("compare", one, "vs", other).returncode == 0


def test_a_link_in_a_circle_ends(place: Path) -> None:
    (place / "e").symlink_to(place)
    assert len(catalog.rows(place)) == 4


def test_a_record_at_the_top_hides_no_run_below_it(place: Path) -> None:
    before = [row.path for row in catalog.rows(place)]
    shutil.copy(place / "a" / "run.mcap", place / "run.mcap")
    shutil.copy(place / "a" / "run.mcap", place / "run.recovered.mcap")
    after = [row.path for row in catalog.rows(place)]
    assert sorted(after) == sorted([*before, str(place / "run.mcap")])


def test_a_directory_that_cannot_be_looked_into_says_so(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = Path.is_file

    def locked(path: Path) -> bool:
        if path.parent == place / "b":
            raise PermissionError(errno.EACCES, "Permission denied")
        return plain(path)

    monkeypatch.setattr(Path, "is_file", locked)
    found = {row.path: row for row in catalog.rows(place)}
    assert len(found) == 4
    assert found[str(place / "b")].problem == "cannot be looked into: Permission denied"


def test_csv_holds_the_curve_exactly(quick_run: Path, tmp_path: Path) -> None:
    out = tmp_path / "tables"
    said = in_process("export", quick_run, "--csv", "--out", out)
    assert said.returncode == 0
    assert "SIMULATED" in said.stdout
    curve = stepload.open(quick_run).curve
    with (out / "curve.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(curve)
    assert [float(row["force_n"]) for row in rows] == curve["force_n"].tolist()
    assert "hold" in {row["phase"] for row in rows}
    assert {path.name for path in out.iterdir()} == {
        "curve.csv", "levels.csv", "touches.csv", "force.csv", "arm.csv", "ticks.csv",
    }  # fmt: skip
    again = in_process("export", quick_run, "--csv", "--out", out)
    assert again.returncode == 2
    assert "there already" in again.stderr


def test_parquet_holds_the_same(quick_run: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "tables"
    assert in_process("export", quick_run, "--parquet", "--out", out).returncode == 0
    run = stepload.open(quick_run)
    table = parquet.read_table(out / "curve.parquet")
    assert np.array_equal(table["force_n"].to_numpy(), run.curve["force_n"])
    assert table.schema.metadata[b"stepload.run_id"].decode() == run.run_id


def test_excel_holds_the_same(
    quick_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a part of the record: a whole one is half a million cells."""
    openpyxl = pytest.importorskip("openpyxl")
    run = stepload.open(quick_run)
    whole, _ = export.tables(run)
    part = {
        "levels": whole["levels"],
        "curve": whole["curve"].between(*whole["levels"]["end_s"][1:3]),
    }
    monkeypatch.setattr(export, "tables", lambda _: (part, ""))
    out = tmp_path / "tables"
    assert in_process("export", quick_run, "--xlsx", "--out", out).returncode == 0
    [book] = out.glob("*.xlsx")
    sheets = openpyxl.load_workbook(book, read_only=True)
    levels = list(sheets["levels"].iter_rows(values_only=True))
    assert len(levels) == 1 + len(run.levels) > 1
    assert levels[1][levels[0].index("level_n")] == run.levels[0].level_n
    assert sum(1 for _ in sheets["curve"].iter_rows()) == 1 + part["curve"].rows > 1
    sheets.close()


def test_a_run_without_a_contact_gives_its_raw_streams(quick_run: Path, tmp_path: Path) -> None:
    data = (quick_run / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: len(data) // 20])
    said = in_process("export", tmp_path, "--csv", "--out", tmp_path / "tables")
    assert said.returncode == 0, said.stderr
    assert "ends early" in said.stdout
    assert "no curve, levels or touches: " in said.stdout
    assert not (tmp_path / "tables" / "curve.csv").exists()
    assert (tmp_path / "tables" / "force.csv").exists()


def test_what_somebody_wrote_into_a_record_is_no_formula_and_no_path(
    quick_run: Path, tmp_path: Path
) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    run = stepload.open(quick_run)
    texts = {
        "plan": "../../out of here",
        "payload": '=HYPERLINK("http://x")',
        "rig": "a\x1b[2Jb\x00",
    }
    told = replace(run, metadata={**run.metadata, **texts})
    [path] = write_tables(told, {}, tmp_path / "tables", Format.XLSX)
    assert path.parent == tmp_path / "tables"
    book = openpyxl.load_workbook(path, read_only=True)  # of the sheets only the one that is asked
    cells = {row[0].value: row[1] for row in book["about"].iter_rows()}
    book.close()
    assert cells["payload"].data_type == "s"
    assert cells["payload"].value == texts["payload"]
    assert cells["rig"].value == "a\\x1b[2Jb\\x00"


@pytest.mark.parametrize("format", list(Format))
def test_an_export_that_breaks_off_leaves_nothing_that_looks_whole(
    quick_run: Path, tmp_path: Path, format: Format, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("openpyxl")
    pytest.importorskip("pyarrow")
    run = stepload.open(quick_run)
    part = {"ticks": run.ticks.where(slice(9))}
    monkeypatch.setattr(Path, "rename", _full)
    with pytest.raises(BadInputError, match="No space left"):
        write_tables(run, part, tmp_path / "tables", format)
    assert not list((tmp_path / "tables").iterdir())


def _full(path: Path, target: Path) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_no_format_is_an_error(quick_run: Path, tmp_path: Path) -> None:
    said = in_process("export", quick_run, "--out", tmp_path / "x")
    assert said.returncode == 2
    assert "--csv" in said.stderr
    assert not (tmp_path / "x").exists()
