"""The retract of safing: asked for again while the arm is silent, and words that are true."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from stepload.engine import safe_end
from stepload.engine import unload as unload_module
from stepload.engine.notices import Notices
from stepload.engine.operator import Operator
from stepload.engine.unload import ForceLeft, Way, unload
from stepload.errors import DeviceError
from stepload.rig.faults import Fault, FaultCode

PATIENT, HASTY = Way(2e-3, 0.01, 2.4, 60.0), Way(2e-3, 0.01, 2.4, 0.0)


class Arm:
    """Raises `errors` one after another, then confirms; each retract takes a second."""

    def __init__(self, clock, *codes: FaultCode, fault: FaultCode | None = None) -> None:
        self.clock, self.codes, self.sent = clock, list(codes), 0
        self.latched = Fault(fault, "m", "h", 0.0) if fault else None

    def fault(self):
        return self.latched

    def retract(self, distance_m, speed_m_s, timeout_s) -> None:
        self.sent += 1
        self.clock.sleep(1.0)
        if self.codes:
            raise DeviceError("silent", code=self.codes.pop(0), hint="look")


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


@pytest.fixture
def clock(monkeypatch) -> Clock:
    clock = Clock()
    times = SimpleNamespace(
        monotonic=lambda: clock.now_s, time=lambda: clock.now_s, sleep=clock.sleep,
        localtime=lambda s: s, strftime=lambda form, s: f"{s:.0f}",
    )  # fmt: skip
    monkeypatch.setattr(unload_module, "time", times)
    return clock


@pytest.fixture
def force() -> SimpleNamespace:
    return SimpleNamespace(gone=False, still_on=False, words="8.1 N, 2.3 s old", look=lambda: None)


@pytest.fixture
def lines() -> list[str]:
    return []


def test_a_silent_arm_is_asked_until_it_confirms_and_the_operator_is_told_at_once(
    clock, force, lines
):
    arm = Arm(clock, *[FaultCode.NOT_CONNECTED] * 3, fault=FaultCode.STALE)
    unload(arm, PATIENT, force, Operator(), lines.append)
    assert arm.sent == 4
    told = lines[1]
    assert "trying until 62; 8.1 N, 2.3 s old; USE THE EMERGENCY STOP" in told
    assert "when it answers it goes back by 2.00 mm: keep clear of it" in told
    assert "or press the emergency stop first and leave it pressed" in told
    assert "Ctrl+C ends the trying" in told
    assert "confirmed by the arm" in lines[-1]


def test_the_trying_ends_at_the_time_that_was_told(clock, force, lines):
    arm = Arm(clock, *[FaultCode.STALE] * 100)
    with pytest.raises(DeviceError, match="given up") as caught:
        unload(arm, PATIENT, force, Operator(), lines.append)
    assert caught.value.code == FaultCode.STALE
    assert 62.0 <= clock.now_s <= 65.0
    assert "NOT confirmed" in lines[-1]
    assert "8.1 N, 2.3 s old" in lines[-1]
    assert "may still move the arm back when it answers again" in lines[-1]


@pytest.mark.parametrize(
    "code", [FaultCode.PROTECTIVE_STOP, FaultCode.PROGRAM_STOPPED, FaultCode.REFUSED_COMMAND]
)
def test_an_arm_that_answers_no_is_asked_once(clock, force, lines, code):
    arm = Arm(clock, code)
    with pytest.raises(DeviceError) as caught:
        unload(arm, PATIENT, force, Operator(), lines.append)
    assert (arm.sent, caught.value.code) == (1, code)
    assert "NOT confirmed" in lines[-1]
    assert "may still move" not in lines[-1]


def test_no_patience_no_second_try(clock, force, lines):
    arm = Arm(clock, FaultCode.STALE)
    with pytest.raises(DeviceError):
        unload(arm, HASTY, force, Operator(), lines.append)
    assert arm.sent == 1


def test_ctrl_c_ends_the_trying_only_after_it_was_told_of(clock, force, lines):
    operator = Operator()
    operator.signals = 3  # pressed before: no level skips the retract
    arm = Arm(clock, *[FaultCode.STALE] * 100)
    force.look = lambda: setattr(operator, "signals", 3 + (arm.sent >= 5))
    with pytest.raises(DeviceError, match="the operator has ended the trying"):
        unload(arm, PATIENT, force, operator, lines.append)
    assert arm.sent == 5


def test_a_contact_seen_to_be_open_needs_no_more_tries(clock, force, lines):
    arm = Arm(clock, *[FaultCode.STALE] * 100)
    force.look = lambda: setattr(force, "gone", arm.sent >= 3)
    with pytest.raises(DeviceError, match="the contact is open"):
        unload(arm, PATIENT, force, Operator(), lines.append)
    assert arm.sent == 3


def test_an_arm_that_is_back_with_the_force_on_is_not_confirmed(clock, force, lines):
    force.still_on = True
    with pytest.raises(DeviceError, match=r"says that it is back, but 8\.1 N"):
        unload(Arm(clock), PATIENT, force, Operator(), lines.append)
    assert "emergency stop" in lines[-1]


def test_a_terminal_that_is_held_holds_nobody_up():
    release, written = threading.Event(), []

    def write(text: str) -> None:
        release.wait(10.0)
        written.append(text)

    notices = Notices(write)
    notices.say("one")
    notices.say("two")
    assert written == []
    release.set()
    notices.close()
    assert written == ["one", "two"]


class Hangs:
    """A force sensor whose drain does not come back until it is let go."""

    def __init__(self) -> None:
        self.go, self.calls = threading.Event(), 0

    def drain(self) -> list[object]:
        self.calls += 1
        self.go.wait(30.0)
        return []


def _engine(cause: str):
    return SimpleNamespace(
        supervisor=SimpleNamespace(smooth_n=8.1),
        cause=SimpleNamespace(rule=cause) if cause else None,
    )


@pytest.mark.parametrize(("cause", "calls"), [("R3", 1), ("hang", 0)])
def test_a_sensor_that_hangs_does_not_keep_the_retract_from_being_sent(cause, calls):
    sensor = Hangs()
    left = ForceLeft(_engine(cause), sensor, None)
    left.look()
    left.look()
    assert sensor.calls == calls
    assert left.force_n == 8.1
    sensor.go.set()
    if left._looking is not None:
        left._looking.join(30.0)


@pytest.mark.parametrize(("readable", "proven"), [(True, True), (False, False)])
def test_samples_that_cannot_be_read_prove_nothing(readable: bool, proven: bool) -> None:
    def take(samples, now_s):
        if not readable:
            raise TypeError("not a wrench")

    watch = SimpleNamespace(receive_s=5.0, take=take, project=lambda sample: 0.2)
    engine = _engine("loop")
    engine.supervisor = SimpleNamespace(smooth_n=8.1, zero_n=0.0, tared=True, force=watch)
    engine.limits = SimpleNamespace(stale_force_s=0.1, touch_force_n=2.0)
    sensor = SimpleNamespace(drain=lambda: [SimpleNamespace(receive_time_s=5.0)])
    left = ForceLeft(engine, sensor, SimpleNamespace(now_s=lambda: 5.01))
    left.look()
    assert left.proven is proven
    assert left.gone is proven


def test_where_safing_itself_breaks_the_arm_is_sent_a_retract_and_a_stop():
    sent = []

    def refuse(*way):
        sent.append(way)
        raise RuntimeError("refused")

    rig = SimpleNamespace(arm=SimpleNamespace(retract=refuse, safe=lambda limit_s: sent.append(())))
    errors = []
    done = safe_end.make_rig_safe(None, rig, errors)
    assert sent == [
        (safe_end.BLIND_RETRACT_M, safe_end.BLIND_SPEED_M_S, safe_end.BLIND_TIMEOUT_S), (),
    ]  # fmt: skip
    assert [(one.name, bool(one.error)) for one in done] == [
        (safe_end.RETRACT, True), ("arm stop", False),
    ]  # fmt: skip
    assert len(errors) == 1


def test_every_device_is_made_safe_and_the_arm_first():
    sent = []

    def device(name):
        return SimpleNamespace(safe=lambda limit_s: sent.append((name, limit_s)))

    rig = SimpleNamespace(
        arm=device("arm"), force=device("force"), second_force=device("second"), displacement=None
    )
    engine = SimpleNamespace(safe_reached=True, operator=Operator())
    done = safe_end.make_rig_safe(engine, rig, [])
    assert sent[0] == ("arm", safe_end.SAFE_DEADLINE_S)
    assert {name for name, _ in sent} == {"arm", "force", "second"}
    assert not any(one.error for one in done)
