"""The controller on payloads of four decades and both arm classes, with an ideal plant."""

from __future__ import annotations

import math
import random
from collections import deque
from dataclasses import replace
from typing import Any

import pytest
from long_ones import long
from run_plans import limits_for, stvf_plan, ur_plan

from stepload.engine import travel_limit
from stepload.engine.controller import StepController
from stepload.engine.travel_limit import DRIFT_SHARE
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.press import OLD_S

ONE: dict[str, Any] = {"cross_check": "", "undetected_s": OLD_S, "answers_n": 1e-9}
"""With one force channel, the travel is limited; as on a rigid surface."""
LIMITS = {
    # Payloads of four decades on the limits of one: what is no answer of that one is not asked.
    name: replace(limits_for(plan, 727.0), answer_n_per_m=1.0, answer_top_n_per_m=1.0, **ONE)
    for name, plan in (("stvf", stvf_plan()), ("ur", ur_plan()))
}

PLAIN = replace(limits_for(stvf_plan(), 727.0), **ONE)
"""Those of a plan with the answer that its payload must give."""


class Spring:
    """Arm with delay and lag against K_s in series with F = K δ^n; force comes late and noisy."""

    def __init__(self, limits: RunLimits, k: float, n: float, start_n: float) -> None:
        self.limits, self.k, self.n = limits, k, n
        self.chance = random.Random(3)
        self.x = self.position(start_n)
        self.true_n = self.peak_n = start_n
        period_s = limits.period_s
        self.commands = deque([self.x] * (1 + round(limits.command_delay_s / period_s)))
        self.forces = deque([start_n] * (1 + round(limits.force_delay_s / period_s)))
        self.share = 1.0 - math.exp(-period_s / limits.arm_lag_s)
        self.smooth_n = start_n

    def position(self, force_n: float) -> float:
        return force_n / self.limits.stiffness_n_per_m + (force_n / self.k) ** (1.0 / self.n)

    def tick(self, target_m: float) -> None:
        self.commands.append(target_m)
        self.x += self.share * (self.commands.popleft() - self.x)
        low, high = 0.0, 2000.0
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.position(middle) < self.x else (low, middle)
        self.true_n = low
        self.peak_n = max(self.peak_n, low)
        self.forces.append(low + self.chance.gauss(0.0, 0.3))

    def reading(self) -> float:
        force_n = self.forces.popleft()
        alpha = self.limits.period_s / max(0.25 * self.limits.reaction_s, 2 * self.limits.period_s)
        self.smooth_n += alpha * (force_n - self.smooth_n)
        return force_n


def press(plant: Spring, controller: StepController, target_m: float, seconds: float) -> float:
    for _ in range(round(seconds / plant.limits.period_s)):
        target_m = controller.step(
            plant.reading(), plant.smooth_n, plant.x, target_m, plant.limits.period_s
        )
        plant.tick(target_m)
    return target_m


@pytest.mark.parametrize("arm", ["ur", "stvf"])
@pytest.mark.parametrize("n", [1.0, *long([1.5]), 3.0])
@pytest.mark.parametrize("secant", [1e5, 1e6, 1e8])
def test_steps_are_reached_without_overshoot(arm: str, n: float, secant: float) -> None:
    limits = replace(LIMITS[arm], cross_check="arm")
    plant = Spring(limits, 300.0 / (300.0 / secant) ** n, n, 3.0)
    controller = StepController(limits)
    target_m = plant.x
    for level in (50.0, 100.0):
        plant.peak_n = 0.0
        controller.begin(level, plant.smooth_n, plant.x, 1.0, level > 50.0)
        target_m = press(plant, controller, target_m, 6.0)
        assert controller.reached
        assert plant.peak_n - level <= 0.25
        assert abs(plant.true_n - level) <= limits.band_n + 0.5


