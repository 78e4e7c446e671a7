"""The help of every verb: an example that can be typed."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from stepload.cli.main import app, main
from stepload.cli.verbs import LINES, OwnVerbs
from stepload.errors import ExitCode


def verbs(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    if not hasattr(command, "commands"):
        yield words, command
    inside = all_built() if words == () else getattr(command, "commands", {}).items()
    for name, each in sorted(inside):
        yield from verbs(each, (*words, name))


def all_built() -> Iterator[tuple[str, Any]]:
    for name in ROOT.list_commands(None):
        yield name, ROOT.resolve_command(None, [name])[1]


ROOT: Any = get_command(app)
ALL = dict(verbs(ROOT))
HOME = Path(__file__).resolve().parents[2]
PAGES = [HOME / "README.md", *sorted((HOME / "docs").rglob("*.md"))]


@pytest.mark.parametrize("words", sorted(ALL), ids=" ".join)
def test_every_verb_has_an_example_that_can_be_typed(words: tuple[str, ...]) -> None:
    told = ALL[words].help or ""
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


def in_a_new_process(*words: str, **environment: str) -> tuple[str, list[str]]:
    """What `stepload WORDS` prints, and the verbs' modules it imported."""
    program = (
        "import sys, atexit; sys.argv[0] = 'stepload'\n"
        f"rooms = {[*dict.fromkeys(line.split('.')[0] for line in LINES)]!r}\n"
        "seen = lambda: [r for r in rooms if 'stepload.cli.' + r in sys.modules]\n"
        "atexit.register(lambda: print(*seen(), file=sys.stderr))\n"
        "from stepload.cli.main import main\n"
        "main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        capture_output=True, text=True, check=True, env={**os.environ, **environment},
    )  # fmt: skip
    return done.stdout, done.stderr.split()


def test_only_the_verb_that_is_called_is_imported() -> None:
    shown, rooms = in_a_new_process("--help")
    assert all(name in shown for name in (*(verb.name for verb in OwnVerbs.VERBS), "campaign"))
    assert rooms == []
    assert in_a_new_process("plans")[1] == ["reference"]


def test_a_preflight_imports_nothing_of_scipy() -> None:
    """Its import took two fifths of a preflight."""
    program = (
        "import sys, atexit\n"
        "atexit.register(lambda: print('scipy' in sys.modules, file=sys.stderr))\n"
        "from stepload.cli.main import main\n"
        "main()"
    )
    plan = HOME / "procedures" / "plastic-sphere.yaml"
    done = subprocess.run(
        [sys.executable, "-c", program, "preflight", plan],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stderr.split() == ["False"]


@pytest.mark.parametrize("words", [*([verb] for verb in OwnVerbs.ELSEWHERE), ["paper", "--help"]])
def test_a_verb_names_the_package_of_ours_that_is_not_installed(
    words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(OwnVerbs, "_ask_others", lambda self: None)
    monkeypatch.setattr(sys, "argv", ["stepload", *words])
    with pytest.raises(SystemExit) as left:
        main()
    told = capsys.readouterr().err
    assert (left.value.code, "stepload-verify" in told) == (ExitCode.BAD_INPUT, True)
    project = tomllib.loads((HOME / "pyproject.toml").read_text())["project"]
    [extra] = re.findall(r"stepload\[(\w+)\]", told)
    assert project["optional-dependencies"][extra] == ["stepload-verify"]
