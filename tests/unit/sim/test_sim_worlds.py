"""What a simulated rig does when its switches are on: the mechanics and the samples."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from stepload.engine.first_loading import true_deformation
from stepload.rig.samples import ForceSample
from stepload.rig.world import DEFAULT_SPEC, PayloadTruth
from stepload_drivers.sim.simulation import World

SPHERE = PayloadTruth("smooth", 6.57e8, 1.5, 727.0, 0.0, 0.0, 0.0, math.inf)
QUIET = replace(
    DEFAULT_SPEC,
    payload=SPHERE,
    surface_m=1e-4,
    system_damping_n_s_per_m=3.87e4,
    position_quantum_m=0.0,
    position_noise_m=0.0,
    arm_force_noise_n=0.0,
    force_noise_n=0.0,
    force_quantum_n=0.0,
    start_force_bias_n=0.0,
    gauge_rate_hz=100.0,
)
K_S = QUIET.system_stiffness_n_per_m


def world(**changes: Any) -> World:
    """A world without noise; fields of `PayloadTruth` and of `WorldSpec`."""
    on_payload = {name: value for name, value in changes.items() if hasattr(SPHERE, name)}
    on_rig = {name: value for name, value in changes.items() if name not in on_payload}
    made = World(replace(QUIET, payload=replace(SPHERE, **on_payload), **on_rig))
    for channel in made.channels:
        channel.listen()
    return made


def go(made: World, to_m: float, seconds: float = 1.0) -> None:
    """Ramp the drive to a travel and stand there."""
    plant = made.plant
    start_m, begun_s = plant.target_m, made.time_s
    for step in range(1, 101):
        plant.command(begun_s + step * seconds / 200.0, start_m + (to_m - start_m) * step / 100.0)
    made.advance(begun_s + seconds)


def hold(made: World, force_n: float, seconds: float) -> None:
    """Hold a force by moving the drive."""
    plant = made.plant
    for _ in range(round(seconds / 0.01)):
        gap_m = (force_n - plant.force_n) / K_S
        plant.command(made.time_s, plant.target_m + 0.2 * gap_m)
        made.advance(made.time_s + 0.01)


def test_a_held_contact_creeps_by_the_share_that_was_asked_for() -> None:
    """δ(t) = δ (1 + c (1 − e^(−t/τ))) at a force that is held."""
    made = world(creep=0.2, creep_time_s=5.0)
    go(made, 2e-4, 0.1)
    hold(made, 150.0, 0.5)
    made.advance(made.time_s + 0.01)
    hold(made, 150.0, 30.0)
    at_once_m = true_deformation(SPHERE, made.true_force_n)
    assert made.true_force_n == pytest.approx(150.0, rel=1e-3)
    assert made.plant.closed_m == pytest.approx(1.2 * at_once_m, rel=2e-3)


@pytest.mark.parametrize(("decades", "share"), [(0, 0.632), (2, 0.243)])
def test_creep_takes_its_time(decades: int, share: float) -> None:
    made = world(creep=0.2, creep_time_s=2.0, creep_decades=decades)
    go(made, 2e-4, 0.02)
    hold(made, 150.0, 2.0)
    at_once_m = true_deformation(SPHERE, made.true_force_n)
    crept = (made.plant.closed_m / at_once_m - 1.0) / 0.2
    assert crept == pytest.approx(share, rel=0.03)


def test_a_crept_contact_comes_back_when_it_is_free() -> None:
    made = world(creep=0.2, creep_time_s=1.0)
    go(made, 2e-4)
    hold(made, 150.0, 5.0)
    go(made, 0.0, 0.1)
    assert made.true_force_n == 0.0
    touched_m = []
    for _ in range(2):
        go(made, QUIET.surface_m + 2e-6, 0.05)
        touched_m.append(made.true_force_n)
        go(made, 0.0, 0.05)
        made.advance(made.time_s + 20.0)
    assert touched_m[0] == 0.0, "a dent is left"
    assert touched_m[1] > 0.5, "and has come back"


def test_slip_is_travel_that_is_measured_and_moves_nothing() -> None:
    """The same true place of the drive lies 3 µm apart in the measured travel, up and down."""
    made = world(slip_m=3e-6)
    go(made, 2.1e-4)
    up_m, up_n = made.arm.last, made.true_force_n
    go(made, 2.6e-4)
    go(made, 2.1e-4 - 3e-6)
    assert made.true_force_n == pytest.approx(up_n, rel=1e-4)
    assert up_m - made.arm.last == pytest.approx(3e-6, rel=1e-3)


def test_a_soft_load_path_is_not_seen_by_a_gauge_across_the_contact() -> None:
    made = world(softness=0.5, softness_force_n=80.0)
    made.advance(0.05)
    for travel_m in (1.2e-4, 2e-4):
        go(made, travel_m)
        force_n = made.true_force_n
        given_m = 0.5 * 80.0 / K_S * -math.expm1(-force_n / 80.0)
        deformation_m = true_deformation(SPHERE, force_n)
        assert travel_m - QUIET.surface_m == pytest.approx(
            force_n / K_S + given_m + deformation_m, rel=1e-5
        )
        assert made.plant.closed_m == pytest.approx(deformation_m, rel=1e-5)
        assert made.gauge is not None
        closed_m = made.gauge.pending[-1].displacement_m - made.gauge.pending[0].displacement_m
        assert closed_m == pytest.approx(deformation_m + QUIET.surface_m, rel=1e-4)


def _wrench(channel: Any) -> tuple[float, ...]:
    sample: ForceSample = channel.pending[-1]
    return sample.wrench


@pytest.mark.parametrize(("axis", "across"), [("+fz", 0), ("-fz", 0), ("+fx", 1), ("+fy", 2)])
def test_a_lateral_force_is_in_the_wrench_of_every_sensor(axis: str, across: int) -> None:
    made = world(
        lateral=0.3,
        force_axis=axis,
        second_force_rate_hz=500.0,
        second_force_axis=axis,
        second_force_range_n=1e3,
    )
    go(made, 2e-4)
    along = "xyz".index(axis[-1])
    assert made.second_force is not None
    for channel in (made.force, made.second_force):
        six = _wrench(channel)
        assert six[across] == pytest.approx(0.3 * made.true_force_n)
        assert abs(six[along]) == pytest.approx(made.true_force_n)
        assert sum(map(bool, six)) == 2


def test_a_bent_sensor_errs_by_its_share_of_full_scale() -> None:
    made = world(sensor_quadratic=0.01, sensor_cubic=-0.02, force_range_n=400.0, arm_has_force=True)
    go(made, 2e-4)
    true_n = made.true_force_n
    share = true_n / 400.0
    error_n = _wrench(made.force)[2] - true_n
    assert error_n == pytest.approx(400.0 * (0.01 * share**2 - 0.02 * share**3))
    assert made.arm.arm_force_n == pytest.approx(true_n), "the arm's own force is not bent"


@pytest.mark.parametrize("law", ["dmt", "jkr"])
def test_a_sticking_contact_pulls_before_it_parts(law: str) -> None:
    """Drawn apart slowly on a stiff rig the force dips to about −P, then the tip is free."""
    made = world(adhesion_n=4.0, adhesion_law=law)
    go(made, 2e-4)
    plant = made.plant
    least_n = 0.0
    for step in range(1500):
        plant.command(made.time_s, 2e-4 - step * 0.1e-6)
        made.advance(made.time_s + 0.001)
        least_n = min(least_n, made.true_force_n)
    assert least_n == pytest.approx(-4.0, rel=0.1)
    made.advance(made.time_s + 0.5)
    assert made.true_force_n == 0.0
    assert plant.tip_m == pytest.approx(plant.drive_m, abs=1e-9)


def test_yield_below_the_believed_limit_leaves_a_set() -> None:
    made = world(law="elastic_plastic", elastic_limit_n=40.0)
    go(made, 2.2e-4)
    top_n = made.true_force_n
    assert top_n > 150.0
    go(made, 0.0)
    set_m = made.plant._contact_m - QUIET.surface_m
    assert set_m > 2e-6
    go(made, QUIET.surface_m + 0.9 * set_m)
    assert made.true_force_n == 0.0
    go(made, 2.2e-4)
    assert made.true_force_n == pytest.approx(top_n, rel=1e-3), "reloading is elastic"
