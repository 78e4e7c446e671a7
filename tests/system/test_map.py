"""`stepload map`: one small map, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

from stepload.data import columns
from stepload.design import map as cells

SMALL = ("map", "stvf")


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A map of few cells."""
    payloads = [ROOT / "procedures" / "payloads" / f"plastic-{n}.yaml" for n in ("sphere", "cone")]
    monkeypatch.setattr(cells, "shipped_payloads", lambda: payloads)
    monkeypatch.setattr(cells, "PANELS", ("exponent",))
    monkeypatch.setattr(cells, "EXPONENTS", (1.5,))
    monkeypatch.setattr(cells, "COLUMNS", 2)


def test_a_map_is_drawn_told_and_written(tmp_path: Path) -> None:
    done = in_process(*SMALL, "--json", "--out", "m", "--parquet", "m.parquet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    sphere, cone = said["payloads"]
    assert (sphere["can"], cone["can"]) == ("yes", "no")
    assert sphere["half_width"] < said["accuracy"] == 0.2
    assert len(sphere["narrowing"]) == 2
    assert all(each["half_width"] < sphere["half_width"] for each in sphere["narrowing"])
    assert (tmp_path / "m" / "map.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "m" / "map.svg").read_text()
    assert json.loads((tmp_path / "m" / "map.json").read_text()) == said
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