def test_a_softest_payload_is_reached_slowly() -> None:
    limits = LIMITS["ur"]
    plant = Spring(limits, 1e4, 1.0, 3.0)
    controller = StepController(limits)
    controller.begin(50.0, 3.0, plant.x, 1.0, False)
    press(plant, controller, plant.x, 8.0)
    assert controller.reached
    assert plant.peak_n < 50.25


def test_unloading_comes_down_to_the_level() -> None:
    limits = LIMITS["ur"]
    plant = Spring(limits, 1e6, 1.0, 200.0)
    controller = StepController(limits)
    controller.begin(150.0, 200.0, plant.x, -1.0, True)
    press(plant, controller, plant.x, 4.0)
    assert controller.reached
    assert plant.true_n == pytest.approx(150.0, abs=1.5)


def test_loading_never_moves_back() -> None:
    limits = LIMITS["stvf"]
    controller = StepController(limits)
    controller.begin(50.0, 0.0, 0.0, 1.0, False)
    chance = random.Random(1)
    target_m = 0.0
    for _ in range(500):
        after = controller.step(chance.gauss(30, 20), 30.0, target_m, target_m, 0.001)
        assert after >= target_m
        target_m = after


@pytest.mark.parametrize("arm", ["ur", "stvf"])
@pytest.mark.parametrize("stuck", [0.0, 120.0, 240.0])
def test_a_stuck_force_cannot_pull_the_target_past_the_leash(arm: str, stuck: float) -> None:
    limits = LIMITS[arm]
    controller = StepController(limits)
    controller.begin(stuck + 50.0, stuck, 0.0, 1.0, False)
    chance = random.Random(7)
    target_m = 0.0
    for _ in range(20_000):
        force_n = stuck + chance.gauss(0.0, limits.noise_n)
        target_m = controller.step(force_n, stuck, target_m, target_m, limits.period_s)
    true_n = stuck + limits.stiffness_n_per_m * target_m
    assert stuck + 1.0 < true_n < limits.force_limit_n


@pytest.mark.parametrize(
    ("reached", "same", "leashes"), [(False, True, 0.5), (True, True, 1.0), (False, False, 1.0)]
)
def test_a_level_that_was_given_up_leaves_no_new_leash(
    reached: bool, same: bool, leashes: float
) -> None:
    """A channel that does not move proves nothing, however many levels it is asked for."""
    limits = LIMITS["stvf"]
    controller = StepController(limits)
    target_m, stuck = 0.0, 50.0
    for level_n in (200.0, 300.0):
        controller.begin(level_n, stuck, target_m, 1.0, same)
        for _ in range(20_000):
            target_m = controller.step(stuck, stuck, target_m, target_m, limits.period_s)
        if reached:
            controller.step(level_n, level_n, target_m, target_m, limits.period_s)
            assert controller.reached
    travel_limit_m = (
        1.0 * (limits.force_limit_n - stuck - 6.0 * limits.noise_n) / limits.stiffness_n_per_m
    )
    assert target_m == pytest.approx(leashes * travel_limit_m, rel=1e-3)


def dead_n(
    limits: RunLimits, payload_n_per_m: float, seed: int, *, frozen: bool, every: int = 1,
    coloured_s: float = 0.0,
) -> float:  # fmt: skip
    """Force at rest, as a share of F_lim, where the only channel dies while the arm loads.

    Its noise has a time constant of `coloured_s` then.
    """
    chance, period_s = random.Random(seed), limits.period_s
    stiffness = 1.0 / (1.0 / limits.stiffness_n_per_m + 1.0 / payload_n_per_m)
    controller, start_n = StepController(limits), chance.uniform(3.0, 0.8 * limits.top_force_n)
    target_m = x_m = start_n / stiffness
    reading_n = smooth_n = start_n + chance.gauss(0.0, limits.noise_n)
    dies_n, dead = chance.uniform(start_n, limits.top_force_n), False
    controller.begin(1.2 * limits.top_force_n, smooth_n, x_m, 1.0, False)
    commands = deque([x_m] * (1 + round(limits.command_delay_s / period_s)))
    readings = deque([start_n] * (1 + round(limits.force_delay_s / period_s)))
    share = 1.0 - math.exp(-period_s / limits.arm_lag_s)
    kept = math.exp(-period_s / coloured_s) if coloured_s else 0.0
    noise_n = 0.0
    for tick in range(round((60.0 if coloured_s else 8.0) / period_s)):
        commands.append(target_m)
        x_m += share * (commands.popleft() - x_m)
        dead = dead or stiffness * x_m >= dies_n
        readings.append(dies_n if dead else stiffness * x_m)
        felt_n = readings.popleft()
        if tick % every == 0 and not (dead and frozen):
            white_n = chance.gauss(0.0, limits.noise_n)
            noise_n = kept * noise_n + math.sqrt(1.0 - kept * kept) * white_n if dead else white_n
            reading_n = felt_n + noise_n
        smooth_n += 0.2 * (reading_n - smooth_n)
        target_m = controller.step(reading_n, smooth_n, x_m, target_m, period_s)
    return stiffness * x_m / limits.force_limit_n


