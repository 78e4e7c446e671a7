"""`-v` and `--log-file`: what a bug report needs, in every verb; nothing else shows it."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import pytest
from real_runs import in_process

from stepload.cli.log import start_log
from stepload.plan import load

LINE = re.compile(
    r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} (DEBUG|INFO|WARNING|ERROR) ([\w.]+): .+"
)  # fmt: skip


def _modules(text: str) -> set[str]:
    found = (LINE.fullmatch(line) for line in text.splitlines())
    return {match[2] for match in found if match}


def test_the_file_of_a_run_has_time_level_and_module(quick: Path, tmp_path: Path) -> None:
    file, out = tmp_path / "log.txt", tmp_path / "run"
    done = in_process("--log-file", file, "run", quick, "--dry-run", "--out", out, "--quiet")
    assert done.returncode == 0, done.stderr
    text = file.read_text()
    assert all(map(LINE.fullmatch, text.splitlines()))
    assert _modules(text) >= {
        "stepload.cli.log", "stepload.session.experiment", "stepload.session.files",
        "stepload.engine.open_rig", "stepload.engine.loop",
    }  # fmt: skip
    assert len(text.splitlines()) < 150
    assert " INFO " not in done.stderr
    assert not logging.getLogger().isEnabledFor(logging.INFO)


def test_a_bug_leaves_its_traceback_in_the_file_alone(
    quick: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("here")

    monkeypatch.setattr(load, "load_plan", broken)
    file = tmp_path / "log.txt"
    done = in_process("--log-file", file, "preflight", quick)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "--log-file" in done.stderr
    text = file.read_text()
    assert "Traceback" in text
    assert "ZeroDivisionError: here" in text


@pytest.mark.parametrize(
    "said", ["run --live-token hunter2 plan", "http://h:1/?token=hunter2&x=1", "Password: hunter2"]
)
def test_a_secret_is_not_logged(said: str, tmp_path: Path) -> None:
    stop = start_log(0, tmp_path / "log.txt")
    try:
        logging.getLogger("stepload.some").info("%s", said)
    finally:
        stop()
    text = (tmp_path / "log.txt").read_text()
    assert "hunter2" not in text
    assert "***" in text
