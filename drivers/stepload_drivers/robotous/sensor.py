"""ROBOTOUS RFT force-torque sensors on CAN and on UART."""

from __future__ import annotations

import logging
import math
import time
from abc import abstractmethod
from collections.abc import Iterable
from typing import Annotated, Any, ClassVar, NamedTuple

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Baud, Setting, number
from stepload.declaration.sections import SECTION, key
from stepload.errors import BadInputError, DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.arrival import ArrivalCounter
from stepload_drivers.canbus import CanLink, Channel, Interface
from stepload_drivers.framing import CanPairer
from stepload_drivers.robotous import codec
from stepload_drivers.robotous.codec import (
    Command,
    Model,
    UartDecoder,
    model_named,
    uart_frame,
)
from stepload_drivers.serialport import Port, SerialPort
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import (
    REPLY_S,
    STALE_S,
    Deadline,
    MaxAge,
    OtherSensor,
    Streamed,
    ask_twice,
    require_serial_number,
)

CAN_BITRATE = 1_000_000
PAIR_LIMIT_S = 1e-3
STOP_S = 0.02
FROZEN_S = 0.05
_CanId = Annotated[int, number(1, 255)]

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class RobotousOptions:
    """Options of every RFT sensor."""

    rate_hz: Annotated[float, Setting("Hz", 10.0, 1000.0), key("sample rate")] = 1000.0
    filter_hz: Annotated[
        float, Setting("Hz", 0.0, 1000.0), key("low-pass cut-off, 0 Hz for none")
    ] = 0.0
    serial_number: OtherSensor = ""
    max_age_s: MaxAge = STALE_S


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class UartOptions(RobotousOptions):
    """Options of an RFT sensor on a serial port."""

    port: Port
    baud: Annotated[Baud, key("the sensor's bit rate")] = 921600


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class CanOptions(RobotousOptions):
    """Options of an RFT sensor on CAN."""

    interface: Interface = "socketcan"
    channel: Channel
    receiver_id: Annotated[_CanId, key("id the sensor listens to")] = 0x64
    first_id: Annotated[_CanId, key("id of D1..D8")] = 1
    second_id: Annotated[_CanId, key("id of D9..D16")] = 2


class Errors(NamedTuple):
    """Counters of a link since it was opened."""

    damaged: int
    skipped: int
    orphans: int


class UartLink:
    """8N1, 19-byte frames."""

    def __init__(self, port: SerialPort) -> None:
        self._port = port
        self._decoder = UartDecoder()

    def send(self, command: bytes) -> None:
        self._port.write(uart_frame(command))

    def receive(self) -> list[bytes]:
        return self._decoder.feed(self._port.read())

    def discard_input(self) -> None:
        self._port.discard_input()
        self._decoder = UartDecoder()

    def errors(self) -> Errors:
        return Errors(self._decoder.damaged, self._decoder.skipped, 0)

    def close(self) -> None:
        self._port.close()


class CanPairLink:
    """Commands to `receiver_id`; payloads as frames with `first_id` and `second_id`."""

    def __init__(self, bus: CanLink, receiver_id: int, first_id: int, second_id: int) -> None:
        self._bus = bus
        self._receiver_id = receiver_id
        self._ids = (first_id, second_id)
        self._pairer = CanPairer(self._ids, PAIR_LIMIT_S)

    def send(self, command: bytes) -> None:
        self._bus.send(self._receiver_id, command)

    def receive(self) -> list[bytes]:
        payloads = (self._pairer.feed(frame) for frame in self._bus.receive())
        return [payload for payload in payloads if payload is not None]

    def discard_input(self) -> None:
        self._bus.discard_input()
        self._pairer = CanPairer(self._ids, PAIR_LIMIT_S)

    def errors(self) -> Errors:
        return Errors(self._bus.damaged, 0, self._pairer.orphans)

    def close(self) -> None:
        self._bus.close()


Link = UartLink | CanPairLink
"""Commands out, 16-byte payloads in; `receive` waits at most 0.1 s for the first bytes."""


def _one_of(name: str, value: float, allowed: Iterable[float]) -> float:
    if value not in allowed:
        listed = ", ".join(f"{v:g}" for v in sorted(allowed))
        raise BadInputError(f"{name} {value:g} Hz: an RFT sensor has {listed} Hz")
    return value


