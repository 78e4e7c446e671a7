"""One contract for all: the six sensor drivers on their emulators, and the simulated rig."""

import pytest

from stepload.rig.contract import CHECKS, SkippedCheck, Trial
from stepload.rig.plugins import load_driver
from stepload_verify.emulators.catalog import EMULATORS, driver_options
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Sine, WrenchSource

TCP = {"transport": "socketcand"}
DRIVERS = {
    "robotous_uart": ("robotous_uart", {}, {}),
    "robotous_can slcan": ("robotous_can", {}, {}),
    "robotous_can socketcand": ("robotous_can", TCP, {}),
    "bota_serial": ("bota_serial", {}, {}),
    "ati_can slcan": ("ati_can", {}, {}),
    "ati_can socketcand": ("ati_can", TCP, {}),
    "gauge_serial": ("gauge_serial", {"rate_hz": 100.0}, {"rate": 100.0}),
    "line_serial": ("line_serial", {"unit": "kgf"}, {}),
    "line_serial asked": ("line_serial", {"request": "?\\r"}, {}),
}


@pytest.fixture(params=DRIVERS)
def trial(request):
    name, device, options = DRIVERS[request.param]
    board = FaultBoard()
    source = WrenchSource(Sine(0.0))
    with EMULATORS[name](source, board, **device) as emulator:
        board.switch_on("offset", 5.0)
        group = "displacement_sensors" if name == "gauge_serial" else "force_sensors"
        driver = load_driver(f"stepload.{group}", name)
        options = {**driver_options(emulator), **options}
        yield Trial(
            make=lambda: driver(**options),
            observe_s=0.2,
            silence=lambda: board.switch_on("silent"),
            stale_s=1.0 if name == "gauge_serial" else 0.4,
        )


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_driver_keeps_the_contract(trial, check):
    try:
        check(trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))
