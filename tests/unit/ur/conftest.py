"""A child's loop in virtual time, with ports of ur_rtde that a test can spoil."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from driver_time import Clock
from ur_fakes import APPROACH, PERIOD_S, Died, FakeLink, FakeTold, FakeUr

from stepload_drivers.ur import arm as arm_module
from stepload_drivers.ur import client, dashboard_watch, direct_control, procedures
from stepload_drivers.ur import configuration as told_module
from stepload_drivers.ur import loop as loop_module
from stepload_drivers.ur import watch as watch_module
from stepload_drivers.ur.settings import Settings


@pytest.fixture
def clock(monkeypatch) -> Clock:
    clock = Clock()
    modules = (
        loop_module,
        procedures,
        direct_control,
        client,
        dashboard_watch,
        told_module,
        watch_module,
        arm_module,
    )
    clock.install(monkeypatch, *modules)
    return clock


@pytest.fixture
def ur(clock) -> FakeUr:
    return FakeUr(clock)


@pytest.fixture
def link(clock) -> FakeLink:
    return FakeLink(clock)


@pytest.fixture
def told(clock) -> FakeTold:
    return FakeTold(clock)


@pytest.fixture
def make_loop(ur, link, told, monkeypatch):
    """Makes the child's loop with options of the driver; its control port is there already."""

    def end_process(status: int) -> None:
        raise Died(status)

    def ask_remote(host: str) -> SimpleNamespace:
        return SimpleNamespace(
            done=lambda: True, poll=lambda: None, remote=True,
            end_program=lambda: ur.inputs.append(("dashboard stop", 0.0, 0.0)),
        )  # fmt: skip

    monkeypatch.setattr(loop_module, "ReceivePort", lambda settings: ur)
    monkeypatch.setattr(procedures, "ControlPort", lambda settings: ur)
    monkeypatch.setattr(loop_module, "stay_alive_for", lambda seconds: None)
    monkeypatch.setattr(loop_module, "os", SimpleNamespace(_exit=end_process))
    monkeypatch.setattr(watch_module, "RemoteCheck", ask_remote)
    monkeypatch.setattr(watch_module, "ConfigurationClient", lambda host, deadline_s: told)

    def make(*, control: bool = True, **options: Any) -> loop_module.Loop:
        settings = Settings(host="127.0.0.1", approach=APPROACH, **options)
        loop = loop_module.Loop(link, settings, PERIOD_S)
        if control:
            loop.control = ur
        return loop

    return make


@pytest.fixture
def step_for(clock):
    """Steps a loop for some time."""

    def run(loop: loop_module.Loop, seconds: float) -> None:
        end_s = clock.now_s + seconds
        while clock.now_s < end_s:
            loop.step()

    return run
