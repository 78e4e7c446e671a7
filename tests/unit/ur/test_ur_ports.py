"""The calls of ur_rtde that are used: every return value looked at, every package of one moment."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest
from ur_fakes import HOME

from stepload_drivers.ur import ports
from stepload_drivers.ur.ports import ControlPort, ReceivePort
from stepload_drivers.ur.settings import Settings


class Rtde:
    """Both interfaces of ur_rtde; `answers` by name of the call, True where there is none."""

    FLAG_UPLOAD_SCRIPT, FLAG_NO_EXT_FT, FLAG_UPPER_RANGE_REGISTERS = 1, 2, 4

    def __init__(self, *arguments):
        self.arguments = arguments
        self.calls = []
        self.answers = {}
        self.stamps = [1.0]
        self.pose = list(HOME)

    def getTimestamp(self):  # noqa: N802
        return self.stamps.pop(0) if len(self.stamps) > 1 else self.stamps[0]

    def getActualTCPPose(self):  # noqa: N802
        return self.pose

    def getActualTCPForce(self):  # noqa: N802
        return [0.0] * 6

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)

        def call(*arguments):
            self.calls.append((name, *arguments))
            answer = self.answers.get(name, True)
            if isinstance(answer, Exception):
                raise answer
            return answer

        return call


@pytest.fixture(autouse=True)
def limits(monkeypatch):
    """Limits that were set on the files this process may have open."""
    limits = []
    monkeypatch.setattr(ports.resource, "setrlimit", lambda what, pair: limits.append((what, pair)))
    return limits


@pytest.fixture(autouse=True)
def library(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtde_receive", SimpleNamespace(RTDEReceiveInterface=Rtde))
    monkeypatch.setitem(sys.modules, "rtde_control", SimpleNamespace(RTDEControlInterface=Rtde))


def settings(**options):
    return Settings(host="10.0.0.2", **options)


def test_a_package_is_new_only_with_another_stamp():
    port = ReceivePort(settings())
    first = port.read_new(None)
    assert first.pose == HOME
    assert port.read_new(first) is None
    port._rtde.stamps = [1.002]
    assert port.read_new(first).timestamp_s == 1.002


def test_from_the_control_interface_on_no_socket_can_be_opened(limits):
    ReceivePort(settings())
    assert limits == []
    ControlPort(settings())
    assert limits == [(ports.resource.RLIMIT_NOFILE, (3, 3))]


def test_values_of_two_moments_are_read_again():
    port = ReceivePort(settings())
    port._rtde.stamps = [1.0, 1.002, 1.002, 1.002]
    assert port.read_new(None).timestamp_s == 1.002
    port._rtde.stamps = [number / 1000 for number in range(2 * ports.READS + 1)]
    assert port.read_new(None) is None


def test_prepare_sets_tcp_and_payload_before_the_watchdog():
    port = ControlPort(settings(tcp_offset=(0, 0, 0.1), payload_mass=1.5, watchdog=20.0))
    assert port.prepare() is True
    assert port._rtde.calls == [
        ("setTcp", [0.0, 0.0, 0.1, 0.0, 0.0, 0.0]),
        ("setPayload", 1.5, [0.0, 0.0, 0.0]),
        ("setWatchdog", 20.0),
    ]
    plain = ControlPort(settings())
    assert plain.prepare() is True
    assert plain._rtde.calls == [("setWatchdog", 10.0)]


@pytest.mark.parametrize("refused", ["setTcp", "setPayload", "setWatchdog"])
def test_whatever_is_refused_is_not_prepared(refused):
    port = ControlPort(settings(tcp_offset=(0, 0, 0.1), payload_mass=1.5))
    port._rtde.answers[refused] = False
    assert port.prepare() is False


@pytest.mark.parametrize("answer", [True, False])
def test_every_answer_is_handed_on(answer):
    port = ControlPort(settings())
    for name in ("kickWatchdog", "servoL", "servoStop", "reuploadScript", "isConnected"):
        port._rtde.answers[name] = answer
    assert port.kick() is port.servo([0.0] * 6, 0.002) is port.stop_servo(10.0) is answer
    assert port.upload() is port.connected() is answer


def test_a_target_goes_out_with_the_settings_of_the_servo():
    port = ControlPort(settings(lookahead=0.05, gain=500.0))
    port.servo([1.0] * 6, 0.002)
    assert port._rtde.calls == [("servoL", [1.0] * 6, 0.0, 0.0, 0.002, 0.05, 500.0)]
