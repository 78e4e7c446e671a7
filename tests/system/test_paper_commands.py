"""The commands of docs/paper.md do what they say, in the order in which they stand there."""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
import sys
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from real_runs import ROOT, leave_out_figures

from stepload.cli.main import main
from stepload.plan.calibration import read_calibration
from stepload.report.run_record import saved_run
from stepload_verify.paper import document, simulated

PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
pytestmark = [pytest.mark.long, pytest.mark.timeout(900)]  # four whole experiments in a row

PLANS = ("sphere.yaml", "instron.yaml")
"""What the page calls its plans, in their order."""


def _commands() -> list[tuple[str, ...]]:
    lines = re.findall(r"^\$ stepload (.*)$", PAGE, re.MULTILINE)
    return [tuple(shlex.split(line, comments=True)) for line in lines]


def _refused(command: tuple[str, ...]) -> bool:
    return bool(re.search(rf"^\$ stepload {' '.join(command)} +# refused", PAGE, re.MULTILINE))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands are typed."""
    return tmp_path_factory.mktemp("paper")


@pytest.fixture(scope="module")
def answers(place: Path) -> dict[str, dict[str, Any]]:
    """Every command of the page, run in one directory; its JSON by its text."""
    blocks = re.findall(r"^```yaml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    for name, text in zip(PLANS, blocks, strict=True):
        assert f"`{name}`" in PAGE
        (place / name).write_text(_sooner(text), encoding="utf-8")
    found = {}
    for command in _commands():
        code, text, told = _typed(place, command)
        assert code == (3 if _refused(command) else 0), (command, told)
        if command[:2] == ("plans", "copy"):
            plan = place / f"{command[2]}.yaml"
            plan.write_text(_sooner(plan.read_text(encoding="utf-8")), encoding="utf-8")
        found[" ".join(command)] = json.loads(text)
    return found


def _sooner(plan: str) -> str:
    """The plan with short waits, a short search and one cycle in place of three."""
    short = (
        "hold: 0.3 s",
        "tare: 0.3 s",
        "warm_up: 0 s",
        "settle_timeout: 0.3 s",
        "touches: 1",
        "surface_uncertainty: 0.3 mm",
    )
    plan = re.sub(r" *surface_uncertainty: .*?(,|\n)", "", plan)
    changed, count = re.subn(r"( *)hold: \d+ s(,|\n)", partial(_instead, short), plan)
    assert count == 1, plan
    return changed.replace("cycles: 3", "cycles: 1")


def _instead(lines: tuple[str, ...], hold: re.Match[str]) -> str:
    indent, end = hold.groups()
    return "".join(f"{indent}{line}{end}" for line in lines)


def _typed(place: Path, command: tuple[str, ...]) -> tuple[int, str, str]:
    """One command in `place`, with --json: exit code, standard output, standard error."""
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(place),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(sys, "argv", ["stepload", *command, "--json"])
        leave_out_figures(patch)
        patch.setattr(simulated, "RUNS", 3)
        with pytest.raises(SystemExit) as done:
            main()
    return int(done.value.code or 0), out.getvalue(), err.getvalue()


def _answer(answers: dict[str, dict[str, Any]], begin: str) -> dict[str, Any]:
    (found,) = (data for command, data in answers.items() if command.startswith(begin))
    return found


def test_the_page_shows_every_step(answers: dict[str, dict[str, Any]]) -> None:
    verbs = [command.split()[0] for command in answers]
    shown = "paper plans calibrate run predict identify compare preflight"
    assert set(shown.split()) == set(verbs)


def test_the_page_and_its_curves_are_written(
    place: Path, answers: dict[str, dict[str, Any]]
) -> None:
    written = _answer(answers, "paper")
    assert written["page"] == "paper.md"
    assert len(written["differs"]) > 5
    assert (place / "paper.md").read_text().startswith("# Against the paper\n")
    for file in (ROOT / "docs" / "paper").iterdir():
        made = (place / "paper" / file.name).read_bytes()
        assert made == file.read_bytes() or file.suffix == ".svg" or file.name == document.KEPT


def test_the_runs_go_by_the_record_that_was_made(
    place: Path, answers: dict[str, dict[str, Any]]
) -> None:
    record = read_calibration(place / "calibration" / "stvf.json")
    assert _answer(answers, "calibrate")["calibration"]["run"] == record.run
    for test in ("test-1", "test-2"):
        run = next(data for text, data in answers.items() if text.endswith(f"--out {test}"))
        assert run["status"] == "completed"
        sources = saved_run(place / test).conditions.sources
        assert sources.system_stiffness_n_per_m == pytest.approx(record.stiffness_n_per_m)
    again = _answer(answers, "identify test-1")
    assert set(again["fits"]) >= {"rs_btls", "joint"}
