"""Calibration records: written, read, and doubted when they do not fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from stepload.plan.calibration import CalibrationRecord, read_calibration, write_calibration
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Provenance
from stepload.plan.problems import PlanError

WritePlan = Callable[..., Path]

RECORD = CalibrationRecord(
    rig="STVF",
    pose="straight down",
    direction="+fz",
    temperature_c=21.5,
    measured_on=date(2025, 3, 1),
    valid_until=date(2025, 6, 1),
    stiffness_n_per_m=3.3219e6 + 1.0 / 3.0,
    sigma_n_per_m=2.1e4,
    msde_m=5.4e-7,
    damping_n_s_per_m=1.9e4,
    force_from_n=120.0,
    force_to_n=300.0,
    run="runs/2025-03-01/run.mcap",
    software="0.1.0 — “ümlaut”",
    smooth_error_m=6.1e-7,
    smooth_degrees=2.5,
    simulated=True,
)
TODAY = date(2025, 4, 1)


def planned(
    write_plan: WritePlan, tmp_path: Path, record: CalibrationRecord | None, policy: str = "warn"
) -> Plan:
    if record is not None:
        write_calibration(record, tmp_path / "cal.json")
    rig = (
        "rig: {profile: stvf, arm: {pose: straight down}, "
        f"system_stiffness: {{record: cal.json, policy: {policy}}}}}\n"
        "identify: {temperature: 23 degC}"
    )
    return load_plan(write_plan(("rig: stvf", rig)), today=TODAY)


def test_what_is_written_is_read_back_exactly(tmp_path: Path) -> None:
    path = tmp_path / "cal.json"
    bare = replace(RECORD, temperature_c=None, pose="", run="", software="", smooth_error_m=None)
    for record in (RECORD, bare):
        write_calibration(record, path)
        assert read_calibration(path) == record
    assert [p.name for p in tmp_path.iterdir()] == ["cal.json"]


def test_a_valid_record_replaces_the_profile(write_plan: WritePlan, tmp_path: Path) -> None:
    stiffness = planned(write_plan, tmp_path, RECORD, "refuse").rig.system_stiffness
    assert stiffness.stiffness_n_per_m == RECORD.stiffness_n_per_m
    assert stiffness.provenance is Provenance.MEASURED
    assert stiffness.record == tmp_path / "cal.json"
    assert stiffness.valid_until == date(2025, 6, 1)
    assert stiffness.validity_problem == ""
    assert stiffness.smooth_error_m == RECORD.smooth_error_m
    assert stiffness.smooth_degrees == RECORD.smooth_degrees


def test_the_record_is_kept_with_the_plan(write_plan: WritePlan, tmp_path: Path) -> None:
    sources = planned(write_plan, tmp_path, RECORD).sources
    assert (tmp_path / "cal.json").read_text() in [source.text for source in sources]


@pytest.mark.parametrize(
    ("record", "problem"),
    [
        (None, "cal.json does not exist"),
        (replace(RECORD, valid_until=date(2025, 3, 31)), "expired on 2025-03-31"),
        (replace(RECORD, rig="other"), "made for the rig 'other', this is 'STVF'"),
        (replace(RECORD, pose="sideways"), "measured in pose 'sideways'"),
        (replace(RECORD, direction="-fz"), "measured in direction '-fz'"),
        (replace(RECORD, temperature_c=29.0), "measured at 29 °C, this is 23 °C"),
    ],
)
def test_a_record_that_does_not_fit_is_doubted_or_refused(
    write_plan: WritePlan, tmp_path: Path, record: CalibrationRecord | None, problem: str
) -> None:
    stiffness = planned(write_plan, tmp_path, record).rig.system_stiffness
    assert problem in stiffness.validity_problem
    believed = RECORD.stiffness_n_per_m if record else 3.49e6
    assert stiffness.stiffness_n_per_m == believed
    with pytest.raises(PlanError) as caught:
        planned(write_plan, tmp_path, record, "refuse")
    assert [p.line for p in caught.value.problems] == [3]
    assert problem in caught.value.problems[0].message


def test_its_last_day_is_still_valid(write_plan: WritePlan, tmp_path: Path) -> None:
    record = replace(RECORD, valid_until=TODAY)
    assert planned(write_plan, tmp_path, record).rig.system_stiffness.validity_problem == ""


def test_a_missing_record_with_nothing_to_stand_in_is_an_error(write_plan: WritePlan) -> None:
    rig = "rig: {profile: stvf, system_stiffness: {value: ~, sigma: ~, record: cal.json}}"
    with pytest.raises(PlanError, match=r"cal\.json does not exist"):
        load_plan(write_plan(("rig: stvf", rig)))


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('"2100', '"-2100', 10, "out of range"),
        (" N/m", " N", 9, "is a force, not a stiffness"),
        ('"direction": "+fz"', '"direction": "up"', 5, "not a choice"),
        ("2025-06-01", "2025-02-01", 1, "before measured_on"),
        ('"rig": "STVF",', "", 1, "missing key 'rig'"),
        ('"run"', '"runn"', 17, "unknown key 'runn'"),
        ("{", "[", 20, "not YAML"),
    ],
)
def test_a_broken_record_is_an_error_at_its_place(
    write_plan: WritePlan, tmp_path: Path, old: str, new: str, line: int, message: str
) -> None:
    path = tmp_path / "cal.json"
    write_calibration(RECORD, path)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(PlanError) as caught:
        read_calibration(path)
    first = caught.value.problems[0]
    assert (first.line, Path(first.file).name) == (line, "cal.json")
    assert message in first.message
    with pytest.raises(PlanError) as in_plan:
        planned(write_plan, tmp_path, None)
    assert first in in_plan.value.problems
