"""The cadence: read the devices, tick, command, record, until the run is over and the arm is safe.

Absolute deadlines on one grid, so that a late tick does not shift the ones after it. The same loop
runs in virtual time, where sleeping makes the simulated world go on.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext, suppress
from typing import Any, Protocol

from stepload.record.outcome import ActionResult, Cause, Lateness, RunOutcome, RunStatus
from stepload.record.rows import TickRow
from stepload.rig.clock import Clock
from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor, Identity
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample
from stepload.run.hang import LOOK_S, LOOKS, LoopHungError, hang_watch
from stepload.run.operator import StopLevel
from stepload.run.safing import Action, make_safe, why_it_stopped
from stepload.run.tick import Engine
from stepload.run.undisturbed import undisturbed

FAULT_POLL_TICKS = 16
PROGRESS_S = 0.1
SAFE_DEADLINE_S = 3.0
EXPLAIN_DEADLINE_S = 1.0
RETRACT_EXTRA_S = 2.0
DEADLINE_SLACK_S = 1.0
"""A device is given its own timeout; its thread a little more."""
BLIND_RETRACT_M, BLIND_SPEED_M_S, BLIND_TIMEOUT_S = 1e-3, 1e-3, 4.0
"""The retract of last resort, where nothing can be asked for the plan's."""


class Recorder(Protocol):
    """What the loop pushes into; nothing here may block."""

    force: Callable[[ForceSample], None]
    second_force: Callable[[ForceSample], None]
    arm: Callable[[ArmSample], None]
    displacement: Callable[[DisplacementSample], None]
    tick: Callable[[TickRow], None]

    def event(self, time_s: float, kind: str, data: Mapping[str, object]) -> None:
        """Something happened."""
        ...

    def problem(self) -> str:
        """Why recording does not work any more; "" while it does."""
        ...


class RigDevices(Protocol):
    """The open devices of a rig; `stepload.rig.world.SimulatedRig` is one."""

    arm: Arm
    force: ForceSensor
    displacement: DisplacementSensor | None
    second_force: ForceSensor | None
    clock: Clock


