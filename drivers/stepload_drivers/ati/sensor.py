"""ATI force-torque sensors (Mini45, Mini58, Mini85 …) with the NETCANOEM CAN interface."""

from __future__ import annotations

import math
import time
import zlib
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Setting, Verbatim, number
from stepload.declaration.sections import SECTION, key
from stepload.errors import DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.ati import codec
from stepload_drivers.ati.codec import DEFAULT_BASE, Calibration, Op, frame_id
from stepload_drivers.ati.link import Dialogue
from stepload_drivers.ati.poller import Answer, Poller
from stepload_drivers.canbus import CanLink, Channel, Interface
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import STALE_S, Deadline, MaxAge, Streamed, require_serial_number

FROZEN_S = 0.05
PAIR_LIMIT_S = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class AtiCanOptions:
    """Options of a NETCANOEM board."""

    interface: Interface = "socketcan"
    channel: Channel
    bitrate: Annotated[
        int, number(10_000, 1_000_000), key("bit/s; the device's default is 250000")
    ] = 250_000
    base: Annotated[int, number(0, 0x7F), key("base id of the device")] = DEFAULT_BASE
    rate_hz: Annotated[float, Setting("Hz", 10.0, 1000.0), key("polling rate")] = 500.0
    calibration: Annotated[int, number(0, 15), key("calibration slot")] = 0
    units: Annotated[Verbatim, key('only for firmware before 3.7, e.g. "N N-m"')] = ""
    serial_number: Annotated[Verbatim, key("refuse a device with another serial number")] = ""
    max_age_s: MaxAge = STALE_S


class AtiCan(Streamed[ForceSample], ForceSensor):
    """NETCANOEM, polled. A sample's sequence is the number of its question.

    The device has no clock (`device_time_s` is NaN) and no bias: tare in software.
    """

    DRIVER = "ati_can"
    ADDRESS = ("channel", "base")
    OPTIONS: ClassVar[type] = AtiCanOptions

    def __init__(self, **options: Any) -> None:
        told = AtiCanOptions(**options)
        self._interface, self._channel = told.interface, told.channel
        self._bitrate, self._base = told.bitrate, told.base
        self._slot, self._units = told.calibration, told.units
        self._serial_number = told.serial_number
        self._max_age_s = told.max_age_s
        self.rate_hz = told.rate_hz
        self._name = f"NETCANOEM on {self._channel}"
        self._link: CanLink | None = None

    def _connect(self, deadline: Deadline) -> Identity:
        bus = self._link = CanLink(
            self._interface, self._channel, self._bitrate, deadline.left_s(self._channel)
        )
        bus.discard_input()
        dialogue = Dialogue(bus, self._base, deadline)
        firmware = dialogue.firmware()
        serial_number = dialogue.serial_number()
        require_serial_number(self._name, serial_number, self._serial_number)
        dialogue.select_calibration(self._slot)
        self._calibration: Calibration = dialogue.calibration(firmware, self._units)
        answer = dialogue.ask(Op.GAUGES, b"", (Op.GAUGES, Op.GAUGES_2), (8, 6))
        status, _ = codec.gauges(answer[Op.GAUGES], answer[Op.GAUGES_2])
        if status & codec.CRITICAL:
            raise DeviceError(
                f"{self._name} reports: {codec.status_text(status)} (status {status:#06x})",
                code=FaultCode.DEVICE_REPORTS,
                hint="see section 7.3 of the device's manual",
            )
        revision = zlib.crc32(repr(self._calibration.rows).encode())
        return Identity(
            self.DRIVER,
            "NETCANOEM",
            serial_number,
            "{}.{}.{}".format(*firmware),
            f"slot {self._slot}, matrix {revision:08x}",
        )

    def _new_stream(self) -> Stream[ForceSample]:
        self._period_s = 1.0 / self.rate_hz
        self._poller = Poller(self._base, self._period_s, PAIR_LIMIT_S)
        self._last_question = 0
        return self._empty_stream(
            max(self._max_age_s, 10.0 * self._period_s), max(FROZEN_S, 25.0 * self._period_s)
        )

    def _read(self, stream: Stream[ForceSample]) -> None:
        assert self._link is not None
        poller = self._poller
        before_s = time.monotonic()
        frames = self._link.receive(poller.pause_s(before_s))
        now_s = time.monotonic()
        samples = [
            self._sample(answer, now_s, stream)
            for frame in frames
            if (answer := poller.feed(frame, now_s)) is not None
        ]
        self._count_errors(self._link, stream)
        stream.put(samples, now_s)
        if poller.due(before_s):
            self._link.send(frame_id(self._base, Op.GAUGES), b"")

    def _count_errors(self, bus: CanLink, stream: Stream[ForceSample]) -> None:
        poller = self._poller
        stream.total("damaged", bus.damaged, corrupt=True)
        stream.total("timeouts", poller.timeouts)
        stream.total("orphans", poller.orphans, corrupt=True)
        stream.total("late", poller.late)
        stream.total("resyncs", poller.resyncs)

    def _sample(self, answer: Answer, time_s: float, stream: Stream[ForceSample]) -> ForceSample:
        if self._last_question:
            stream.lose(answer.question - self._last_question - 1)
        self._last_question = answer.question
        word, counts = codec.gauges(answer.first, answer.second)
        status = 0
        if codec.saturated(counts):
            status |= Status.SATURATED
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name}: a gauge is saturated (counts {counts})",
                "overload or a broken sensor cable: unload, then check the cable",
            )
        if word & codec.CRITICAL:
            status |= Status.DEVICE_FAULT
            stream.latch(
                FaultCode.DEVICE_REPORTS,
                f"{self._name} reports: {codec.status_text(word)} (status {word:#06x})",
                "see section 7.3 of the device's manual",
            )
        elif word:
            stream.count("status_bits")
        wrench = self._calibration.wrench(counts)
        return ForceSample(answer.question, math.nan, time_s, int(status), wrench, math.nan)
