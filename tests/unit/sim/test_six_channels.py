"""What the devices of a rig with six axes tell: wrench, gauge, pose, and faults of the sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from six_rigs import SURFACE_M, rig, rub, tip_shift_m

from stepload.rig.mount import Mount, SensorMount
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
    assert abs(tip_shift_m(world.plant)[0]) > 1e-4
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
