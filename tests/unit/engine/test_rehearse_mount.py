"""From the plan's words about six axes to the truth of the simulated rig."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from six_rigs import tip_shift_m

from stepload.engine.rehearse import mount_of, world_for
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.mounting import Mounting
from stepload.plan.simulation import Simulation
from stepload.rig.world import load_world

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"


def told(**mount):
    return Simulation(mount=Mounting(**mount))


def test_the_stiffness_along_the_press_is_the_rigs_and_the_rest_a_share_of_it():
    mount = mount_of(told(coupling_x=0.4, lateral_compliance=0.5), 1e5)
    expected = np.array([[5e-6, 0.0, 4e-6], [0.0, 5e-6, 0.0], [4e-6, 0.0, 1e-5]])
    assert np.array(mount.compliance_m_per_n) == pytest.approx(expected)


def test_every_word_arrives():
    mount = mount_of(
        told(
            turn_rad_per_n=3e-5,
            friction=0.4,
            friction_kinetic=0.2,
            tangential_ratio=0.7,
            tilt_x_rad=0.01,
            tilt_y_rad=0.02,
            sensor_turn_x_rad=0.03,
            sensor_turn_z_rad=0.05,
            sensor_lever_m=0.2,
            eccentricity_x_m=1e-3,
            eccentricity_y_m=-2e-3,
            torque_noise_n_m=0.003,
            gauge_offset_x_m=0.02,
        ),
        1e5,
    )
    assert mount.turn_rad_per_n == ((0.0, 0.0, 0.0), (3e-5, 0.0, 3e-5), (0.0, 0.0, 0.0))
    assert (mount.friction_static, mount.friction_kinetic) == (0.4, 0.2)
    assert mount.tangential_ratio == 0.7
    assert mount.plate_tilt_rad == (0.01, 0.02)
    assert mount.gauge_offset_m == (0.02, 0.0)
    sensor = mount.sensor
    assert sensor.rotation_rad == (0.03, 0.0, 0.05)
    assert sensor.lever_m == (1e-3, -2e-3, 0.2)
    assert sensor.torque_noise_nm == 0.003
    assert sensor.cross_talk is None
    assert mount.second_sensor == replace(sensor, rotation_rad=(0.0, 0.0, 0.0))


def test_a_plan_with_an_empty_mount_presses_in_six_axes(tmp_path):
    text = (PROCEDURES / "ur5e-silicone-sphere.yaml").read_text()
    text = text.replace("rig:\n", "rig:\n  simulation: {mount: {}}\n")
    text = text.replace("payloads/", f"{PROCEDURES}/payloads/")
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    spec = world_for(preflight_of(load_plan(path)))
    assert spec.mount == mount_of(told(), spec.system_stiffness_n_per_m)
    rig = load_world()(spec)
    plant = rig.world.plant
    plant.command(0.0, spec.surface_m + 1e-3)
    rig.clock.sleep_until(3.0)
    assert abs(tip_shift_m(plant)[0]) > 1e-5
