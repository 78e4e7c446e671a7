"""The simulated rig keeps the same contract, in virtual time and in real time."""

from dataclasses import replace

import pytest

from stepload.rig.contract import CHECKS, SkippedCheck, Trial
from stepload_drivers.sim.devices import SimArm, SimDisplacementSensor, SimForceSensor
from stepload_drivers.sim.live import DEFAULT_SPEC
from stepload_drivers.sim.world import open_world

SPEC = replace(DEFAULT_SPEC, gauge_rate_hz=100.0)


class Virtual:
    """Makes one device of a new virtual world at a time, and lets its time pass."""

    def __init__(self, which):
        self.which, self.clock = which, None

    def make(self):
        rig = open_world(SPEC)
        self.clock = rig.clock
        return getattr(rig, self.which)

    def wait(self, seconds):
        self.clock.sleep_until(self.clock.now_s() + seconds)


def virtual(which):
    world = Virtual(which)
    return Trial(make=world.make, wait=world.wait, move_m=1e-3)


def real(device):
    return Trial(make=device, move_m=1e-3, observe_s=0.1)


TRIALS = {
    "virtual arm": lambda: virtual("arm"),
    "virtual force": lambda: virtual("force"),
    "virtual displacement": lambda: virtual("displacement"),
    "real arm": lambda: real(SimArm),
    "real force": lambda: real(SimForceSensor),
    "real displacement": lambda: real(SimDisplacementSensor),
}


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("trial", TRIALS.values(), ids=TRIALS.keys())
def test_simulated_device_keeps_the_contract(trial, check):
    try:
        check(trial())
    except SkippedCheck as reason:
        pytest.skip(str(reason))
