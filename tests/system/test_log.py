"""`-v` and `--log-file`: what a bug report needs, in every verb; nothing else shows it."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
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


def test_without_either_nothing_is_logged(quick: Path) -> None:
    done = in_process("preflight", quick)
    assert not _modules(done.stderr)


def test_v_shows_states_and_a_verb_keeps_its_own_verbose(quick: Path) -> None:
    shown = in_process("-v", "preflight", quick, "--verbose")
    own = in_process("preflight", quick, "--verbose")
    assert "stepload.cli.log" in _modules(shown.stderr)
    assert shown.stdout == own.stdout
    assert not _modules(own.stderr)


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


def test_a_file_that_cannot_be_written_ends_the_command(quick: Path, tmp_path: Path) -> None:
    done = in_process("--log-file", tmp_path / "no" / "log.txt", "preflight", quick)
    assert done.returncode == 2
    assert "log.txt" in done.stderr


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


def test_a_library_user_sees_nothing(quick: Path) -> None:
    code = (
        "import stepload, stepload_drivers, logging\n"
        f"stepload.preflight({str(quick)!r})\n"
        "logging.getLogger('stepload_drivers.x').warning('fault')\n"
        "print(logging.getLogger().handlers)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert done.stdout.strip() == "[]"


def test_help_does_not_load_the_log() -> None:
    code = "import sys; from stepload.cli.main import main; sys.argv[1:] = ['--help']\n"
    code += "try: main()\nexcept SystemExit: print('logging' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"
