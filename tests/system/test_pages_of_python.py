"""The page about Python, run block by block; and the site of all pages."""

from __future__ import annotations

import io
import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, DataEnd, Footer, Metadata, MetadataIndex
from mcap.writer import MCAP0_MAGIC
from real_runs import ENVIRONMENT, QUICK, ROOT, leave_out_figures

NOTEBOOK = ROOT / "docs" / "notebooks" / "first-look.ipynb"
RESOURCE = re.compile(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?:https?:)?//')


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages run in this process, whose filter makes every warning an error, and without figures."""
    monkeypatch.chdir(tmp_path)
    leave_out_figures(monkeypatch)


def test_every_block_of_the_python_page_runs(
    cycles_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(cycles_run, tmp_path / "runs" / "20260801-101500-demo")
    (tmp_path / "procedures").mkdir()
    (tmp_path / "procedures" / "plastic-sphere.yaml").write_text(QUICK)
    run_blocks(ROOT / "docs" / "python.md", tmp_path, least=5)
    assert "plastic" in capsys.readouterr().out


def test_every_block_of_the_batch_page_runs(
    cycles_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The runs are one record with other names in it."""
    for piece in ("S01", "S02"):
        _named_copy(cycles_run / "run.mcap", tmp_path / "runs" / piece / "run.mcap", piece)
    run_blocks(ROOT / "docs" / "batch.md", tmp_path, least=2)
    printed = capsys.readouterr().out
    assert "2 of 2 runs are identified" in printed
    assert printed.count("S02") == 2


def run_blocks(page: Path, directory: Path, *, least: int) -> None:
    """Run the Python of a page as one program; there are so many blocks at least."""
    found = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    assert len(found) >= least
    (directory / "page.py").write_text("\n".join(found))
    runpy.run_path("page.py")


def _named_copy(record: Path, path: Path, specimen: str) -> None:
    """The same record of another specimen, as bytes but for that; its summary is indexes only."""
    path.parent.mkdir(parents=True)
    stream, made, summary = ReadDataStream(io.BytesIO(record.read_bytes())), RecordBuilder(), []
    made.write(stream.read(len(MCAP0_MAGIC)))
    while (opcode := stream.read1()) != Opcode.DATA_END:
        start, length = made.count, stream.read8()
        body = stream.read(length)
        inside = ReadDataStream(io.BytesIO(body))
        each = Metadata.read(inside) if opcode == Opcode.METADATA else None
        if each is not None and each.name == "run":
            each.metadata |= {"batch": "B7", "specimen": specimen}
            each.write(made)
        else:
            made.write1(opcode)
            made.write8(length)
            made.write(body)
        size = made.count - start
        if each is not None:
            summary.append(MetadataIndex(start, size, each.name))
        elif opcode == Opcode.ATTACHMENT:
            file = Attachment.read(inside)
            summary.append(AttachmentIndex(
                start, size, file.create_time, file.log_time, len(file.data), file.name,
                file.media_type,
            ))  # fmt: skip
    DataEnd(0).write(made)
    start = made.count
    for index in summary:
        index.write(made)
    Footer(start, 0, 0).write(made)
    path.write_bytes(made.end() + MCAP0_MAGIC)


def test_the_site_is_whole_and_asks_the_network_for_nothing(tmp_path: Path) -> None:
    pytest.importorskip("zensical")
    shutil.copytree(ROOT / "docs", tmp_path / "docs")
    shutil.copy(ROOT / "mkdocs.yml", tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "zensical", "build", "--strict"],
        cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pages = sorted((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        assert not RESOURCE.search(page.read_text()), page
    assert "elastic limit" in (tmp_path / "site" / "search.json").read_text()


def test_every_cell_of_the_notebook_runs(tmp_path: Path) -> None:
    (tmp_path / "procedures").mkdir()
    (tmp_path / "procedures" / "plastic-sphere.yaml").write_text(QUICK)
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    assert not any(cell.get("outputs") for cell in cells)
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    (tmp_path / "notebook.py").write_text("\n".join(code))
    made = runpy.run_path("notebook.py")
    assert made["run"].results["headline"]["value_n_per_m"] > 0.0
    assert made["levels"]["step"].tolist() == [1, 2, 3]
    assert made["found"].verdict in ("identified", "marginal")
