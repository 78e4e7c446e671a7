"""The driver of docs/write-your-own-driver.md keeps the contract."""

import importlib.util
import math
import re
import socket
import threading
import time
from pathlib import Path

import pytest

from stepload.rig.contract import (
    CheckStatus,
    Trial,
    run_contract,
    run_trial,
    trial_of,
)
from stepload.rig.device import ForceSensor

PAGE = Path(__file__).parents[2] / "docs" / "write-your-own-driver.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
(EXAMPLE,) = (text for text in EXAMPLES if "class TcpLoadCell" in text)


@pytest.fixture(scope="module")
def load_cell(tmp_path_factory):
    """The class on the page."""
    path = tmp_path_factory.mktemp("page") / "load_cell.py"
    path.write_text(EXAMPLE)
    spec = importlib.util.spec_from_file_location("load_cell", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.TcpLoadCell


class Amplifier:
    """Sends "5.0…" a hundred times a second to whoever connects."""

    def __init__(self):
        self.force_n = 5.0
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.settimeout(0.02)
        self.options = {"host": "127.0.0.1", "port": self.server.getsockname()[1]}
        self.silent, self.stopped = threading.Event(), threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        links = []
        number = 0
        begin_s = time.monotonic()
        while not self.stopped.wait(max(0.0, begin_s + 0.01 * (number + 1) - time.monotonic())):
            number += 1
            try:
                self.server.settimeout(0.0001)
                links.append(self.server.accept()[0])
            except (TimeoutError, BlockingIOError):
                pass
            for link in () if self.silent.is_set() else list(links):
                try:
                    link.sendall(b"%.4f\n" % (self.force_n + 0.001 * math.sin(number)))
                except OSError:
                    links.remove(link)
                    link.close()
        for link in links:
            link.close()
        self.server.close()


@pytest.fixture
def amplifier():
    device = Amplifier()
    yield device
    device.stopped.set()
    device.thread.join()


def test_the_page_keeps_its_promise_of_length():
    assert len([line for line in EXAMPLE.splitlines() if line.strip()]) < 100


def test_the_driver_on_the_page_keeps_the_contract(load_cell, amplifier):
    def load():
        amplifier.force_n += 10.0
        return 10.0

    results = run_trial(
        Trial(
            *trial_of(load_cell, amplifier.options),
            silence=amplifier.silent.set,
            restore=amplifier.silent.clear,
            stale_s=1.0,
            load=load,
        )
    )
    assert [r for r in results if r.status is CheckStatus.FAILED] == []
    skipped = {r.name for r in results if r.status is CheckStatus.SKIPPED}
    assert skipped == {"bias", "motion", "rest", "shift", "stop", "targets"}


def test_a_crash_is_a_failed_check_not_the_end_of_the_suite(load_cell, amplifier):
    class SafeCrashes(load_cell):
        def safe(self, timeout_s):
            self._socket.fileno()

    results = run_contract(ForceSensor, SafeCrashes, amplifier.options)
    failed = [r for r in results if r.status is CheckStatus.FAILED]
    assert [r.name for r in failed] == ["safe"]
    assert "AttributeError" in failed[0].message
