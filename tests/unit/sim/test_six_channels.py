"""What the devices of a rig with six axes tell: wrench, gauge, pose, and faults of the sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from long_ones import long
from six_rigs import SURFACE_M, rig, rub

from stepload.rig.faults import FaultCode
from stepload.rig.mount import Mount, SensorMount
from stepload.rig.samples import Status
from stepload.rig.world import SimulatedRig, WorldFault, WorldSpec
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.world import open_world

LEVER = SensorMount(lever_m=(0.0, 0.0, 0.1))


def still(mount: Mount, **truth: Any) -> WorldSpec:
    """A rig whose sensors are exact."""
    quiet = {
        "force_noise_n": 0.0,
        "force_quantum_n": 0.0,
        "force_delay_s": 0.0,
        "start_force_bias_n": 0.0,
        "arm_force_noise_n": 0.0,
        "position_noise_m": 0.0,
        "position_quantum_m": 0.0,
        "gauge_rate_hz": 100.0,
    }
    return rig(mount=mount, **(quiet | truth))


def opened(spec: WorldSpec) -> SimulatedRig:
    live = open_world(spec)
    for device in (live.arm, live.force, live.displacement, live.second_force):
        if device is not None:
            device.open(1.0)
    return live


def press(live: SimulatedRig, depth_m: float = 1e-3, seconds: float = 1.5) -> World:
    """Ramp into the payload in the first 0.8 s, gently, and wait."""
    world = live.world
    assert isinstance(world, World)
    now_s = live.clock.now_s()
    for i in range(800):
        goal_m = SURFACE_M * min(1.0, i / 100) + depth_m * max(0.0, (i - 150) / 649)
        world.plant.command(now_s + 1e-3 * i, goal_m)
    live.clock.sleep_until(now_s + seconds)
    return world


def last(device: Any) -> Any:
    return device.drain()[-1]


def test_the_wrench_is_the_load_with_its_moment_about_the_sensor():
    mount = replace(rub(0.2, x=0.5, y=0.2), sensor=replace(LEVER, lever_m=(2e-3, -3e-3, 0.1)))
    live = opened(still(mount))
    load = np.array(press(live).plant.load)
    wrench = last(live.force).wrench
    assert wrench[:3] == pytest.approx(tuple(load))
    assert wrench[3:] == pytest.approx(tuple(np.cross([2e-3, -3e-3, 0.1], load)))
    assert abs(wrench[0]) > 1.0
    x, y, z = wrench[:3]
    tx, ty = wrench[3] + 0.1 * y, wrench[4] - 0.1 * x  # without the lever's part
    assert (-ty / z, tx / z) == pytest.approx((2e-3, -3e-3))


@pytest.mark.parametrize("axis", ["+fx", "-fy", "-fz", *long(["-fx", "+fy"])])
def test_another_axis_shows_the_same_wrench_renamed(axis):
    mount = replace(rub(0.2, x=0.5, y=0.2), sensor=LEVER)
    shown = {}
    for name in ("+fz", axis):
        live = opened(still(mount, force_axis=name))
        press(live)
        shown[name] = last(live.force).wrench
    x, y, z, tx, ty, tz = shown["+fz"]
    sign = -1.0 if axis[0] == "-" else 1.0
    renamed = {"x": (z, x, y, tz, tx, ty), "y": (y, z, x, ty, tz, tx), "z": (x, y, z, tx, ty, tz)}
    assert shown[axis] == pytest.approx(tuple(sign * value for value in renamed[axis[-1]]))
    assert shown[axis]["xyz".index(axis[-1])] * sign > 10.0


def test_a_sensor_that_is_mounted_askew_shows_the_load_in_its_own_frame():
    """Turned by +5 degrees about x, an axial load shows along +y too."""
    turn = math.radians(5.0)
    straight, askew = (
        opened(still(replace(rub(0.0), sensor=replace(LEVER, rotation_rad=rotation))))
        for rotation in ((0.0, 0.0, 0.0), (turn, 0.0, 0.0))
    )
    press(straight)
    press(askew)
    x, y, z = last(straight.force).wrench[:3]
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert last(askew.force).wrench[:3] == pytest.approx(
        (0.0, z * math.sin(turn), z * math.cos(turn)), abs=1e-9
    )


def test_cross_talk_is_of_the_other_components():
    share = tuple(
        tuple(0.02 if i // 3 == j // 3 and i != j else 0.0 for j in range(6)) for i in range(6)
    )
    clean = opened(still(replace(rub(0.2, x=0.5), sensor=LEVER)))
    mixed = opened(still(replace(rub(0.2, x=0.5), sensor=replace(LEVER, cross_talk=share))))
    press(clean)
    press(mixed)
    true = np.array(last(clean.force).wrench)
    assert last(mixed.force).wrench == pytest.approx(tuple(true + np.array(share) @ true))


@pytest.mark.parametrize(
    ("kind", "shown"),
    [
        ("force_lateral_dead", (2, None, None, None, None, None)),
        ("force_torque_dead", (2, 0, 1, None, None, None)),
        ("force_lateral_swapped", (2, 1, 0, 5, 3, 4)),
    ],
)
def test_what_fails_across_the_axis(kind: str, shown: tuple[int | None, ...]) -> None:
    """A sensor that presses along x, so that its components are z, x, y of the press."""
    mount = replace(rub(0.2, x=0.5, y=0.2), sensor=LEVER)
    sound, faulty = (
        opened(replace(still(mount, force_axis="+fx"), faults=faults))
        for faults in ((), (WorldFault(kind, 0.0, 100.0, 0.0),))
    )
    press(sound)
    press(faulty)
    true = last(sound.force).wrench
    of_press = (true[1], true[2], true[0], true[4], true[5], true[3])
    wanted = [0.0 if index is None else of_press[index] for index in shown]
    assert last(faulty.force).wrench == pytest.approx(tuple(wanted))


def test_a_torque_at_full_scale_says_nothing_of_it():
    sensor = replace(LEVER, torque_range_nm=7.0)
    spec = still(replace(rub(0.2, x=0.5), sensor=sensor))
    live = opened(replace(spec, faults=(WorldFault("force_torque_saturated", 0.0, 100.0, 0.0),)))
    press(live)
    sample = last(live.force)
    assert sample.wrench[3] == pytest.approx(7.0)
    assert not sample.status


def test_every_component_has_noise_a_zero_and_a_resolution():
    sensor = replace(LEVER, torque_noise_nm=0.01, torque_quantum_nm=0.002)
    live = opened(
        still(
            replace(rub(0.0), sensor=sensor),
            force_noise_n=0.2,
            force_quantum_n=0.05,
            start_force_bias_n=4.0,
        )
    )
    live.clock.sleep_until(2.0)
    rows = np.array([sample.wrench for sample in live.force.drain()])
    assert rows.std(axis=0)[:3] == pytest.approx([0.2] * 3, rel=0.1)
    assert rows.std(axis=0)[3:] == pytest.approx([0.01] * 3, rel=0.1)
    assert abs(np.corrcoef(rows.T) - np.eye(6)).max() < 0.1
    means = rows.mean(axis=0)
    assert means[2] == pytest.approx(4.0, abs=0.03)
    assert np.all(abs(means[:2]) < 4.1)
    assert np.all(abs(means[:2]) > 0.01)
    assert np.all(abs(means[3:]) < 0.21)
    for column, quantum in zip(rows.T, [0.05] * 3 + [0.002] * 3, strict=True):
        assert np.allclose(np.round(column / quantum) * quantum, column)


def test_a_drift_and_a_bend_are_of_the_pressing_component():
    live = opened(still(rub(0.0), force_axis="-fz", force_drift_n_per_s=1.0))
    live.clock.sleep_until(2.0)
    assert last(live.force).wrench[:3] == pytest.approx((0.0, 0.0, -2.0), abs=2e-3)
    bent = opened(
        still(
            rub(0.0),
            force_axis="-fz",
            sensor_quadratic=0.05,
            sensor_cubic=-0.02,
            force_range_n=200.0,
        )
    )
    true_n = press(bent).plant.force_n
    share = true_n / 200.0
    expected = true_n + 200.0 * (0.05 * share**2 - 0.02 * share**3)
    assert last(bent.force).wrench[2] == pytest.approx(-expected)


@pytest.mark.parametrize(
    ("sensor", "truth"),
    [({"torque_range_nm": 0.5}, {}), ({"lateral_range_n": 5.0}, {}), ({}, {"force_range_n": 20.0})],
    ids=["torque", "across", "along"],
)
def test_each_component_has_its_own_full_scale(sensor, truth):
    """A small sensor overloads by its moment first."""
    live = opened(still(replace(rub(0.3, x=0.6), sensor=replace(LEVER, **sensor)), **truth))
    assert live.force.fault() is None
    load = press(live).plant.load
    sample = last(live.force)
    assert sample.status == Status.OVERRANGE | Status.SATURATED
    assert live.force.fault().code is FaultCode.OVERLOAD
    limits = [sensor.get("lateral_range_n", 1000.0)] * 2 + [truth.get("force_range_n", 1000.0)]
    limits += [sensor.get("torque_range_nm", math.inf)] * 3
    if not truth:
        assert sample.wrench[2] == pytest.approx(load[2])
    assert all(abs(v) <= 1.2 * m * (1 + 1e-12) for v, m in zip(sample.wrench, limits, strict=True))


def test_just_beyond_full_scale_is_told_and_not_cut():
    live = opened(still(rub(0.0), force_range_n=50.0))
    world = press(live, 5e-4)
    true_n = world.plant.force_n
    assert 20.0 < true_n < 50.0
    live = opened(still(rub(0.0), force_range_n=true_n / 1.1))
    press(live, 5e-4)
    sample = last(live.force)
    assert sample.status == Status.OVERRANGE
    assert sample.wrench[2] == pytest.approx(true_n, rel=1e-6)


FAULTS = {
    "reversed": (0.0, lambda w: tuple(-v for v in w)),
    "gain": (1.5, lambda w: tuple(1.5 * v for v in w)),
    "bias": (3.0, lambda w: (w[0], w[1], w[2] + 3.0, *w[3:])),
    "swapped": (0.0, lambda w: (w[2], w[0], w[1], w[5], w[3], w[4])),
    "clipped": (2.0, lambda w: (*[max(-2.0, min(2.0, v)) for v in w[:3]], *w[3:])),
    "saturated": (0.0, lambda w: (0.0, 0.0, 1000.0, 0.0, 0.0, 0.0)),
    "gain_ramp": (0.1, lambda w: tuple(1.1 * v for v in w)),
    "bias_ramp": (2.0, lambda w: (w[0], w[1], w[2] + 2.0, *w[3:])),
}
RATHER = ("reversed", "bias", "swapped", "clipped")
"""A fault of each kind: of the sign, of the zero, of the axes and of the range."""


@pytest.mark.parametrize("kind", [*RATHER, *long(kind for kind in FAULTS if kind not in RATHER)])
def test_a_fault_of_the_sensor_is_one_of_the_whole_wrench(kind):
    size, change = FAULTS[kind]
    mount = replace(rub(0.2, x=0.5), sensor=LEVER)
    sound = opened(still(mount))
    press(sound, seconds=3.0)
    true = last(sound.force).wrench
    broken = opened(still(mount, faults=(WorldFault(f"force_{kind}", 2.0, 60.0, size),)))
    press(broken, seconds=3.0 - broken.clock.now_s())
    assert last(broken.force).wrench == pytest.approx(change(true), rel=2e-3, abs=2e-3)


@pytest.mark.parametrize("kind", ["freeze", "stuck_mean", "aged", "filter"])
def test_a_wrench_that_stands_still_stands_still_in_all_six(kind):
    mount = replace(rub(0.2, x=0.5), sensor=replace(LEVER, torque_noise_nm=0.001))
    fault = WorldFault(f"force_{kind}", 0.05, 60.0, 1e4 if kind == "filter" else 60.0)
    live = opened(still(mount, force_noise_n=0.05, faults=(fault,)))
    live.clock.sleep_until(0.1)
    press(live)
    rows = np.array([sample.wrench for sample in live.force.drain()])[-400:]
    assert abs(rows.mean(axis=0)).max() < 0.2
    assert (np.ptp(rows, axis=0) == 0.0).all() == (kind == "freeze")
    assert (np.ptp(rows, axis=0) > 0.0).all() == (kind != "freeze")


def test_nan_and_loss_are_latched_as_with_one_axis():
    live = opened(still(rub(0.0), faults=(WorldFault("force_nan", 0.1, 1.0, 0.0),)))
    live.clock.sleep_until(0.3)
    assert all(math.isnan(value) for value in last(live.force).wrench)
    assert live.force.fault().code is FaultCode.NOT_FINITE
    live = opened(still(rub(0.0), faults=(WorldFault("force_lost", 0.1, 0.0, 0.0),)))
    live.clock.sleep_until(1.0)
    assert live.force.fault().code is FaultCode.STALE


def test_a_gauge_off_the_axis_sees_the_tool_turn():
    """Abbe: the approach at the gauge is that of the contact + phi x offset, along the press."""
    turn = ((0.0, 0.0, 3e-5), (0.0, 0.0, 2e-5), (0.0, 0.0, 0.0))
    shown = []
    for offset in ((0.0, 0.0), (0.02, 0.0), (0.0, 0.02)):
        live = opened(still(replace(rub(0.0), turn_rad_per_n=turn, gauge_offset_m=offset)))
        world = press(live, seconds=3.0)
        shown.append(last(live.displacement).displacement_m)
    force_n = world.plant.force_n
    assert shown[1] - shown[0] == pytest.approx(-2e-5 * force_n * 0.02, rel=1e-6)
    assert shown[2] - shown[0] == pytest.approx(3e-5 * force_n * 0.02, rel=1e-6)


def test_the_pose_shows_the_drives_and_not_what_gives_way():
    live = opened(still(rub(0.0, x=0.5)))
    world = press(live)
    assert abs(world.plant.tip_shift_m[0]) > 1e-4
    assert last(live.arm).pose[:2] == (0.0, 0.0)
    world.plant.command_shift(live.clock.now_s(), 1e-4, 2e-4)
    live.clock.sleep_until(live.clock.now_s() + 0.5)
    sample = last(live.arm)
    assert sample.pose == pytest.approx((-1e-4, 2e-4, -sample.position_m, 0.0, 0.0, 0.0))


def test_a_second_sensor_has_its_own_lever():
    mount = replace(
        rub(0.2, x=0.5), sensor=LEVER, second_sensor=replace(LEVER, lever_m=(0, 0, 0.3))
    )
    second = {"second_force_rate_hz": 500.0, "second_force_range_n": 1000.0}
    live = opened(still(mount, **second))
    press(live)
    main, other = last(live.force).wrench, last(live.second_force).wrench
    assert other[:3] == pytest.approx(main[:3])
    assert other[4] == pytest.approx(3.0 * main[4])
    assert abs(main[4]) > 0.1


def test_a_sample_between_base_steps_lies_between_their_loads():
    live = opened(still(rub(0.0, x=0.5), force_rate_hz=3000.0))
    world = live.world
    world.plant.command(live.clock.now_s(), SURFACE_M + 1e-3)
    live.force.drain()
    mixed = 0
    for _ in range(150):
        live.clock.sleep_until(live.clock.now_s() + 1e-3)
        low, high = sorted((world.plant.last_load[2], world.plant.load[2]))
        rows = [sample.wrench[2] for sample in live.force.drain()]
        assert all(low - 1e-9 <= value <= high + 1e-9 for value in rows)
        mixed += len({round(value, 9) for value in rows}) == 3
    assert mixed > 50


def test_the_same_seed_gives_the_same_samples():
    spec = still(rub(0.2, x=0.5), force_noise_n=0.1)
    rows = []
    for _ in range(2):
        live = opened(spec)
        press(live)
        rows.append([*live.force.drain(), *live.arm.drain()])
    assert rows[0] == rows[1]
