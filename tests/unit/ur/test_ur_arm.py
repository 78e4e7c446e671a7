"""The run's side of the UR arm, with a child process that only a test moves."""

from __future__ import annotations

import math
from typing import Any

import pytest
from ur_fakes import APPROACH, HOME

from stepload.errors import BadInputError, DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import TAKEN_OVER, FaultCode
from stepload.rig.samples import Status
from stepload_drivers.ur import arm as arm_module
from stepload_drivers.ur import wire
from stepload_drivers.ur.last_state import LastState
from stepload_drivers.ur.preflight import Controller
from stepload_drivers.ur.state import PAUSED, PLAYING, ROBOT_RUNNING, UrState, target_pose

SAFE = {"ok": True, "confirmed": True, "runtime_state": PLAYING}
FAULT = {"message": "m", "hint": "h", "time_s": 1.0}


def sample(clock, position_m: float = 0.0, age_s: float = 0.0, **fields: Any) -> bytes:
    words = {"robot_mode": ROBOT_RUNNING, "safety_mode": 1, "runtime_state": PLAYING,
             "safety_bits": 1, "wrench": (0.0,) * 6, **fields}  # fmt: skip
    pose = tuple(target_pose(HOME, APPROACH, position_m))
    package = UrState(timestamp_s=clock.now_s, pose=pose, **words)
    return wire.pack_sample(clock.now_s - age_s, package)


class FakeChild:
    """Answers requests as told; `made` lists every one that was started."""

    made: list[FakeChild]
    at_start: list[tuple[float, Any]]

    def __init__(self, clock, settings, period_s, connect_s) -> None:
        self.clock, self.settings, self.period_s = clock, settings, period_s
        self.ended = self.killed = self.has_quit = self.deaf = False
        self.said_last = "ur_rtde crashed"
        self.answers: dict[str, dict[str, Any] | None] = {}
        self.sent: list[bytes] = []
        self.queue: list[tuple[float, Any]] = [
            (clock.now_s + after_s, message) for after_s, message in self.at_start
        ]
        self.made.append(self)

    def arrives(self, message: Any, after_s: float = 0.0) -> None:
        self.queue.append((self.clock.now_s + after_s, message))

    def receive(self, wait_s: float = 0.0) -> list[bytes]:
        if not any(at_s <= self.clock.now_s for at_s, _ in self.queue):
            self.clock.sleep(wait_s)
        due = [message for at_s, message in self.queue if at_s <= self.clock.now_s]
        self.queue = [entry for entry in self.queue if entry[0] > self.clock.now_s]
        messages = []
        for message in due:
            made = message(self.clock) if callable(message) else message
            if made is KeyboardInterrupt:
                raise KeyboardInterrupt
            if made is None:
                self.ended = True
            else:
                messages.append(made)
        return messages

    def send(self, message: bytes) -> bool:
        if self.deaf or self.killed:
            return False
        self.sent.append(message)
        if message[:1] == wire.REQUEST:
            request = wire.unpack_json(message)
            if answer := self.answers.get(request["op"]):
                reply = wire.pack_json(wire.REPLY, number=request["number"], **answer)
                self.arrives(reply, 0.05)
        return True

    def requests(self) -> list[str]:
        return [wire.unpack_json(m)["op"] for m in self.sent if m[:1] == wire.REQUEST]

    def of(self, kind: bytes) -> list[bytes]:
        return [message for message in self.sent if message[:1] == kind]

    def last_words(self) -> str:
        return self.said_last

    def kill(self) -> None:
        self.killed = True

    def quit(self) -> None:
        self.has_quit = True


HELLO = wire.pack_json(wire.HELLO, start=list(HOME))


class Rescue:
    """What was done without ur_rtde."""

    def __init__(self) -> None:
        self.done: list[str] = []
        self.error: DeviceError | None = None
        self.has_ended = True
        self.age_s = 0.0
        self.last: LastState | None = None
        self.closed = False

    def made(self, last: LastState) -> Rescue:
        self.last = last
        return self

    def close(self) -> None:
        self.closed = True

    def ended(self, deadline_s: float) -> bool:
        return self.has_ended

    def stop(self, host: str, deadline_s: float) -> None:
        self.done.append("stop")

    def retract(self, distance_m, speed_m_s, deadline_s) -> None:
        self.done.append(f"retract {distance_m} {speed_m_s}")
        if self.error is not None:
            raise self.error


