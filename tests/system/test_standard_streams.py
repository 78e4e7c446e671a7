"""Every verb with a full disk under its output, and without one of its standard streams."""

from __future__ import annotations

import contextlib
import io
import subprocess
import sys
from pathlib import Path

import pytest
from real_runs import ENVIRONMENT, leave_out_figures
from typer.main import get_command

from stepload.cli.main import app, main
from stepload.errors import ExitCode
from stepload.record.reader import read_recording

VERBS: dict[str, str] = {
    "preflight": "PLAN", "schema": "", "profiles": "", "plans": "", "layout": "FILE",
    "identify": "RUN", "recover": "EMPTY", "replay": "RUN", "compare": "RUN RUN", "runs": "EMPTY",
    "export": "RUN --csv --out NEW", "snippet": "RUN --for drake", "drivers": "", "doctor": "PLAN",
    "hazards": "stvf", "explain": "R6", "map": "PLAN", "predict": "PLAN", "pose": "PLAN",
}  # fmt: skip
"""A call that succeeds; for the others, which take longer or ask, their help."""
COSTLY = ("replay", "compare", "snippet", "pose", "doctor", "map", "predict")
NO_JSON = ("schema", "layout", "emulate")


def _verbs() -> list[str]:
    return list(get_command(app).list_commands(None))  # type: ignore[attr-defined, arg-type]


def _calls(json: bool) -> list[object]:
    verbs = [each for each in _verbs() if not json or (each in VERBS and each not in NO_JSON)]
    return [pytest.param(each, json, marks=[pytest.mark.long] * (each in COSTLY)) for each in verbs]


def _on_full_disk(*words: str) -> tuple[int, str]:
    """Exit code and standard error of a command in this process whose output is full."""
    err = io.StringIO()
    with (
        open("/dev/full", "w") as full,
        contextlib.redirect_stdout(full),
        contextlib.redirect_stderr(err),
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(sys, "argv", ["stepload", *words])
        leave_out_figures(patch)
        with pytest.raises(SystemExit) as ended:
            main()
    return int(ended.value.code or 0), err.getvalue()


@pytest.mark.parametrize(("verb", "json"), [*_calls(False), *_calls(True)])
def test_a_full_disk_under_the_output_is_no_success(
    verb: str, json: bool, quick_plan: Path, quick_run: Path, tmp_path: Path
) -> None:
    (tmp_path / "empty").mkdir()
    places = {
        "PLAN": quick_plan, "RUN": quick_run, "EMPTY": tmp_path / "empty", "NEW": tmp_path / "new",
        "FILE": tmp_path / "layout.json",
    }  # fmt: skip
    words = [str(places.get(word, word)) for word in VERBS.get(verb, "--help").split()]
    code, err = _on_full_disk(verb, *words, *(["--json"] if json else []))
    assert code == ExitCode.BAD_INPUT
    said = [line for line in err.splitlines() if "No space left" in line]
    assert len(said) == 1
    assert "Traceback" not in err


BARE = "import pytest, real_runs; real_runs.leave_out_figures(pytest.MonkeyPatch())"
"""In front of the program: figures take longer than a quick run."""


def test_a_run_without_input_and_room_for_its_output_keeps_its_record(
    quick_plan: Path, tmp_path: Path
) -> None:
    """Its first file gets the number of no standard stream."""
    out = tmp_path / "run"
    program = [sys.executable, "-c", f"{BARE}; from stepload.cli.main import main; main()"]
    words = ["run", str(quick_plan), "--dry-run", "--json", "--out", str(out)]
    done = subprocess.run(
        ["sh", "-c", 'exec "$@" <&- >/dev/full', "sh", *program, *words],
        stderr=subprocess.PIPE, text=True, env={**ENVIRONMENT, "PYTHONPATH": ":".join(sys.path)},
    )  # fmt: skip
    assert done.returncode == ExitCode.BAD_INPUT
    assert done.stderr.splitlines()[-1].endswith("No space left on device")
    assert read_recording(out / "run.mcap").outcome["verdict"] == "marginal"


def test_closed_streams_change_no_exit_code() -> None:
    for words, code in (("explain R6 --json", 0), ("explain no-such-code", 2)):
        line = f'exec "$0" -m stepload {words} <&- >&- 2>&-'
        done = subprocess.run(["sh", "-c", line, sys.executable], env=ENVIRONMENT)
        assert done.returncode == code
