"""`stepload runs` and `stepload export`: a directory of runs as one table, a run as files."""

from __future__ import annotations

import csv
import errno
import itertools
import json
import shutil
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from long_ones import long
from mcap.reader import make_reader
from real_runs import in_process
from real_runs import results as real_results
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import stepload
from stepload.data.export import Format, write_tables
from stepload.errors import BadInputError


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


def test_every_run_has_a_row(place: Path) -> None:
    said = in_process("runs", place, "--json")
    assert said.returncode == 0
    schema = json.loads(in_process("schema", "runs").stdout)
    jsonschema.validate(json.loads(said.stdout), schema | {"additionalProperties": False})
    assert json.loads(said.stdout)["$schema"] == schema["$id"] == "urn:stepload:runs:1"
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


def test_csv_holds_the_curve_exactly(quick_run: Path, tmp_path: Path) -> None:
    shutil.copy(quick_run / "run.mcap", tmp_path)
    out = tmp_path / "tables"
    said = in_process("export", tmp_path, "--csv")
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
    again = in_process("export", tmp_path, "--csv")
    assert again.returncode == 2
    assert "there already" in again.stderr


def test_hdf5_is_nexus_and_holds_what_parquet_holds(cycles_run: Path, tmp_path: Path) -> None:
    h5py, parquet = pytest.importorskip("h5py"), pytest.importorskip("pyarrow.parquet")
    said = in_process("export", cycles_run, "--hdf5", "--parquet", "--out", tmp_path, "--json")
    (path,) = [Path(each) for each in json.loads(said.stdout)["files"] if each.endswith(".h5")]
    tables = sorted(tmp_path.glob("*.parquet"))
    assert len(tables) == 6
    with h5py.File(path) as file:
        assert file.attrs["NX_class"] == "NXroot"
        entry = file[file.attrs["default"]]
        assert entry.attrs["NX_class"] == "NXentry"
        assert entry.attrs["simulated"] == "true"
        assert entry["entry_identifier"].asstr()[()] == stepload.open(cycles_run).run_id
        for table in tables:
            group, wanted = entry[table.stem], parquet.read_table(table)
            assert group.attrs["NX_class"] == "NXdata"
            assert set(group) == set(wanted.column_names)
            assert group[group.attrs["signal"]].shape == group[group.attrs["axes"][0]].shape
            for name in wanted.column_names:
                values, column = wanted[name].to_numpy(), group[name]
                if names := h5py.check_enum_dtype(column.dtype):
                    known = {code: word for word, code in names.items()}
                    assert [known[code] for code in column[()].tolist()] == values.tolist()
                elif values.dtype.kind == "O":
                    assert column.asstr()[()].tolist() == values.tolist()
                else:
                    np.testing.assert_array_equal(column[()], values)
                assert ("units" in column.attrs) == (values.dtype.kind == "f")
        assert entry["force/torque_x_n_m"].attrs["units"] == "N.m"
        assert entry["arm/position_m"].attrs["units"] == "m"
        assert entry["ticks/compliance_m_per_n"].attrs["units"] == "m/N"
        results = json.loads(entry["results/data"].asstr()[()])
        assert results["$schema"] == entry["results/description"].asstr()[()]
        assert results["headline"] == real_results(cycles_run)["headline"]


def test_the_directory_of_a_run_is_a_rosbag2(quick_run: Path) -> None:
    run, types = stepload.open(quick_run), get_typestore(Stores.ROS2_HUMBLE)
    with Reader(quick_run) as bag:
        counts = {each.topic: each.msgcount for each in bag.connections}
        assert counts["/force"] == counts["/force/sample"] == run.force.rows
        assert counts["/tick"] == run.ticks.rows
        assert bag.message_count == sum(counts.values())
        for each in bag.connections:
            if each.msgtype not in types.types:
                types.register(get_types_from_msg(each.msgdef.data, each.msgtype))
        found: dict[str, list[float]] = {"/force": [], "/arm": [], "/events": []}
        times, overlaps = [], 0
        for each, time_ns, raw in bag.messages():
            times.append(time_ns)
            if len(found.get(each.topic, range(500))) < 500:
                message = types.deserialize_cdr(raw, each.msgtype)
                found[each.topic].append(
                    message.wrench.force.z if each.topic == "/force"
                    else message.position_m if each.topic == "/arm" else len(message.data)
                )  # fmt: skip
        assert len(times) == bag.message_count
        assert bag.start_time == min(times)
        assert bag.duration == max(times) - min(times) + 1
    assert found["/force"] == run.force["force_z_n"][:500].tolist()
    assert found["/arm"] == run.arm["position_m"][:500].tolist()
    assert all(found["/events"])
    with (quick_run / "run.mcap").open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    for before, after in itertools.pairwise(chunks):
        overlaps += after.message_start_time < before.message_end_time
    assert not overlaps
    assert len(chunks) > 5


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
    [path] = write_tables(told, {}, tmp_path / "tables", Format.HDF5)
    assert path.parent == tmp_path / "tables"


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
