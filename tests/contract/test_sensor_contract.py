"""One contract for all: the sensor drivers on their emulators, and the simulated rig."""

from dataclasses import replace
from functools import partial

import pytest
from clock_checks import CONTRACT
from long_ones import long

from stepload.rig.contract import SkippedCheck, Trial, trial_of
from stepload.rig.contract_life import check_lost_link, check_stale
from stepload.rig.plugins import load_driver
from stepload_verify.emulators.catalog import EMULATORS, GAUGES, driver_options
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.gauge import RANGE_M
from stepload_verify.emulators.physics import Sine, WrenchSource

LOAD_N, LOAD_M = 20.0, 1e-3
TCP = {"transport": "socketcand"}
DRIVERS = {
    "robotous_uart": ("robotous_uart", {}, {}),
    "robotous_can slcan": ("robotous_can", {}, {}),
    "robotous_can socketcand": ("robotous_can", TCP, {}),
    "bota_serial": ("bota_serial", {}, {}),
    "ati_can slcan": ("ati_can", {}, {}),
    "ati_can socketcand": ("ati_can", TCP, {}),
    "ati_net": ("ati_net", {"units": "lbf"}, {}),
    "gauge_serial": ("gauge_serial", {"rate_hz": 100.0}, {"rate": 100.0}),
    "line_serial": ("line_serial", {"unit": "kgf"}, {}),
    "line_serial asked": ("line_serial", {"request": "?\\r"}, {}),
}


SELDOM = ("robotous_can socketcand", "ati_can slcan", "line_serial asked")
"""What differs from another driver by its transport alone."""


@pytest.fixture(params=[*(each for each in DRIVERS if each not in SELDOM), *long(SELDOM)])
def trial(request):
    name, device, options = DRIVERS[request.param]
    board = FaultBoard()
    source = WrenchSource(Sine(0.0))
    with EMULATORS[name](source, board, **device) as emulator:
        board.switch_on("offset", 5.0)
        group = "displacement_sensors" if name in GAUGES else "force_sensors"
        make, make_with = trial_of(
            load_driver(f"stepload.{group}", name), {**driver_options(emulator), **options}
        )

        def load():
            board.clear()
            if name in GAUGES:
                board.switch_on("overrange", LOAD_M / RANGE_M)
                return LOAD_M
            board.switch_on("offset", 5.0 + LOAD_N)
            return LOAD_N

        def silence(fault="silent"):
            board.switch_on(fault)
            if fault == "unplug":
                assert emulator.unplugged.wait(60.0), "it went on to send"

        yield Trial(
            make,
            make_with,
            observe_s=0.2,
            silence=silence,
            stale_s=1.0 if name in GAUGES else 0.4,
            load=load,
        )


@pytest.mark.parametrize("check", CONTRACT)
def test_driver_keeps_the_contract(trial, check):
    try:
        check(trial)
    except SkippedCheck as reason:
        pytest.skip(str(reason))


@pytest.mark.parametrize("check", [check_stale, check_lost_link])
def test_unplugged_driver_keeps_the_contract(trial, check):
    check(replace(trial, silence=partial(trial.silence, "unplug")))