@pytest.fixture
def rescue(monkeypatch) -> Rescue:
    rescue = Rescue()
    monkeypatch.setattr(arm_module, "direct_control", rescue)
    monkeypatch.setattr(arm_module, "Unloading", lambda settings, last: rescue.made(last))
    monkeypatch.setattr(
        arm_module.dashboard_watch, "loaded_program", lambda host: "Loaded program: a.urp"
    )
    return rescue


@pytest.fixture
def make_arm(clock, rescue, monkeypatch):
    """Makes an arm whose children say `at_start` after their start."""
    FakeChild.made = []

    def make(*at_start: tuple[float, Any], **options: Any):
        FakeChild.at_start = list(at_start or ((0.2, HELLO), (0.21, sample)))
        controller = Controller((5, 12, 0, 0), "2024001", "UR5")
        monkeypatch.setattr(arm_module, "preflight", lambda settings, deadline_s: controller)
        monkeypatch.setattr(
            arm_module, "ChildProcess", lambda *arguments: FakeChild(clock, *arguments)
        )
        return arm_module.UrArm(host="127.0.0.2", approach=APPROACH, **options)

    return make


@pytest.fixture
def opened(make_arm):
    """An open arm and its child."""

    def make(**options: Any):
        arm = make_arm(**{"max_age": 2.0, **options})
        arm.open(5.0)
        arm.drain()
        return arm, FakeChild.made[-1]

    return make


def fault(code: FaultCode) -> bytes:
    return wire.pack_json(wire.FAULT, code=code.value, **FAULT)


# open


def test_open_returns_with_the_first_sample_of_a_child_that_has_said_hello(make_arm, clock):
    arm = make_arm((0.1, sample), (0.2, HELLO), (0.5, sample))
    began_s = clock.now_s
    identity = arm.open(5.0)
    assert clock.now_s - began_s >= 0.5
    assert (identity.model, identity.serial_number) == ("UR5", "2024001")
    assert [s.position_m for s in arm.drain()] == [0.0]
    assert arm.health().received == 1


def test_open_gives_up_at_its_deadline_says_how_far_it_got_and_leaves_nothing(make_arm, clock):
    arm = make_arm((0.1, wire.pack_json(wire.STAGE, name="RTDE control interface")), (0.2, HELLO))
    began_s = clock.now_s
    with pytest.raises(DeviceError, match="RTDE control interface") as caught:
        arm.open(2.0)
    assert 2.0 <= clock.now_s - began_s < 2.1
    assert caught.value.code == FaultCode.NOT_CONNECTED
    assert FakeChild.made[-1].killed


@pytest.mark.parametrize(
    "messages",
    [
        [(0.1, fault(FaultCode.PROTECTIVE_STOP))],
        [(0.1, HELLO), (0.1, sample), (0.1, fault(FaultCode.PROTECTIVE_STOP))],
    ],
)
def test_a_stop_during_open_fails_it(make_arm, messages):
    arm = make_arm(*messages)
    with pytest.raises(DeviceError) as caught:
        arm.open(2.0)
    assert caught.value.code == FaultCode.PROTECTIVE_STOP
    assert FakeChild.made[-1].killed


@pytest.mark.parametrize(
    "messages", [[(0.1, lambda _: None)], [(0.1, HELLO), (0.2, sample), (0.2, lambda _: None)]]
)
def test_a_child_that_ends_during_open_fails_it(make_arm, messages):
    with pytest.raises(DeviceError, match="crashed") as caught:
        make_arm(*messages).open(2.0)
    assert caught.value.code == FaultCode.DRIVER


