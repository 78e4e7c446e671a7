"""The retract past ur_rtde: sent once, looked for until seen, and not after a person took over."""

from __future__ import annotations

from dataclasses import replace

import pytest
from ur_fakes import APPROACH, HOME, PACKAGE_S, rtde_of

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ArmSample
from stepload_drivers.ur import dashboard_watch, direct_control
from stepload_drivers.ur.direct_control import retract_script
from stepload_drivers.ur.last_state import LastState
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PAUSED, PLAYING, ROBOT_RUNNING, STOPPED, UrState, target_pose

SETTINGS = Settings(host="10.0.0.2", approach=APPROACH)
NORMAL = {"safety_mode": 1, "safety_bits": 1}
TOLD = ArmConfiguration((0.0,) * 6, (0.0,) * 6, 1.2, (0.0, 0.0, 0.05), 1.0)
WAY_M, SPEED_M_S = 2e-3, 0.01
WHOLE = retract_script(APPROACH, WAY_M, SPEED_M_S)


class Controller:
    """Carries out retracts; `awake`: it answers, `reachable`: its script port takes programs.

    `silent`: it sends no data, `deaf`: its dashboard does not answer.
    """

    def __init__(self, clock) -> None:
        self.clock = clock
        self.scripts: list[str] = []
        self.queue: list[str] = []
        self.reachable = self.carries_out = True
        self.silent = self.deaf = False
        self.loaded = "Loaded program: a.urp"
        self.configuration: ArmConfiguration | None = TOLD
        self.remote: bool | None = True
        self.mode = "RUNNING"
        self.position_m = 5e-3
        self.runtime_state = STOPPED
        self.words = dict(NORMAL)
        self.clock_ahead_s = 0.0
        self.repeats = False
        self.stop_at_m: float | None = None
        self._goal_m = self.position_m

    def send_script(self, host, script, deadline_s) -> None:
        if not self.reachable:
            raise DeviceError("no port", code=FaultCode.NOT_CONNECTED)
        self.scripts.append(script)
        self.queue.append(script)

    def tick(self) -> None:
        if self.queue:
            script = self.queue.pop()
            self.queue.clear()
            if self.carries_out:
                z_m = float(script.split("p[")[1].split(",")[2])
                self._goal_m, self.runtime_state = self.position_m - z_m, PLAYING
        if self.runtime_state == PLAYING and self._goal_m < self.position_m:
            speed = SPEED_M_S * (self.configuration.speed_fraction if self.configuration else 1.0)
            self.position_m = max(self._goal_m, self.position_m - speed * PACKAGE_S)
            if self.position_m <= (self._goal_m if self.stop_at_m is None else self.stop_at_m):
                self.runtime_state = STOPPED

    def dashboard(self, host, commands, deadline_s):
        return [self.ask(command, deadline_s) for command in commands]

    def ask(self, command, deadline_s) -> str:
        if self.deaf:
            self.clock.sleep(deadline_s - self.clock.now_s)
            raise DeviceError("silent", code=FaultCode.NOT_CONNECTED)
        safety = {1: "NORMAL", 3: "PROTECTIVE_STOP", 5: "SAFEGUARD_STOP", 7: "ROBOT_EMERGENCY_STOP"}
        program = {STOPPED: "STOPPED", PLAYING: "PLAYING", PAUSED: "PAUSED"}[self.runtime_state]
        return {
            "running": f"Program running: {str(self.runtime_state == PLAYING).lower()}",
            "is in remote control": str(self.remote).lower(),
            "safetystatus": f"Safetystatus: {safety[self.words['safety_mode']]}",
            "robotmode": f"Robotmode: {self.mode}",
            "programState": f"{program} a.urp",
            "get loaded program": self.loaded,
        }.get(command, f'could not understand: "{command}"')

    def close(self) -> None:
        pass

    @property
    def awake(self) -> bool:
        return not (self.silent or self.deaf)

    @awake.setter
    def awake(self, awake: bool) -> None:
        self.silent = self.deaf = not awake

    def told(self, host, deadline_s) -> ArmConfiguration:
        if self.configuration is None:
            raise DeviceError("not told", code=FaultCode.NOT_CONNECTED)
        return self.configuration

    def state(self) -> UrState:
        pose = tuple(target_pose(HOME, APPROACH, self.position_m))
        stamp_s = self.clock.now_s + self.clock_ahead_s
        if self.repeats:
            stamp_s = 1.0
        return UrState(
            stamp_s, pose, (0.0,) * 6, robot_mode=ROBOT_RUNNING,
            runtime_state=self.runtime_state, **self.words,
        )  # fmt: skip


