"""A real driver and the emulator of its device, on a real transport."""

import time
from contextlib import contextmanager

import pytest

from stepload.rig.plugins import load_driver
from stepload_verify.emulators.catalog import EMULATORS, GAUGES, driver_options
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Sine, WrenchSource

BOUND_S = 10.0

TOLERATES_S = {"emulated": 0.005, "start_emulator": 0.02, "emulated_run": 0.02}
"""Whoever uses one of these fixtures runs in real time, and may fail in a longer stall.

A question to an ATI sensor is given up after 10 ms, in which emulator and driver have to wake once
each; the emulated UR controller makes up for 20 ms and then skips periods.
"""


def pytest_collection_modifyitems(items):
    for item in items:
        for fixture, tolerates_s in TOLERATES_S.items():
            if fixture in item.fixturenames:
                item.add_marker(pytest.mark.realtime(tolerates_s=tolerates_s))


class Pair:
    """A driver that is open on its emulator."""

    def __init__(self, driver, emulator):
        self.driver, self.emulator = driver, emulator
        self.samples = []

    def run(self, seconds):
        """Drain as an engine would."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.samples += self.driver.drain()
            time.sleep(0.005)
        self.samples += self.driver.drain()

    def until(self, done):
        """Drain until `done()`; whether that came within a generous bound."""
        end_s = time.monotonic() + BOUND_S
        while not done() and time.monotonic() < end_s:
            self.run(0.01)
        return done()


@pytest.fixture
def emulated():
    """Opens a pair: `with emulated("bota_serial", faults=("wrap",), rate=800.0) as pair:`."""

    @contextmanager
    def opened(name, *, peak_n=10.0, device=None, faults=(), open_it=True, **options):
        board = FaultBoard()
        for fault in faults:
            board.switch_on(fault)
        source = WrenchSource(Sine(peak_n))
        emulator = EMULATORS[name](source, board, **(device or {}))
        group = "displacement_sensors" if name in GAUGES else "force_sensors"
        driver = load_driver(f"stepload.{group}", name)(**driver_options(emulator), **options)
        with emulator:
            try:
                if open_it:
                    driver.open(5.0)
                yield Pair(driver, emulator)
            finally:
                driver.close()

    return opened
