"""The catch-up bound against a mass on a spring driven into a linear contact."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stepload.contact.catch_up import (
    catch_up_force,
    catch_up_speed,
    largest_catch_up,
    sudden_step,
)
from stepload.contact.press import PressRig


def rig(mass_kg: float = 40.0, lag_s: float = 0.0, acceleration: float = 0.65) -> PressRig:
    return PressRig(
        stiffness_n_per_m=3.5e6, damping_n_s_per_m=0.0, mass_kg=mass_kg,
        acceleration_m_s2=acceleration, lag_s=lag_s, noise_n=0.1, reaction=(), reaction_s=0.01,
        loop_s=0.01, cross_check_s=0.0,
    )  # fmt: skip


@settings(deadline=None, max_examples=40)
@given(
    mass=st.floats(2.0, 60.0),
    acceleration=st.floats(0.5, 2.0),
    tangent=st.floats(1e5, 1e8),
    travel=st.floats(1e-6, 1e-4),
    gap_share=st.floats(0.0, 1.0),
)
def test_no_simulated_catch_up_comes_above_the_bound(
    mass: float, acceleration: float, tangent: float, travel: float, gap_share: float
) -> None:
    numbers = rig(mass, acceleration=acceleration)
    half_s = math.sqrt(travel / acceleration)
    gap = gap_share * travel
    step_s = 0.02 / math.sqrt((numbers.stiffness_n_per_m + tangent) / mass)
    x = v = time_s = peak = 0.0
    while time_s < 2.0 * half_s + 300.0 * step_s:
        if time_s < half_s:
            drive = 0.5 * acceleration * time_s**2
        else:
            left_s = max(0.0, 2.0 * half_s - time_s)
            drive = travel - 0.5 * acceleration * left_s**2
        force = tangent * max(0.0, x - gap)
        v += (numbers.stiffness_n_per_m * (drive - x) - force) / mass * step_s
        x += v * step_s
        peak = max(peak, force)
        time_s += step_s
    assert peak <= catch_up_force(numbers, travel, tangent)


def test_a_slow_servo_catches_up_slowly() -> None:
    assert catch_up_speed(rig(), 1e-5) == pytest.approx(math.sqrt(0.65 * 1e-5))
    assert catch_up_speed(rig(lag_s=0.02), 1e-5) == pytest.approx(1e-5 / 0.02)


@pytest.mark.parametrize("force_n", [1.0, 90.0, 2000.0])
def test_the_largest_step_spends_the_whole_force(force_n: float) -> None:
    travel_m = largest_catch_up(rig(), force_n, 1e7)
    assert catch_up_force(rig(), travel_m, 1e7) == pytest.approx(force_n, rel=1e-9)


@settings(deadline=None, max_examples=40)
@given(
    mass=st.floats(2.0, 60.0),
    acceleration=st.floats(0.5, 2.0),
    tangent=st.floats(1e5, 1e9),
    ratio=st.floats(0.0, 2.0),
    force=st.floats(1.0, 1000.0),
    lag=st.sampled_from([0.0, 0.002, 0.02]),
)
def test_a_sudden_step_in_contact_adds_no_more_than_was_allowed(
    mass: float, acceleration: float, tangent: float, ratio: float, force: float, lag: float
) -> None:
    stiffness = 3.5e6
    damping = ratio * 2.0 * math.sqrt(stiffness * mass)
    travel = sudden_step(force, stiffness, damping, acceleration, lag)
    step_s = 0.05 / math.sqrt((stiffness + tangent) / mass)
    step_s = min(step_s, 0.2 * mass / max(damping, 1e-9))
    x = v = drive = speed = added = 0.0
    for _ in range(6000):
        gap = travel - drive
        want = gap / lag if lag else math.inf
        want = min(want, math.sqrt(2.0 * acceleration * gap) if gap > 0.0 else 0.0)
        speed = min(want, speed + acceleration * step_s)
        drive = min(travel, drive + speed * step_s)
        push = stiffness * (drive - x) + damping * (speed - v)
        v += (push - tangent * x) / mass * step_s
        x += v * step_s
        added = max(added, tangent * x)
    assert added <= force * 1.02


def test_no_force_left_is_no_step() -> None:
    assert sudden_step(0.0, 1e6, 0.0, 1.0, 0.0) == sudden_step(-5.0, 1e6, 1e3, 1.0, 0.01) == 0.0
