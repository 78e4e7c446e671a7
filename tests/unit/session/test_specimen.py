"""A wrong specimen is told by the height of the first touch and the first level."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from run_plans import preflight_for, stvf_plan

from stepload.feasibility.preflight import Preflight
from stepload.plan.model import DisplacementSpec
from stepload.record.outcome import Touch
from stepload.record.rows import Phase
from stepload.session.specimen import SpecimenCheck

PREFLIGHT = preflight_for(stvf_plan())
TOUCH_N, LEVEL_N = 5.0, 50.0
SURFACE_M = PREFLIGHT.plan.procedure.surface_distance_m
ROOM_M = PREFLIGHT.plan.procedure.surface_uncertainty_m
STIFFNESS = PREFLIGHT.plan.rig.system_stiffness.stiffness_n_per_m


def _rule(
    check: SpecimenCheck, at_m: float, softer: float = 1.0, preflight: Preflight = PREFLIGHT
) -> str:
    """The stop of a run that touches there and deforms so many times what theory says."""
    law, causes = PREFLIGHT.theory.law, list[Any]()
    touch = Touch(0.0, at_m, TOUCH_N, 0.0, 1, "first")
    grown_m = softer * (law.deformation(LEVEL_N) - law.deformation(TOUCH_N))
    engine: Any = SimpleNamespace(
        course=SimpleNamespace(touches=[touch], start_m=0.0),
        row=SimpleNamespace(phase=Phase.DWELL, force_n=LEVEL_N, time_s=1.0),
        supervisor=SimpleNamespace(arm=SimpleNamespace(
            position_m=at_m + grown_m + (LEVEL_N - TOUCH_N) / STIFFNESS
        )),
        trip=causes.append,
    )  # fmt: skip
    for phase in (Phase.DWELL, Phase.LOAD, Phase.HOLD, Phase.HOLD):
        engine.row.phase = phase
        check(engine, preflight)
    return causes[0].message.rpartition(" by ")[2] if causes else ""


@pytest.mark.parametrize(
    ("away", "softer", "source"),
    [
        (0.0, 1.0, ""),
        (0.9, 1.0, ""),
        (-1.1, 1.0, "surface_distance"),
        (1.1, 1.0, "surface_distance"),
        (0.0, 1.7, ""),
        (0.0, 2.7, "theory"),
    ],
)
def test_against_the_plan(away: float, softer: float, source: str) -> None:
    assert _rule(SpecimenCheck(), SURFACE_M + away * ROOM_M, softer) == source


def test_a_gauge_does_not_measure_the_travel() -> None:
    gauge = DisplacementSpec(driver="sim", rate_hz=1000.0, resolution_m=1e-7)
    plan = replace(PREFLIGHT.plan, rig=replace(PREFLIGHT.plan.rig, displacement=gauge))
    preflight = replace(PREFLIGHT, plan=plan)
    assert _rule(SpecimenCheck(), SURFACE_M, 5.0, preflight) == ""
