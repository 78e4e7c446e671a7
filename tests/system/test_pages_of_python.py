"""The page about Python, run block by block; and the site of all pages."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from real_runs import CYCLES, ENVIRONMENT, ROOT

RESOURCE = re.compile(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?:https?:)?//')


def test_every_block_of_the_python_page_runs(cycles_run: Path, tmp_path: Path) -> None:
    shutil.copytree(cycles_run, tmp_path / "runs" / "20260801-101500-demo")
    (tmp_path / "procedures").mkdir()
    (tmp_path / "procedures" / "plastic-sphere.yaml").write_text(CYCLES)
    assert "plastic" in printed_by(ROOT / "docs" / "python.md", tmp_path, blocks=5)


def test_every_block_of_the_batch_page_runs(cycles_run: Path, tmp_path: Path) -> None:
    """The runs are one record with other names in it."""
    for piece in ("S01", "S02"):
        _named_copy(cycles_run / "run.mcap", tmp_path / "runs" / piece / "run.mcap", piece)
    printed = printed_by(ROOT / "docs" / "batch.md", tmp_path, blocks=2)
    assert "2 of 2 runs are identified" in printed
    assert printed.count("S02") == 2


def printed_by(page: Path, directory: Path, *, blocks: int) -> str:
    """What the Python of a page prints, run in a directory; there are so many blocks at least."""
    found = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    assert len(found) >= blocks
    (directory / "page.py").write_text("\n".join(found))
    done = subprocess.run(
        [sys.executable, "-W", "error", "page.py"],
        cwd=directory, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def _named_copy(record: Path, path: Path, specimen: str) -> None:
    """The same record of another specimen, written by the library of the format."""
    path.parent.mkdir(parents=True)
    with record.open("rb") as source, path.open("wb") as target:
        reader, writer = make_reader(source), Writer(target, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="test")
        for each in reader.iter_metadata():
            more = {"batch": "B7", "specimen": specimen} if each.name == "run" else {}
            writer.add_metadata(each.name, each.metadata | more)
        for file in reader.iter_attachments():
            writer.add_attachment(
                file.create_time, file.log_time, file.name, file.media_type, file.data
            )
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in channels:
                assert schema is not None
                named = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, named
                )
            writer.add_message(
                channels[channel.id],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()


def test_the_site_is_whole_and_asks_the_network_for_nothing(tmp_path: Path) -> None:
    pytest.importorskip("material")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT, env={**ENVIRONMENT, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True,
        check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pages = sorted(tmp_path.rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        assert not RESOURCE.search(page.read_text()), page
    assert "elastic limit" in (tmp_path / "search" / "search_index.json").read_text()


def test_the_notebook_runs(tmp_path: Path) -> None:
    (tmp_path / "procedures").mkdir()
    (tmp_path / "procedures" / "plastic-sphere.yaml").write_text(CYCLES)
    made = tmp_path / "made.ipynb"
    code = (
        "import sys, nbformat; from nbclient import NotebookClient\n"
        "notebook = nbformat.read(sys.argv[1], as_version=4)\n"
        "NotebookClient(notebook, timeout=100, kernel_name='python3').execute()\n"
        "nbformat.write(notebook, sys.argv[2])\n"
    )
    source = ROOT / "docs" / "notebooks" / "first-look.ipynb"
    done = subprocess.run(
        [sys.executable, "-c", code, source, made],
        cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "SIMULATED" not in source.read_text()  # no outputs are kept
    assert '"identified"' in made.read_text() or "'identified'" in made.read_text()