class _Robotous(Streamed[ForceSample], ForceSensor):
    """What CAN and UART share: dialogue, stream, bias.

    Neither a counter nor a clock is in the data: `device_time_s` is NaN, losses are found from
    arrival times, and samples that arrive together are spread back at the sample period.
    """

    DRIVER: ClassVar[str]
    _link: Link | None = None
    _model: Model

    def __init__(self, told: RobotousOptions) -> None:
        self.rate_hz = _one_of("rate", told.rate_hz, codec.RATE_CODES)
        self._cutoff_hz = _one_of("filter", told.filter_hz, (0.0, *codec.CUTOFFS_HZ))
        self._serial_number = told.serial_number
        self._max_age_s = told.max_age_s
        self._name = f"RFT sensor ({self.DRIVER})"

    @abstractmethod
    def _open_link(self, deadline: Deadline) -> Link: ...

    def _connect(self, deadline: Deadline) -> Identity:
        self._link = self._open_link(deadline)
        self._link.send(codec.command(Command.STOP))
        time.sleep(STOP_S)
        self._link.discard_input()
        name = codec.text(self._ask(deadline, Command.MODEL))
        serial_number = codec.text(self._ask(deadline, Command.SERIAL))
        firmware = codec.text(self._ask(deadline, Command.FIRMWARE))
        require_serial_number(self._name, serial_number, self._serial_number)
        model = model_named(name)
        if model is None:
            raise DeviceError(
                f"{self._name} calls itself {name!r}, whose dividers are not known",
                code=FaultCode.UNSUPPORTED,
                hint="a guessed divider would scale every force; see docs/devices/robotous.md",
            )
        self._model = model
        self._configure(deadline)
        self._link.send(codec.command(Command.START))
        calibration = f"dividers {model.force_divider:g}/N {model.torque_divider:g}/Nm"
        return Identity(self.DRIVER, name, serial_number, firmware, calibration)

    def _configure(self, deadline: Deadline) -> None:
        cutoffs = (0.0, *codec.CUTOFFS_HZ)
        number = cutoffs.index(self._cutoff_hz)
        wanted = (1 if number else 0, number)
        self._set(deadline, Command.SET_FILTER, *wanted)
        reply = self._ask(deadline, Command.GET_FILTER)
        if reply[1] != wanted[0] or (number and reply[2] != number):
            self._not_taken("filter", f"{wanted}", f"({reply[1]}, {reply[2]})")
        self._set(deadline, Command.SET_RATE, codec.RATE_CODES[self.rate_hz])
        got = codec.RATE_OF_CODE.get(self._ask(deadline, Command.GET_RATE)[1])
        if got != self.rate_hz:
            self._not_taken("rate", f"{self.rate_hz:g} Hz", f"{got} Hz")

    def _set(self, deadline: Deadline, name: Command, *parameters: int) -> None:
        reply = self._ask(deadline, name, *parameters)
        if reply[1] != 1:
            reason = codec.ERRORS.get(reply[2], f"error {reply[2]}")
            raise DeviceError(
                f"{self._name} refused {name.name} {parameters}: {reason}",
                code=FaultCode.REFUSED_COMMAND,
                hint="check model and, for rates above 333 Hz on a UART, its bit rate",
            )

    def _not_taken(self, what: str, wanted: str, got: str) -> None:
        raise DeviceError(
            f"{self._name}: {what} reads back as {got} after setting {wanted}",
            code=FaultCode.REFUSED_COMMAND,
            hint="switch the sensor off and on and try again",
        )

    def _ask(self, deadline: Deadline, name: Command, *parameters: int) -> bytes:
        """The reply to a command; sent twice when the first goes unanswered."""
        assert self._link is not None
        link, request = self._link, " ".join(map(str, (name.name, *parameters)))
        return ask_twice(
            _log,
            self._name,
            request,
            deadline,
            lambda wait: self._reply(link, wait, name, *parameters),
            "check power, cable, bit rate and (CAN) ids and termination",
        )

    @staticmethod
    def _reply(link: Link, wait: Deadline, name: Command, *parameters: int) -> bytes | None:
        link.send(codec.command(name, *parameters))
        while wait.running:
            for payload in link.receive():
                if payload[0] == name:
                    return payload
        return None

    def _new_stream(self) -> Stream[ForceSample]:
        self._period_s = 1.0 / self.rate_hz
        self._arrivals = ArrivalCounter(self._period_s)
        self._sequence = 0
        slowest_s = 10.0 * self._period_s
        smooth_s = 1.0 / self._cutoff_hz if self._cutoff_hz else 0.0
        return self._empty_stream(max(self._max_age_s, slowest_s), max(FROZEN_S, smooth_s))

    def _read(self, stream: Stream[ForceSample]) -> None:
        assert self._link is not None
        payloads = [p for p in self._link.receive() if p[0] in codec.SAMPLE_IDS]
        arrival_s = time.monotonic()
        errors = self._link.errors()
        stream.total("damaged", errors.damaged, corrupt=True)
        stream.total("skipped_bytes", errors.skipped)
        if torn := stream.total("orphans", errors.orphans, corrupt=True):
            self._arrivals.skip(torn)
            self._sequence += torn
            stream.lose(torn)
        if not payloads:
            return
        lost, times = self._arrivals.stamped(len(payloads), arrival_s)
        stream.lose(lost)
        self._sequence += max(0, lost)
        stream.put(
            [self._sample(p, t, stream) for p, t in zip(payloads, times, strict=True)], arrival_s
        )

    def _sample(self, payload: bytes, time_s: float, stream: Stream[ForceSample]) -> ForceSample:
        self._sequence += 1
        status = 0
        if bits := codec.overload(payload):
            status = int(Status.OVERRANGE)
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name}: above 120 % of the rated load on {codec.overloaded_axes(bits)} "
                f"(rated Fz {self._model.rated_z_n:g} N)",
                "unload; check the sensor's zero before going on, it may have been damaged",
            )
        wrench = codec.wrench(payload, self._model)
        return ForceSample(self._sequence, math.nan, time_s, status, wrench, math.nan)

    def bias(self, timeout_s: float) -> bool:
        """Make the present value the device's zero (command 11); it sends no reply."""
        if self._link is None:
            return False
        self._link.send(codec.command(Command.BIAS, 1))
        _log.info("%s: zeroed by its own command", self._name)
        return True

    def _stop(self, link: Link) -> None:
        """Stop the data and wait for silence: what is closed at once may not have been sent."""
        link.send(codec.command(Command.STOP))
        wait = Deadline(REPLY_S)
        while wait.running and link.receive():
            pass


