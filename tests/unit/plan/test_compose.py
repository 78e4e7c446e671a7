"""A rig of parts: what a data sheet brings, and what is never taken of another device."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError, Problem

WritePlan = Callable[..., Path]

ARM = "arm: {options: {host: 127.0.0.1}}"
UART = "profile: robotous-rft64-6a01-uart, axis: +fx, options: {port: /dev/null}"


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


def test_a_simulated_driver_plays_the_sensor_that_is_declared(write_plan: WritePlan) -> None:
    rig = loaded(write_plan, "profile: ur5e, arm: {driver: sim}, force: {driver: sim}").rig
    assert (rig.force.axis, rig.force.noise_n) == ("-fz", 0.15)
