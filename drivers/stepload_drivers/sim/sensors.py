"""The sensors of a simulated world."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from stepload.errors import DeviceError
from stepload.rig.device import DisplacementSensor, ForceSensor, Health, Identity
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import DisplacementSample, ForceSample
from stepload_drivers.sim.channels import Channel
from stepload_drivers.sim.stream import NO_HEALTH, Host, Stream

SampleT = TypeVar("SampleT")


class _Listener(Generic[SampleT]):
    """The host's end of one sensor of a world: everything that is common to all quantities."""

    def __init__(self, name: str, find_host: Callable[[], Host]) -> None:
        self._name = name
        self._find_host = find_host
        self._stream: Stream | None = None
        self.rate_hz = 0.0

    def _listen(self, host: Host, channel: Channel | None, timeout_s: float) -> None:
        if channel is None:
            message = f"{self._name}: the simulated rig has no such sensor"
            raise DeviceError(message, code=FaultCode.NOT_CONNECTED)
        self._stream = Stream(self._name, host, channel, timeout_s)
        self.rate_hz = 1.0 / channel.period_s

    def drain(self) -> list[SampleT]:
        return self._stream.drain() if self._stream else []

    def health(self) -> Health:
        return self._stream.health() if self._stream else NO_HEALTH

    def fault(self) -> Fault | None:
        return self._stream.fault() if self._stream else None

    def safe(self, timeout_s: float) -> None:
        """A sensor moves nothing: it is always safe."""

    def close(self) -> None:
        if self._stream:
            self._stream.close()
        self._stream = None


class WorldForceSensor(_Listener[ForceSample], ForceSensor):
    """A force sensor that lives in a world; the second one if `second`."""

    def __init__(self, find_host: Callable[[], Host], *, second: bool = False) -> None:
        super().__init__("sim second force sensor" if second else "sim force sensor", find_host)
        self._second = second

    def open(self, timeout_s: float) -> Identity:
        if self._stream is None:
            host = self._find_host()
            world = host.world
            self._listen(host, world.second_force if self._second else world.force, timeout_s)
        serial = "SIM-FORCE-2" if self._second else "SIM-FORCE"
        return Identity("sim", "simulated force sensor", serial, "1", "none")


class WorldDisplacementSensor(_Listener[DisplacementSample], DisplacementSensor):
    """The gauge across the contact of a world."""

    def __init__(self, find_host: Callable[[], Host]) -> None:
        super().__init__("sim gauge", find_host)

    def open(self, timeout_s: float) -> Identity:
        if self._stream is None:
            host = self._find_host()
            self._listen(host, host.world.gauge, timeout_s)
        return Identity("sim", "simulated gauge", "SIM-GAUGE", "1", "none")
