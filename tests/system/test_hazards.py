"""Nothing moves before somebody has read the hazards: the commands ask, refuse, and keep it."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest
from real_runs import ROOT, in_process

DEMO = (ROOT / "procedures/demo-wire.yaml").read_text()
UNREAD = "".join(row for row in DEMO.splitlines(keepends=True) if "hazards_read" not in row)
"""On an address at which nobody answers: the plan may run and its devices do not open."""


@pytest.fixture
def plan(tmp_path) -> Path:
    path = tmp_path / "plan.yaml"
    text = UNREAD.replace("payloads/", f"{ROOT}/procedures/payloads/")
    path.write_text(text.replace("host: 127.0.10.1", "host: 127.0.10.77"))
    return path


class _Terminal(io.StringIO):
    def isatty(self):
        return True


def _at_a_terminal(monkeypatch, answer):
    monkeypatch.setattr(sys, "stdin", _Terminal(answer))
    monkeypatch.setattr("stepload.cli.hazards._at_a_terminal", lambda: True)


@pytest.mark.parametrize("verb", ["run", "doctor"])
def test_without_a_terminal_one_line_says_it(plan, verb):
    said = in_process(verb, plan, cwd=plan.parent)
    assert said.returncode == 4  # nobody answers at the address of its devices
    assert said.stderr.splitlines()[0] == f"hazards not read yet: stepload hazards {plan}"


def test_yes_is_for_scripts(plan):
    said = in_process("run", plan, "--yes", cwd=plan.parent)
    assert said.returncode == 4, said.stderr
    assert "hazards" not in said.stderr


def test_whoever_signs_is_kept_and_not_asked_again(plan, monkeypatch):
    _at_a_terminal(monkeypatch, "Anna\n")
    said = in_process("run", plan, cwd=plan.parent)
    assert said.returncode == 4, said.stderr
    assert "can crush a hand" in said.stderr
    assert 'hazards_read_by: "Anna"' in plan.read_text()
    again = in_process("run", plan, cwd=plan.parent)
    assert again.returncode == 4
    assert "can crush a hand" not in again.stderr


def test_a_rehearsal_asks_nobody(plan):
    said = in_process("doctor", plan, "--dry-run", "--seconds", "0.2", cwd=plan.parent)
    assert "hazards" not in said.stderr


MOVE = ("drivers", "test", "ur", "--options", "host=127.0.10.77", "--move", "1 mm")


def test_the_contract_moves_no_arm_before_somebody_has_read_them(tmp_path, monkeypatch):
    said = in_process(*MOVE, cwd=tmp_path)
    assert said.returncode == 3, said.stderr
    assert "--move: nobody has confirmed to have read the hazards of the arm" in said.stderr
    assert "--yes in scripts" in said.stderr
    _at_a_terminal(monkeypatch, "\n")
    said = in_process(*MOVE, cwd=tmp_path)
    assert said.returncode == 3
    assert "can crush a hand" in said.stderr


@pytest.mark.parametrize("how", ["--yes", "name"])
def test_the_contract_goes_on_with_consent(tmp_path, monkeypatch, how):
    begun = []
    monkeypatch.setattr("stepload.rig.contract.run_trial", lambda trial: begun.append(trial) or [])
    if how == "name":
        _at_a_terminal(monkeypatch, "Anna\n")
    said = in_process(*MOVE, *([how] if how == "--yes" else []), cwd=tmp_path)
    assert said.returncode == 0, said.stderr
    assert begun[0].move_m == pytest.approx(1e-3)
