"""The help of every verb: an example that can be typed, and completion."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from stepload.cli.explain import codes
from stepload.cli.main import _add_verbs, app
from stepload.cli.run_paths import run_ids


def verbs(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if not hasattr(command, "commands"):
        yield words, command
    for name, each in sorted(getattr(command, "commands", {}).items()):
        yield from verbs(each, (*words, name))


_add_verbs()
ROOT = get_command(app)
VERBS = dict(verbs(ROOT))
HOME = Path(__file__).resolve().parents[2]
PAGES = [HOME / "README.md", *sorted((HOME / "docs").rglob("*.md"))]


@pytest.mark.parametrize("words", sorted(VERBS), ids=" ".join)
def test_every_verb_has_an_example_that_can_be_typed(words: tuple[str, ...]) -> None:
    told = VERBS[words].help or ""
    [example] = [
        line.strip().removeprefix("Example: ")
        for line in told.splitlines()
        if line.strip().startswith("Example: ")
    ]
    assert parsed(shlex.split(example)).name == words[-1]


def parsed(typed: list[str]) -> Any:
    """The verb of a command line that the parser takes."""
    assert typed[0] == "stepload"
    command: Any = ROOT
    context = command.make_context("stepload", typed[1:])
    rest = [*context._protected_args, *context.args]
    while hasattr(command, "commands"):
        _, command, rest = command.resolve_command(context, rest)
        context = command.make_context(command.name, list(rest), parent=context)
        rest = [*getattr(context, "_protected_args", ()), *context.args]
    return command


def shown(page: Path) -> list[str]:
    """The command lines of stepload in the blocks of a page."""
    blocks = re.findall(r"^```(?:console|sh|bash|)\n(.*?)^```", page.read_text(), re.M | re.S)
    lines = "\n".join(blocks).replace("\\\n", " ").splitlines()
    lines = [part for line in lines for part in line.removeprefix("$ ").split(" && ")]
    return [line for line in lines if line.startswith("stepload ")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_page_can_be_typed(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for line in shown(page):
        typed = shlex.split(line, comments=True)
        assert typed[1:] == ["--help"] or parsed(typed), line


def test_codes_and_runs_are_completed(
    tmp_path: Any, quick_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "unidentifiable" in codes("unid")
    monkeypatch.setenv("STEPLOAD_RUNS", str(quick_run))
    [run_id] = run_ids("")
    assert run_ids(run_id[:3]) == [run_id]
    assert run_ids("runs/") == []
    monkeypatch.setenv("STEPLOAD_RUNS", str(tmp_path / "none"))
    assert run_ids("") == []
