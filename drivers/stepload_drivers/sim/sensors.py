"""The sensors of a simulated world."""

from __future__ import annotations

import logging
from typing import Generic, TypeVar

from stepload.errors import DeviceError
from stepload.rig.device import DisplacementSensor, ForceSensor, Health, Identity
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import DisplacementSample, ForceSample
from stepload_drivers.sim.channels import Channel
from stepload_drivers.sim.stream import NO_HEALTH, Host, Place, Stream

SampleT = TypeVar("SampleT")
_log = logging.getLogger(__name__)


class Listener(Generic[SampleT]):
    """The host's end of one device of a world: everything that is common to all quantities."""

    def __init__(self, name: str, identity: Identity, place: Place) -> None:
        self._name = name
        self._identity = identity
        self._place = place
        self._stream: Stream | None = None

    def _channel(self, host: Host) -> Channel | None:
        """The device's channel, None where the rig has none."""
        raise NotImplementedError

    def _begin(self, host: Host, channel: Channel) -> None:
        """Take over what the device must know of its world."""
        raise NotImplementedError

    def open(self, timeout_s: float) -> Identity:
        if self._stream is None:
            try:
                host = self._place.host()
                if (channel := self._channel(host)) is None:
                    message = f"{self._name}: the simulated rig has no such sensor"
                    raise DeviceError(message, code=FaultCode.NOT_CONNECTED)
                self._stream = Stream(self._name, host, channel, timeout_s)
                self._begin(host, channel)
                _log.info("%s: open", self._name)
            except BaseException:
                self._place.give_back()
                raise
        return self._identity

    def drain(self) -> list[SampleT]:
        return self._stream.drain() if self._stream else []

    def health(self) -> Health:
        return self._stream.health() if self._stream else NO_HEALTH

    def fault(self) -> Fault | None:
        return self._stream.fault() if self._stream else None

    def close(self) -> None:
        if self._stream:
            if fault := self.fault():
                _log.warning("%s: fault %s: %s", self._name, fault.code.value, fault.message)
            _log.info("%s: closed, %s", self._name, self.health())
            self._stream.close()
        self._stream = None
        self._place.give_back()


class _Sensor(Listener[SampleT]):
    rate_hz = 0.0

    def _begin(self, host: Host, channel: Channel) -> None:
        self.rate_hz = 1.0 / channel.period_s

    def safe(self, timeout_s: float) -> None:
        """A sensor moves nothing: it is always safe."""


class WorldForceSensor(_Sensor[ForceSample], ForceSensor):
    """A force sensor that lives in a world; the second one if `second`."""

    def __init__(self, place: Place, *, second: bool = False) -> None:
        name = "sim second force sensor" if second else "sim force sensor"
        serial = "SIM-FORCE-2" if second else "SIM-FORCE"
        super().__init__(
            name, Identity("sim", "simulated force sensor", serial, "1", "none"), place
        )
        self._second = second

    def _channel(self, host: Host) -> Channel | None:
        return host.world.second_force if self._second else host.world.force


class WorldDisplacementSensor(_Sensor[DisplacementSample], DisplacementSensor):
    """The gauge across the contact of a world."""

    def __init__(self, place: Place) -> None:
        identity = Identity("sim", "simulated gauge", "SIM-GAUGE", "1", "none")
        super().__init__("sim gauge", identity, place)

    def _channel(self, host: Host) -> Channel | None:
        return host.world.gauge