class _Loop:
    """The loop's own state."""

    def __init__(
        self,
        engine: Engine,
        rig: RigDevices,
        recorder: Recorder,
        on_progress: Callable[[Engine], None] | None,
        identities: Mapping[str, Identity],
    ) -> None:
        self.engine = engine
        self.rig = rig
        self.recorder = recorder
        self.on_progress = on_progress
        self.identities = identities
        self.errors: list[str] = []
        self.busy = ""
        self.ticks = self.overruns = 0
        self.worst_s = self.total_s = 0.0
        self._broken: set[str] = set()

    def run(self) -> None:
        """Tick until the engine is done. Raises what `Arm.command` raises."""
        rig, engine, recorder = self.rig, self.engine, self.recorder
        clock = rig.clock
        now, sleep_until, tick = clock.now_s, clock.sleep_until, engine.tick
        period_s = rig.arm.period_s
        deadline_s = now()
        next_progress_s = deadline_s
        events = engine.events
        push_force, push_arm, push_tick = recorder.force, recorder.arm, recorder.tick
        gauge, second = rig.displacement, rig.second_force
        nothing: list[Any] = []
        command = rig.arm.command
        operator = engine.operator
        done = False
        while not done:
            begin_s = now()
            late_s = begin_s - deadline_s
            self.ticks += 1
            self.total_s += late_s
            if late_s > period_s:
                self.overruns += 1
            if late_s > self.worst_s:
                self.worst_s = late_s
            engine.late_s = late_s
            force_samples = self._drain(rig.force, "force sensor", begin_s)
            arm_samples = self._drain(rig.arm, "arm", begin_s)
            second_samples = (
                self._drain(second, "second force sensor", begin_s) if second else nothing
            )
            gauge_samples = self._drain(gauge, "displacement sensor", begin_s) if gauge else nothing
            now_s = now()  # after what was drained: no honest sample is later than its tick
            target_m, done = tick(now_s, force_samples, arm_samples, gauge_samples, second_samples)
            if target_m == target_m:
                self.busy = "the arm's command"
                command(target_m)
            self.busy = "recording"
            try:
                for sample in force_samples:
                    push_force(sample)
                for arm_sample in arm_samples:
                    push_arm(arm_sample)
                for sample in second_samples:
                    recorder.second_force(sample)
                for gauge_sample in gauge_samples:
                    recorder.displacement(gauge_sample)
                if engine.row is not None:
                    push_tick(engine.row)
                if events:
                    for event in events:
                        recorder.event(*event)
                    events.clear()
            except Exception as error:  # the arm comes before the record
                self._trip("recorder", now_s, error)
            if self.ticks % FAULT_POLL_TICKS == 0:
                self._poll(now_s)
            if self.on_progress and now_s >= next_progress_s:
                next_progress_s = now_s + PROGRESS_S
                self._show(now_s)
            if operator.stop_level >= StopLevel.ARM_ONLY and not engine.safe_reached:
                return
            self.busy = "the clock"
            deadline_s += period_s
            if late_s > period_s:  # leave the missed ticks out instead of hurrying after them
                deadline_s += period_s * (late_s // period_s)
            sleep_until(deadline_s)

    def _drain(self, device: Any, name: str, now_s: float) -> list[Any]:
        self.busy = name
        try:
            samples: list[Any] = device.drain()
        except Exception as error:  # a driver's bug is no reason to leave the force on
            self._trip(name, now_s, error)
            return []
        return samples

    def explain(self) -> None:
        """A rule saw what a device's data look like; by now the device may know why."""
        engine = self.engine
        cause = engine.cause
        if cause is None or not cause.rule.startswith("R"):
            return
        for message in self._faults():
            engine.cause = cause = cause._replace(message=f"{cause.message}; {message}")
            engine.events.append((self.rig.clock.now_s(), "fault", {"message": message}))

    def _faults(self) -> Iterator[str]:
        """Latched faults of devices, in words."""
        for role, device in _devices(self.rig):
            if (fault := _fault_of(device)) is not None:
                yield f"{self._who(role)}: {fault}"

    def _poll(self, now_s: float) -> None:
        """Latched faults of devices, and a recorder that does not record."""
        if self.engine.cause is not None:
            return
        for message in self._faults():
            self.engine.trip(Cause("device", 1.0, 0.0, "", 0.0, now_s, message))
        if problem := self.recorder.problem():
            message = f"recording stopped: {problem}"
            self.engine.trip(Cause("recorder", 1.0, 0.0, "", 0.0, now_s, message))

    def _show(self, now_s: float) -> None:
        try:
            if self.on_progress:
                self.on_progress(self.engine)
        except Exception as error:  # a broken terminal must not disturb the run
            self.on_progress = None
            self.errors.append(f"progress display: {type(error).__name__}: {error}")

    def _who(self, role: str) -> str:
        """The role, and what tells the device from another one of its kind."""
        identity = self.identities.get(role.replace(" ", "_"))
        if identity is None:
            return role
        return f"{role} (driver {identity.driver}, serial number {identity.serial_number})"

    def _trip(self, name: str, now_s: float, error: Exception) -> None:
        message = f"{self._who(name)}: {type(error).__name__}: {error}"
        if name not in self._broken:
            self._broken.add(name)
            self.errors.append(message)
        self.engine.trip(Cause("device", 1.0, 0.0, "", 0.0, now_s, message))


def _devices(rig: RigDevices) -> list[tuple[str, Device]]:
    """What the rig has, by role."""
    roles: list[tuple[str, Device | None]] = [
        ("arm", rig.arm),
        ("force sensor", rig.force),
        ("second force sensor", rig.second_force),
        ("displacement sensor", rig.displacement),
    ]
    return [(role, device) for role, device in roles if device is not None]


def _fault_of(device: Device) -> str | None:
    try:
        fault = device.fault()
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    if fault is None:
        return None
    return f"{fault.code.value}: {fault.message}" + (f" ({fault.hint})" if fault.hint else "")


def run_loop(
    engine: Engine,
    rig: RigDevices,
    recorder: Recorder,
    *,
    on_progress: Callable[[Engine], None] | None = None,
    identities: Mapping[str, Identity] | None = None,
) -> RunOutcome:
    """Run an engine on open devices to its end, make the rig safe, and say what happened.

    Does not raise for anything that goes wrong on the way: it is in the outcome. Files are not
    closed here; finish the record afterwards. `on_progress` is called ten times a second.
    `identities` by role, as in `OpenRig`, are named where a device ends the run.
    """
    loop = _Loop(engine, rig, recorder, on_progress, identities or {})
    start_s = rig.clock.now_s()
    outcomes: tuple[ActionResult, ...] = ()

    def rescue() -> None:
        nonlocal outcomes
        held_s = LOOK_S * LOOKS
        message = f"the loop has stood still for {held_s:g} s, held up by {loop.busy}"
        engine.trip(Cause("hang", held_s, LOOK_S, "s", held_s, rig.clock.now_s(), message))
        loop.errors.append(message)
        outcomes = _made_safe(engine, rig, loop.errors)

    def last_words() -> str:
        engine.operator.on_lost()
        return why_it_stopped(
            RunStatus.STOPPED, engine.cause, False, outcomes, start_s, rig.clock.now_s()
        )

    watched = not rig.clock.virtual and threading.current_thread() is threading.main_thread()
    try:
        with (
            undisturbed(rig.clock.virtual),
            hang_watch(lambda: loop.ticks, rescue, last_words) if watched else nullcontext(),
        ):
            loop.run()
    except LoopHungError:
        pass
    except BaseException as error:  # the arm is made safe before anything else is thought of
        message = f"{type(error).__name__}: {error}"
        loop.errors.append(message)
        engine.trip(Cause("loop", 1.0, 0.0, "", 0.0, rig.clock.now_s(), message))
    loop_end_s = rig.clock.now_s()
    outcomes = outcomes or _made_safe(engine, rig, loop.errors)
    end_s = rig.clock.now_s()
    # A device that hangs must not keep the outcome from being told: asked under a deadline too.
    with suppress(BaseException):
        make_safe([Action("why", loop.explain, EXPLAIN_DEADLINE_S)], engine.operator)
    course, cause = engine.course, engine.cause
    if cause is not None:
        status = RunStatus.STOPPED
    elif course.done and not course.interrupted:
        status = RunStatus.COMPLETED
    else:
        status = RunStatus.INTERRUPTED
    retracted = engine.safe_reached or course.done
    signal_number = engine.operator.signal_number
    why = why_it_stopped(status, cause, retracted, outcomes, start_s, loop_end_s, signal_number)
    outcome = RunOutcome(
        status=status,
        cause=cause,
        why=why,
        retracted=retracted,
        safing=outcomes,
        start_s=start_s,
        end_s=end_s,
        peak_force_n=engine.peak_force_n,
        zero_shift_n=course.zero_shift_n,
        levels_done=course.levels_done,
        cycle=course.cycle,
        touches=tuple(course.touches),
        tares=tuple(course.tares),
        lateness=Lateness(
            loop.ticks, loop.overruns, loop.worst_s, loop.total_s / max(loop.ticks, 1)
        ),
        signal_number=signal_number,
        errors=tuple(loop.errors),
    )
    _record_end(recorder, engine, outcome)
    return outcome


def _made_safe(engine: Engine, rig: RigDevices, errors: list[str]) -> tuple[ActionResult, ...]:
    """Safing; if that itself is broken, the arm is told directly, once, to retract and to stop."""
    try:
        return make_safe(_actions(engine, rig), engine.operator)
    except BaseException as error:
        errors.append(f"safing: {type(error).__name__}: {error}")
    arm = rig.arm
    return (
        _told_directly(
            "arm retract", lambda: arm.retract(BLIND_RETRACT_M, BLIND_SPEED_M_S, BLIND_TIMEOUT_S)
        ),
        _told_directly("arm stop", lambda: arm.safe(SAFE_DEADLINE_S)),
    )


def _told_directly(name: str, call: Callable[[], None]) -> ActionResult:
    begin_s, told = time.monotonic(), ""
    try:
        call()
    except BaseException as error:  # what comes after it must be sent as well
        told = f"{type(error).__name__}: {error}"
    return ActionResult(name, True, told, begin_s, time.monotonic() - begin_s)


def _actions(engine: Engine, rig: RigDevices) -> list[Action]:
    """Retract where the loop did not get there, stop in any case, then the sensors."""
    actions = []
    limits = engine.limits
    if not (engine.safe_reached or engine.course.done):
        distance_m = engine.retract_distance_m
        speed = limits.retract_speed_m_s
        timeout_s = 2.0 * distance_m / speed + RETRACT_EXTRA_S
        actions.append(
            Action(
                "arm retract",
                lambda: rig.arm.retract(distance_m, speed, timeout_s),
                timeout_s + DEADLINE_SLACK_S,
                arm=True,
            )
        )
    return actions + [_safe(role, device) for role, device in _devices(rig)]


def _safe(role: str, device: Device) -> Action:
    is_arm = role == "arm"
    return Action(
        "arm stop" if is_arm else role,
        lambda: device.safe(SAFE_DEADLINE_S),
        SAFE_DEADLINE_S + DEADLINE_SLACK_S,
        arm=is_arm,
    )


def _record_end(recorder: Recorder, engine: Engine, outcome: RunOutcome) -> None:
    with suppress(BaseException):  # what the run came to must not be lost with the record's end
        for event in engine.events:
            recorder.event(*event)
        for action in outcome.safing:
            recorder.event(
                outcome.end_s,
                "safing_action",
                {"name": action.name, "sent": action.sent, "error": action.error,
                 "duration_s": action.duration_s},
            )  # fmt: skip
        recorder.event(outcome.end_s, "end", {"status": outcome.status.value, "why": outcome.why})
    engine.events.clear()
