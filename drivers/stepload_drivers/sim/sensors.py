"""The host's end of a world: its streams with their first fault, and the sensors."""

from __future__ import annotations

import logging
import math
from typing import Any, Generic, Protocol, TypeVar

from stepload.errors import DeviceError
from stepload.rig.clock import Clock
from stepload.rig.device import DisplacementSensor, ForceSensor, Health, Identity
from stepload.rig.faults import Fault, FaultCode
from stepload.rig.samples import DisplacementSample, ForceSample, Status
from stepload_drivers.sim.channels import Channel
from stepload_drivers.sim.simulation import World

SampleT = TypeVar("SampleT")
_log = logging.getLogger(__name__)
_EARLY_S = 1e-9
_STALE_S = 0.05
_STALE_PERIODS = 5.0
_OPEN_WAIT_S = 0.001
_STOPPED, _TOO_LARGE = int(Status.STOPPED), int(Status.OVERRANGE | Status.SATURATED)


class Host(Protocol):
    """The program's side of a world: its clock, and how the world keeps up with it."""

    @property
    def world(self) -> World: ...

    @property
    def clock(self) -> Clock: ...

    @property
    def origin_s(self) -> float:
        """Host time of world time 0."""
        ...

    def catch_up(self) -> float:
        """Let the world go on to the host's present time, and return that."""
        ...


class Place(Protocol):
    """Where a device finds its host."""

    def host(self) -> Host:
        """The host of the world, which runs from now on at the latest.

        Raises:
            DeviceError: the device does not fit into the world.
        """
        ...

    def give_back(self) -> None:
        """The device needs the world no longer. Idempotent."""
        ...


class Stream:
    """Samples of one channel, taken off the wire.

    Opening waits for the first sample.

    Raises:
        DeviceError: no sample within `timeout_s`.
    """

    def __init__(self, name: str, host: Host, channel: Channel, timeout_s: float) -> None:
        self._name = name
        self._host = host
        self._channel = channel
        self._fault: Fault | None = None
        self._received = self._lost = 0
        self._newest_s = math.nan
        self._longest_s = 0.0
        self._stale_s = max(_STALE_S, _STALE_PERIODS * channel.period_s)
        self._sequence = channel.sequence
        channel.listen()
        self._opened_s = now_s = host.catch_up()
        end_s = now_s + timeout_s
        while not (channel.pending and channel.pending[0][2] <= now_s + _EARLY_S):
            if now_s >= end_s:
                channel.ignore()
                raise DeviceError(
                    f"{name}: no sample within {timeout_s:g} s",
                    code=FaultCode.NOT_CONNECTED,
                    hint="look at the simulated rig's faults",
                )
            host.clock.sleep_until(min(end_s, now_s + _OPEN_WAIT_S))
            now_s = host.catch_up()
        self._first_s: float = channel.pending[0][2]

    def close(self) -> None:
        self._channel.ignore()

    def drain(self) -> list[Any]:
        channel = self._channel
        now_s = self._host.catch_up()
        if channel.raising:
            raise RuntimeError(f"{self._name}: simulated exception in drain")
        pending = channel.pending
        limit_s = now_s + _EARLY_S
        out = []
        while pending and pending[0][2] <= limit_s:
            out.append(pending.popleft())
        if out:
            newest = out[-1]
            gap_s = out[0][2] - self._newest_s
            if gap_s > self._longest_s:
                self._longest_s = gap_s
            self._newest_s = newest[2]
            self._received += len(out)
            if channel.disturbed or newest[3]:
                self._inspect(out)
            self._sequence = newest[0]
        return out

    def _inspect(self, samples: list[Any]) -> None:
        """Count lost samples, and latch faults of the readings; only faults cause either."""
        self._lost += max(0, samples[-1][0] - self._sequence - len(samples))
        for sample in samples:
            status = sample[3]
            if status & _STOPPED:
                self.latch(FaultCode.PROTECTIVE_STOP, "the arm is in protective stop", sample[2])
            elif status & _TOO_LARGE:
                self.latch(FaultCode.OVERLOAD, "a reading is beyond the rated range", sample[2])
            value = sample[4]
            values = value if isinstance(value, tuple) else (value,)
            if not all(map(math.isfinite, values)):
                self.latch(FaultCode.NOT_FINITE, "a reading is not a finite number", sample[2])

    def latch(self, code: FaultCode, message: str, time_s: float) -> None:
        """Keep the first fault."""
        if self._fault is None:
            hint = "this is the simulated rig: look at its faults"
            self._fault = Fault(code, f"{self._name}: {message}", hint, time_s)

    def fault(self) -> Fault | None:
        if self._fault is None:
            now_s = self._host.catch_up()
            since_s = self._newest_s if self._received else self._opened_s
            if now_s - since_s > self._stale_s and not self._waiting(now_s):
                age_s = now_s - since_s
                message = f"no new sample for {age_s:.3g} s, limit {self._stale_s:.3g} s"
                self.latch(FaultCode.STALE, message, now_s)
        return self._fault

    def _waiting(self, now_s: float) -> bool:
        """Whether a fresh sample has arrived that is not drained yet."""
        pending = self._channel.pending
        return any(now_s - self._stale_s <= s[2] <= now_s + _EARLY_S for s in pending)

    def health(self) -> Health:
        """Counts what has arrived, drained or not."""
        now_s = self._host.catch_up()
        waiting = [s for s in self._channel.pending if s[2] <= now_s + _EARLY_S]
        received, lost = self._received + len(waiting), self._lost
        newest_s, longest_s = self._newest_s, self._longest_s
        if waiting:
            lost += max(0, waiting[-1][0] - self._sequence - len(waiting))
            if self._received:
                longest_s = max(longest_s, waiting[0][2] - newest_s)
            newest_s = waiting[-1][2]
        span_s = newest_s - self._first_s
        return Health(
            received=received,
            lost=lost,
            rate_hz=(received - 1) / span_s if received > 1 and span_s > 0.0 else 0.0,
            age_s=now_s - newest_s if received else math.inf,
            longest_gap_s=longest_s,
            errors={},
        )


NO_HEALTH = Health(0, 0, 0.0, math.inf, 0.0, {})
"""Health of a device that has never been opened."""


def not_open(name: str) -> DeviceError:
    """Error of a device that is asked to act before `open` or after `close`."""
    return DeviceError(f"{name}: not open", code=FaultCode.NOT_CONNECTED, hint="open it first")


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
