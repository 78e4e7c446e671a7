"""The text-line load cell of docs/write-your-own-driver.md keeps the contract, and is short."""

import importlib.util
import re
from pathlib import Path

import pytest

from stepload.errors import DeviceError
from stepload.rig.contract import CheckStatus, Trial, run_trial
from stepload.rig.faults import FaultCode
from stepload_drivers.units import UNITS_N
from stepload_verify.emulators.emulator import Emulator
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Sine, WrenchSource
from stepload_verify.emulators.wire import PtyWire

PAGE = Path(__file__).parents[2] / "docs" / "write-your-own-driver.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
(EXAMPLE,) = (text for text in EXAMPLES if "class CheckedLoadCell" in text)


@pytest.fixture(scope="module")
def module(tmp_path_factory):
    """The code on the page."""
    path = tmp_path_factory.mktemp("page") / "checked_load_cell.py"
    path.write_text(EXAMPLE)
    spec = importlib.util.spec_from_file_location("checked_load_cell", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class CheckedCell:
    """What the page says the cell sends; `Z` and CR zero it."""

    period_s = 0.02

    def __init__(self, module, source):
        self.module, self.source = module, source
        self.offset_n = 9.0

    def receive(self, data, now_s):
        if b"Z\r" in data:
            self.offset_n = 0.0
        return []

    def restart(self, now_s):
        return []

    def sample(self, time_s):
        force_n = self.source.wrench(time_s)[2] + self.offset_n
        body = f"{force_n / UNITS_N['kgf']:+08.2f},0"
        return [f"{body}*{self.module.checksum(body):02X}\r".encode()]


@pytest.fixture
def emulator(module):
    source = WrenchSource(Sine(0.0, noise_n=0.3))
    with Emulator(CheckedCell(module, source), PtyWire(), FaultBoard()) as emulator:
        yield emulator


def test_the_page_keeps_its_promise_of_length():
    assert len([line for line in EXAMPLE.splitlines() if line.strip()]) < 60


def test_the_driver_on_the_page_keeps_the_contract(module, emulator):
    trial = Trial(
        make=lambda: module.CheckedLoadCell(port=emulator.address, range=200.0),
        silence=lambda: emulator.board.switch_on("silent"),
        restore=emulator.board.clear,
        stale_s=0.5,
    )
    results = run_trial(trial)
    assert [r for r in results if r.status is CheckStatus.FAILED] == []
    skipped = {r.name for r in results if r.status is CheckStatus.SKIPPED}
    assert skipped == {"options", "load", "motion", "rest", "shift", "stop", "targets"}


def test_the_line_on_the_page_is_read_and_a_damaged_one_is_not(module):
    cell = module.CheckedLoadCell(port="x", range=200.0)
    (line,) = re.findall(r"`(\+0012\.34,0\*\w+)`", PAGE.read_text())
    assert cell.reading(line) == pytest.approx(12.34 * UNITS_N["kgf"])
    with pytest.raises(ValueError, match="damaged"):
        cell.reading(line.replace("12.34", "12.35"))
    with pytest.raises(DeviceError) as caught:
        cell.reading(f"+0012.34,1*{module.checksum('+0012.34,1'):02X}")
    assert caught.value.code == FaultCode.OVERLOAD
