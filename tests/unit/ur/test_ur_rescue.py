"""Stop and retract without ur_rtde: always sent, confirmed by what the controller says."""

from __future__ import annotations

import pytest
from ur_fakes import APPROACH, HOME

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import rescue
from stepload_drivers.ur.settings import settings_from
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState, target_pose

SETTINGS = settings_from({"host": "10.0.0.2", "approach": APPROACH})
PERIOD_S = 0.008


class Controller:
    """Takes scripts and dashboard lines; tells `position_m` and whether a program runs."""

    def __init__(self, clock) -> None:
        self.clock = clock
        self.scripts: list[str] = []
        self.lines: list[str] = []
        self.replies: list[str] | None = ["Stopped", "Program running: false"]
        self.remote: bool | None = True
        self.script_port = True
        self.moves = True
        self.begun_s: float | None = None
        self.speed_m_s, self.distance_m, self.position_m = 0.0, 0.0, 1e-3
        self.fields = {"safety_mode": 1}
        self.data = True
        self.program_s: float | None = None  # how long the program runs

    def dashboard(self, host, commands, deadline_s):
        self.lines += commands
        if self.replies is None:
            self.clock.sleep(deadline_s - self.clock.now_s)
            raise DeviceError("silent", code=FaultCode.NOT_CONNECTED)
        return self.replies

    def send_script(self, host, script, deadline_s) -> None:
        if not self.script_port:
            raise DeviceError("no port", code=FaultCode.NOT_CONNECTED)
        self.scripts.append(script)
        self.begun_s = self.clock.now_s
        if "movel" in script:
            self.speed_m_s, self.distance_m = 0.01, 2e-3

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

    class Rtde:
        def __init__(self, host, deadline_s) -> None:
            self.deadline_s = deadline_s

        def __enter__(self):
            return self

        def __exit__(self, *_) -> None:
            pass

        def version(self) -> None:
            if not controller.data:
                raise DeviceError("no data", code=FaultCode.NOT_CONNECTED)

        def start(self, rate_hz) -> None:
            pass

        def read(self) -> UrState:
            clock.sleep(PERIOD_S)
            if clock.now_s > self.deadline_s:
                raise DeviceError("no answer in time", code=FaultCode.NOT_CONNECTED)
            return controller.state()

    monkeypatch.setattr(rescue, "RtdeClient", Rtde)
    monkeypatch.setattr(rescue, "dashboard", controller.dashboard)
    monkeypatch.setattr(rescue, "send_script", controller.send_script)
    monkeypatch.setattr(rescue, "in_remote_control", lambda host, limit_s: controller.remote)
    return controller


def test_a_dashboard_that_confirms_is_enough(controller, clock):
    rescue.stop("h", clock.now_s + 2.0)
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
    rescue.stop("h", clock.now_s + 2.0)
    assert controller.scripts == [rescue.STOP_SCRIPT]
    assert clock.now_s - began_s >= 0.2  # until the program has ended


def test_a_stop_that_nobody_sees_is_an_error_after_both_were_sent(controller, clock):
    controller.replies, controller.program_s = None, 1e9
    with pytest.raises(DeviceError):
        rescue.stop("h", clock.now_s + 1.0)
    assert controller.lines
    assert controller.scripts == [rescue.STOP_SCRIPT]


def test_an_arm_that_moves_on_is_no_stop(controller, clock):
    controller.replies, controller.program_s = ["no", "no"], 0.0
    controller.speed_m_s, controller.distance_m = 0.05, 1.0
    with pytest.raises(DeviceError):
        rescue.stop("h", clock.now_s + 1.0)


def test_a_slow_dashboard_leaves_time_for_the_script(controller, clock):
    controller.replies = None
    rescue.stop("h", clock.now_s + 1.5)
    assert controller.begun_s is not None


def test_a_retract_is_done_when_the_arm_is_back(controller, clock):
    rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 3.0)
    assert controller.scripts == [rescue.retract_script(APPROACH, 2e-3, 0.01)]


def test_a_retract_that_ends_short_is_an_error_with_its_travel(controller, clock):
    controller.moves = False
    with pytest.raises(DeviceError, match=r"0\.00 mm back, 2\.00 mm") as caught:
        rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 3.0)
    assert caught.value.code == FaultCode.REFUSED_COMMAND


def test_a_retract_in_local_control_says_so(controller, clock):
    controller.moves, controller.remote = False, False
    with pytest.raises(DeviceError) as caught:
        rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 3.0)
    assert caught.value.code == FaultCode.NOT_REMOTE


def test_a_retract_under_a_protective_stop_says_so_at_once(controller, clock):
    controller.fields["safety_mode"] = 3
    began_s = clock.now_s
    with pytest.raises(DeviceError, match="not possible") as caught:
        rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 3.0)
    assert caught.value.code == FaultCode.PROTECTIVE_STOP
    assert clock.now_s - began_s < 0.2


def test_a_retract_that_nobody_sees_is_sent_and_given_its_time(controller, clock):
    controller.data = False
    began_s = clock.now_s
    with pytest.raises(DeviceError):
        rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 3.0)
    assert len(controller.scripts) == 1
    assert clock.now_s - began_s >= rescue.START_S + rescue.ramp_s(2e-3, 0.01) - 1e-6


def test_a_retract_never_waits_past_its_deadline(controller, clock):
    controller.data = False
    deadline_s = clock.now_s + 0.4
    with pytest.raises(DeviceError):
        rescue.retract(SETTINGS, 2e-3, 0.01, deadline_s)
    assert clock.now_s == pytest.approx(deadline_s)


def test_a_retract_whose_script_no_port_takes_is_an_error(controller, clock):
    controller.script_port = False
    with pytest.raises(DeviceError, match="no port"):
        rescue.retract(SETTINGS, 2e-3, 0.01, clock.now_s + 1.0)


def test_the_time_of_a_retract_is_its_way_and_one_ramp():
    assert rescue.ramp_s(2e-3, 0.01) == pytest.approx(0.2 + 0.05)
