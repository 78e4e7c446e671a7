"""`stepload map`: one small map, whole."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

from stepload.data import columns
from stepload.design import atlas, points
from stepload.plan import room_to_write

SMALL = ("map", "stvf", "--samples", 12, "--seed", 3)


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A map of few cells."""
    payloads = [ROOT / "procedures" / "payloads" / f"plastic-{n}.yaml" for n in ("sphere", "cone")]
    monkeypatch.setattr(atlas, "shipped_payloads", lambda: payloads)
    monkeypatch.setattr(points, "PANELS", ("exponent",))
    monkeypatch.setattr(points, "EXPONENTS", (1.5,))
    monkeypatch.setattr(points, "COLUMNS", 2)
    sold = points.for_sale
    monkeypatch.setattr(points, "for_sale", lambda told: dict(list(sold(told).items())[:3]))


@pytest.mark.long
def test_a_map_is_drawn_told_and_written_the_same_by_one_process_and_by_two(
    tmp_path: Path,
) -> None:
    alone = in_process(
        *SMALL, "--processes", 1, "--json", "--out", "m", "--parquet", "m.parquet", cwd=tmp_path
    )
    two = in_process(*SMALL, "--processes", 2, "--json", cwd=tmp_path)
    assert alone.returncode == two.returncode == 0, alone.stderr
    assert alone.stdout == two.stdout
    said = json.loads(alone.stdout)
    assert said["identifications"] == 12 * len(said["cells"])
    assert said["agreed"] == said["checked"] > 0
    sphere, cone = said["payloads"]
    # 12 of 12 are no proof: the lower bound is 74 %.
    assert (sphere["can"], cone["can"]) == ("not shown", "no")
    assert "must not be pressed" in cone["text"]
    assert "stepload map" not in alone.stderr
    assert (tmp_path / "m" / "map.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "m" / "map.svg").read_text()
    assert json.loads((tmp_path / "m" / "map.json").read_text()) == said
    for figure in ("Drawn: K_s", "Not drawn: yield", "Left out:", "As it is this rig"):
        assert figure in alone.stderr
    import pyarrow.parquet as parquet

    table = parquet.read_table(tmp_path / "m.parquet")
    assert table.num_rows == len(said["cells"])
    assert set(table.column_names) == set(said["cells"][0])


def test_what_is_there_is_not_overwritten_and_a_missing_library_is_told_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "map.svg").write_text("mine")
    (tmp_path / "m.parquet").write_text("mine")
    for words, told in (
        (("--out", "m"), "map.svg is there already"),
        (("--parquet", "m.parquet"), "m.parquet is there already"),
        (("--top-force", "3 m"), "3 m"),
        (("--top-force", ""), "expected a force with its unit"),
        (("--payload", "none.yaml"), "none.yaml"),
    ):
        said = in_process(*SMALL, *words, cwd=tmp_path)
        assert said.returncode == 2, words
        assert told in said.stderr

    def missing(name: str, wanted_for: str) -> None:
        raise columns.BadInputError(f"{wanted_for} needs {name}, which is not installed")

    monkeypatch.setattr(columns, "library", missing)
    said = in_process(*SMALL, "--parquet", "new.parquet", cwd=tmp_path)
    assert (said.returncode, "needs pyarrow" in said.stderr) == (2, True)


def test_a_place_where_nothing_can_be_written_is_told_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(dir: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(room_to_write.tempfile, "TemporaryFile", full)
    for words in (("--out", "new/m"), ("--parquet", "new.parquet")):
        said = in_process(*SMALL, *words, cwd=tmp_path)
        assert said.returncode == 2, words
        assert "No space left on device" in said.stderr
        assert "simulated identifications" not in said.stderr
    assert list(tmp_path.iterdir()) == []