@pytest.mark.parametrize("frozen", [True, False], ids=["frozen", "dead behind noise"])
@pytest.mark.parametrize("arm", ["ur", "stvf"])
@pytest.mark.parametrize("payload", [1e12, *long([3e6]), 1e4])
@pytest.mark.parametrize("seeds", [range(8), *long([range(8, 12)])])
def test_channels_that_die_at_any_moment_leave_the_force_below_its_limit(
    seeds: range, arm: str, payload: float, frozen: bool
) -> None:
    """No other rule looks. Their last rise may be found once more, and proves nothing then."""
    reached = [dead_n(LIMITS[arm], payload, seed, frozen=frozen) for seed in seeds]
    assert max(reached) < 1.0


def drifted_n(limits: RunLimits, drift_n_per_s: float, seconds: float = 60.0) -> float:
    """Where an arm ends beyond a channel that died at 50 N and rises by itself, on metal."""
    controller, target_m, chance = StepController(limits), 0.0, random.Random(5)
    controller.begin(300.0, 50.0, 0.0, 1.0, False)
    for tick in range(round(seconds / limits.period_s)):
        force_n = 50.0 + drift_n_per_s * tick * limits.period_s
        force_n += chance.gauss(0.0, limits.noise_n)
        target_m = controller.step(force_n, 50.0, target_m, target_m, limits.period_s)
    return 50.0 + limits.stiffness_n_per_m * target_m


@pytest.mark.parametrize(("drift_share", "held"), [(math.inf, False), (DRIFT_SHARE, True)])
@pytest.mark.parametrize("drift", [0.05, 0.2, *long([0.02, 0.1])])
def test_a_dead_channel_that_drifts_is_no_payload_that_answers(
    drift: float, drift_share: float, held: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It rises where the arm stands as it did on the way; an answer comes with the motion."""
    monkeypatch.setattr(travel_limit, "DRIFT_SHARE", drift_share)
    limits = LIMITS["ur"]
    assert (drifted_n(limits, drift) < limits.force_limit_n) == held


def test_a_dead_channel_with_slow_noise_is_no_payload_that_answers() -> None:
    """A filter behind what died: its means are as noisy as its readings, and one answers."""
    reached = [dead_n(PLAIN, 1e12, seed, frozen=False, coloured_s=0.1) for seed in (1, 2)]
    assert max(reached) < 1.0


@pytest.mark.parametrize("every", [10, *long([20])])
@pytest.mark.parametrize("seeds", [range(12), *long([range(12, 20)])])
def test_a_slow_sensor_that_dies_behind_its_noise_leaves_the_force_below_its_limit(
    seeds: range, every: int
) -> None:
    """Few readings make a mean: its noise is that of readings, not of ticks."""
    limits = replace(LIMITS["ur"], reading_s=every * LIMITS["ur"].period_s)
    reached = [dead_n(limits, 1e12, seed, frozen=False, every=every) for seed in seeds]
    assert max(reached) < 1.0
