"""The catch-up bound against a mass on a spring driven into a linear contact."""

from __future__ import annotations

import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from stepload.feasibility.command_backlog import (
    catch_up_force,
    largest_catch_up,
    sudden_step,
)
from stepload.feasibility.press import PressRig


def rig(
    mass_kg: float = 40.0,
    lag_s: float = 0.0,
    acceleration: float = 0.65,
    stiffness: float = 3.5e6,
    ratio: float = 0.0,
) -> PressRig:
    return PressRig(
        stiffness_n_per_m=stiffness,
        damping_n_s_per_m=ratio * 2.0 * math.sqrt(stiffness * mass_kg),
        mass_kg=mass_kg, acceleration_m_s2=acceleration, lag_s=lag_s, noise_n=0.1,
        reaction_s=0.01, loop_s=0.01, cross_check_s=0.0,
    )  # fmt: skip


def peak_force(numbers: PressRig, travel_m: float, tangent: float, gap_m: float) -> float:
    """Peak of what the contact adds, `gap_m` away; below zero it is closed and stays closed."""
    stiffness, damping = numbers.stiffness_n_per_m, numbers.damping_n_s_per_m
    mass, acceleration = numbers.mass_kg, numbers.acceleration_m_s2
    swing_s = math.sqrt(mass / (stiffness + tangent))
    step_s = min(0.05 * swing_s, 0.1 * mass / damping if damping else math.inf)
    end_s = 3.0 * math.sqrt(travel_m / acceleration) + 3.0 * numbers.lag_s + 10.0 * swing_s
    closed, gap_m = gap_m < 0.0, max(0.0, gap_m)
    x = v = drive = speed = peak = 0.0
    for _ in range(min(int(end_s / step_s), 20_000)):
        left = travel_m - drive
        want = math.sqrt(2.0 * acceleration * left) if left > 0.0 else 0.0
        if numbers.lag_s:
            want = min(want, left / numbers.lag_s)
        speed = min(want, speed + acceleration * step_s)
        drive = min(travel_m, drive + speed * step_s)
        force = tangent * (x - gap_m)
        if force < 0.0 and not closed:
            force = 0.0
        v += (stiffness * (drive - x) + damping * (speed - v) - force) / mass * step_s
        x += v * step_s
        peak = max(peak, force)
    return peak


@pytest.mark.parametrize("force_n", [1.0, 90.0, 2000.0])
def test_the_largest_step_spends_the_whole_force(force_n: float) -> None:
    travel_m = largest_catch_up(rig(), force_n, 1e7)
    assert catch_up_force(rig(), travel_m, 1e7) == pytest.approx(force_n, rel=1e-9)


_PLANT = {
    "mass": st.floats(2.0, 60.0),
    "acceleration": st.floats(0.5, 2.0),
    "system_exponent": st.floats(4.6, 6.6),
    "exponent": st.floats(4.0, 9.5),
    "ratio": st.floats(0.01, 2.5),
    "lag": st.sampled_from([0.0, 0.002, 0.02, 0.04]),
}


@given(**_PLANT, travel_exponent=st.floats(-6.5, -3.5), gap_share=st.floats(0.0, 1.0))
@example(5.25, 0.59, 6.544, 9.1056, 0.0124, 0.0286, -5.541, 0.1534)
@example(3.39, 1.2, 5.25, 9.06, 0.011, 0.03, -6.0, 0.5)
def test_no_simulated_catch_up_comes_above_the_bound(
    mass: float, acceleration: float, system_exponent: float, exponent: float, ratio: float,
    lag: float, travel_exponent: float, gap_share: float,
) -> None:  # fmt: skip
    numbers = rig(mass, lag, acceleration, 10.0**system_exponent, ratio)
    travel, tangent = 10.0**travel_exponent, 10.0**exponent
    peak = peak_force(numbers, travel, tangent, gap_share * travel)
    assert peak <= catch_up_force(numbers, travel, tangent)


@given(**_PLANT, force=st.floats(1.0, 1000.0))
@example(2.0, 1.0, 6.544, 8.2773, 1.0, 0.0, 2.0)
@example(50.6, 0.593, 6.544, 9.4362, 1.37, 0.0, 8.2)
@example(13.63, 1.25, 4.8237, 8.9672, 1.35, 0.0014, 2.0)
def test_a_sudden_step_in_contact_adds_no_more_than_was_allowed(
    mass: float, acceleration: float, system_exponent: float, exponent: float, ratio: float,
    lag: float, force: float,
) -> None:  # fmt: skip
    numbers = rig(mass, lag, acceleration, 10.0**system_exponent, ratio)
    travel = sudden_step(
        force, numbers.stiffness_n_per_m, numbers.damping_n_s_per_m, acceleration, lag
    )
    assert peak_force(numbers, travel, 10.0**exponent, -1.0) <= force
