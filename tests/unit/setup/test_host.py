"""Limits of the computer, from either side: late ticks, room on the disk."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from run_plans import stvf_plan

from stepload.setup import host
from stepload.setup.check_line import Mark


@pytest.mark.parametrize(("late", "mark"), [(0, Mark.OK), (2, Mark.WARN), (6, Mark.FAIL)])
def test_of_a_hundred_ticks_five_may_be_late(late, mark):
    [line] = host.check_lateness([3e-3] * late + [1e-4] * (100 - late), 2e-3)
    assert line.mark is mark


@pytest.mark.parametrize(("times", "mark"), [(11.0, Mark.OK), (3.0, Mark.WARN), (1.5, Mark.FAIL)])
def test_a_disk_has_room_for_two_runs(tmp_path, monkeypatch, times, mark):
    plan = stvf_plan()
    plan = replace(plan, record=replace(plan.record, directory=tmp_path / "runs"))
    free = SimpleNamespace(free=times * host.bytes_per_s(plan) * host.LONG_RUN_S)
    monkeypatch.setattr("stepload.setup.host.shutil.disk_usage", lambda path: free)
    assert host.check_disk(plan).mark is mark
