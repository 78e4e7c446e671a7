"""A run takes as long as its schedule says, in virtual time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from lab_plans import plan_of, rows

from stepload.envelope.envelope import envelope_of
from stepload.record.outcome import RunStatus
from stepload.session.experiment import run_plan

WITHIN = 0.1
SHORT = {"tare_s": 1.0, "touches": 2, "surface_distance_m": 1e-3, "surface_uncertainty_m": 3e-4}


@pytest.mark.parametrize(
    ("name", "levels_n"),
    [
        ("acetal-stvf", (50.0, 250.0)),
        ("silicone-ur5e-class", (16.0, 40.0)),  # the step controller is slow at first
        ("rubber-pad-ur10e", (30.0, 50.0)),
        ("tpu-dome-stvf", (10.0, 20.0)),  # the cap on the speed in contact binds
    ],
)
def test_a_run_takes_as_long_as_is_said(
    name: str, levels_n: tuple[float, ...], tmp_path: Path
) -> None:
    [text] = [text for each, _, _, text in rows() if each == name]
    plan = plan_of(text, name, tmp_path)
    steps = {"levels_n": levels_n, "top_force_n": levels_n[-1], "step_n": levels_n[0]}
    plan = replace(plan, procedure=replace(plan.procedure, **SHORT, **steps))
    envelope = envelope_of(plan)
    finished = run_plan(envelope, dry_run=True, out=tmp_path / "run")
    assert finished.outcome.status is RunStatus.COMPLETED
    assert finished.data["duration_s"] == pytest.approx(envelope.duration_s, rel=WITHIN)
