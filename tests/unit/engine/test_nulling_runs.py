"""Whole runs in the six-axis world whose force across the approach is taken off."""

from __future__ import annotations

import math
from typing import Any

import pytest
from long_ones import long
from run_bench import bench_for, run
from tilted_plans import tilted_plan

from stepload.plan.model import Nulling


def nulled_run(true_over_believed: float, friction: float = 0.1, **sensor: Any) -> Any:
    """A run in the six-axis world, whose tip is 1.45e5 N/m stiff across when it sticks."""
    requested = Nulling(sensor_turn_rad=sensor.pop("said_rad", 0.0))
    plan = tilted_plan(
        0.5, friction=friction, alignment=None, nulling=requested,
        lateral_stiffness_n_per_m=1.45e5 / true_over_believed, **sensor,
    )  # fmt: skip
    bench = bench_for(plan)
    engine = run(bench)
    return bench, engine, [event[2] for event in engine.events if event[1] == "nulled"]


@pytest.mark.parametrize("times", [1.0, *long((0.5, 3.0))])
def test_in_the_world_with_six_axes_the_force_goes_and_the_tool_stays_near(times: float) -> None:
    bench, engine, told = nulled_run(times)
    assert engine.cause is None
    assert len(told) == 2
    assert all(each["why"] == "gone" for each in told)
    assert all(each["after_n"] < 0.25 * each["before_n"] for each in told[-1:])
    assert max(math.hypot(*each["shift_m"]) for each in told) <= 3e-4
    assert bench.peak_n < bench.limits.force_limit_n


def test_a_sensor_that_is_turned_is_believed_where_the_plan_says_so() -> None:
    _, engine, told = nulled_run(1.0, sensor_turn_rad=math.pi / 2, said_rad=math.pi / 2)
    assert engine.cause is None
    assert all(each["why"] == "gone" for each in told)


def test_a_sensor_that_is_turned_otherwise_ends_it_for_the_run() -> None:
    bench, engine, told = nulled_run(1.0, sensor_turn_rad=math.pi)
    assert [each["why"] for each in told] == ["useless"]
    assert told[0]["after_n"] < told[0]["before_n"] + 2.0
    assert engine.cause is None
    assert bench.peak_n < bench.limits.force_limit_n
