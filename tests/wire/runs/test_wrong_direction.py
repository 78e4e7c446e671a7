"""The real UR driver with `approach` turned round, a soft ball near: the first way back presses."""

from __future__ import annotations

from dataclasses import replace

import pytest
from long_ones import long_rows

from stepload.feasibility.preflight import preflight_of
from stepload.record.outcome import RunStatus
from stepload.session import experiment, files


@pytest.mark.parametrize(
    ("surface_m", "rule", "pressed"),
    [(1.5e-4, "pressed_back", True), *long_rows([(1e-3, "R8", False)])],
)
def test_an_approach_that_is_turned_round_ends_unloaded(
    surface_m, rule, pressed, emulated_run, tmp_path, monkeypatch
):
    monkeypatch.setattr(experiment, "run_document", lambda findings: None)
    monkeypatch.setattr(files, "render", lambda page: "")
    run = emulated_run(
        elastic_limit_n=80.0, surface_distance_m=1e-3, surface_uncertainty_m=5e-4,
        retract_m=3.9e-3, world={"surface_m": surface_m},
    )  # fmt: skip
    rig = run.plan.rig
    options = {**rig.arm.options, "approach": (0.0, 0.0, 1.0)}
    arm = replace(rig.arm, options=options)
    plan = replace(run.plan, rig=replace(rig, arm=arm))
    finished = experiment.run_plan(preflight_of(plan), dry_run=False, out=tmp_path)
    outcome, truth = finished.outcome, run.rig.state()
    assert outcome.status is RunStatus.STOPPED
    assert outcome.cause.rule == rule, outcome.why
    assert ("approach" in outcome.cause.message) == pressed
    assert truth["contact_n"] == 0.0
    assert (truth["peak_n"] > 0.5) == pressed
    assert truth["peak_n"] < 20.0
