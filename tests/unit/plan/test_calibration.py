"""Calibration records: written, read, and doubted when they do not fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import get_origin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_hints import quantity_in

from stepload.declaration.sections import Key, keys, schema_of
from stepload.identification.deflection import upper_stiffness_n_per_m
from stepload.plan.calibration import CalibrationRecord, read_calibration, write_calibration
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Provenance, RecordPolicy
from stepload.plan.problems import PlanError

WritePlan = Callable[..., Path]

RECORD = CalibrationRecord(
    stepload_calibration=1,
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
    smooth_length_n=47.0 + 1.0 / 3.0,
    deflection_force_n=(100.0, 200.0 + 1.0 / 3.0, 300.0),
    deflection_m=(3.1e-5, 6.1e-5, 9.1e-5 + 1e-7 / 3.0),
    deflection_sigma_m=(2e-7, 2e-7, 3e-7),
    deflection_common=1.0 / 3.0 * 1e-3,
    across_m_per_n=(3e-8, -1e-8),
    across_sigma_m_per_n=(1e-9, 2e-8),
    across_correlation=-0.25,
    at_share=(0.1, -0.05),
    share_reach=0.15,
    across_told="one way only",
    simulated=True,
    joints_rad=(0.1, -1.5 - 1.0 / 3.0, 1.2, -1.3, -1.57, 0.0),
    tcp_position_m=(0.0, -0.01, 0.12 + 1e-3 / 3.0),
    tcp_rotation_rad=(0.0, 0.0, 0.5),
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


def test_a_valid_record_replaces_the_profile(write_plan: WritePlan, tmp_path: Path) -> None:
    stiffness = planned(write_plan, tmp_path, RECORD, "refuse").rig.system_stiffness
    assert stiffness.stiffness_n_per_m == RECORD.stiffness_n_per_m
    assert stiffness.provenance is Provenance.MEASURED
    assert stiffness.record == tmp_path / "cal.json"
    assert stiffness.valid_until == date(2025, 6, 1)
    assert stiffness.validity_problem == ""
    assert stiffness.smooth_error_m == RECORD.smooth_error_m
    assert stiffness.smooth_degrees == RECORD.smooth_degrees


@pytest.mark.parametrize(
    ("record", "problem"),
    [
        (None, "cal.json does not exist"),
        (replace(RECORD, valid_until=date(2025, 3, 31)), "expired on 2025-03-31"),
        (replace(RECORD, measured_on=date(2025, 4, 3)), "measured on 2025-04-03, which is still"),
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
    expected = RECORD.stiffness_n_per_m if record else 3.49e6
    assert stiffness.stiffness_n_per_m == expected
    with pytest.raises(PlanError) as caught:
        planned(write_plan, tmp_path, record, "refuse")
    assert [p.line for p in caught.value.problems] == [3]
    assert problem in caught.value.problems[0].message


def test_every_value_of_the_record_takes_the_place_of_the_plans_own(
    write_plan: WritePlan, tmp_path: Path
) -> None:
    stiffness = planned(write_plan, tmp_path, RECORD).rig.system_stiffness
    for field in (
        "stiffness_n_per_m", "sigma_n_per_m", "msde_m", "damping_n_s_per_m", "smooth_error_m",
        "smooth_degrees", "smooth_length_n", "deflection_force_n", "deflection_m",
        "deflection_sigma_m", "deflection_common", "across_m_per_n", "across_sigma_m_per_n",
        "across_correlation", "at_share", "share_reach", "measured_on", "valid_until", "pose",
        "direction", "temperature_c", "simulated", "joints_rad", "tcp_offset",
    ):  # fmt: skip
        assert getattr(stiffness, field) == getattr(RECORD, field), field
    assert stiffness.policy is RecordPolicy.WARN


def test_a_record_is_looked_for_beside_the_file_that_names_it(
    write_plan: WritePlan, tmp_path: Path
) -> None:
    (tmp_path / "rigs").mkdir()
    write_calibration(RECORD, tmp_path / "rigs" / "cal.json")
    text = "profile: stvf\nsystem_stiffness: {record: cal.json}\n"
    (tmp_path / "rigs" / "ours.yaml").write_text(text)
    plan = load_plan(write_plan(("rig: stvf", "rig: rigs/ours.yaml")), today=TODAY)
    assert plan.rig.system_stiffness.record == tmp_path / "rigs" / "cal.json"
    assert plan.rig.system_stiffness.stiffness_n_per_m == RECORD.stiffness_n_per_m


def test_a_record_that_cannot_be_opened_is_reported_where_it_is_named(
    write_plan: WritePlan, tmp_path: Path
) -> None:
    (tmp_path / "cal.json").mkdir()
    with pytest.raises(PlanError) as caught:
        planned(write_plan, tmp_path, None)
    (problem,) = caught.value.problems
    assert (Path(problem.file).name, problem.line) == ("plan.yaml", 3)
    assert problem.message == "is not a regular file"


def _records() -> st.SearchStrategy[CalibrationRecord]:
    """Any record that a plan would take, by the declaration of each field."""

    def values(key: Key) -> st.SearchStrategy[object]:
        options = schema_of(key.hint).get("anyOf", [schema_of(key.hint)])
        schema = options[0]
        found: st.SearchStrategy[object]
        if quantity := quantity_in(key.hint):
            low, high, above = quantity.low, quantity.high, quantity.above
            found = st.floats(low, high, exclude_min=above, allow_subnormal=False)
        elif schema["type"] == "number":
            found = st.floats(schema["minimum"], schema["maximum"], allow_subnormal=False)
        elif "enum" in schema:
            found = st.sampled_from(schema["enum"])
        elif schema["type"] == "boolean":
            found = st.booleans()
        elif schema.get("format") == "date":
            found = st.dates()
        elif "const" in schema:
            found = st.just(schema["const"])
        else:
            most = schema["maxLength"]
            letters = st.characters(codec="utf-8").filter(str.isprintable)
            found = st.text(letters, min_size=1, max_size=most).map(str.strip).filter(bool)
        return st.none() | found if len(options) > 1 else found

    kept = {
        key.field: values(key)
        for key in keys(CalibrationRecord)
        if get_origin(key.info.annotation) is not tuple
    }
    rising = st.floats(1e-9, 10.0, exclude_min=True, allow_subnormal=False)
    rows = st.lists(st.tuples(rising, rising), max_size=9, unique_by=(itemgetter(0), itemgetter(1)))

    def complete(r: CalibrationRecord, table: list[tuple[float, float]]) -> CalibrationRecord:
        rows = sorted(f for f, _ in table), sorted(deep for _, deep in table)
        slope = upper_stiffness_n_per_m(*rows) if table else r.stiffness_n_per_m
        if not 1e3 <= slope <= 1e9:
            table, slope = [], r.stiffness_n_per_m
        return replace(
            r, stiffness_n_per_m=slope, sigma_n_per_m=min(r.sigma_n_per_m, 0.5 * slope),
            force_from_n=0.5 * r.force_to_n, measured_on=min(r.measured_on, r.valid_until),
            valid_until=max(r.measured_on, r.valid_until),
            deflection_force_n=tuple(sorted(force for force, _ in table)),
            deflection_m=tuple(sorted(deep for _, deep in table)),
            deflection_sigma_m=tuple(force / 3.0 for force, _ in table),
        )  # fmt: skip

    return st.builds(
        complete, st.fixed_dictionaries(kept).map(lambda x: CalibrationRecord(**x)), rows
    )


@pytest.mark.parametrize(
    "changes",
    [{"sigma_n_per_m": RECORD.stiffness_n_per_m}, {"force_from_n": 300.0, "force_to_n": 300.0}],
)
def test_a_record_that_contradicts_itself_is_refused(
    tmp_path: Path, changes: dict[str, float]
) -> None:
    path = tmp_path / "cal.json"
    write_calibration(replace(RECORD, **changes), path)
    with pytest.raises(PlanError):
        read_calibration(path)


@settings(max_examples=15, deadline=None)
@given(_records())
def test_any_record_is_read_back_exactly(record: CalibrationRecord) -> None:
    with TemporaryDirectory() as directory:
        path = Path(directory) / "cal.json"
        write_calibration(record, path)
        assert read_calibration(path) == record


def test_a_missing_record_with_nothing_to_stand_in_is_an_error(write_plan: WritePlan) -> None:
    sensor = "{profile: bota-rokubi-serial, axis: +fz, options: {port: x}}"
    rig = f"rig: {{profile: stvf, force: {sensor}, system_stiffness: {{record: cal.json}}}}"
    with pytest.raises(PlanError, match=r"cal\.json does not exist"):
        load_plan(write_plan(("rig: stvf", rig)))


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ('"2100', '"-2100', 10, "out of range"),
        (" N/m", " N", 9, "is a force, not a stiffness"),
        ('"direction": "+fz"', '"direction": "up"', 5, "not a choice"),
        ("2025-06-01", "2025-02-28", 8, "before measured_on"),
        ('"rig": "STVF",', "", 1, "missing key 'rig'"),
        ('"run"', '"runn"', 49, "unknown key 'runn'"),
        ("{", "[", 70, "a comma is missing before this"),
        ('"-0.01 m",', "", 1, "tcp_position and tcp_rotation: three numbers each, or none"),
        ('"0.1 rad"', '"0.1 m"', 53, "is a length, not an angle"),
        ('"200.33333333333334 N"', '"99.0 N"', 15, "a force of 99 after 100; they must rise"),
        ('"3.1e-05 m",', "", 15, "3 forces, 2 deflections and 3 uncertainties"),
        ('"9.103333333333334e-05 m"', '"9.1e-4 m"', 15, "the table has a stiffness of"),
        ('"3e-08 m/N",', "", 31, "across has 1 numbers; there are two other axes"),
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