@pytest.fixture
def controller(clock, monkeypatch) -> Controller:
    controller = Controller(clock)
    monkeypatch.setattr(direct_control, "RtdeClient", rtde_of(controller, clock))
    monkeypatch.setattr(direct_control, "dashboard", controller.dashboard)
    monkeypatch.setattr(direct_control, "send_script", controller.send_script)
    monkeypatch.setattr(direct_control, "read_configuration", controller.told)
    monkeypatch.setattr(dashboard_watch, "Dashboard", lambda host, deadline_s: controller)
    monkeypatch.setattr(dashboard_watch.DashboardWatch, "start", lambda self: None)
    return controller


@pytest.fixture
def unloading(controller, clock) -> direct_control.Unloading:
    pose = tuple(target_pose(HOME, APPROACH, controller.position_m))
    sample = ArmSample(1, clock.now_s, clock.now_s, 0, 5e-3, 8.1, pose)
    last = LastState(SETTINGS, sample, (0.0, 0.0), TOLD, controller.loaded)
    return direct_control.Unloading(SETTINGS, last)


def retract(unloading, clock, timeout_s: float = 4.0) -> None:
    unloading.retract(WAY_M, SPEED_M_S, clock.now_s + timeout_s)


def refused(unloading, clock, controller) -> DeviceError:
    """The error of a retract that is not sent, now or ever again."""
    sent = len(controller.scripts)
    with pytest.raises(DeviceError) as caught:
        retract(unloading, clock)
    controller.words = dict(NORMAL)
    controller.runtime_state, controller.remote, controller.mode = STOPPED, True, "RUNNING"
    with pytest.raises(DeviceError) as again:
        retract(unloading, clock)
    assert again.value.code == caught.value.code
    assert len(controller.scripts) == sent
    return caught.value


def test_a_retract_is_done_when_the_arm_is_back(unloading, controller, clock):
    retract(unloading, clock)
    assert controller.scripts == [WHOLE]
    assert controller.position_m == pytest.approx(3e-3)
    assert not unloading.under_way


def test_what_no_port_took_is_sent_when_one_does(unloading, controller, clock):
    controller.reachable = controller.awake = False
    for _ in range(3):
        with pytest.raises(DeviceError) as caught:
            retract(unloading, clock)
        assert caught.value.code == FaultCode.NOT_CONNECTED
        assert not unloading.under_way
    controller.reachable = controller.awake = True
    retract(unloading, clock)
    assert controller.position_m == pytest.approx(3e-3)


def test_nothing_waits_in_a_controller_that_sleeps(unloading, controller, clock):
    controller.awake = False
    for _ in range(3):
        with pytest.raises(DeviceError) as caught:
            retract(unloading, clock)
        assert caught.value.code == FaultCode.NOT_CONNECTED
    assert controller.scripts == []
    controller.awake = True
    retract(unloading, clock)
    assert controller.scripts == [WHOLE]
    assert controller.position_m == pytest.approx(3e-3)


