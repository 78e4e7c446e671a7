"""The PDF of a page: by whom it is made, and that nothing suffers where it cannot be made."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import pytest

from stepload.cli import paper
from stepload.errors import BadInputError
from stepload.results import pdf
from stepload.results.model import Document, Verdict
from stepload.results.page import render
from stepload.results.terminal import Output

MAKES = """#!/bin/sh
for word in "$@"; do
  case "$word" in
    --print-to-pdf=*) target="${word#*=}" ;;
    file://*) source="${word#file://}" ;;
  esac
  echo "$word" >> "%s"
done
printf '%%%%PDF-1.7 ' > "$target"
cat "$source" >> "$target"
"""


@pytest.fixture
def page(tmp_path: Path) -> Path:
    made = tmp_path / "report.html"
    made.write_text(render(Document("t", Verdict("good", "ok", "fine"))), encoding="utf-8")
    return made


@pytest.fixture(autouse=True)
def _only_what_the_test_puts_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "bin").mkdir()
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/usr/bin:/bin")
    monkeypatch.setattr(pdf, "BROWSERS", ("a-browser",))
    monkeypatch.setattr(pdf, "find_spec", lambda name: None)


def browser(tmp_path: Path, script: str) -> Path:
    program = tmp_path / "bin" / "a-browser"
    program.write_text(script)
    program.chmod(0o755)
    return program


@pytest.mark.parametrize(("paper", "size"), [("a4", "A4"), ("letter", "letter")])
def test_the_browser_gets_the_page_on_that_paper_and_no_network(
    page: Path, tmp_path: Path, paper: str, size: str
) -> None:
    heard = tmp_path / "heard"
    browser(tmp_path, MAKES % heard)
    made = pdf.print_page(page, paper)
    assert (made.by, made.problem) == ("a-browser", "")
    assert made.line == f"pdf: {tmp_path / 'report.pdf'}"
    assert f"@page{{size:{size}}}\n</style>" in made.path.read_text()
    assert "size:" not in page.read_text().partition("</style>")[0].rpartition("@page")[2]
    words = heard.read_text().split("\n")
    assert "--host-resolver-rules=MAP * ~NOTFOUND" in words
    assert sorted(each.name for each in tmp_path.iterdir()) == [
        "bin", "heard", "report.html", "report.pdf",
    ]  # fmt: skip


def test_without_a_converter_a_sentence_says_what_to_do(page: Path) -> None:
    made = pdf.print_page(page)
    assert not made.path.exists()
    assert made.line.startswith("no PDF: neither Chromium nor WeasyPrint is installed (pip")
    assert "print" in made.line


@pytest.mark.parametrize(
    ("script", "told"),
    [
        ("#!/bin/sh\necho it broke >&2\nexit 3\n", "a-browser ended with exit code 3: it broke"),
        ("#!/bin/sh\nexit 0\n", "a-browser wrote no PDF"),
        ("no program at all", ""),
    ],
)
def test_a_converter_that_fails_leaves_what_was_there(
    page: Path, tmp_path: Path, script: str, told: str
) -> None:
    browser(tmp_path, script)
    (tmp_path / "report.pdf").write_text("the last one")
    made = pdf.print_page(page)
    assert made.by == ""
    assert told in made.problem
    assert made.problem
    assert (tmp_path / "report.pdf").read_text() == "the last one"


def test_a_converter_that_hangs_is_ended_with_what_it_started(page: Path, tmp_path: Path) -> None:
    browser(tmp_path, f"#!/bin/sh\nsleep 600 &\necho $! > {tmp_path}/child\nwait\n")
    made = pdf.print_page(page, timeout_s=0.5)
    assert made.problem == "a-browser was ended after 0.5 s"
    child = Path(f"/proc/{(tmp_path / 'child').read_text().strip()}/stat")
    for _ in range(100):
        if not child.exists() or child.read_text().split()[2] == "Z":
            break
        time.sleep(0.02)
    else:
        raise AssertionError("its child is alive")


def test_a_directory_that_takes_no_file_is_a_sentence_too(page: Path, tmp_path: Path) -> None:
    browser(tmp_path, MAKES % os.devnull)
    (tmp_path / "report.pdf").mkdir()
    assert "report.pdf" in pdf.print_page(page).problem


def test_a_verb_ends_as_it_would_have(
    page: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    out = Output(as_json=False)
    paper.put_on_paper(page, None, out)
    assert capsys.readouterr().out == ""
    paper.put_on_paper(page, "a4", out)
    assert capsys.readouterr().out.startswith("no PDF: neither")
    paper.put_on_paper(page.with_name("none.html"), "a4", out)
    assert capsys.readouterr().out == "no PDF: there is no report\n"
    monkeypatch.setattr(pdf, "print_page", interrupted)
    paper.put_on_paper(page, "a4", out)
    assert capsys.readouterr().out.startswith("no PDF: left out on request")


def test_a_size_of_paper_is_checked_before_anything_runs() -> None:
    assert paper.wanted_paper(False, "a4") is None
    assert paper.wanted_paper(True, "letter") == "letter"
    with pytest.raises(BadInputError, match="--paper 'a5'"):
        paper.wanted_paper(True, "a5")
    with pytest.raises(BadInputError, match="without --pdf"):
        paper.wanted_paper(False, "letter")
