"""The cadence: read the devices, tick, command, record, until the run is over.

Absolute deadlines on one grid, so that a late tick does not shift the ones after it. The same loop
runs in virtual time, where sleeping makes the simulated world go on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from stepload.engine.interfaces import RecordSink, RigDevices, by_role
from stepload.engine.notices import EventLog
from stepload.engine.operator import StopLevel
from stepload.engine.tick import Engine
from stepload.errors import in_words
from stepload.record.outcome import Cause, Lateness
from stepload.rig.device import Device, Identity


class DeviceFaults:
    """Turns faults of a run's devices into text, and ends the run because of them.

    `errors` keeps the first error that each device raised.
    """

    def __init__(
        self, engine: Engine, rig: RigDevices, identities: Mapping[str, Identity], errors: list[str]
    ) -> None:
        self.errors = errors
        self._engine, self._rig, self._identities = engine, rig, identities
        self._raised: set[str] = set()

    def raised(self, role: str, now_s: float, error: Exception) -> None:
        """End the run because what has this role raised an error.

        A bug of a driver is no reason to leave the force on.
        """
        message = f"{self._name(role)}: {in_words(error)}"
        if role not in self._raised:
            self._raised.add(role)
            self.errors.append(message)
        self._engine.trip(Cause("device", 1.0, 0.0, "", 0.0, now_s, message))

    def poll(self, now_s: float) -> None:
        """End the run where a device has latched a fault."""
        for message in self._latched():
            self._engine.trip(Cause("device", 1.0, 0.0, "", 0.0, now_s, message))

    def explain(self) -> None:
        """Add to a rule's cause what the devices report themselves: by now they may know why."""
        engine = self._engine
        cause = engine.cause
        if cause is None or not cause.rule.startswith("R"):
            return
        for message in self._latched():
            engine.cause = cause = cause._replace(message=f"{cause.message}; {message}")
            engine.events.append((self._rig.clock.now_s(), "fault", {"message": message}))

    def _latched(self) -> Iterator[str]:
        for role, device in by_role(self._rig):
            if fault := _fault_of(device):
                yield f"{self._name(role)}: {fault}"

    def _name(self, role: str) -> str:
        """The role, with driver and serial number where the device's identity is known."""
        identity = self._identities.get(role.replace(" ", "_"))
        if identity is None:
            return role
        return f"{role} (driver {identity.driver}, serial number {identity.serial_number})"


def _fault_of(device: Device) -> str:
    """The latched fault of a device in words; "" without one."""
    try:
        fault = device.fault()
    except Exception as error:
        return in_words(error)
    if fault is None:
        return ""
    return f"{fault.code.value}: {fault.message}" + (f" ({fault.hint})" if fault.hint else "")


FAULT_POLL_TICKS = 16
PROGRESS_S = 0.1
_ARM_ONLY = int(StopLevel.ARM_ONLY)

Samples = list[Any]
NOTHING: Samples = []
NO_SHIFT = (0.0, 0.0)