def test_what_was_handed_over_to_a_controller_that_fell_asleep_is_not_sent_again(
    unloading, controller, clock, monkeypatch
):
    sent = controller.send_script

    def fall_asleep(*arguments) -> None:
        sent(*arguments)
        controller.awake = False

    monkeypatch.setattr(direct_control, "send_script", fall_asleep)
    for _ in range(3):
        with pytest.raises(DeviceError) as caught:
            retract(unloading, clock)
        assert caught.value.code == FaultCode.NOT_CONNECTED
    assert controller.scripts == [WHOLE]
    assert not unloading.ended(clock.now_s + 3.0)
    controller.awake = True
    retract(unloading, clock)
    assert controller.scripts == [WHOLE]
    assert controller.position_m == pytest.approx(3e-3)
    assert unloading.ended(clock.now_s + 3.0)


def test_a_program_that_was_lost_is_sent_once_more(unloading, controller, clock):
    controller.carries_out = False
    with pytest.raises(DeviceError, match=r"0\.00 mm back, 2\.00 mm") as caught:
        retract(unloading, clock)
    assert caught.value.code == FaultCode.REFUSED_COMMAND
    assert controller.scripts == [WHOLE, WHOLE]


def test_a_retract_that_somebody_stopped_is_not_sent_again(unloading, controller, clock):
    controller.stop_at_m = 4e-3
    with pytest.raises(DeviceError, match=r"1\.\d\d mm back, 2\.00 mm") as caught:
        retract(unloading, clock)
    assert caught.value.code == FaultCode.REFUSED_COMMAND
    assert controller.scripts == [WHOLE]


def test_data_that_stand_still_confirm_nothing(unloading, controller, clock, monkeypatch):
    controller.repeats, controller.carries_out = True, False

    def start(*_: object) -> None:
        controller.runtime_state = PLAYING

    monkeypatch.setattr(direct_control, "send_script", start)
    with pytest.raises(DeviceError) as caught:
        retract(unloading, clock)
    assert caught.value.code == FaultCode.STALE
    assert unloading.under_way


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ({"safety_mode": 3, "safety_bits": 1}, FaultCode.PROTECTIVE_STOP),
        ({"safety_mode": 5, "safety_bits": 1}, FaultCode.SAFEGUARD_STOP),
        ({"safety_mode": 1, "safety_bits": 1 << 6}, FaultCode.EMERGENCY_STOP),
    ],
)
def test_nothing_is_sent_after_a_safety_stop(unloading, controller, clock, words, code):
    controller.words = words
    assert refused(unloading, clock, controller).code == code


def test_nothing_is_sent_to_a_controller_in_local_control(unloading, controller, clock):
    controller.remote = False
    assert refused(unloading, clock, controller).code == FaultCode.NOT_REMOTE


def test_nothing_is_sent_after_a_pause(unloading, controller, clock):
    controller.runtime_state = PAUSED
    assert refused(unloading, clock, controller).code == FaultCode.PROGRAM_STOPPED


def test_a_program_that_outlives_our_watchdog_is_another_ones(unloading, controller, clock):
    clock.sleep(10.0)
    controller.runtime_state = PLAYING
    error = refused(unloading, clock, controller)
    assert error.code == FaultCode.PROGRAM_STOPPED
    assert "another program" in error.message


def test_our_own_program_is_replaced_before_its_watchdog_ends_it(unloading, controller, clock):
    controller.runtime_state = PLAYING
    retract(unloading, clock)
    assert controller.position_m == pytest.approx(3e-3)


def test_an_arm_that_somebody_has_moved_is_left_alone(unloading, controller, clock):
    controller.position_m -= 0.01
    error = refused(unloading, clock, controller)
    assert error.code == FaultCode.PROGRAM_STOPPED
    assert "10.00 mm from where it can have come by itself" in error.message


def test_a_retract_paused_under_way_is_over(unloading, controller, clock):
    tick = controller.tick

    def pause_half_way() -> None:
        tick()
        if controller.position_m < 4e-3 and controller.runtime_state == PLAYING:
            controller.runtime_state = PAUSED

    controller.tick = pause_half_way
    with pytest.raises(DeviceError) as caught:
        retract(unloading, clock)
    assert caught.value.code == FaultCode.PROGRAM_STOPPED
    assert len(controller.scripts) == 1
    assert not unloading.under_way


