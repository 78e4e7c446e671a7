"""ATI force-torque sensors (Mini45, Mini58, Mini85 …) with the NETCANOEM CAN interface."""

from __future__ import annotations

import logging
import math
import struct
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
from stepload_drivers.ati.codec import (
    AXES,
    DEFAULT_BASE,
    FORCE_UNITS_N,
    OLD_COUNTS,
    TORQUE_UNITS_NM,
    UNITS_FIRMWARE,
    Calibration,
    Op,
    frame_id,
    matrix_row,
)
from stepload_drivers.ati.poller import Answer, Poller
from stepload_drivers.canbus import CanLink, Channel, Interface
from stepload_drivers.stream import Stream
from stepload_drivers.streamed import (
    STALE_S,
    Deadline,
    MaxAge,
    OtherSensor,
    Streamed,
    ask_twice,
    require_serial_number,
)

FROZEN_S = 0.05
PAIR_LIMIT_S = 1e-3


_log = logging.getLogger(__name__)
MATRIX_OPS = (Op.MATRIX, Op.MATRIX_2, Op.MATRIX_3)


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
    serial_number: OtherSensor = ""
    max_age_s: MaxAge = STALE_S


class AtiCan(Streamed[ForceSample], ForceSensor):
    """NETCANOEM, polled. A sample's sequence is the number of its question.

    The device has no clock (`device_time_s` is NaN) and no bias: tare in software.
    """

    DRIVER = "ati_can"
    ADDRESS = ("channel", "base")
    OPTIONS: ClassVar[type] = AtiCanOptions

    def __init__(self, **options: Any) -> None:
        self._options = AtiCanOptions(**options)
        self._base = self._options.base
        self.rate_hz = self._options.rate_hz
        self._name = f"NETCANOEM on {self._options.channel}"
        self._link: CanLink | None = None

    def _connect(self, deadline: Deadline) -> Identity:
        told = self._options
        bus = self._link = CanLink(
            told.interface, told.channel, told.bitrate, deadline.left_s(told.channel)
        )
        bus.discard_input()
        dialogue = Dialogue(bus, self._base, deadline)
        firmware = dialogue.firmware()
        serial_number = dialogue.serial_number()
        require_serial_number(self._name, serial_number, told.serial_number)
        dialogue.select_calibration(told.calibration)
        self._calibration: Calibration = dialogue.calibration(firmware, told.units)
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
            f"slot {told.calibration}, matrix {revision:08x}",
        )

    def _new_stream(self) -> Stream[ForceSample]:
        self._period_s = 1.0 / self.rate_hz
        self._poller = Poller(self._base, self._period_s, PAIR_LIMIT_S)
        self._last_question = 0
        return self._empty_stream(
            max(self._options.max_age_s, 10.0 * self._period_s),
            max(FROZEN_S, 25.0 * self._period_s),
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


class Dialogue:
    """Sends one request at a time; it is repeated once when it goes unanswered."""

    def __init__(self, bus: CanLink, base: int, deadline: Deadline) -> None:
        self._bus = bus
        self._base = base
        self._deadline = deadline
        self.name = f"NETCANOEM at {bus.where}, base {base:#04x}"

    def ask(
        self, op: Op, data: bytes = b"", expect: tuple[Op, ...] = (), sizes: tuple[int, ...] = ()
    ) -> dict[Op, bytes]:
        """Data of the answering frames by operation; `expect` defaults to `op` alone."""
        expect = expect or (op,)

        def exchange(wait: Deadline) -> dict[Op, bytes] | None:
            received: dict[Op, bytes] = {}
            self._bus.send(frame_id(self._base, op), data)
            while wait.running and len(received) < len(expect):
                for frame in self._bus.receive(0.05):
                    if frame.id >> 4 == self._base and frame.id & 0xF in expect:
                        received[Op(frame.id & 0xF)] = frame.data
            got = tuple(len(received[o]) for o in expect if o in received)
            return received if len(received) == len(expect) and got == (sizes or got) else None

        hint = "check power, bit rate (DIP switch 2-1: 250 kbit/s), base id and termination"
        return ask_twice(_log, self.name, f"{op.name} {data.hex()}", self._deadline, exchange, hint)

    def firmware(self) -> tuple[int, int, int]:
        """Major, minor and build number."""
        major, minor, build = struct.unpack(">BBH", self.ask(Op.FIRMWARE, sizes=(4,))[Op.FIRMWARE])
        return major, minor, build

    def serial_number(self) -> str:
        return self.ask(Op.SERIAL)[Op.SERIAL].decode("ascii", "replace").strip("\0 ")

    def select_calibration(self, index: int) -> None:
        """Use calibration slot `index` (the device forgets it at reset).

        Raises:
            DeviceError: the device echoes another slot.
        """
        echo = self.ask(Op.CALIBRATION, bytes((index,)), sizes=(1,))[Op.CALIBRATION][0]
        if echo != index:
            raise DeviceError(
                f"{self.name} took calibration {echo} instead of {index}",
                code=FaultCode.REFUSED_COMMAND,
                hint="correct `calibration` in the rig file",
            )

    def calibration(self, firmware: tuple[int, int, int], old_units: str) -> Calibration:
        """Matrix, counts and units, read from the device; firmware before 3.7 has no units.

        Raises:
            DeviceError: a matrix that is not finite, or a unit or count that is not in the manual.
        """
        rows = [
            matrix_row(self.ask(Op.MATRIX, bytes((axis,)), MATRIX_OPS, (8, 8, 8)))
            for axis in range(AXES)
        ]
        if not all(math.isfinite(value) for row in rows for value in row):
            raise DeviceError(
                f"{self.name}: the calibration matrix has values that are not finite",
                code=FaultCode.NOT_FINITE,
                hint="check the calibration slot",
            )
        if len(set(rows)) < AXES:  # an answer that came late is taken for the next axis
            raise DeviceError(
                f"{self.name}: two rows of the calibration matrix are the same",
                code=FaultCode.CORRUPT,
                hint="open it again; if it stays, check the calibration slot",
            )
        counts = (OLD_COUNTS, OLD_COUNTS)
        if firmware[:2] >= UNITS_FIRMWARE:
            counts = struct.unpack(">II", self.ask(Op.COUNTS, sizes=(8,))[Op.COUNTS])
            codes = tuple(self.ask(Op.UNITS, sizes=(2,))[Op.UNITS])
        else:
            codes = self._old_codes(old_units)
        if codes[0] not in FORCE_UNITS_N or codes[1] not in TORQUE_UNITS_NM or 0 in counts:
            raise DeviceError(
                f"{self.name}: unit codes {codes} and counts per unit {counts} make no sense",
                code=FaultCode.OUT_OF_RANGE,
                hint="check the calibration slot",
            )
        return Calibration.from_device(
            rows, *counts, FORCE_UNITS_N[codes[0]][1], TORQUE_UNITS_NM[codes[1]][1]
        )

    def _old_codes(self, units: str) -> tuple[int, int]:
        for force_code, (force, _) in FORCE_UNITS_N.items():
            for torque_code, (torque, _) in TORQUE_UNITS_NM.items():
                if units == f"{force} {torque}":
                    return force_code, torque_code
        raise DeviceError(
            f"{self.name}: firmware before 3.7 does not tell its units",
            code=FaultCode.UNSUPPORTED,
            hint='write them into the rig file from the calibration sheet, e.g. units: "N N-m"',
        )