class RobotousUart(_Robotous):
    """RFT sensor on a serial port (8N1, 19-byte frames)."""

    DRIVER = "robotous_uart"
    OPTIONS: ClassVar[type] = UartOptions

    def __init__(self, **options: Any) -> None:
        told = UartOptions(**options)
        super().__init__(told)
        self._port, self._baud = told.port, told.baud
        rate, baud = self.rate_hz, self._baud
        slowest = 921600 if rate > 500 else 230400 if rate > 333 else 57600
        if baud < slowest:
            raise BadInputError(
                f"rate {rate:g} Hz needs a bit rate of at least {slowest} Bd, not {baud} Bd",
                hint="set the sensor to a higher bit rate, or ask for a lower rate",
            )

    def _open_link(self, deadline: Deadline) -> Link:
        return UartLink(SerialPort(self._port, self._baud, refuse_latency=True))


class RobotousCan(_Robotous):
    """RFT sensor on CAN (1 Mbit/s, two frames a sample)."""

    DRIVER = "robotous_can"
    ADDRESS = ("channel", "first_id")
    OPTIONS: ClassVar[type] = CanOptions

    def __init__(self, **options: Any) -> None:
        told = CanOptions(**options)
        super().__init__(told)
        self._interface, self._channel = told.interface, told.channel
        self._ids = (told.receiver_id, told.first_id, told.second_id)
        if len(set(self._ids)) != 3:
            raise BadInputError(f"CAN ids {self._ids} must all be different")

    def _open_link(self, deadline: Deadline) -> Link:
        bus = CanLink(self._interface, self._channel, CAN_BITRATE, deadline.left_s(self._channel))
        return CanPairLink(bus, *self._ids)
