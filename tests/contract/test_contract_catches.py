"""The driver of docs/write-your-own-driver.md passes the contract; each broken one is caught."""

import importlib.util
import math
import re
import socket
import threading
import time
from pathlib import Path

import pytest

from stepload.errors import DeviceError
from stepload.rig.contract import (
    ContractViolation,
    Trial,
    Verdict,
    check_bias,
    check_close,
    check_failing_open,
    check_open,
    check_safe,
    check_samples,
    check_stale,
    check_unopened,
    run_contract,
    run_trial,
)
from stepload.rig.device import Arm, ForceSensor, Identity

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
                    link.sendall(b"%.4f\n" % (5.0 + 0.001 * math.sin(number)))
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
    trial = Trial(
        make=lambda: load_cell(**amplifier.options), silence=amplifier.silent.set, stale_s=1.0
    )
    results = run_trial(trial)
    assert [r for r in results if r.verdict is Verdict.FAILED] == []
    skipped = {r.name for r in results if r.verdict is Verdict.SKIPPED}
    assert skipped == {"bias", "motion"}


def test_run_contract_reports_every_check(load_cell, amplifier):
    results = run_contract(ForceSensor, load_cell, amplifier.options)
    assert {r.verdict for r in results} == {Verdict.PASSED, Verdict.SKIPPED}
    assert len(results) == 9
    with pytest.raises(ContractViolation, match="no Arm"):
        run_contract(Arm, load_cell, amplifier.options)


def broken(base, **methods):
    return type("Broken", (base,), methods)


def repeats(base):
    def drain(self):
        samples = base.drain(self)
        return samples + samples[-1:]

    return broken(base, drain=drain)


def loses_unnoticed(base):
    def drain(self):
        return [s._replace(sequence=2 * s.sequence) for s in base.drain(self)]

    return broken(base, drain=drain)


def time_goes_back(base):
    def drain(self):
        return [s._replace(receive_time_s=-s.receive_time_s) for s in base.drain(self)]

    return broken(base, drain=drain)


def hides_nan(base):
    def drain(self):
        return [s._replace(wrench=(math.nan,) * 6) for s in base.drain(self)]

    return broken(base, drain=drain)


def drops_half(base):
    def drain(self):
        return [s for s in base.drain(self) if s.sequence % 2]

    return broken(base, drain=drain)


def wrong_rate(base):
    def rename(self, timeout_s):
        identity = base.open(self, timeout_s)
        self.rate_hz = 1000.0
        return identity

    return broken(base, open=rename)


def opens_in_constructor(base):
    def init(self, *, host, port):
        base.__init__(self, host=host, port=port)
        self._socket = socket.create_connection((host, port))
        self._thread = threading.Thread()

    return broken(base, __init__=init)


def anonymous(base):
    def nameless(self, timeout_s):
        base.open(self, timeout_s)
        return Identity("tcp_load_cell", "", "unknown", "unknown", "unknown")

    return broken(base, open=nameless)


def unsafe(base):
    def safe(self, timeout_s):
        raise DeviceError("no", code="refused_command")

    return broken(base, safe=safe)


def safe_crashes_when_closed(base):
    def safe(self, timeout_s):
        self._socket.fileno()

    return broken(base, safe=safe)


def leaks(base):
    def close(self):
        self._kept = self._socket or getattr(self, "_kept", None)
        self._socket = None

    return broken(base, close=close)


def wrong_error(base):
    def refuse(self, timeout_s):
        if timeout_s < 1.0:
            raise DeviceError("no", code="whatever")
        return base.open(self, timeout_s)

    return broken(base, open=refuse)


def never_stale(base):
    return broken(base, fault=lambda self: None)


def lies_about_bias(base):
    return broken(base, bias=lambda self, timeout_s: True)


@pytest.mark.parametrize(
    ("make", "check", "words"),
    [
        (repeats, check_samples, "repeated"),
        (loses_unnoticed, check_samples, "lost samples"),
        (time_goes_back, check_samples, "receive time went back"),
        (hides_nan, check_samples, "not finite"),
        (drops_half, check_samples, "lost samples"),
        (wrong_rate, check_samples, "rate"),
        (opens_in_constructor, check_unopened, "only `open` may"),
        (anonymous, check_open, "identity.model"),
        (unsafe, check_safe, "sound device failed"),
        (leaks, check_close, "left open"),
        (wrong_error, check_failing_open, "no FaultCode"),
        (never_stale, check_stale, "no fault"),
        (lies_about_bias, check_bias, "still reads"),
    ],
)
def test_a_broken_driver_is_caught(load_cell, amplifier, make, check, words):
    driver = make(load_cell)
    devices = []

    def new():
        devices.append(driver(**amplifier.options))
        return devices[-1]

    trial = Trial(make=new, silence=amplifier.silent.set, stale_s=0.5, observe_s=0.2)
    try:
        with pytest.raises(ContractViolation, match=words):
            check(trial)
    finally:
        amplifier.stopped.set()  # ends also the connections that a broken driver leaves behind
        for device in devices:
            device._socket = device._socket or getattr(device, "_kept", None)
            load_cell.close(device)


def test_a_crash_is_a_failed_check_not_the_end_of_the_suite(load_cell, amplifier):
    driver = safe_crashes_when_closed(load_cell)
    results = run_contract(ForceSensor, driver, amplifier.options)
    failed = [r for r in results if r.verdict is Verdict.FAILED]
    assert [r.name for r in failed] == ["safe"]
    assert "AttributeError" in failed[0].message
