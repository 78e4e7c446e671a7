"""The mechanics of six axes: against one axis, closed forms and a solver without time or mass."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from long_ones import long_rows
from quasi_static import press
from six_rigs import SURFACE_M, go, plant, rig, rub, shift, springs, tip_shift_m, wait

from stepload.rig.mount import Mount
from stepload.rig.world import WorldFault
from stepload_drivers.sim.friction import lateral_derating
from stepload_drivers.sim.plant import Plant
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.six_plant import SixPlant


def pressed(spec, make, speed_m_s=0.5e-3):
    """Ramp into the payload, 20 um further, and stand; every force on the way."""
    mechanics = make(spec)
    goal_m, forces = spec.surface_m + 20e-6, []
    for i in range(1200):
        mechanics.command(mechanics.time_s, min(goal_m, speed_m_s * i * 1e-3))
        mechanics.step()
        forces.append(mechanics.force_n)
    return mechanics, forces


@pytest.mark.parametrize(
    ("stiffness", "k", "n"), [(3.49e6, 6.57e8, 1.5), (1e5, 1e8, 1.0), (3e4, 3e13, 2.5)]
)
@pytest.mark.parametrize("lag_s", [0.0, 0.004])
def test_without_coupling_and_friction_it_is_the_one_axis_plant(stiffness, k, n, lag_s):
    spec = rig(stiffness, k, n, lag_s=lag_s, max_acceleration_m_s2=2.0, lost_motion_m=2e-6)
    one, expected = pressed(spec, lambda spec: Plant(spec, step_s=1e-3))
    six, forces = pressed(spec, lambda spec: plant(spec, Mount(springs(stiffness))))
    assert six.peak_n == pytest.approx(one.peak_n, rel=2e-3)
    assert six.peak_equivalent_n == six.peak_n
    assert six.drive_m == pytest.approx(one.drive_m, abs=1e-15)
    assert six.tip_m == pytest.approx(one.tip_m, abs=5e-9)
    assert six.closed_m == pytest.approx(one.closed_m, abs=5e-9)
    touching = next(i for i, force_n in enumerate(expected) if force_n > 0.0)
    near = slice(touching, touching + 12)
    assert forces[near] == pytest.approx(expected[near], abs=0.02 * one.peak_n)


def test_a_start_pose_that_presses_carries_the_friction_of_the_way_there():
    """Then no load of the way back is harder on the payload than that at the start."""
    spec = rig(payload={"poisson_ratio": 0.49})
    driven = plant(spec, rub(0.5, x=0.2))
    go(driven, SURFACE_M + 1e-3)
    began = plant(replace(spec, surface_m=-1e-3), rub(0.5, x=0.2))
    assert began.force_n == pytest.approx(driven.force_n, rel=1e-3)
    assert began.friction_n == pytest.approx(driven.friction_n, rel=1e-2)
    assert began.friction_n > 0.1 * began.force_n
    assert began.drive_m == 0.0
    start_n = began.peak_equivalent_n
    go(began, -1.5e-3)
    assert began.force_n == 0.0
    assert began.peak_equivalent_n == start_n


@pytest.mark.parametrize("seed", range(3))
def test_in_free_air_the_tip_swings_as_the_exact_solution(seed):
    """M u'' + b S u' + S u = 0 about a drive that stands."""
    chance = np.random.default_rng(seed)
    half = chance.normal(size=(3, 3))
    mass = half @ half.T + 2.0 * np.eye(3)
    mount = replace(
        rub(0.0, x=0.4, y=-0.2),
        mass_kg=tuple(map(tuple, mass.tolist())),
        plate_tilt_rad=(0.1, -0.2),
    )
    spec = rig(surface_m=1.0)
    six = plant(spec, mount)
    six.command(0.0, 1e-4)
    six.step()
    stiffness = np.linalg.inv(np.array(mount.compliance_m_per_n))
    damping = stiffness * spec.system_damping_n_s_per_m / spec.system_stiffness_n_per_m
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ damping]])
    values, vectors = np.linalg.eig(system)
    six.step()  # the drive stands from here on
    speed = np.array(six._held.to_press) @ np.array(six.tip.speed)
    begin = np.array([*tip_shift_m(six), six.tip_m - 1e-4, *speed])
    for tick in range(1, 80):
        six.step()
        grown = vectors @ np.diag(np.exp(values * tick * 1e-3)) @ np.linalg.inv(vectors) @ begin
        found = [*tip_shift_m(six), six.tip_m - 1e-4]
        assert found == pytest.approx(grown.real[:3], rel=1e-6, abs=1e-12)


