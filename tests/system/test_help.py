"""The help of every verb: an example that can be typed, and completion."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
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


@pytest.mark.parametrize("words", sorted(VERBS), ids=" ".join)
def test_every_verb_has_an_example_that_can_be_typed(words: tuple[str, ...]) -> None:
    told = VERBS[words].help or ""
    [example] = [
        line.strip().removeprefix("Example: ")
        for line in told.splitlines()
        if line.strip().startswith("Example: ")
    ]
    typed = shlex.split(example)
    assert typed[0] == "stepload"
    command: Any = ROOT
    context = command.make_context("stepload", typed[1:])
    rest = [*context._protected_args, *context.args]
    while hasattr(command, "commands"):
        _, command, rest = command.resolve_command(context, rest)
        context = command.make_context(command.name, list(rest), parent=context)
        rest = [*getattr(context, "_protected_args", ()), *context.args]
    assert command.name == words[-1]


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
