"""A run asks the arm how it stands once it is open, and before anything moves."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from stepload.engine.open_rig import OpenRig, opened
from stepload.engine.operator import Operator, StopLevel
from stepload.errors import RefusedError
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, RecordPolicy
from stepload.record.reader import read_recording
from stepload.report.conditions import FILE
from stepload.rig.device import ArmConfiguration
from stepload.rig.pose import from_texts
from stepload.session.experiment import run_plan

PLAN = Path(__file__).resolve().parents[3] / "procedures" / "plastic-sphere.yaml"
JOINTS = (0.1, -1.5, 1.2, -1.3, -1.57, 0.0)
ELSEWHERE = ArmConfiguration((0.1, -1.4, 1.2, -1.3, -1.57, 0.0))


def calibrated(policy: RecordPolicy) -> Plan:
    plan = load_plan(PLAN)
    stiffness = replace(plan.rig.system_stiffness, joints_rad=JOINTS, policy=policy)
    return replace(plan, rig=replace(plan.rig, system_stiffness=stiffness))


def standing(
    stands: ArmConfiguration, rigs: list[OpenRig]
) -> Callable[..., AbstractContextManager[OpenRig]]:
    """Opens the simulated rig with an arm that says it stands so."""

    @contextmanager
    def open_rig(preflight: Preflight, **how: Any) -> Iterator[OpenRig]:
        with opened(preflight, **how) as rig:
            rigs.append(replace(rig, stands=stands))
            yield rigs[-1]

    return open_rig


def test_elsewhere_nothing_moves_where_the_policy_is_to_refuse(tmp_path: Path) -> None:
    rigs: list[OpenRig] = []
    with pytest.raises(RefusedError, match="another pose than the arm stands in"):
        run_plan(
            preflight_of(calibrated(RecordPolicy.REFUSE)), dry_run=True, out=tmp_path / "run",
            open_rig=standing(ELSEWHERE, rigs),
        )  # fmt: skip
    assert len(rigs) == 1  # it was open, and no record was begun: no tick has run
    assert not (tmp_path / "run").exists()


def test_elsewhere_the_record_and_its_limits_go_by_what_is_left_of_the_stiffness(
    tmp_path: Path,
) -> None:
    operator = Operator()
    operator.request_stop(StopLevel.NOW)
    preflight = preflight_of(calibrated(RecordPolicy.WARN))
    run_plan(
        preflight, dry_run=True, out=tmp_path / "run", operator=operator,
        open_rig=standing(ELSEWHERE, []),
    )  # fmt: skip
    recording = read_recording(tmp_path / "run" / "run.mcap")
    assert from_texts(recording.metadata) == ELSEWHERE
    assert recording.metadata["simulated"] == "true"
    assert recording.metadata["calibration"] == "indicative"
    sources = json.loads(recording.attachments[FILE])["sources"]
    stated = preflight.plan.rig.system_stiffness.stiffness_n_per_m
    assert sources["system_stiffness_sigma_n_per_m"] == pytest.approx(0.34 * stated)
    assert sources["deflection_force_n"] == []
    told = json.loads(recording.attachments["preflight.json"])
    assert "calibration_record" in {reason["code"] for reason in told["reasons"]}