ORACLES = [
    (9e4, 8e6, rub(0.3, x=0.33, y=0.1), 2e-3),
    *long_rows(
        [
            (9e4, 8e6, rub(0.1, x=0.33, y=0.1, plate_tilt_rad=(0.02, 0.05)), 2e-3),
            (9e4, 8e6, rub(0.0, x=0.6, plate_tilt_rad=(0.02, -0.05)), 2e-3),
        ]
    ),
    (9e4, 1e8, rub(0.6, x=0.6, y=0.1, plate_tilt_rad=(-0.02, 0.05)), 1e-3),
    (
        3.49e6,
        6.57e8,
        Mount(springs(3.49e6, 1.7, 0.1), friction_static=0.15, friction_kinetic=0.15),
        1.2e-4,
    ),
]


@pytest.mark.parametrize(("stiffness", "k", "mount", "top_m"), ORACLES)
def test_it_agrees_with_a_solver_without_time_and_mass(stiffness, k, mount, top_m):
    """Loading and half of the unloading: deformation to 0.2 %, friction and sideways motion too."""
    spec = rig(stiffness, k)
    six = plant(spec, mount)
    up = np.linspace(SURFACE_M, SURFACE_M + top_m, 401)
    down = np.linspace(SURFACE_M + top_m, SURFACE_M + 0.5 * top_m, 201)
    path = [*up, *down[1:]]
    states = press(mount, k, 1.5, SURFACE_M, [(0.0, 0.0, at_m) for at_m in path])
    go(six, SURFACE_M - 1e-6, 0.2)
    for (at_m, state), place in zip(zip(path, states, strict=True), range(len(path)), strict=True):
        go(six, at_m, 0.008, settle_s=0.2 if place in (200, 400, 600) else 0.0)
        if place in (200, 400, 600):
            assert six.tip.depth_m == pytest.approx(state.depth_m, rel=2e-3)
            assert six.load == pytest.approx(tuple(state.load_n), rel=2e-3, abs=0.02 * six.force_n)
            assert tip_shift_m(six) == pytest.approx(state.tip_m[:2], rel=0.02, abs=1e-6)


def test_a_contact_that_slides_freely_shows_the_whole_compliance():
    """1/K_s to four digits, as the first column of C says it."""
    mount = rub(0.0, x=0.5, y=-0.2)
    six = plant(rig(), mount)
    go(six, SURFACE_M + 1e-3)
    given_m = six.drive_m - six.tip_m
    assert given_m / six.force_n == pytest.approx(1.0 / 9e4, rel=1e-5)
    assert tip_shift_m(six)[0] / six.force_n == pytest.approx(-0.5 / 9e4, rel=1e-5)
    assert tip_shift_m(six)[1] / six.force_n == pytest.approx(0.2 / 9e4, rel=1e-5)


def test_a_contact_that_sticks_has_the_stiffness_of_the_held_tip():
    """Linear contact that never slides: (C + diag(1/k_t, 1/k_t, 1/k_n))^-1, element 33."""
    mount = rub(9.0, x=0.5, y=-0.2, tangential_ratio=0.7)
    six = plant(rig(k=2e7, n=1.0), mount)
    go(six, SURFACE_M - 1e-7)
    go(six, SURFACE_M + 1e-6)  # slowly, or it bounces
    go(six, SURFACE_M + 1e-3, 3.0)
    soft = np.array(mount.compliance_m_per_n) + np.diag([1 / 1.4e7, 1 / 1.4e7, 1 / 2e7])
    expected = np.linalg.inv(soft)
    assert six.force_n / 1e-3 == pytest.approx(expected[2, 2], rel=1e-5)
    assert six.load[0] / 1e-3 == pytest.approx(expected[0, 2], rel=1e-4)
    assert six.force_n / 1e-3 > 1.3 * (9e4 * 2e7) / (9e4 + 2e7)


