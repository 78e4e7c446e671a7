"""What the arm of a rig with six axes tells of force: along the press and across it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from six_rigs import SURFACE_M, rig, rub

from stepload.rig.world import SimulatedRig, WorldFault
from stepload_drivers.sim.simulation import World
from stepload_drivers.sim.world import open_world

MOUNT = rub(0.2, x=0.5, y=0.2)


def pressed(mount: Any = MOUNT, seconds: float = 1.5, **truth: Any) -> SimulatedRig:
    """A rig whose arm is quiet unless it is said, pressed into the payload."""
    quiet = {"arm_force_noise_n": 0.0, "position_noise_m": 0.0, "position_quantum_m": 0.0}
    live = open_world(rig(mount=mount, **(quiet | truth)))
    live.arm.open(1.0)
    assert isinstance(live.world, World)
    now_s = live.clock.now_s()
    for i in range(800):
        goal_m = SURFACE_M * min(1.0, i / 100) + 1e-3 * max(0.0, (i - 150) / 649)
        live.world.plant.command(now_s + 1e-3 * i, goal_m)
    live.clock.sleep_until(now_s + seconds)
    return live


def load(live: SimulatedRig) -> Any:
    return live.world.plant.load  # type: ignore[attr-defined]


def test_the_arm_tells_what_the_tip_does_to_the_plate() -> None:
    live = pressed()
    sample = live.arm.drain()[-1]
    assert sample.wrench[:3] == pytest.approx(load(live))
    assert abs(sample.wrench[0]) > 1.0
    assert sample.wrench[2] == sample.force_n
    assert np.isnan(sample.wrench[3:]).all()
    assert live.arm.has_wrench


def test_every_component_has_a_noise_and_a_zero_of_its_own() -> None:
    live = open_world(rig(mount=MOUNT, arm_force_noise_n=2.0))
    live.arm.open(1.0)
    live.clock.sleep_until(4.0)
    forces = np.array([sample.wrench[:3] for sample in live.arm.drain()])
    assert np.std(forces, axis=0) == pytest.approx([2.0] * 3, rel=0.1)
    assert abs(np.corrcoef(forces.T)[np.triu_indices(3, 1)]).max() < 0.1
    assert len(set(np.round(forces.mean(axis=0), 3))) == 3


FAULTS = {
    "arm_force_gain": (0.5, lambda x, y: (0.5 * x, 0.5 * y)),
    "arm_force_reversed": (0.0, lambda x, y: (-x, -y)),
    "arm_force_deaf": (0.0, lambda x, y: (0.0, 0.0)),
    "arm_force_bias": (5.0, lambda x, y: (x, y)),
    "arm_force_old": (1.55, lambda x, y: (0.0, 0.0)),
    "arm_force_clipped": (1.5, lambda x, y: (math.copysign(1.5, x), math.copysign(1.5, y))),
}


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_of_the_arms_force_is_one_of_the_whole_vector(kind: str) -> None:
    size, change = FAULTS[kind]
    x, y, _ = load(pressed())
    assert min(abs(x), abs(y)) > 1.5
    live = pressed(seconds=1.6, faults=(WorldFault(kind, 1.5, 60.0, size),))
    sample = live.arm.drain()[-1]
    assert sample.wrench[:2] == pytest.approx(change(x, y), abs=1e-3)
    assert sample.wrench[2] == sample.force_n


@pytest.mark.parametrize("turned", [False, True])
def test_an_arm_that_is_turned_round_presses_on_its_way_back(turned: bool) -> None:
    faults = (WorldFault("arm_turned", 0.0, 60.0, 0.0),) if turned else ()
    live = open_world(rig(mount=MOUNT, faults=faults))
    live.arm.open(1.0)
    live.arm.command(-2.0 * SURFACE_M)
    live.clock.sleep_until(2.0)
    assert live.arm.drain()[-1].position_m == pytest.approx(-2.0 * SURFACE_M, abs=10e-6)
    assert (live.world.true_force_n > 1.0) == turned
