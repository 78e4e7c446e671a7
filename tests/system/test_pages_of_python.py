"""The page about Python, run block by block; and the site of all pages."""

from __future__ import annotations

import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
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


def run_blocks(page: Path, directory: Path, *, least: int) -> None:
    """Run the Python of a page as one program; there are so many blocks at least."""
    found = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    assert len(found) >= least
    (directory / "page.py").write_text("\n".join(found))
    runpy.run_path("page.py")


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
