"""What a bug report needs, and the shell's completion of verbs, names and codes."""

from __future__ import annotations

import json

import pytest
from real_runs import in_process

from stepload import __version__


def test_a_bug_report_names_versions_computer_and_plugins():
    assert in_process("--version").stdout == f"{__version__}\n"
    said = in_process("--version", "--verbose")
    assert said.returncode == 0
    long = [line for line in said.stdout.splitlines() if len(line) > 80]
    assert all(line.startswith(("path ", "platform ")) for line in long)
    told = json.loads(in_process("--version", "--json").stdout)
    assert told["stepload"] == __version__
    assert {"numpy", "mcap", "pydantic"} <= set(told["packages"])
    groups = {each["group"]: each["version"] for each in told["drivers"] if each["name"] == "sim"}
    assert set(groups) == {
        "stepload.arms", "stepload.force_sensors", "stepload.displacement_sensors",
        "stepload.worlds",
    }  # fmt: skip
    assert set(groups.values()) == {__version__}
    assert all(version in said.stdout for version in told["packages"].values())


def test_json_before_a_verb_is_refused():
    assert in_process("--json", "drivers").returncode == 2


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("stepload ru", {"run", "runs"}),
        ("stepload run --dr", {"--dry-run"}),
        ("stepload run plan.yaml --world si", {"sim"}),
        ("stepload drivers test line", {"line_serial"}),
        ("stepload drivers test sim --kind wo", {"worlds"}),
        ("stepload plans copy plastic-sp", {"plastic-sphere"}),
        ("stepload profiles ur20", {"ur20"}),
        ("stepload hazards st", {"stvf"}),
        ("stepload explain R12", {"R12"}),
    ],
)
def test_the_shell_completes(monkeypatch, words, offered):
    monkeypatch.setenv("_STEPLOAD_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
    assert set(in_process().stdout.split()) == offered
