"""An arm of six elastic joints in MuJoCo, where that is installed: an oracle and no dependency.

MuJoCo has links, joint springs and the equations of motion; it knows of no compliance matrix.
Contact and friction act on it as an outer force, because its own contacts are not those of a
payload. Here the plate comes to the arm; in the world the arm goes to the plate.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from six_rigs import SURFACE_M, go, plant, rig

from stepload.rig.mount import Mount
from stepload_drivers.sim.springs import rows
from stepload_verify.trials.friction_bias import ARMS, TOOL_M, TWISTS, tip_compliance

mujoco = pytest.importorskip("mujoco")

JOINTS = np.array([0.3, -1.9, -1.4, 0.0, -math.pi / 2, 0.2])
JOINTS[3] = -math.pi / 2 - JOINTS[1] - JOINTS[2]
ARM = "UR5"
STEP_S = 1e-4


def transform(angle, a, d, twist):
    c, s, ct, st = math.cos(angle), math.sin(angle), math.cos(twist), math.sin(twist)
    return np.array(
        [[c, -s * ct, s * st, a * c], [s, c * ct, -c * st, a * s], [0, st, ct, d], [0, 0, 0, 1]]
    )


def model():
    (a2, a3, d1, d4, d5, d6), stiffness = ARMS[ARM]
    lengths, offsets = (0.0, a2, a3, 0.0, 0.0, 0.0), (d1, 0.0, 0.0, d4, d5, d6 + TOOL_M)
    text, place = "", np.eye(4)
    for angle, a, d, twist, k in zip(JOINTS, lengths, offsets, TWISTS, stiffness, strict=True):
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, place[:3, :3].flatten())
        at = " ".join(f"{v:.17g}" for v in place[:3, 3])
        turned = " ".join(f"{v:.17g}" for v in quat)
        text += (
            f'<body pos="{at}" quat="{turned}"><joint type="hinge" axis="0 0 1" '
            f'stiffness="{k}" damping="{0.02 * k}" armature="0.5"/>'
            '<inertial pos="0 0 0" mass="2" diaginertia="0.02 0.02 0.02"/>'
        )
        place = transform(angle, a, d, twist)
    at = " ".join(f"{v:.17g}" for v in place[:3, 3])
    text += f'<site name="tip" pos="{at}"/>' + "</body>" * 6
    option = f'<option timestep="{STEP_S}" gravity="0 0 0" integrator="implicitfast"/>'
    made = mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{text}</worldbody></mujoco>")
    data = mujoco.MjData(made)
    mujoco.mj_forward(made, data)
    return made, data


def test_the_compliance_matrix_is_that_of_the_joints_to_four_digits():
    made, data = model()
    expected, pose = tip_compliance(ARM, JOINTS)
    assert data.site("tip").xpos == pytest.approx(pose[:3, 3], abs=1e-9)
    frame = pose[:3, :3]
    found = np.empty((3, 3))
    for axis in range(3):
        pushed = []
        for sign in (1.0, -1.0):
            mujoco.mj_resetData(made, data)
            mujoco.mj_forward(made, data)
            begin = data.site("tip").xpos.copy()
            for _ in range(6000):
                data.qfrc_applied[:] = 0.0
                mujoco.mj_applyFT(
                    made, data, sign * frame[:, axis], np.zeros(3), data.site("tip").xpos, 6,
                    data.qfrc_applied,
                )  # fmt: skip
                mujoco.mj_step(made, data)
            pushed.append(frame.T @ (data.site("tip").xpos - begin))
        found[:, axis] = 0.5 * (pushed[0] - pushed[1])
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-4 * expected[2, 2])


@pytest.mark.parametrize("friction", [0.0, 0.03, 0.6])
@pytest.mark.parametrize("k", [2e6, 8e6])
def test_the_deformation_is_that_of_the_arm_of_links_to_two_per_mille(k, friction):
    made, data = model()
    compliance, pose = tip_compliance(ARM, JOINTS)
    frame = pose[:3, :3]
    begin = data.site("tip").xpos.copy()
    top_m, seconds = 1e-3, 2.0
    rubbed, at, kept, depth = np.zeros(2), np.zeros(2), 0.0, 0.0
    for step in range(round((seconds + 0.5) / STEP_S)):
        come = top_m * min(1.0, step * STEP_S / seconds)
        tip = frame.T @ (data.site("tip").xpos - begin)
        depth = max(0.0, tip[2] + come)
        normal = k * depth**1.5
        stiffness = 0.8 * 1.5 * k * math.sqrt(depth)
        left = min(1.0, stiffness / kept) if kept else 1.0
        rubbed = rubbed * left + 0.5 * (kept + stiffness) * (tip[:2] - at)
        size = float(np.linalg.norm(rubbed))
        if size > friction * normal:
            rubbed *= friction * normal / size
        at, kept = tip[:2].copy(), stiffness
        data.qfrc_applied[:] = 0.0
        force = frame @ np.array([-rubbed[0], -rubbed[1], -normal])
        mujoco.mj_applyFT(
            made, data, force, np.zeros(3), data.site("tip").xpos, 6, data.qfrc_applied
        )
        mujoco.mj_step(made, data)
    mount = Mount(
        rows(0.5 * (compliance + compliance.T)), friction_static=friction, friction_kinetic=friction
    )
    spec = replace(rig(1.0 / mount.compliance_m_per_n[2][2], k), surface_m=SURFACE_M)
    six = plant(spec, mount)
    go(six, SURFACE_M - 1e-7)
    go(six, SURFACE_M + top_m, 2.0)
    assert (six.tip.slid_m > 1e-6) == (friction < 0.1)
    assert six.tip.depth_m == pytest.approx(depth, rel=2e-3)
    assert six.load == pytest.approx((*rubbed, normal), rel=0.02, abs=0.01 * normal)
