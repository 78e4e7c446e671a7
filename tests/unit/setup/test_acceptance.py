"""The last steps: doctor and touch ask first, and believe only what is sound and complete."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
from bench_fakes import DAY, Rig, setup_of

from stepload.errors import RefusedError
from stepload.record.outcome import RunStatus, Touch
from stepload.setup import acceptance
from stepload.setup.check_line import CheckLine, Mark
from stepload.setup.checkup import Checkup

NAN = math.nan
OK = CheckLine("arm: stop", Mark.OK, NAN, NAN, "", "")
SKIPPED = CheckLine("arm: watchdog", Mark.SKIPPED, NAN, NAN, "", "none to prove")


@pytest.fixture
def done(monkeypatch):
    """What was done, in order; plans are not read."""
    log = []
    monkeypatch.setattr(acceptance, "load_plan", lambda path: None)
    monkeypatch.setattr(acceptance, "preflight_of", lambda plan: SimpleNamespace(reasons=()))
    monkeypatch.setattr(acceptance, "touch_plan", lambda answers, rig, path: ("a plan", 2.0))
    monkeypatch.setattr(acceptance, "stands_at_start", lambda setup: log.append("at start"))
    return log


def examined(monkeypatch, done, *lines):
    def examine(preflight, **how):
        done.append(how)
        figures = {("force", "noise"): (0.2, "N", "at rest")}
        return Checkup(lines, "", figures)

    monkeypatch.setattr(acceptance.checkup, "examine", examine)


def test_the_doctor_moves_the_real_rig_and_says_what_it_did_not_look_at(monkeypatch, done):
    examined(monkeypatch, done, OK, SKIPPED)
    found = acceptance.doctor(setup_of(Rig()))
    [how] = done
    assert (how["dry_run"], how["still"]) == (False, False)
    assert found.notes == ("the doctor found nothing that fails; not looked at: arm: watchdog",)
    assert found.values["force.noise"].text == "200 mN"


def test_the_doctor_does_not_move_the_arm_without_consent(monkeypatch, done):
    examined(monkeypatch, done, OK)
    with pytest.raises(RefusedError, match="The answer was no"):
        acceptance.doctor(setup_of(Rig(), may_move="no"))
    assert done == []


def touching(tmp_path, done, status=RunStatus.COMPLETED, **answers):
    def press(preflight, directory):
        done.append(directory)
        touch = Touch(0.0, 3e-3, 1.0, 1e-3, 1, "")
        return SimpleNamespace(status=status, why="stopped: R1", peak_force_n=4.0, touches=[touch])

    return replace(setup_of(Rig(), **answers), rig=tmp_path / "rig.yaml", press=press)


def test_a_touch_begins_with_consent_where_the_arm_was_led(tmp_path, done):
    acceptance.touch(touching(tmp_path, done))
    assert done == ["at start", tmp_path / "runs" / f"touch-{DAY}-1"]


def test_nothing_is_touched_without_consent(tmp_path, done):
    with pytest.raises(RefusedError, match="The answer was no"):
        acceptance.touch(touching(tmp_path, done, may_touch="no"))
    assert done == []


def test_nothing_is_touched_from_elsewhere(tmp_path, done, monkeypatch):
    def elsewhere(setup):
        raise RefusedError("the arm stands elsewhere", hint="")

    monkeypatch.setattr(acceptance, "stands_at_start", elsewhere)
    with pytest.raises(RefusedError, match="elsewhere"):
        acceptance.touch(touching(tmp_path, done))
    assert done == []
