"""A rig of parts: what a data sheet brings, and what is never taken of another device."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from stepload.plan.compose import problems_of
from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Provenance
from stepload.plan.problems import PlanError, Problem
from stepload.plan.references import data_sheets, read_data_sheet
from stepload.plan.tree import Mapping, parse_tree

WritePlan = Callable[..., Path]

ARM = "arm: {options: {host: 127.0.0.1}}"
UART = "profile: robotous-rft64-6a01-uart, axis: +fx, options: {port: /dev/null}"
FIGURES = "rate: 1 kHz, range: 500 N, resolution: 0.1 N, noise: 0.2 N, delay: 2 ms"


def loaded(write_plan: WritePlan, rig: str) -> Plan:
    return load_plan(write_plan(("rig: stvf", f"rig: {{{rig}}}"), ("300 N", "100 N")))


def refused(write_plan: WritePlan, rig: str) -> list[Problem]:
    with pytest.raises(PlanError) as caught:
        loaded(write_plan, rig)
    return list(caught.value.problems)


def test_a_sensor_brings_its_data_sheet_and_the_rig_its_mounting(write_plan: WritePlan) -> None:
    plan = loaded(write_plan, f"profile: ur10e, {ARM}, force: {{{UART}}}")
    force = plan.rig.force
    assert (force.driver, force.options["port"]) == ("robotous_uart", "/dev/null")
    assert (force.range_n, force.resolution_n, force.axis) == (200.0, 0.2, "+fx")
    assert plan.rig.arm.max_push_n == 340.0
    named = [source.name for source in plan.sources]
    assert "data sheet robotous-rft64-6a01-uart" in named  # the record keeps its text


def test_a_plan_may_correct_a_data_sheet(write_plan: WritePlan) -> None:
    sensor = UART.replace("axis", "noise: 0.05 N, axis")
    plan = loaded(write_plan, f"profile: ur10e, {ARM}, force: {{{sensor}}}")
    assert (plan.rig.force.noise_n, plan.rig.force.range_n) == (0.05, 200.0)


def test_the_second_sensor_has_a_data_sheet_of_its_own(write_plan: WritePlan) -> None:
    bota = "force: {options: {port: /dev/null}}"
    second = f"second_force: {{source: sensor, sensor: {{{UART}}}}}"
    rig = loaded(write_plan, f"profile: ur10e, {ARM}, {bota}, {second}").rig
    assert rig.second_force.sensor is not None
    assert (rig.second_force.sensor.range_n, rig.force.range_n) == (200.0, 1000.0)


@pytest.mark.parametrize("key", ["axis", "rate", "range", "resolution", "noise", "delay"])
def test_nothing_is_taken_of_another_sensor(write_plan: WritePlan, key: str) -> None:
    figures = {
        "axis": "-fz", "rate": "1 kHz", "range": "500 N", "resolution": "0.1 N", "noise": "0.2 N",
        "delay": "2 ms",
    }  # fmt: skip
    del figures[key]
    written = ", ".join(f"{each}: {value}" for each, value in figures.items())
    force = f"force: {{driver: robotous_uart, options: {{port: /dev/null}}, {written}}}"
    found = refused(write_plan, f"profile: ur10e, {ARM}, {force}")
    assert any(f"missing key {key!r}" in problem.message for problem in found)
    assert {(Path(p.file).name, p.line) for p in found} == {("plan.yaml", 3)}


def test_what_was_optional_is_not_taken_either(write_plan: WritePlan) -> None:
    force = f"force: {{driver: bota_serial, axis: +fz, options: {{port: /dev/null}}, {FIGURES}}}"
    kept = loaded(write_plan, f"profile: ur10e, {ARM}, {force}").rig.force
    other = force.replace("bota_serial", "robotous_uart")
    dropped = loaded(write_plan, f"profile: ur10e, {ARM}, {other}").rig.force
    assert (kept.drift_n_per_s, dropped.drift_n_per_s) == (0.01, 0.0)


def test_the_problem_names_the_profile_and_the_data_sheets(write_plan: WritePlan) -> None:
    force = "force: {driver: robotous_uart, options: {port: /dev/null}}"
    problem = refused(write_plan, f"profile: ur10e, {ARM}, {force}")[0]
    assert "another device than that of the profile ur10e, bota_serial" in problem.message
    assert "robotous-rft64-6a01-uart" in problem.hint


def test_a_data_sheet_has_no_axis(write_plan: WritePlan) -> None:
    force = f"force: {{{UART.replace('axis: +fx, ', '')}}}"
    found = refused(write_plan, f"profile: ur10e, {ARM}, {force}")
    assert any("missing key 'axis'" in problem.message for problem in found)


def test_an_unknown_data_sheet_is_refused_with_those_there_are(write_plan: WritePlan) -> None:
    force = "force: {profile: robotous-rft64, axis: -fz}"
    (problem,) = refused(write_plan, f"profile: ur10e, {ARM}, {force}")
    assert "'robotous-rft64' is no data sheet" in problem.message
    assert all(name in problem.hint for name in data_sheets())


def test_a_data_sheet_is_of_one_driver(write_plan: WritePlan) -> None:
    force = f"force: {{{UART}, driver: bota_serial}}"
    found = refused(write_plan, f"profile: ur10e, {ARM}, {force}")
    assert any("this data sheet is of the driver robotous_uart" in p.message for p in found)


def test_a_simulated_driver_plays_the_sensor_that_is_declared(write_plan: WritePlan) -> None:
    rig = loaded(write_plan, "profile: ur5e, arm: {driver: sim}, force: {driver: sim}").rig
    assert (rig.force.axis, rig.force.noise_n) == ("-fz", 0.15)


def test_another_arm_is_another_rig(write_plan: WritePlan) -> None:
    found = refused(write_plan, "profile: stvf, arm: {driver: ur, options: {host: 127.0.0.1}}")
    said = [problem.message for problem in found]
    assert any("missing key 'max_push'" in each for each in said)
    assert any("system_stiffness of the profile stvf does not hold" in each for each in said)
    assert any("second_force of the profile stvf does not hold" in each for each in said)


def test_a_stated_stiffness_does_not_hold_with_another_sensor(write_plan: WritePlan) -> None:
    sensor = f"profile: stvf, force: {{{UART}}}"
    said = [problem.message for problem in refused(write_plan, sensor)]
    assert any("system_stiffness of the profile stvf does not hold" in each for each in said)
    own = "system_stiffness: {value: 3 MN/m, sigma: 1 MN/m, provenance: indicative}"
    rig = loaded(write_plan, f"{sensor}, {own}").rig
    assert rig.system_stiffness.provenance is Provenance.INDICATIVE


def test_a_rig_without_profile_has_nothing_to_leave_behind() -> None:
    empty = Mapping(parse_tree(read_data_sheet("bota-rokubi-serial"))[0].place)
    assert list(problems_of(empty, empty, None, "")) == []


@pytest.mark.parametrize("name", data_sheets())
def test_every_data_sheet_tells_all_but_the_mounting(write_plan: WritePlan, name: str) -> None:
    sheet, problems = parse_tree(read_data_sheet(name))
    assert not problems
    assert isinstance(sheet, Mapping)
    assert not {"axis", "profile", "max_age"} & set(sheet.entries)
    told = {"gain_uncertainty", "nonlinearity", "drift", "noise", "range", "resolution", "delay"}
    assert told <= set(sheet.entries)
    for line in read_data_sheet(name).text.splitlines():
        if line.partition(":")[0] in told - {"range"}:
            assert "#" in line, "a number says where it is from"
    address = {
        "robotous_can": "channel",
        "ati_can": "channel",
        "ati_net": "host",
        "ur_force": "host",
    }
    driver = sheet.entries["driver"]
    option = address.get(str(getattr(driver, "value", "")), "port")
    force = f"{{profile: {name}, axis: -fz, options: {{{option}: here}}}}"
    force_spec = loaded(write_plan, f"profile: ur10e, {ARM}, force: {force}").rig.force
    assert force_spec.resolution_n <= 0.07 * force_spec.range_n
