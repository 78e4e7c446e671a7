"""Limits of the computer, from either side: late ticks, disk, wall clock."""

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


@pytest.mark.parametrize("step_s", [1e-2, -1e-2])
def test_a_wall_clock_that_steps_either_way_is_told(step_s):
    assert host.check_wall_clock(step_s).mark is Mark.WARN
    assert host.check_wall_clock(0.1 * step_s).mark is Mark.OK


def disk_lines(tmp_path, monkeypatch, speed=100.0, sync_s=0.0, room=100.0):
    """Lines of a disk that takes `speed` times what a run writes, and has room for so many."""
    plan = stvf_plan()
    plan = replace(plan, record=replace(plan.record, directory=tmp_path / "runs"))
    needed = host.bytes_per_s(plan)
    times_s = [max(sync_s, host.BLOCK_BYTES / (speed * needed))] * host.BLOCKS
    monkeypatch.setattr(host, "_sync_times_s", lambda directory: times_s)
    free = SimpleNamespace(free=room * needed * host.LONG_RUN_S)
    monkeypatch.setattr("stepload.setup.host.shutil.disk_usage", lambda path: free)
    return {line.name: line.mark for line in host.check_disk(plan)}


@pytest.mark.parametrize(("times", "mark"), [(11.0, Mark.OK), (3.0, Mark.WARN), (1.5, Mark.FAIL)])
def test_a_disk_is_faster_than_a_run_and_has_room_for_two(tmp_path, monkeypatch, times, mark):
    assert disk_lines(tmp_path, monkeypatch, speed=times)["disk speed"] is mark
    assert disk_lines(tmp_path, monkeypatch, room=times)["disk space"] is mark


def test_a_disk_that_cannot_be_written_fails(tmp_path, monkeypatch):
    def full(directory):
        raise OSError(28, "no space left")

    plan = stvf_plan()
    plan = replace(plan, record=replace(plan.record, directory=tmp_path))
    monkeypatch.setattr(host, "_sync_times_s", full)
    [line] = host.check_disk(plan)
    assert line.mark is Mark.FAIL
