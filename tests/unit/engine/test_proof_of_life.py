"""Channels that are dead, reversed, swapped or off in gain never come as far as the approach."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from run_bench import Bench, bench_for, run, spec_for
from run_plans import stvf_plan, ur_plan

from stepload.plan.model import Plan, SecondForceSource
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import WorldFault

QUICK = {"touches": 1, "tare_s": 0.2, "hold_s": 0.2, "top_force_n": 100.0, "unload": False}
MASS_KG = 3.0
MAKERS = [stvf_plan, ur_plan]


def carrying(plan: Plan, *, second: str = "arm", both: bool = False) -> Plan:
    """A plan whose main channel, or both, carry a tool."""
    force = replace(plan.rig.force, tool_mass_kg=MASS_KG)
    other = plan.rig.second_force
    if second == "sensor":
        sensor = replace(plan.rig.force, axis="+fy")
        other = replace(
            other, source=SecondForceSource.SENSOR, noise_n=sensor.noise_n, sensor=sensor
        )
    if both:
        other = replace(other, tool_mass_kg=MASS_KG)
    return replace(plan, rig=replace(plan.rig, force=force, second_force=other))


def shaken(plan: Plan, *faults: WorldFault, until_s: float = 8.0) -> Bench:
    bench = bench_for(plan, spec=spec_for(plan, 1, faults))
    run(bench, until_s)
    return bench


def always(kind: str, magnitude: float = 0.0) -> WorldFault:
    return WorldFault(kind, 0.0, 600.0, magnitude)


def felt(bench: Bench) -> list[dict[str, Any]]:
    (told,) = [data for _, kind, data in bench.engine.events if kind == "proof_of_life"]
    channels: Any = told["channels"]
    return list(channels)


@pytest.mark.parametrize("second", ["arm", "sensor"])
@pytest.mark.parametrize("make", MAKERS)
def test_sound_channels_are_proven_and_the_run_goes_on(make: Any, second: str) -> None:
    bench = shaken(carrying(make(**QUICK), second=second, both=True), until_s=60.0)
    assert bench.engine.cause is None
    assert bench.engine.course.done
    assert [each["channel"] for each in felt(bench)] == ["rig.force", "rig.second_force"]
    for each in felt(bench):
        assert each["proven"]
        assert abs(each["felt_kg"] / MASS_KG - 1.0) < 0.2
        assert 0.0 < each["half_width_kg"] < 0.3 * MASS_KG


WRONG = [
    ("force_reversed", 0.0, "the sign is wrong"),
    ("force_swapped", 0.0, "along -fx instead"),
    ("force_stuck_mean", 0.0, "dead although its noise lives"),
    ("force_gain", 0.5, "gain is wrong by a factor of 0.5"),
    ("force_gain", 2.0, "gain is wrong by a factor of 2"),
    ("second_reversed", 0.0, "the sign is wrong"),
    ("second_swapped", 0.0, "along +fz instead"),
    ("second_stuck_mean", 0.0, "dead although its noise lives"),
    ("second_gain", 0.4, "gain is wrong by a factor of 0.4"),
    ("arm_force_reversed", 0.0, "the sign is wrong"),
    ("arm_force_deaf", 0.0, "dead although its noise lives"),
]


@pytest.mark.parametrize(("kind", "magnitude", "said"), WRONG)
@pytest.mark.parametrize("make", MAKERS)
def test_a_wrong_channel_ends_the_run_before_the_approach(
    make: Any, kind: str, magnitude: float, said: str
) -> None:
    second = "sensor" if kind.startswith("second") else "arm"
    bench = shaken(carrying(make(**QUICK), second=second, both=True), always(kind, magnitude))
    cause = bench.engine.cause
    assert cause is not None
    assert cause.rule == "proof_of_life"
    named = "force sensor" if kind.startswith("force") else "second force channel"
    assert cause.message.startswith(f"the {named} felt")
    assert said in cause.message
    assert bench.peak_n == 0.0
    assert bench.engine.safe_reached


@pytest.mark.parametrize(
    ("gain", "late_s"), [(2.0, 0.03), (1.0, 0.03), (1.0, 0.05)], ids=["gain", "weak", "dead"]
)
def test_a_late_channel_is_not_taken_for_a_wrong_or_a_right_one(gain: float, late_s: float) -> None:
    """Twice the gain, a sixth of a cycle late, reads the stated mass in phase."""
    faults = always("force_delay", late_s), always("force_gain", gain)
    bench = shaken(carrying(ur_plan(**QUICK)), *faults)
    cause = bench.engine.cause
    assert cause is not None
    assert cause.rule == "proof_of_life"
    assert f"its readings came {late_s * 1e3 + 2:.0f} ms later than rig.force.delay says" in (
        cause.message
    )
    assert bench.peak_n == 0.0


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("second", ["arm_force_deaf", "second_stuck_mean"])
def test_two_dead_channels_with_live_noise_never_press(make: Any, second: str) -> None:
    """Only the main one is known to carry a tool; without the shake such a run presses through."""
    kind = "arm" if second.startswith("arm") else "sensor"
    dead = always("force_stuck_mean"), always(second)
    plan = make(**QUICK)
    blind = replace(carrying(plan, second=kind), name="blind")
    blind = replace(
        blind, rig=replace(blind.rig, force=replace(blind.rig.force, tool_mass_kg=None))
    )
    assert shaken(blind, *dead, until_s=60.0).peak_n > 0.0
    bench = shaken(carrying(plan, second=kind), *dead, until_s=60.0)
    assert bench.peak_n == 0.0
    assert bench.engine.cause is not None
    assert "dead although its noise lives" in bench.engine.cause.message


@pytest.mark.parametrize("make", MAKERS)
def test_the_arm_shakes_on_the_way_that_it_has_backed_off_by(make: Any) -> None:
    plan = carrying(make(**QUICK))
    bench, rows = bench_for(plan), list[TickRow]()
    run(bench, 8.0, rows)
    shaking = [row.target_m for row in rows if row.phase == Phase.PROOF_OF_LIFE]
    before = [row.target_m for row in rows if row.phase == Phase.DRIFT_CHECK][-1]
    after = next(row.target_m for row in rows if row.phase == Phase.FAST_APPROACH)
    (told,) = [data for _, kind, data in bench.engine.events if kind == "proof_of_life"]
    assert min(shaking) >= before - 1e-12
    assert max(shaking) == pytest.approx(before + float(str(told["travel_m"])), abs=1e-6)
    assert max(shaking) <= bench.engine.course.start_m
    assert after == pytest.approx(before, abs=1e-4)
    phases = [data["phase"] for _, kind, data in bench.engine.events if kind == "phase"]
    assert phases[3:6] == ["DRIFT_CHECK", "PROOF_OF_LIFE", "FAST_APPROACH"]


def test_an_arm_that_does_not_follow_proves_nothing() -> None:
    """Commands that arrive late, and a position that says so: R7 or the shake itself stops it."""
    plan = carrying(ur_plan(**QUICK))
    bench = bench_for(plan, spec=spec_for(plan, 1, max_speed_m_s=1e-4))
    run(bench, 12.0)
    assert bench.engine.cause is not None
    assert bench.engine.cause.rule in ("R7", "proof_of_life")
    assert bench.peak_n == 0.0


def test_an_operator_ends_the_run_in_the_shake() -> None:
    bench = bench_for(carrying(ur_plan(**QUICK)))
    while bench.engine.course.phase != Phase.PROOF_OF_LIFE:
        run(bench, 0.05)
    bench.operator.press()
    run(bench, 10.0)
    assert bench.engine.course.interrupted
    assert bench.peak_n == 0.0


def test_no_mass_no_shake() -> None:
    bench = bench_for(ur_plan(**QUICK))
    run(bench, 3.0)
    assert Phase.PROOF_OF_LIFE.name not in [
        data.get("phase") for _, kind, data in bench.engine.events if kind == "phase"
    ]