# what is sent without data, and what was seen while nothing could be


def no_answer(unloading, clock) -> DeviceError:
    with pytest.raises(DeviceError) as caught:
        retract(unloading, clock)
    assert caught.value.code == FaultCode.NOT_CONNECTED
    return caught.value


def test_an_arm_without_data_goes_back_on_the_dashboards_word(unloading, controller, clock):
    controller.silent = True
    no_answer(unloading, clock)  # nobody sees it done
    assert controller.scripts == [WHOLE]
    assert unloading.under_way
    controller.silent = False
    retract(unloading, clock)
    assert controller.scripts == [WHOLE]


@pytest.mark.parametrize(
    ("name", "value"), [("deaf", True), ("mode", "DISCONNECTED"), ("runtime_state", PLAYING)]
)
def test_without_data_and_without_that_word_nothing_is_sent(
    unloading, controller, clock, name, value
):
    usual = getattr(controller, name)
    controller.silent = True
    setattr(controller, name, value)
    no_answer(unloading, clock)
    assert controller.scripts == []
    setattr(controller, name, usual)
    controller.silent = False
    retract(unloading, clock)
    assert controller.scripts == [WHOLE]


def test_data_without_a_dashboard_are_enough(unloading, controller, clock):
    controller.deaf = True
    retract(unloading, clock)
    assert controller.position_m == pytest.approx(3e-3)


@pytest.mark.parametrize(
    ("name", "value", "code"),
    [
        ("words", {"safety_mode": 3, "safety_bits": 1}, FaultCode.PROTECTIVE_STOP),
        ("words", {"safety_mode": 5, "safety_bits": 1}, FaultCode.SAFEGUARD_STOP),
        ("remote", False, FaultCode.NOT_REMOTE),
        ("runtime_state", PAUSED, FaultCode.PROGRAM_STOPPED),
        ("mode", "BACKDRIVE", FaultCode.DEVICE_REPORTS),
        ("loaded", "Loaded program: b.urp", FaultCode.PROGRAM_STOPPED),
    ],
)
def test_who_was_seen_once_while_no_data_came_has_the_arm_for_good(
    unloading, controller, clock, name, value, code
):
    usual = getattr(controller, name)
    controller.silent = True
    setattr(controller, name, value)
    unloading._dashboard.ask()  # as its thread does, between two attempts
    setattr(controller, name, usual)
    controller.silent = False
    error = refused(unloading, clock, controller)
    assert error.code == code
    assert "while the arm did not answer" in error.message
    assert controller.scripts == []


def test_a_sign_right_before_the_sending_is_not_too_late(unloading, controller, clock, monkeypatch):
    def told(host: str, deadline_s: float) -> ArmConfiguration:
        controller.remote = False
        return TOLD

    monkeypatch.setattr(direct_control, "read_configuration", told)
    assert refused(unloading, clock, controller).code == FaultCode.NOT_REMOTE
    assert controller.scripts == []


def test_a_sign_ends_a_retract_that_nobody_saw_begin(unloading, controller, clock):
    controller.silent, controller.carries_out = True, False
    no_answer(unloading, clock)
    controller.words = {"safety_mode": 3, "safety_bits": 1}
    unloading._dashboard.ask()
    assert refused(unloading, clock, controller).code == FaultCode.PROTECTIVE_STOP
    assert not unloading.under_way  # so that a stop may be sent now


def test_what_somebody_did_in_the_dark_is_seen_afterwards(unloading, controller, clock):
    controller.configuration = replace(TOLD, speed_fraction=0.5)
    error = refused(unloading, clock, controller)
    assert error.code == FaultCode.PROGRAM_STOPPED
    assert "speed slider" in error.message


def test_a_controller_that_was_switched_on_again_is_left_alone(unloading, controller, clock):
    controller.clock_ahead_s = -100.0
    assert "started anew" in refused(unloading, clock, controller).message