def test_an_interrupt_during_open_leaves_no_child(make_arm):
    arm = make_arm((0.1, lambda _: KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        arm.open(2.0)
    assert FakeChild.made[-1].killed
    assert arm._child is None


# samples


def test_a_sample_is_travel_and_force_along_the_approach(opened, clock):
    arm, child = opened()
    child.arrives(sample(clock, 2e-3, wrench=(3.0, -4.0, 12.0, 0.1, 0, 0)))
    child.arrives(sample(clock, 2e-3, safety_mode=3))
    good, stopped = arm.drain()
    assert (good.position_m, good.force_n) == pytest.approx((2e-3, 12.0))
    assert good.wrench == pytest.approx((3.0, 4.0, 12.0, 0.1, 0.0, 0.0))
    assert arm.has_wrench
    assert (good.status, stopped.status) == (0, Status.STOPPED)
    assert good.receive_time_s == clock.now_s
    assert arm.drain() == []


def test_where_it_is_held_is_the_controllers_own_target(opened):
    """Not its measured pose, from which travel is counted."""
    arm, child = opened()
    assert math.isnan(arm.held_m())
    child.arrives(wire.pack_configuration(ArmConfiguration((0.1,) * 6)))
    assert math.isnan(arm.held_m())
    x, y, z, *turn = arm._start
    held = (x + 0.3, y, z - 0.8e-3, *turn)
    child.arrives(wire.pack_configuration(ArmConfiguration(held_pose=held)))
    assert arm.held_m() == pytest.approx(0.8e-3)


def test_the_run_is_heard_by_the_child_well_within_the_leash(opened, clock):
    arm, child = opened(command_timeout=0.1)
    child.sent.clear()
    for _ in range(100):
        clock.sleep(0.002)
        arm.drain()
    assert 4 <= len(child.of(wire.BEAT)) <= 12


def test_old_samples_are_a_fault_and_the_end_of_the_child(opened, clock):
    arm, child = opened(max_age=0.05)
    clock.sleep(0.045)
    assert arm.fault() is None
    clock.sleep(0.02)
    assert arm.fault().code is FaultCode.STALE
    assert child.killed


@pytest.mark.parametrize(
    "code",
    [
        FaultCode.STALE,
        FaultCode.NOT_CONNECTED,
        FaultCode.NOT_FINITE,
        FaultCode.OUT_OF_RANGE,
        FaultCode.CLOCK,
        FaultCode.DRIVER,
    ],
)
def test_a_doubtful_connection_ends_the_child(opened, code):
    arm, child = opened()
    child.arrives(fault(code))
    assert arm.fault().code is code
    assert child.killed


def test_a_stop_of_the_controller_keeps_the_child_and_the_first_fault_counts(opened):
    arm, child = opened()
    child.arrives(fault(FaultCode.PROTECTIVE_STOP))
    child.arrives(fault(FaultCode.PROGRAM_STOPPED))
    assert arm.fault().code is FaultCode.PROTECTIVE_STOP
    assert not child.killed


@pytest.mark.parametrize(
    "said",
    ["RTDEControlInterface: Robot is disconnected, reconnecting...", "(asio.misc:2) End of file"],
)
def test_a_child_that_ends_over_a_lost_connection_says_so(opened, said):
    """ur_rtde crashes where it cannot reconnect, sometimes before the loop has seen the loss."""
    arm, child = opened()
    child.said_last = f"ur_rtde crashed (SIGSEGV); it printed last: {said}"
    child.arrives(lambda _: None)
    assert arm.fault().code is FaultCode.NOT_CONNECTED
    assert "the controller closed the connection" in arm.fault().message
    assert child.killed


def test_a_child_that_ends_is_a_fault(opened):
    arm, child = opened()
    child.arrives(lambda _: None)
    assert arm.fault().code is FaultCode.DRIVER
    assert "crashed" in arm.fault().message


# command


def targets(child) -> list[float]:
    return [wire.unpack_target(message)[0] for message in child.of(wire.TARGET)]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_target_that_is_not_finite_is_refused_and_never_sent(opened, value):
    arm, child = opened()
    with pytest.raises(DeviceError) as caught:
        arm.command(value)
    assert caught.value.code == FaultCode.NOT_FINITE
    assert targets(child) == []
    assert arm._target_m == 0.0


def test_a_target_may_lead_the_arm_and_the_last_target_so_far_and_no_further(opened, clock):
    arm, child = opened(max_lead=0.002)
    arm.command(0.002)
    with pytest.raises(DeviceError, match=r"2\.50 mm ahead") as caught:
        arm.command(0.0025)  # the arm still says 0
    assert caught.value.code == FaultCode.OUT_OF_RANGE
    child.arrives(sample(clock, 0.010))
    with pytest.raises(DeviceError):
        arm.command(0.0045)  # a position that lies ahead does not let the target run off
    arm.command(-0.5)
    assert targets(child) == [0.002, -0.5]


@pytest.mark.parametrize("code", [*sorted(TAKEN_OVER), FaultCode.WATCHDOG_STOP])
def test_no_target_goes_out_where_none_may_or_can_arrive(opened, code):
    arm, child = opened()
    child.arrives(fault(code))
    with pytest.raises(DeviceError) as caught:
        arm.command(-1e-3)
    assert caught.value.code == code
    assert targets(child) == []


@pytest.mark.parametrize("code", sorted(TAKEN_OVER))
def test_nothing_retracts_an_arm_that_a_person_may_have(opened, rescue, code):
    arm, child = opened()
    child.answers["retract"] = {"ok": True}
    child.arrives(fault(code))
    with pytest.raises(DeviceError, match="no retract was sent") as caught:
        arm.retract(1e-3, 0.01, 3.0)
    assert caught.value.code == code
    assert (child.requests(), rescue.done) == ([], [])


@pytest.mark.parametrize(("after_s", "sent"), [(0.3, []), (0.7, ["retract 0.001 0.01"])])
def test_who_stopped_the_program_is_waited_for_before_anything_moves(
    opened, rescue, clock, after_s, sent
):
    """The retract comes between the end of the program and the child's word of who ended it."""
    arm, child = opened()
    child.answers["retract"] = {"ok": False, "message": "the control program does not run"}
    child.arrives(sample(clock, runtime_state=1))
    child.arrives(fault(FaultCode.PROGRAM_STOPPED), after_s=after_s)
    if sent:
        arm.retract(1e-3, 0.01, 3.0)
    else:
        with pytest.raises(DeviceError, match="no retract was sent"):
            arm.retract(1e-3, 0.01, 3.0)
    assert rescue.done == sent


def test_an_arm_stopped_by_its_own_watchdog_is_unloaded(opened, rescue):
    arm, child = opened()
    child.answers["retract"] = {"ok": False, "message": "m"}
    child.arrives(fault(FaultCode.WATCHDOG_STOP))
    arm.retract(2e-3, 0.01, 3.0)
    assert rescue.done == ["retract 0.002 0.01"]


def test_no_stop_cancels_a_retract_that_was_not_seen_to_end(make_arm, rescue):
    arm = make_arm()
    arm.retract(2e-3, 0.01, 1.0)
    rescue.has_ended = False
    with pytest.raises(DeviceError, match="would cancel the retract"):
        arm.safe(1.0)
    rescue.has_ended = True
    arm.safe(1.0)
    assert rescue.done == ["retract 0.002 0.01", "stop"]


def test_a_target_that_cannot_be_handed_over_is_an_error(opened, make_arm):
    arm, child = opened()
    child.deaf = True
    with pytest.raises(DeviceError, match="not sent"):
        arm.command(1e-3)
    child.deaf = False
    arm.command(2e-3)  # the last one is not taken as sent
    with pytest.raises(DeviceError) as caught:
        make_arm().command(0.0)
    assert caught.value.code == FaultCode.NOT_CONNECTED


# safe


def test_safe_is_done_when_the_child_confirms(opened, rescue):
    arm, child = opened()
    child.answers["safe"] = SAFE
    arm.safe(2.0)
    assert child.requests() == ["safe"]
    assert rescue.done == []
    assert not child.killed


@pytest.mark.parametrize("runtime_state", [1, 3])
def test_safe_is_done_when_the_program_has_ended(opened, rescue, runtime_state):
    arm, child = opened()
    child.answers["safe"] = {"ok": True, "confirmed": False, "runtime_state": runtime_state}
    arm.safe(2.0)
    assert rescue.done == []


@pytest.mark.parametrize("runtime_state", [PLAYING, PAUSED])
def test_an_unconfirmed_stop_of_a_live_program_goes_to_the_dashboard(opened, rescue, runtime_state):
    arm, child = opened()
    child.answers["safe"] = {"ok": True, "confirmed": False, "runtime_state": runtime_state}
    arm.safe(2.0)
    assert rescue.done == ["stop"]
    assert not child.killed


@pytest.mark.parametrize("answer", [None, {"ok": False, "message": "moves on"}])
def test_a_child_that_cannot_stop_the_arm_is_killed_and_the_stop_sent_past_it(
    opened, rescue, clock, answer
):
    arm, child = opened()
    child.answers["safe"] = answer
    began_s = clock.now_s
    arm.safe(2.0)
    assert child.killed
    assert rescue.done == ["stop"]
    assert clock.now_s - began_s < 1.5  # time is left for the other way


def test_safe_is_sent_without_a_child(make_arm, rescue):
    make_arm().safe(1.0)
    assert rescue.done == ["stop"]


# retract


def test_retract_is_done_when_the_child_has_done_it(opened, rescue):
    arm, child = opened()
    child.answers["retract"] = {"ok": True}
    arm.retract(2e-3, 0.01, 3.0)
    assert rescue.done == []


@pytest.mark.parametrize("answer", [None, {"ok": False, "message": "does not follow"}])
def test_a_child_that_cannot_retract_is_killed_and_the_arm_unloaded_past_it(
    opened, rescue, clock, answer
):
    arm, child = opened()
    child.answers["retract"] = answer
    began_s = clock.now_s
    arm.retract(2e-3, 0.01, 1.5)
    assert child.killed
    assert rescue.done == ["retract 0.002 0.01"]
    assert clock.now_s - began_s <= 0.85


def test_a_retract_that_is_not_confirmed_is_followed_by_no_stop_of_its_own(make_arm, rescue):
    rescue.error = DeviceError("no way", code=FaultCode.NOT_CONNECTED)
    with pytest.raises(DeviceError, match="no way"):
        make_arm().retract(2e-3, 0.01, 1.0)
    assert rescue.done == ["retract 0.002 0.01"]


def undetected(rescue, clock, position_m: float) -> str:
    """What the retract past ur_rtde thinks of an arm that stands there now."""
    pose = tuple(target_pose(HOME, APPROACH, position_m))
    package = UrState(clock.now_s, pose, (0.0,) * 6, ROBOT_RUNNING, 1, 1, 1)
    return rescue.last.moved(package, None)


def test_the_targets_that_were_sent_tell_how_far_the_arm_can_be(opened, rescue, clock):
    arm, child = opened()
    arm.command(1e-3)
    arm.command(-1e-3)
    child.deaf = True
    arm.retract(2e-3, 0.01, 3.0)
    assert rescue.last.loaded == "Loaded program: a.urp"
    for position_m, explained in ((1e-3, True), (1.5e-3, False), (-3e-3, True), (-3.5e-3, False)):
        assert (undetected(rescue, clock, position_m) == "") is explained


@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0, -1.0])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_motion_that_is_no_number_is_refused_and_never_sent(opened, rescue, place, value):
    arm, child = opened()
    numbers = [2e-3, 0.01, 1.0]
    numbers[place] = value
    for move in (arm.retract, arm.prove_stop):
        with pytest.raises(BadInputError, match="not a positive number"):
            move(*numbers)
    assert child.requests() == []
    assert rescue.done == []


# prove_stop


@pytest.mark.parametrize("answer", [None, {"ok": False, "message": "the watchdog did not act"}])
def test_a_stop_that_is_not_proven_ends_in_a_stop(opened, rescue, answer):
    arm, child = opened()
    child.answers["prove"] = answer
    with pytest.raises(DeviceError, match="not proven"):
        arm.prove_stop(2e-3, 0.01, 1.0)
    assert child.killed
    assert rescue.done == ["stop"]


def test_close_lets_the_child_leave_by_itself(opened):
    arm, child = opened()
    arm.close()
    arm.close()
    assert child.has_quit
    assert not child.killed
    assert arm.drain() == []
