"""Ends the run where a device reports a fault or raises, and names the device."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from stepload.engine.interfaces import RigDevices, by_role
from stepload.engine.tick import Engine
from stepload.errors import in_words
from stepload.record.outcome import Cause
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
