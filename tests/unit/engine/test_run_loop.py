"""The loop on the simulated rig: complete, paused, stopped, broken; and safing that always ends."""

from __future__ import annotations

import logging
import math
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from long_ones import long_rows
from run_bench import Bench, bench_for, spec_for
from run_plans import stvf_plan

from stepload.engine import loop
from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator, StopLevel
from stepload.engine.replay import Zero, group_by_tick, replay
from stepload.engine.safing import Action, make_safe
from stepload.record.outcome import Cause, RunOutcome, RunStatus
from stepload.record.rows import Phase, TickRow
from stepload.rig.device import Identity
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample
from stepload.rig.world import WorldFault

QUICK = {"touches": 2, "tare_s": 0.2, "hold_s": 0.2, "settle_timeout_s": 0.3, "top_force_n": 100.0}


@dataclass
class Tape:
    """Keeps what the loop records."""

    forces: list[ForceSample] = field(default_factory=list)
    arms: list[ArmSample] = field(default_factory=list)
    rows: list[TickRow] = field(default_factory=list)
    events: list[tuple[float, str, Mapping[str, object]]] = field(default_factory=list)
    trouble: str = ""
    on_tick: Callable[[TickRow], None] | None = None

    def force(self, sample: ForceSample) -> None:
        self.forces.append(sample)

    def second_force(self, sample: ForceSample) -> None:
        raise AssertionError("this rig has none")

    def arm(self, sample: ArmSample) -> None:
        self.arms.append(sample)

    def displacement(self, sample: DisplacementSample) -> None:
        raise AssertionError("this rig has none")

    def tick(self, row: TickRow) -> None:
        self.rows.append(row)
        if self.on_tick:
            self.on_tick(row)

    def event(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        self.events.append((time_s, kind, data))

    def problem(self) -> str:
        return self.trouble

    def kinds(self) -> Counter[str]:
        return Counter(kind for _, kind, _ in self.events)

    def phases(self) -> list[str]:
        return [str(data["phase"]) for _, kind, data in self.events if kind == "phase"]


def _bench(faults: list[WorldFault] | None = None, **procedure: Any) -> Bench:
    plan = stvf_plan(**(QUICK | procedure))
    return bench_for(plan, 727.0, spec_for(plan, 4, faults or []))


def _go(bench: Bench, tape: Tape, **options: Any) -> RunOutcome:
    bench.rig.arm.open(1.0)
    bench.rig.force.open(1.0)
    return run_loop(bench.engine, bench.rig, tape, **options)


@pytest.mark.parametrize("off_m", [-0.8e-3, 0.8e-3, 0.06e-3])
def test_a_position_that_is_off_from_the_start_is_no_place_to_start_from(off_m: float) -> None:
    """The first command, to stay where it says it is, would move the arm."""
    bench = _bench([WorldFault("position_jump", 0.0, 600.0, off_m)])
    bench.rig.arm.command = _refuse  # type: ignore[method-assign]
    outcome = _go(bench, Tape())
    assert outcome.cause is not None
    assert outcome.cause.rule == "held"
    assert outcome.cause.value == pytest.approx(off_m, abs=3e-6)
    assert outcome.status is RunStatus.STOPPED
    assert bench.peak_n == 0.0
    assert not outcome.errors


def _refuse(*_: object) -> None:
    raise AssertionError("nothing may be commanded")


def test_an_arm_that_cannot_say_where_it_is_held_is_not_commanded() -> None:
    bench = _bench()
    bench.rig.arm.command = _refuse  # type: ignore[method-assign]

    def broken() -> float:
        raise RuntimeError("no such register")

    bench.rig.arm.held_m = broken  # type: ignore[method-assign]
    outcome = _go(bench, Tape())
    assert outcome.cause is not None
    assert outcome.cause.rule == "device"
    assert "no such register" in outcome.cause.message


def test_an_arm_that_no_longer_says_where_it_is_held_is_not_commanded() -> None:
    """It did when it was opened; a comparison with no number would let everything pass."""
    bench = _bench([WorldFault("position_jump", 0.0, 600.0, 0.8e-3)])
    bench.rig.arm.command = _refuse  # type: ignore[method-assign]
    bench.rig.arm.held_m = lambda: math.nan  # type: ignore[method-assign]
    outcome = _go(bench, Tape())
    assert outcome.cause is not None
    assert outcome.cause.rule == "device"
    assert "where its controller holds it" in outcome.cause.message


def test_a_run_goes_through_every_phase_in_order() -> None:
    bench, tape = _bench(cycles=2), Tape()
    outcome = _go(bench, tape)
    assert outcome.status is RunStatus.COMPLETED
    assert outcome.cause is None
    assert outcome.why.startswith("The run was completed.")
    cycle = ["LOAD", "HOLD", "LOAD", "HOLD", "UNLOAD", "UNLOAD_HOLD", "RETRACT", "POST_TARE"]
    touch = ["GUARDED_APPROACH", "DWELL"]
    assert tape.phases() == [
        "WARM_UP", "FREE_AIR", "TARE", "DRIFT_CHECK", "FAST_APPROACH", *touch, "TOUCH_RETRACT",
        *touch, *cycle, "FAST_APPROACH", *touch, *cycle, "FAST_APPROACH", *touch, "RETRACT", "DONE",
    ]  # fmt: skip
    assert outcome.levels_done == 4
    assert [t.purpose for t in outcome.touches] == ["first", "again", "cycle", "last"]
    assert all(abs(t.position_m - outcome.touches[0].position_m) < 1e-5 for t in outcome.touches)
    assert outcome.tares[0].noise_n == pytest.approx(0.3, rel=0.3)
    assert abs(outcome.zero_shift_n) < 0.2
    assert len(tape.rows) == outcome.lateness.ticks
    assert len(tape.forces) == pytest.approx(len(tape.rows), abs=2)
    assert outcome.lateness.overruns == 0
    assert all(action.error == "" for action in outcome.safing)
    held = [data for _, kind, data in tape.events if kind == "held" and data["loading"]]
    assert [data["level_n"] for data in held] == [50.0, 100.0] * 2
    assert all(abs(data["force_n"] - data["level_n"]) < 1.0 for data in held)  # type: ignore[operator]
    assert bench.peak_n < 101.0


def test_start_level_and_cycle_continue_an_interrupted_run() -> None:
    plan = stvf_plan(**QUICK)
    bench = bench_for(plan, 727.0, start_level=1, start_cycle=1)
    tape = Tape()
    assert _go(bench, tape).levels_done == 1
    assert {row.level_n for row in tape.rows if row.phase == Phase.LOAD} == {100.0}


class _Pauser:
    """Asks for a pause in one phase, and takes it back after 4 s in which the force was off."""

    def __init__(self, bench: Bench, phase: Phase, step: int = 0, cycle: int = 1) -> None:
        self._operator, self._when = bench.operator, (phase, step, cycle)
        self._paused_s = 0.0
        self.requested = False

    def __call__(self, row: TickRow) -> None:
        phase, step, cycle = self._when
        if not self.requested and (row.phase, row.cycle) == (phase, cycle) and row.step == step:
            self.requested = self._operator.paused = True
        if row.phase == Phase.PAUSED:
            assert row.force_n < 2.0
            self._paused_s = self._paused_s or row.time_s
            if row.time_s > self._paused_s + 4.0:
                self._operator.paused = False


TOUCH = ["FAST_APPROACH", "GUARDED_APPROACH", "DWELL"]
ZERO = ["FREE_AIR", "TARE", "DRIFT_CHECK"]
AGAIN = ["PAUSED", *ZERO, *TOUCH]
LAST = [*TOUCH, "RETRACT", "DONE"]
OPENED = ["RETRACT", "POST_TARE"]
UP, DOWN = ["LOAD", "HOLD"], ["UNLOAD", "UNLOAD_HOLD"]
CYCLE = [*UP, *UP, *DOWN, *OPENED]


@pytest.mark.parametrize(
    ("phase", "step", "cycle", "after"),
    [
        pytest.param(
            Phase.TARE, 0, 1, [*AGAIN, *CYCLE, *TOUCH, *CYCLE, *LAST], marks=pytest.mark.long
        ),
        (Phase.DWELL, 0, 1, ["RETRACT", *AGAIN, *CYCLE, *TOUCH, *CYCLE, *LAST]),
        (Phase.LOAD, 1, 1, ["HOLD", "RETRACT", *AGAIN, *UP, *DOWN, *OPENED, *TOUCH, *CYCLE, *LAST]),
        pytest.param(
            Phase.LOAD, 2, 1, ["HOLD", *OPENED, *AGAIN, *CYCLE, *LAST], marks=pytest.mark.long
        ),
        pytest.param(
            Phase.UNLOAD,
            1,
            1,
            ["UNLOAD_HOLD", *OPENED, *AGAIN, *CYCLE, *LAST],
            marks=pytest.mark.long,
        ),
        pytest.param(
            Phase.UNLOAD_HOLD, 1, 1, [*OPENED, *AGAIN, *CYCLE, *LAST], marks=pytest.mark.long
        ),
        pytest.param(Phase.POST_TARE, 1, 1, [*AGAIN, *CYCLE, *LAST], marks=pytest.mark.long),
        (Phase.UNLOAD, 1, 2, ["UNLOAD_HOLD", *OPENED, "PAUSED", *ZERO, *LAST]),
        pytest.param(Phase.POST_TARE, 1, 2, ["PAUSED", *ZERO, *LAST], marks=pytest.mark.long),
    ],
    ids=lambda value: value.name if isinstance(value, Phase) else "",
)
def test_a_pause_is_honoured_after_each_step_and_between_cycles(
    phase: Phase, step: int, cycle: int, after: list[str]
) -> None:
    bench, tape = _bench(cycles=2, touches=1), Tape()
    tape.on_tick = pauser = _Pauser(bench, phase, step, cycle)
    outcome = _go(bench, tape)
    assert pauser.requested
    assert outcome.status is RunStatus.COMPLETED, outcome.why
    rows = [row for row in tape.rows if (row.phase, row.step, row.cycle) == (phase, step, cycle)]
    told = [str(data["phase"]) for time_s, kind, data in tape.events
            if kind == "phase" and time_s > rows[0].time_s]  # fmt: skip
    if phase is Phase.TARE:
        assert told.pop(0) == "DRIFT_CHECK"
    assert told == after
    cut = [data for _, kind, data in tape.events if kind == "cycle_cut"]
    assert cut == ([{"cycle": 1, "steps": 1}] if (phase, step) == (Phase.LOAD, 2) else [])
    loaded = [data["step"] for _, kind, data in tape.events if kind == "held" and data["loading"]]
    assert loaded == [1, 2, 1, 2]


def test_a_pause_between_cycles_without_lift_off_opens_the_contact() -> None:
    bench, tape = _bench(cycles=2, touches=1, lift_off=False, unload_fraction=0.1), Tape()
    tape.on_tick = pauser = _Pauser(bench, Phase.UNLOAD_HOLD)
    outcome = _go(bench, tape)
    assert pauser.requested
    assert outcome.status is RunStatus.COMPLETED, outcome.why
    phases = tape.phases()
    at = phases.index("PAUSED")
    assert phases[at - 4 :] == [*DOWN, *OPENED, *AGAIN, *CYCLE, *LAST]
    assert [touch.purpose for touch in outcome.touches] == ["first", "resume", "last"]
    assert [touch.cycle for touch in outcome.touches] == [1, 2, 2]


OTHER_PHASES = (Phase.TARE, Phase.GUARDED_APPROACH, Phase.UNLOAD)


@pytest.mark.parametrize(
    ("phase", "level"),
    [
        *((Phase.LOAD, level) for level in (1, 2, 3)),
        *((phase, 2) for phase in OTHER_PHASES),
        *long_rows((phase, level) for phase in OTHER_PHASES for level in (1, 3)),
    ],
)
def test_the_operator_stops_at_any_time(phase: Phase, level: int) -> None:
    bench, tape = _bench(), Tape()

    def act(row: TickRow) -> None:
        if row.phase == phase:
            bench.operator.request_stop(StopLevel(level))

    tape.on_tick = act
    outcome = _go(bench, tape)
    assert outcome.status is RunStatus.INTERRUPTED
    assert outcome.cause is None
    assert bench.rig.world.true_force_n == 0.0
    names = [action.name for action in outcome.safing if action.sent]
    if level == 1 and phase is Phase.LOAD:
        assert outcome.levels_done == 1
    if level == 3:
        assert names == ["arm retract", "arm stop"]
    else:
        assert names == ["arm stop", "force sensor"]


def test_signals_set_levels() -> None:
    operator = Operator()
    former = signal.getsignal(signal.SIGINT)  # ignored where the tests run in the background
    with operator.listening():
        operator.moving = True
        os.kill(os.getpid(), signal.SIGINT)
        assert operator.stop_level == 1
        os.kill(os.getpid(), signal.SIGTERM)
        assert operator.stop_level == 2
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        assert operator.stop_level == 3
        assert operator.signal_number == signal.SIGINT
    assert signal.getsignal(signal.SIGINT) is former


@pytest.mark.parametrize(
    ("kind", "rule", "retracted"),
    [
        ("force_raise", "device", True),
        ("arm_raise", "device", False),
        ("command_raise", "loop", False),
    ],
)  # fmt: skip
def test_an_exception_in_a_driver_ends_with_the_force_off(
    kind: str, rule: str, retracted: bool
) -> None:
    for start_s in (0.1, 1.0, 3.5):
        bench, tape = _bench([WorldFault(kind, start_s, 60.0, 0.0)]), Tape()
        outcome = _go(bench, tape)
        assert outcome.status is RunStatus.STOPPED
        assert outcome.cause is not None
        assert outcome.cause.rule == rule
        assert "simulated exception" in outcome.cause.message
        assert outcome.retracted is retracted
        assert bench.rig.world.true_force_n == 0.0
        assert bench.peak_n < 727.0
        assert tape.kinds()["end"] == 1


class _Spoilt:
    """A device of the rig that latches a fault, or breaks when it is read, in the first hold."""

    def __init__(self, device: Any, tape: Tape, how: str) -> None:
        self._device, self._tape, self._how = device, tape, how

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    def _due(self, how: str) -> bool:
        return self._how == how and any(row.phase == Phase.HOLD for row in self._tape.rows[-1:])

    def fault(self) -> Fault | None:
        return Fault(FaultCode.STALE, "no new sample", "", 0.0) if self._due("fault") else None

    def drain(self) -> list[Any]:
        if self._due("drain"):
            raise OSError("unplugged")
        return list(self._device.drain())


LATCHED, RAISED = ("fault", "stale: no new sample"), ("drain", "OSError: unplugged")


@pytest.mark.parametrize(
    ("attribute", "role", "how", "told"),
    [
        ("arm", "arm", *LATCHED),
        ("force", "force_sensor", *RAISED),
        ("second_force", "second_force_sensor", *RAISED),
        ("displacement", "displacement_sensor", *LATCHED),
        *long_rows(
            [
                ("arm", "arm", *RAISED),
                ("force", "force_sensor", *LATCHED),
                ("second_force", "second_force_sensor", *LATCHED),
                ("displacement", "displacement_sensor", *RAISED),
            ]
        ),
    ],
)
def test_why_it_stopped_names_the_device_by_role_and_driver(
    attribute: str, role: str, how: str, told: str
) -> None:
    tape = Tape()
    two_of_a_kind: dict[str, Any] = {
        "second_force_rate_hz": 1000.0, "second_force_noise_n": 0.3,
        "second_force_quantum_n": 0.05, "second_force_delay_s": 0.001,
        "second_force_range_n": 1000.0, "second_force_axis": "-fz",
        "gauge_rate_hz": 500.0, "gauge_quantum_m": 1e-6, "gauge_noise_m": 1e-6,
    }  # fmt: skip
    plan = stvf_plan(**QUICK)
    bench = bench_for(plan, 727.0, spec_for(plan, 4, **two_of_a_kind))
    for device in (bench.rig.second_force, bench.rig.displacement):
        assert device is not None
        device.open(1.0)
    setattr(bench.rig, attribute, _Spoilt(getattr(bench.rig, attribute), tape, how))
    identities = {
        name: Identity("bota_serial", "any", f"S{i}", "1", "")
        for i, name in enumerate(
            ["arm", "force_sensor", "second_force_sensor", "displacement_sensor"]
        )
    }
    tape.second_force = tape.displacement = lambda sample: None  # type: ignore
    outcome = _go(bench, tape, identities=identities)
    assert outcome.status is RunStatus.STOPPED
    assert outcome.why.startswith("The run was stopped by device at ")
    number, name = identities[role].serial_number, role.replace("_", " ")
    assert f" s: {name} (driver bota_serial, serial number {number}): {told}." in outcome.why
    assert bench.rig.world.true_force_n == 0.0


def test_a_recorder_that_fails_stops_the_run_but_not_the_retract() -> None:
    bench, tape = _bench(), Tape()

    def full(row: TickRow) -> None:
        if row.phase >= Phase.HOLD:
            raise OSError(28, "No space left on device")

    tape.on_tick = full
    outcome = _go(bench, tape)
    assert outcome.status is RunStatus.STOPPED
    assert "No space left" in outcome.why
    assert outcome.retracted
    assert bench.rig.world.true_force_n == 0.0

    bench, tape = _bench(), Tape(trouble="the writer died")
    outcome = _go(bench, tape)
    assert outcome.cause is not None
    assert outcome.cause.rule == "recorder"


def test_safing_survives_what_raises_and_what_hangs() -> None:
    release = threading.Event()
    called: list[str] = []

    def hang() -> None:
        called.append("hang")
        release.wait(30.0)

    def fail() -> None:
        called.append("fail")
        raise OSError("unplugged")

    actions = [
        Action("sensor", lambda: called.append("sensor"), 1.0),
        Action("retract", hang, 0.1, arm=True),
        Action("stop", fail, 1.0, arm=True),
        Action("leave", lambda: (_ for _ in ()).throw(SystemExit(3)).__next__(), 1.0),
    ]
    start_s = time.monotonic()
    outcomes = make_safe(actions, Operator())
    try:
        assert called == ["hang", "fail", "sensor"]
        assert [outcome.name for outcome in outcomes] == ["retract", "stop", "sensor", "leave"]
        assert all(outcome.sent for outcome in outcomes)
        assert "no answer within" in outcomes[0].error
        assert outcomes[1].error == "OSError: unplugged"
        assert outcomes[2].error == ""
        assert "SystemExit" in outcomes[3].error
        assert time.monotonic() - start_s < 20.0
    finally:
        release.set()


def test_the_third_ctrl_c_skips_all_but_the_arm() -> None:
    operator = Operator()
    called: list[str] = []

    def retract() -> None:
        called.append("retract")
        operator.request_stop(StopLevel.ARM_ONLY)

    outcomes = make_safe(
        [
            Action("sensor", lambda: called.append("sensor"), 1.0),
            Action("retract", retract, 1.0, arm=True),
            Action("stop", lambda: called.append("stop"), 1.0, arm=True),
        ],
        operator,
    )
    assert called == ["retract", "stop"]
    assert not outcomes[2].sent


def test_replay_finds_the_same_trip_and_would_trip_earlier_with_tighter_limits() -> None:
    bench, tape = _bench([WorldFault("force_gain", 8.0, 60.0, 0.5)]), Tape()
    outcome = _go(bench, tape)
    assert outcome.cause is not None
    tares = [
        Zero(time_s, data["mean_n"], data["second_mean_n"], data["wrench"])  # type: ignore[arg-type]
        for time_s, kind, data in tape.events
        if kind == "tare"
    ]
    ticks = list(group_by_tick(tape.rows, tape.forces, tape.arms))
    again = replay(ticks, tares, bench.limits, force_axis="-fz")
    assert again.cause is not None
    assert again.cause.rule == outcome.cause.rule
    assert again.cause.time_s == pytest.approx(outcome.cause.time_s, abs=0.0025)
    tight = replace(bench.limits, force_limit_n=40.0)
    earlier = replay(ticks, tares, tight, force_axis="-fz")
    assert earlier.cause is not None
    assert earlier.cause.rule in ("R1", "R2", "CAP")
    assert earlier.cause.time_s < outcome.cause.time_s
    assert earlier.phase in (Phase.LOAD, Phase.HOLD)


def test_a_device_says_why_a_rule_stopped_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, tape = _bench([WorldFault("force_lost", 2.2, 9.0, 0.0)]), Tape()
    told = Fault(FaultCode.NOT_CONNECTED, "the plug is out", "plug it in", 0.0)
    engine = bench.engine
    monkeypatch.setattr(bench.rig.force, "fault", lambda: told if engine.cause else None)
    outcome = _go(bench, tape)
    assert outcome.cause is not None
    assert outcome.cause.rule == "R3"
    assert "; force sensor: not_connected: the plug is out (plug it in)" in outcome.why
    assert tape.kinds()["fault"] == 1


def test_a_device_that_hangs_when_asked_why_does_not_keep_the_outcome_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bench, release = _bench([WorldFault("force_lost", 2.2, 9.0, 0.0)]), threading.Event()
    engine = bench.engine
    monkeypatch.setattr(loop, "EXPLAIN_DEADLINE_S", 0.1)
    monkeypatch.setattr(
        bench.rig.force, "fault", lambda: release.wait() and None if engine.cause else None
    )
    try:
        outcome = _go(bench, Tape())
    finally:
        release.set()
    assert outcome.cause is not None
    assert outcome.cause.rule == "R3"
    assert outcome.safing[0].name in ("arm retract", "arm stop")


def test_a_stop_is_told_in_its_moment_and_safing_as_it_goes() -> None:
    bench = _bench()
    told: list[tuple[float, str]] = []
    tape = Tape()

    def say(text: str) -> None:
        told.append((bench.rig.clock.now_s(), text))

    def end(row: TickRow) -> None:
        if row.phase == Phase.HOLD:
            bench.engine.trip(Cause("loop", 1.0, 0.0, "", 0.0, row.time_s, "no more"))
            raise KeyboardInterrupt

    tape.on_tick = end
    outcome = _go(bench, tape, say=say)
    assert outcome.cause is not None
    (stopped_s, why), *safing = told
    assert why.startswith("STOPPED by loop")
    assert "no more" in why
    assert "EMERGENCY STOP" in why
    assert stopped_s - outcome.cause.time_s < bench.rig.arm.period_s
    assert "is asked to go back" in safing[0][1]
    assert "confirmed by the arm" in safing[1][1]
    assert not outcome.safing[0].error


def test_a_log_that_blocks_does_not_hold_up_the_ticks(caplog: pytest.LogCaptureFixture) -> None:
    held = threading.Event()

    class Blocking(logging.Handler):
        def emit(self, _: logging.LogRecord) -> None:
            held.wait(20.0)

    log, handler = logging.getLogger(loop.__name__), Blocking()
    bench, tape = _bench(), Tape()
    log.addHandler(handler)
    try:
        with caplog.at_level(logging.INFO):
            outcome = _go(bench, tape)
    finally:
        held.set()
        log.removeHandler(handler)
    assert outcome.status is RunStatus.COMPLETED
    assert tape.kinds()["end"] == 1
