"""The dashboard watched while an arm does not answer: one sign of a person is enough."""

from __future__ import annotations

import time

import pytest

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import dashboard_watch

LOADED = "Loaded program: a.urp"


class Panel:
    """A dashboard that answers as told; `silent`: it does not."""

    def __init__(self) -> None:
        self.replies = {
            "is in remote control": "true",
            "safetystatus": "Safetystatus: NORMAL",
            "safetymode": "Safetymode: NORMAL",
            "robotmode": "Robotmode: RUNNING",
            "programState": "STOPPED a.urp",
            "get loaded program": LOADED,
        }
        self.usual = dict(self.replies)
        self.silent = False
        self.opened = self.closed = 0

    def made(self, host: str, deadline_s: float) -> Panel:
        self.opened += 1
        return self

    def ask(self, command: str, deadline_s: float) -> str:
        if self.silent:
            raise DeviceError("silent", code=FaultCode.NOT_CONNECTED)
        return self.replies.get(command, f'could not understand: "{command}"')

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def panel(monkeypatch) -> Panel:
    panel = Panel()
    monkeypatch.setattr(dashboard_watch, "Dashboard", panel.made)
    return panel


@pytest.fixture
def watch(panel, clock) -> dashboard_watch.DashboardWatch:
    return dashboard_watch.DashboardWatch("10.0.0.2", 1.1, lambda: False, LOADED)


def test_nobody_is_seen_where_nobody_is(watch):
    answers = watch.ask()
    assert answers is not None
    assert answers.nobody
    assert watch.sign is None


@pytest.mark.parametrize(
    ("question", "reply", "code", "words"),
    [
        ("safetystatus", "Safetystatus: PROTECTIVE_STOP", FaultCode.PROTECTIVE_STOP, "PROTECTIVE"),
        ("safetystatus", "Safetystatus: SAFEGUARD_STOP", FaultCode.SAFEGUARD_STOP, "SAFEGUARD"),
        ("safetystatus", "Safetystatus: AUTOMATIC_MODE_SAFEGUARD_STOP", FaultCode.SAFEGUARD_STOP,
         "AUTOMATIC_MODE"),
        ("safetystatus", "Safetystatus: ROBOT_EMERGENCY_STOP", FaultCode.EMERGENCY_STOP,
         "EMERGENCY"),
        ("safetystatus", "Safetystatus: RECOVERY", FaultCode.DEVICE_REPORTS, "RECOVERY"),
        ("robotmode", "Robotmode: POWER_OFF", FaultCode.DEVICE_REPORTS, "mode POWER_OFF"),
        ("robotmode", "Robotmode: BACKDRIVE", FaultCode.DEVICE_REPORTS, "mode BACKDRIVE"),
        ("is in remote control", "false", FaultCode.NOT_REMOTE, "local control"),
        ("programState", "PAUSED a.urp", FaultCode.PROGRAM_STOPPED, "paused"),
        ("get loaded program", "Loaded program: b.urp", FaultCode.PROGRAM_STOPPED, "b.urp"),
        ("get loaded program", "No program loaded", FaultCode.PROGRAM_STOPPED, "No program"),
    ],
)  # fmt: skip
def test_one_sign_is_enough_and_stays(watch, panel, question, reply, code, words):
    panel.replies[question] = reply
    answers = watch.ask()
    assert answers is not None
    assert watch.sign is not None
    assert watch.sign.code == code
    assert words in watch.sign.message
    panel.replies = dict(panel.usual)
    watch.ask()
    assert watch.sign.code == code


@pytest.mark.parametrize("question", ["safetystatus", "robotmode", "programState"])
def test_who_does_not_say_that_all_is_well_has_not_said_it(watch, panel, question):
    del panel.replies[question]
    panel.replies.pop("safetymode" if question == "safetystatus" else "", None)
    answers = watch.ask()
    assert answers is not None
    assert not answers.nobody
    with pytest.raises(DeviceError, match="not told") as caught:
        dashboard_watch.require_nobody("10.0.0.2", answers)
    assert caught.value.code == FaultCode.NOT_CONNECTED


def test_the_first_answer_is_compared_with_where_open_got_none(panel, clock):
    watch = dashboard_watch.DashboardWatch("10.0.0.2", 1.1, lambda: False)
    watch.ask()
    assert watch.sign is None
    panel.replies["get loaded program"] = "Loaded program: b.urp"
    watch.ask()
    assert watch.sign is not None


def play(watch, panel, clock, seconds: float) -> None:
    panel.replies["programState"] = "PLAYING a.urp"
    for _ in range(round(seconds / 0.1)):
        watch.ask()
        clock.sleep(0.1)


def test_a_program_that_outlives_our_watchdog_is_another_ones(watch, panel, clock):
    play(watch, panel, clock, 1.0)
    assert watch.sign is None
    play(watch, panel, clock, 0.4)
    assert watch.sign is not None
    assert "not ours" in watch.sign.message


def test_our_own_retract_may_run_as_long_as_it_takes(panel, clock):
    watch = dashboard_watch.DashboardWatch("10.0.0.2", 1.1, lambda: True, LOADED)
    play(watch, panel, clock, 5.0)
    assert watch.sign is None


def test_after_silence_the_dashboard_is_called_anew(watch, panel):
    watch.ask()
    watch.ask()
    assert (panel.opened, panel.closed) == (1, 0)
    panel.silent = True
    assert watch.ask() is None
    assert panel.closed == 1
    panel.silent = False
    assert watch.ask() is not None
    assert panel.opened == 2


def test_it_watches_by_itself_until_it_is_closed(panel):
    watch = dashboard_watch.DashboardWatch("10.0.0.2", 1.1, lambda: False, LOADED)
    watch.start()
    panel.replies["is in remote control"] = "false"
    until_s = time.monotonic() + 30.0
    while watch.sign is None and time.monotonic() < until_s:
        time.sleep(0.01)
    assert watch.sign is not None
    watch.close()
    while not panel.closed and time.monotonic() < until_s:
        time.sleep(0.01)
    assert panel.closed == 1