class Cadence:
    """Ticks an engine on open devices.

    `ticks` rises as long as the loop turns; `busy` names what it waits for.
    """

    def __init__(
        self,
        engine: Engine,
        rig: RigDevices,
        record: RecordSink,
        faults: DeviceFaults,
        on_progress: Callable[[Engine], None] | None,
        log: EventLog,
    ) -> None:
        self.ticks = 0
        self.busy = ""
        self._engine, self._rig, self._record = engine, rig, record
        self._faults = faults
        self._on_progress = on_progress
        self._log = log
        self._overruns = 0
        self._worst_s = self._total_s = 0.0

    @property
    def lateness(self) -> Lateness:
        """How late the ticks began."""
        mean_s = self._total_s / max(self.ticks, 1)
        return Lateness(self.ticks, self._overruns, self._worst_s, mean_s)

    def run(self) -> None:
        """Tick until the engine is done, or the operator wants no more than the arm's stop.

        Raises:
            Exception: what `Arm.command` raises.
        """
        rig, engine = self._rig, self._engine
        now, sleep_until = rig.clock.now_s, rig.clock.sleep_until
        tick, command, operator = engine.tick, rig.arm.command, engine.operator
        read, keep, period_s = self._read, self._keep, rig.arm.period_s
        progress_s = deadline_s = now()
        done = False
        while not done:
            begin_s = now()
            engine.late_s = late_s = begin_s - deadline_s
            self.ticks += 1
            if late_s:
                self._count(late_s, period_s)
            force, arm, displacement, second = read(begin_s)
            now_s = now()  # taken after the drain: no valid sample is later than its tick
            target_m, done = tick(now_s, force, arm, displacement, second)
            if target_m == target_m:
                self.busy = "the arm's command"
                shift_m = engine.shift_m
                if shift_m == NO_SHIFT:
                    command(target_m)
                else:
                    command(target_m, shift_m)
            else:
                self._ask_held(now_s)
            keep(now_s, force, arm, displacement, second)
            if not self.ticks % FAULT_POLL_TICKS and engine.cause is None:
                self._poll(now_s)
            if now_s >= progress_s:
                progress_s = now_s + PROGRESS_S
                self._show()
            if operator.stop_level >= _ARM_ONLY and not engine.safe_reached:
                return
            self.busy = "the clock"
            deadline_s += period_s
            if late_s > period_s:  # leave the missed ticks out instead of hurrying after them
                deadline_s += period_s * (late_s // period_s)
            sleep_until(deadline_s)

    def _count(self, late_s: float, period_s: float) -> None:
        self._total_s += late_s
        if late_s > period_s:
            self._overruns += 1
        if late_s > self._worst_s:
            self._worst_s = late_s

    def _read(self, now_s: float) -> tuple[Samples, Samples, Samples, Samples]:
        """New samples of the force sensor, the arm, the displacement sensor, the second sensor.

        A driver that raises ends the run and gives none; the other devices are read all the same.
        """
        rig = self._rig
        force = self._drained("force sensor", rig.force, now_s)
        arm = self._drained("arm", rig.arm, now_s)
        second = self._drained("second force sensor", rig.second_force, now_s)
        displacement = self._drained("displacement sensor", rig.displacement, now_s)
        return force, arm, displacement, second

    def _drained(self, role: str, device: Any, now_s: float) -> Samples:
        if device is None:
            return NOTHING
        self.busy = role
        try:
            samples: Samples = device.drain()
        except Exception as error:
            self._faults.raised(role, now_s, error)
            return NOTHING
        return samples

    def _ask_held(self, now_s: float) -> None:
        """Before the first command: ask the arm where its controller holds it."""
        self.busy = "arm"
        try:
            self._engine.course.held_m = held_m = self._rig.arm.held_m()
            if held_m != held_m:
                raise RuntimeError("it does not tell where its controller holds it")
        except Exception as error:
            self._faults.raised(self.busy, now_s, error)

    def _keep(
        self, now_s: float, force: Samples, arm: Samples, displacement: Samples, second: Samples
    ) -> None:
        """Record what was read, the tick and its events; a record that fails ends the run."""
        record, engine = self._record, self._engine
        self.busy = "recording"
        try:
            for sample in force:
                record.force(sample)
            for sample in arm:
                record.arm(sample)
            for sample in second:
                record.second_force(sample)
            for sample in displacement:
                record.displacement(sample)
            if engine.row is not None:
                record.tick(engine.row)
            if engine.events:
                for event in engine.events:
                    record.event(*event)
                    self._log.add(*event)
                engine.events.clear()
        except Exception as error:  # the arm comes before the record
            self._faults.raised("recorder", now_s, error)

    def _poll(self, now_s: float) -> None:
        """Latched faults of devices, and a record that cannot be kept any more."""
        self._faults.poll(now_s)
        if problem := self._record.problem():
            message = f"recording stopped: {problem}"
            self._engine.trip(Cause("recorder", 1.0, 0.0, "", 0.0, now_s, message))

    def _show(self) -> None:
        if self._on_progress is None:
            return
        try:
            self._on_progress(self._engine)
        except Exception as error:  # a broken terminal must not disturb the run
            self._on_progress = None
            self._faults.errors.append(f"progress display: {in_words(error)}")