def test_it_slides_at_the_static_and_goes_on_at_the_kinetic_friction():
    six = plant(rig(), rub(0.3, 0.2))
    go(six, SURFACE_M + 1e-3)
    normal_n = six.tip.normal_n
    most, least, slid, going_on, slides = 0.0, math.inf, [], [], False
    for i in range(4000):
        six.command_shift(six.time_s, 1e-7 * i, 0.0)
        six.step()
        share = six.friction_n / six.tip.normal_n
        most = max(most, share)
        if slides and six.tip.rubbing.sliding:
            going_on.append(share)
        slides = six.tip.rubbing.sliding
        if six.tip.slid_m > 0.0:
            least = min(least, share)
            slid.append(six.tip.slid_m)
    assert six.tip.normal_n == pytest.approx(normal_n, rel=2e-3)
    assert most == pytest.approx(0.3, rel=2e-3)
    assert least < 0.21
    assert going_on
    assert max(going_on) == pytest.approx(0.2, rel=1e-6)
    assert six.load[0] > 0.0  # it pushes the plate along
    jumps = [b - a for a, b in pairwise(slid)]
    assert max(jumps) > 20 * sorted(jumps)[len(jumps) // 2]  # it goes on by jerks


def test_friction_below_its_limit_holds_the_tip():
    """A shift that the springs take: the tip moves by the contact's own give and no more."""
    six = plant(rig(), rub(0.3))
    go(six, SURFACE_M + 1e-3)
    begin_m = tip_shift_m(six)[0]
    shift(six, 5e-5)
    assert six.tip.slid_m == 0.0
    assert 0.0 < six.friction_n < 0.3 * six.tip.normal_n
    springs_n_per_m, contact_n_per_m = 9e4 / 0.8, 0.8 * 1.5 * six.tip.normal_n / six.tip.depth_m
    share = springs_n_per_m / (springs_n_per_m + contact_n_per_m)
    assert tip_shift_m(six)[0] - begin_m == pytest.approx(share * 5e-5, rel=0.01)


@pytest.mark.parametrize("tilt", [(0.0, 0.05), (0.05, 0.0), (-0.04, 0.03)])
def test_a_tilted_plate_pushes_along_its_normal(tilt):
    """n = (sin b, -sin a, cos b) for a small turn (a, b) about axes 1 and 2."""
    six = plant(rig(), rub(0.0, plate_tilt_rad=tilt))
    go(six, SURFACE_M + 1e-3)
    x, y, z = six.load
    assert x / z == pytest.approx(math.tan(tilt[1]), rel=3e-3, abs=1e-9)
    assert y / z == pytest.approx(-math.tan(tilt[0]), rel=3e-3, abs=1e-9)
    assert math.hypot(x, y, z) == pytest.approx(six.tip.normal_n)
    assert six.peak_n >= six.tip.normal_n


def test_the_peak_is_of_the_resultant_and_knows_what_friction_costs():
    six = plant(rig(k=1e8), rub(0.6, x=0.6))
    go(six, SURFACE_M + 1e-3)
    resultant_n = math.hypot(*six.load)
    share = six.friction_n / six.tip.normal_n
    assert share > 0.2
    assert resultant_n > 1.02 * six.force_n
    assert six.peak_n == pytest.approx(resultant_n, rel=0.01)
    assert six.peak_equivalent_n == pytest.approx(
        resultant_n / lateral_derating(0.3)(share), rel=0.03
    )


def test_a_plate_that_becomes_slippery_lets_go_and_holds_again():
    spec = rig(k=1e8)
    spec = replace(spec, faults=(WorldFault("plate_slips", 2.0, 1.0, 0.05),))
    six = plant(spec, rub(0.6, x=0.6))
    go(six, SURFACE_M + 1e-3)
    while six.time_s < 1.99:
        six.step()
    held = six.friction_n / six.tip.normal_n
    assert held > 0.2
    while six.time_s < 2.5:
        six.step()
    assert six.friction_n / six.tip.normal_n < 0.0501
    assert six.tip.slid_m > 1e-6
    while six.time_s < 3.5:
        six.step()
    go(six, SURFACE_M + 1.1e-3)
    assert six.friction_n / six.tip.normal_n > 0.051


def test_brake_and_push_limit_hold_all_drives():
    six = plant(rig(max_push_n=20.0), rub(0.3))
    go(six, SURFACE_M + 2e-3)
    assert six.force_n == pytest.approx(20.0, rel=0.05)
    shift(six, 5e-5)
    six.braked = True
    at = six.shift_m, six.drive_m
    six.command(six.time_s, 0.0)
    six.command_shift(six.time_s, 0.0, 0.0)
    wait(six, 0.1)
    assert (six.shift_m, six.drive_m) == at
    assert six.drive_speed == 0.0
    six.braked = False
    wait(six, 0.1)
    assert (six.shift_m, six.drive_m) == at


def test_a_world_without_a_mount_has_the_one_axis_plant():
    spec = rig()
    assert type(World(spec).plant) is Plant
    assert isinstance(World(replace(spec, mount=rub(0.3))).plant, SixPlant)
