"""Stop without ur_rtde: always sent, confirmed by what the controller says."""

from __future__ import annotations

import pytest
from ur_fakes import APPROACH, HOME, rtde_of

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import direct_control
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState, target_pose


class Controller:
    """Takes scripts and dashboard lines; tells `position_m` and whether a program runs."""

    silent = False

    def __init__(self, clock) -> None:
        self.clock = clock
        self.scripts: list[str] = []
        self.lines: list[str] = []
        self.replies: list[str] | None = ["Stopped", "Program running: false"]
        self.moves = True
        self.begun_s: float | None = None
        self.speed_m_s, self.distance_m, self.position_m = 0.0, 0.0, 1e-3
        self.fields = {"safety_mode": 1}
        self.program_s: float | None = None  # how long the program runs

    def dashboard(self, host, commands, deadline_s):
        self.lines += commands
        if self.replies is None:
            self.clock.sleep(deadline_s - self.clock.now_s)
            raise DeviceError("silent", code=FaultCode.NOT_CONNECTED)
        return self.replies

    def send_script(self, host, script, deadline_s) -> None:
        self.scripts.append(script)
        self.begun_s = self.clock.now_s

    def tick(self) -> None:
        pass

    def state(self) -> UrState:
        gone_m, playing = 0.0, self.begun_s is None
        if self.begun_s is not None:
            since_s = self.clock.now_s - self.begun_s
            if self.moves:
                gone_m = min(self.distance_m, self.speed_m_s * since_s)
            longest_s = self.program_s if self.program_s is not None else 0.2
            playing = since_s < longest_s
        pose = tuple(target_pose(HOME, APPROACH, self.position_m - gone_m))
        words = {"robot_mode": ROBOT_RUNNING, "safety_mode": 1, "safety_bits": 1, **self.fields}
        return UrState(
            self.clock.now_s, pose, (0.0,) * 6, runtime_state=PLAYING if playing else 1, **words
        )


@pytest.fixture
def controller(clock, monkeypatch) -> Controller:
    controller = Controller(clock)
    monkeypatch.setattr(direct_control, "RtdeClient", rtde_of(controller, clock))
    monkeypatch.setattr(direct_control, "dashboard", controller.dashboard)
    monkeypatch.setattr(direct_control, "send_script", controller.send_script)
    return controller


def test_a_dashboard_that_confirms_is_enough(controller, clock):
    direct_control.stop("h", clock.now_s + 2.0)
    assert controller.lines == ["stop", "running"]
    assert controller.scripts == []


@pytest.mark.parametrize(
    "replies",
    [
        None,
        ["Failed to execute: stop", "Program running: false"],
        ["Stopped", "Program running: true"],
    ],
)
def test_an_unconfirmed_stop_is_sent_as_a_program_and_seen_to_stand(controller, clock, replies):
    controller.replies = replies
    began_s = clock.now_s
    direct_control.stop("h", clock.now_s + 2.0)
    assert controller.scripts == [direct_control.STOP_SCRIPT]
    assert clock.now_s - began_s >= 0.2  # until the program has ended


def test_a_stop_that_nobody_sees_is_an_error_after_both_were_sent(controller, clock):
    controller.replies, controller.program_s = None, 1e9
    with pytest.raises(DeviceError):
        direct_control.stop("h", clock.now_s + 1.0)
    assert controller.lines
    assert controller.scripts == [direct_control.STOP_SCRIPT]


def test_an_arm_that_moves_on_is_no_stop(controller, clock):
    controller.replies, controller.program_s = ["no", "no"], 0.0
    controller.speed_m_s, controller.distance_m = 0.05, 1.0
    with pytest.raises(DeviceError):
        direct_control.stop("h", clock.now_s + 1.0)


def test_a_slow_dashboard_leaves_time_for_the_script(controller, clock):
    controller.replies = None
    direct_control.stop("h", clock.now_s + 1.5)
    assert controller.begun_s is not None
