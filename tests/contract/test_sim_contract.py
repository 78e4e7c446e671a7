"""The drivers called `sim` keep the contract in real time; in virtual time see
`test_broken_drivers`."""

import pytest
from clock_checks import AGAINST_THE_CLOCK, CONTRACT

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


def test_what_compares_the_clock_is_marked_as_real_time(request):
    here = [item for item in request.session.items if item.path == request.node.path]
    timed = [item for item in here if _check_of(item) in AGAINST_THE_CLOCK]
    assert all(item.get_closest_marker("realtime") for item in timed)


def _check_of(item):
    return item.callspec.params.get("check") if hasattr(item, "callspec") else None
