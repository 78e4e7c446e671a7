"""`stepload identify --all`: every record of a directory, as if each were identified alone."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from real_runs import in_process


@pytest.fixture
def place(tmp_path: Path, quick_run: Path, cycles_run: Path) -> Path:
    """Two records, one that is none, and a file of something else."""
    for name, made in (("a", quick_run), ("b/c", cycles_run)):
        (tmp_path / name).mkdir(parents=True)
        shutil.copy(made / "run.mcap", tmp_path / name)
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "run.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 100)
    (tmp_path / "notes.txt").write_text("nothing")
    return tmp_path


def test_every_record_says_what_it_says_alone(place: Path) -> None:
    before = {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}
    told = in_process("identify", place, "--all", "--processes", 1, "--json")
    assert told.returncode == 0, told.stderr
    rows = {Path(row["path"]).parent.name: row for row in json.loads(told.stdout)["runs"]}
    assert set(rows) == {"a", "c", "d"}
    for name in ("a", "b/c"):
        row = rows[name[-1]]
        alone = json.loads(in_process("identify", place / name, "--json").stdout)
        assert row["verdict"] == alone["verdict"] == row["verdict_then"]
        assert row["chord_n_per_m"] == alone["headline"]["value_n_per_m"]
        assert row["chord_n_per_m"] == pytest.approx(row["chord_then_n_per_m"], rel=1e-9)
        low, high = alone["headline"]["interval_n_per_m"]
        assert (row["low_n_per_m"], row["high_n_per_m"]) == (low, high)
        assert row["simulated"]
        assert (row["problem"], row["differs"]) == ("", False)
    assert rows["d"]["problem"]
    assert rows["d"]["chord_n_per_m"] is None
    assert {path: path.read_bytes() for path in place.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "x", "--all"], "--all with --out"),
        (["--kind", "system", "--all"], "another --kind"),
        (["--processes", "2"], "--processes without --all"),
        (["--all"], "no record in it"),
    ],
)
def test_what_does_not_go_together_is_refused(tmp_path: Path, words: list[str], said: str) -> None:
    done = in_process("identify", tmp_path, *words)
    assert done.returncode == 2
    assert said in done.stderr
