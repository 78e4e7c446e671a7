"""The drivers called `sim` keep the contract in real time; in virtual time see
`test_broken_drivers`."""

import pytest
from clock_checks import CONTRACT

from stepload.rig.contract import SkippedCheck, Trial, trial_of
from stepload_drivers.sim.devices import SimArm, SimDisplacementSensor, SimForceSensor


@pytest.mark.parametrize("check", CONTRACT)
@pytest.mark.parametrize(
    ("driver", "options"),
    [(SimArm, {"lag": 0.05}), (SimForceSensor, {}), (SimDisplacementSensor, {})],
)
def test_simulated_device_keeps_the_contract(driver, options, check):
    try:
        check(Trial(*trial_of(driver, options), move_m=1e-3, observe_s=0.1))
    except SkippedCheck as reason:
        pytest.skip(str(reason))
