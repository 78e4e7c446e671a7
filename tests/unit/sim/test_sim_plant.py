"""The mechanics against closed forms: statics, impact, limits, convergence."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from itertools import pairwise

import pytest

from stepload.feasibility.press import PressRig, force_budget
from stepload.rig.world import DEFAULT_SPEC, PayloadTruth, WorldSpec
from stepload_drivers.sim.plant import SWING_RAD, Plant

IDEAL = replace(
    DEFAULT_SPEC, command_delay_s=0.0, lag_s=0.0, max_speed_m_s=1.0, max_acceleration_m_s2=1e9
)


def payload(k: float, n: float, **other: float) -> PayloadTruth:
    return replace(IDEAL.payload, k=k, n=n, **other)


def press_to(plant: Plant, target_m: float, seconds: float = 2.0) -> None:
    plant.command(plant.time_s, target_m)
    for _ in range(round(seconds / plant.step_s)):
        plant.step()


def approach(
    spec: WorldSpec, speed_m_s: float, *, step_s: float = 1e-3, refine: float = 1.0
) -> Plant:
    """Run into the surface at constant speed, go on for 20 µm or so, then stand."""
    plant = Plant(spec, step_s=step_s, swing_rad=SWING_RAD / refine, error_factor=1.0 / refine)
    for step in range(round((spec.surface_m + 20e-6) / speed_m_s / step_s)):
        plant.command(plant.time_s, speed_m_s * (step + 1) * step_s)
        plant.step()
    for _ in range(round(1.0 / step_s)):
        plant.step()
    return plant


@pytest.mark.parametrize(
    ("k", "n", "stiffness"),
    [(6.57e8, 1.5, 3.49e6), (1e6, 1.0, 1e5), (1e8, 1.0, 1e5), (1e13, 2.5, 2.5e5), (1e5, 1.0, 3e6)],
)
def test_static_equilibrium(k: float, n: float, stiffness: float) -> None:
    """δ_p = (F/K)^(1/n) and position − surface = δ_p + F/K_s (27)."""
    spec = replace(
        IDEAL,
        payload=payload(k, n),
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=200.0,
        effective_mass_kg=5.0,
    )
    for force_n in (1.0, 30.0, 300.0):
        plant = Plant(spec, step_s=1e-3)
        deformation_m = (force_n / k) ** (1.0 / n)
        press_to(plant, spec.surface_m + deformation_m + force_n / stiffness, 4.0)
        assert plant.force_n == pytest.approx(force_n, rel=1e-3, abs=1e-3)
        assert plant.drive_m - spec.surface_m == pytest.approx(
            deformation_m + force_n / stiffness, rel=1e-9
        )


@pytest.mark.parametrize("k", [1e4, 1e6, 1e8])
@pytest.mark.parametrize("damping", [0.0, 100.0, 3.87e4])
def test_impact_on_a_linear_spring_is_the_exact_solution(k: float, damping: float) -> None:
    """m ẍ = K_s (v t − x) + C_s (v − ẋ) − k x from x = 0, ẋ = v, in closed form."""
    speed, stiffness, mass = 0.01, 1e5, 5.0
    spec = replace(
        IDEAL,
        payload=payload(k, 1.0),
        surface_m=0.02 * (1.0 + 1e-9),
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=damping,
        effective_mass_kg=mass,
        max_push_n=1e6,
    )
    plant = Plant(spec, step_s=1e-3)
    plant.tip_speed = speed
    gamma, omega2 = 0.5 * damping / mass, (stiffness + k) / mass
    drift = stiffness * speed / (stiffness + k)
    offset = damping * (speed - drift) / (stiffness + k)
    root = complex(gamma**2 - omega2) ** 0.5

    def exact_n(t: float) -> float:
        e1, e2 = -gamma + root, -gamma - root
        u0, w0 = -offset, speed - drift
        a = (w0 - e2 * u0) / (e1 - e2)
        b = u0 - a
        swing = (a * pow(math.e, e1 * t) + b * pow(math.e, e2 * t)).real
        return k * (offset + drift * t + swing)

    for tick in range(2000):
        plant.command(plant.time_s, speed * (tick + 1) * 1e-3)
        plant.step()
    peak, fine_s = 0.0, 0.005 / math.sqrt(omega2)
    for tick in range(60):
        in_tick = [exact_n(tick * 1e-3 + i * fine_s) for i in range(math.ceil(1e-3 / fine_s))]
        apart = next((i for i, force_n in enumerate(in_tick) if force_n < -1e-6), None)
        peak = max([peak, *in_tick[:apart]])
        plant.command(plant.time_s, speed * (2001 + tick) * 1e-3)
        plant.step()
        if apart is not None:
            break
        assert plant.force_n == pytest.approx(exact_n((tick + 1) * 1e-3), rel=0.01, abs=0.05)
    assert peak > 0.05
    assert plant.peak_n == pytest.approx(peak, rel=0.01, abs=0.02)


@pytest.mark.parametrize(("k", "n"), [(6.57e8, 1.5), (1e8, 1.0), (1e5, 1.0), (3e13, 2.5)])
@pytest.mark.parametrize("hysteresis", [0.0, 0.2])
def test_halving_every_step_changes_the_peak_by_less_than_a_percent(
    k: float, n: float, hysteresis: float
) -> None:
    spec = replace(
        IDEAL,
        payload=payload(k, n, hysteresis=hysteresis),
        surface_m=1e-3,
        system_stiffness_n_per_m=1e5,
        system_damping_n_s_per_m=100.0,
        effective_mass_kg=5.0,
    )
    coarse = approach(spec, 0.02)
    fine = approach(spec, 0.02, step_s=0.5e-3, refine=2.0)
    finest = approach(spec, 0.02, step_s=0.25e-3, refine=8.0)
    assert coarse.peak_n == pytest.approx(fine.peak_n, rel=0.01)
    assert coarse.peak_n == pytest.approx(finest.peak_n, rel=0.01)
    if not hysteresis:
        assert coarse.force_n == pytest.approx(finest.force_n, rel=0.01, abs=0.05)


def test_drive_keeps_delay_lag_speed_and_acceleration() -> None:
    spec = replace(IDEAL, surface_m=1.0, lag_s=0.01, max_speed_m_s=0.05, max_acceleration_m_s2=0.5)
    plant = Plant(spec, step_s=1e-3)
    plant.command(0.02, 0.01)
    places, speeds = [], []
    for _ in range(600):
        plant.step()
        places.append(plant.drive_m)
        speeds.append(plant.drive_speed)
    assert places[19] == 0.0 < places[20]
    assert max(speeds) <= 0.05 + 1e-12
    gains = [b - a for a, b in pairwise(speeds)]
    assert max(map(abs, gains)) <= 0.5e-3 + 1e-12
    assert max(places) <= 0.01 * (1.0 + 1e-6)
    assert places[-1] == pytest.approx(0.01, rel=1e-6)


def test_lost_motion_at_reversal() -> None:
    plant = Plant(replace(IDEAL, surface_m=1.0, lost_motion_m=10e-6), step_s=1e-3)
    press_to(plant, 1e-3, 0.01)
    assert plant.drive_m == pytest.approx(0.995e-3)
    press_to(plant, 0.991e-3, 0.01)
    assert plant.drive_m == pytest.approx(0.995e-3), "less than the lost motion moves nothing"
    press_to(plant, 0.980e-3, 0.01)
    assert plant.drive_m == pytest.approx(0.985e-3)


@pytest.mark.parametrize("seed", range(12))
def test_guarded_approach_stays_within_the_force_budget(seed: float) -> None:
    """Stop at a threshold after a reaction time: peak ≤ the budget of the guarded approach."""
    rng = random.Random(seed)
    stiffness = 10.0 ** rng.uniform(4.6, 6.5)
    mass = rng.uniform(2.0, 20.0)
    k = 10.0 ** rng.uniform(4.0, 8.0)
    lag_s, delay_s = rng.uniform(0.0, 0.02), rng.uniform(0.001, 0.03)
    speed = 10.0 ** rng.uniform(-4.0, -2.3)
    damping = rng.uniform(0.02, 1.0) * 2.0 * math.sqrt(stiffness * mass)
    spec = replace(
        IDEAL,
        payload=payload(k, 1.0),
        surface_m=speed * 0.3,
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=damping,
        effective_mass_kg=mass,
        lag_s=lag_s,
        max_acceleration_m_s2=2.0,
        max_push_n=1e6,
    )
    plant = Plant(spec, step_s=1e-3)
    seen_s = math.inf
    for tick in range(1500):
        if plant.force_n > 3.0:
            seen_s = min(seen_s, plant.time_s)
        if plant.time_s < seen_s + delay_s:
            plant.command(plant.time_s, speed * (tick + 1) * 1e-3)
        elif tick:
            plant.command(plant.time_s, plant.drive_m - 1e-3)
        plant.step()
    rig = PressRig(stiffness, damping, mass, 2.0, lag_s, 0.0, 0.0, 0.0, 0.0)
    terms = force_budget(
        rig, speed_m_s=speed, threshold_n=3.0, tangent_n_per_m=k, delay_s=delay_s + lag_s + 0.002
    )
    assert math.isfinite(seen_s)
    assert 3.0 <= plant.peak_n <= sum(term.value for term in terms)


def test_a_tip_that_only_grazes_the_surface_between_two_steps_is_felt() -> None:
    """It swings freely by 100 µm, and turns 0.1 µm beyond the surface in the middle of a step."""
    swing_m, omega, mass = 1e-4, math.sqrt(1e5 / 5.0), 5.0
    graze_m = 0.1e-6
    spec = replace(
        IDEAL,
        payload=payload(1e8, 1.0),
        surface_m=swing_m - graze_m,
        system_stiffness_n_per_m=1e5,
        system_damping_n_s_per_m=0.0,
        effective_mass_kg=mass,
    )
    plant = Plant(spec, step_s=1e-3)
    before_s = 0.5e-3
    plant.tip_m = swing_m * math.cos(omega * before_s)
    plant.tip_speed = swing_m * omega * math.sin(omega * before_s)
    assert plant.tip_m < spec.surface_m
    plant.step()
    entry_speed = omega * math.sqrt(2.0 * swing_m * graze_m)
    assert plant.force_n == 0.0
    assert plant.tip_m < spec.surface_m
    back_n = 1e5 * spec.surface_m
    exact_n = math.hypot(back_n, entry_speed * math.sqrt(mass * 1e8)) - back_n
    assert plant.peak_n == pytest.approx(exact_n, rel=0.01)
