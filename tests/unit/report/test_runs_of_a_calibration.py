"""Runs that make no calibration together: one was stopped, or they tell different things."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from run_plans import stvf_plan

from stepload.errors import BadInputError
from stepload.feasibility.preflight import preflight_of
from stepload.report.calibration import across_of_runs, from_system_runs
from stepload.report.conditions import planned
from stepload.report.run_record import SavedRun

GUIDED = planned(preflight_of(stvf_plan()))
ARM = replace(GUIDED, arm=True)


def run(name: str, conditions: Any = ARM, across: bool = True, cut: str = "") -> SavedRun:
    data = SimpleNamespace(across_n=np.zeros((3, 2)) if across else None)
    told = {"run_id": name, "started": "2026-11-25T10:00:00+00:00"}
    return SavedRun(
        Path(f"{name}.mcap"), cast(Any, data), conditions, told, partial=False, cut=cut
    )  # fmt: skip


def test_a_run_that_was_stopped_makes_no_calibration_and_its_reason_is_said() -> None:
    stopped = run("b", cut="stopped by R12: the force across is 31 % of that along")
    with pytest.raises(BadInputError, match=r"b\.mcap: stopped by R12: the force across") as told:
        from_system_runs([run("a"), stopped])
    assert "press again" in str(told.value.hint)


def test_a_run_of_a_guided_axis_does_not_take_the_three_numbers_along() -> None:
    with pytest.raises(BadInputError, match="differ in their structure"):
        from_system_runs([run("a"), run("b", GUIDED)])


def test_a_run_without_the_force_across_does_not_take_the_three_numbers_along() -> None:
    with pytest.raises(BadInputError, match=r"b\.mcap: no lateral force is told there"):
        across_of_runs([run("a"), run("b", across=False)])
    _, alone = across_of_runs([run("a", across=False), run("b", across=False)])
    assert list(map(bool, alone.values())) == [True]
    _, guided = across_of_runs([run("a", GUIDED), run("b", GUIDED, across=False)])
    assert guided == {"across_told": ""}
