"""The sensors of a simulated world."""

from __future__ import annotations

from collections.abc import Callable

from stepload.errors import DeviceError
from stepload.rig.device import DisplacementSensor, ForceSensor, Health, Identity
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import DisplacementSample, ForceSample
from stepload_drivers.sim.stream import NO_HEALTH, Host, Stream

_NOT_THERE = "the simulated rig has no such sensor"


class WorldForceSensor(ForceSensor):
    """A force sensor that lives in a world; the second one if `second`."""

    def __init__(self, find_host: Callable[[], Host], *, second: bool = False) -> None:
        self._find_host = find_host
        self._second = second
        self._name = "sim second force sensor" if second else "sim force sensor"
        self._stream: Stream | None = None
        self.rate_hz = 0.0

    def open(self, timeout_s: float) -> Identity:
        if self._stream is None:
            host = self._find_host()
            channel = host.world.second_force if self._second else host.world.force
            if channel is None:
                raise DeviceError(f"{self._name}: {_NOT_THERE}", code=FaultCode.NOT_CONNECTED)
            self._stream = Stream(self._name, host, channel, timeout_s)
            self.rate_hz = 1.0 / channel.period_s
        serial = "SIM-FORCE-2" if self._second else "SIM-FORCE"
        return Identity("sim", "simulated force sensor", serial, "1", "none")

    def drain(self) -> list[ForceSample]:
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


class WorldDisplacementSensor(DisplacementSensor):
    """The gauge across the contact of a world."""

    def __init__(self, find_host: Callable[[], Host]) -> None:
        self._find_host = find_host
        self._stream: Stream | None = None
        self.rate_hz = 0.0

    def open(self, timeout_s: float) -> Identity:
        if self._stream is None:
            host = self._find_host()
            channel = host.world.gauge
            if channel is None:
                raise DeviceError(f"sim gauge: {_NOT_THERE}", code=FaultCode.NOT_CONNECTED)
            self._stream = Stream("sim gauge", host, channel, timeout_s)
            self.rate_hz = 1.0 / channel.period_s
        return Identity("sim", "simulated gauge", "SIM-GAUGE", "1", "none")

    def drain(self) -> list[DisplacementSample]:
        return self._stream.drain() if self._stream else []

    def health(self) -> Health:
        return self._stream.health() if self._stream else NO_HEALTH

    def fault(self) -> Fault | None:
        return self._stream.fault() if self._stream else None

    def safe(self, timeout_s: float) -> None:
        """A gauge moves nothing: it is always safe."""

    def close(self) -> None:
        if self._stream:
            self._stream.close()
        self._stream = None