def test_an_arm_that_a_retract_took_back_is_where_it_should_be(unloading, controller, clock):
    """The link is lost again under way; the way that is left is sent afterwards."""
    tick = controller.tick

    def lose_it_half_way() -> None:
        tick()
        if controller.position_m < 4.2e-3 and controller.runtime_state == PLAYING:
            controller.silent, controller.tick = True, tick

    controller.tick = lose_it_half_way
    no_answer(unloading, clock)
    controller.position_m, controller.runtime_state = 3.5e-3, STOPPED  # it went on in the dark
    controller._goal_m = controller.position_m
    assert unloading.ended(clock.now_s + 3.0)
    controller.silent = False
    retract(unloading, clock)
    assert controller.position_m == pytest.approx(3e-3, abs=1e-5)


def test_without_data_our_own_program_is_waited_for(unloading, controller, clock):
    controller.runtime_state, controller.silent = PLAYING, True
    clock.at(clock.now_s + 0.8, lambda: setattr(controller, "runtime_state", STOPPED))
    no_answer(unloading, clock)  # one attempt
    assert controller.scripts == [WHOLE]


HELD = replace(TOLD, speed_fraction=0.0)


def test_nothing_waits_for_whoever_raises_the_slider(controller, clock):
    """The slider was at 0 when the arm was seen last, and is still: nothing has changed."""
    controller.configuration = HELD
    pose = tuple(target_pose(HOME, APPROACH, controller.position_m))
    sample = ArmSample(1, clock.now_s, clock.now_s, 0, 5e-3, 8.1, pose)
    last = LastState(SETTINGS, sample, (0.0, 0.0), HELD, controller.loaded)
    error = refused(direct_control.Unloading(SETTINGS, last), clock, controller)
    assert error.code is FaultCode.SETTING_CHANGED
    assert "whenever somebody raises it" in error.message
    assert controller.scripts == []


def after_sending(controller, monkeypatch, **changes) -> None:
    """The controller changes as soon as a program was handed over to it."""
    send = controller.send_script

    def sent(host, script, deadline_s):
        send(host, script, deadline_s)
        vars(controller).update(changes)

    monkeypatch.setattr(direct_control, "send_script", sent)


def test_a_retract_that_the_slider_holds_may_be_stopped(unloading, controller, clock, monkeypatch):
    after_sending(controller, monkeypatch, configuration=HELD)
    with pytest.raises(DeviceError):
        retract(unloading, clock)
    assert unloading.under_way
    assert unloading.ended(clock.now_s + 3.0)
    assert not unloading.under_way


def test_without_a_retract_under_way_a_stop_asks_nobody(unloading, controller, clock):
    controller.deaf = True
    before_s = clock.now_s
    assert unloading.ended(clock.now_s + 3.0)
    assert clock.now_s == before_s


def test_a_stop_waits_for_a_program_that_has_not_begun(unloading, controller, clock, monkeypatch):
    after_sending(controller, monkeypatch, silent=True)
    with pytest.raises(DeviceError):
        retract(unloading, clock)
    assert not unloading.ended(clock.now_s + 0.9 * direct_control.IDLE_LIMIT_S)
    assert unloading.under_way
    assert unloading.ended(clock.now_s + 3.0)


def test_what_was_sent_before_a_sign_is_not_denied(unloading, controller, clock, monkeypatch):
    """It waits in a controller whose motion sleeps while its dashboard answers."""
    after_sending(controller, monkeypatch, silent=True)
    with pytest.raises(DeviceError):
        retract(unloading, clock)
    controller.remote = False
    unloading._dashboard.ask()
    with pytest.raises(DeviceError) as caught:
        retract(unloading, clock)
    assert len(controller.scripts) == 1
    assert caught.value.code is FaultCode.NOT_REMOTE
    assert "may still begin, no other is sent" in caught.value.message
    assert caught.value.hint.startswith("keep clear of the arm")
    with pytest.raises(DeviceError, match="may still begin"):  # nor forgotten later
        retract(unloading, clock)
