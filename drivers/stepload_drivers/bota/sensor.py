"""Bota Systems force-torque sensors (Rokubi, SensONE) with serial interface."""

from __future__ import annotations

import logging
import math
import re
import time
from typing import Annotated, Any, ClassVar

from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import Baud, Flag, Setting
from stepload.declaration.sections import SECTION, key
from stepload.errors import BadInputError, DeviceError
from stepload.rig.device import ForceSensor, Identity
from stepload.rig.faults import FaultCode
from stepload.rig.samples import ForceSample, Status
from stepload_drivers.bota.codec import (
    BAUD_CODES,
    FRAME_BYTES,
    SINC_OF_RATE,
    SINC_STEP_S,
    Decoder,
    DeviceClock,
    Frame,
    FrameStatus,
)
from stepload_drivers.serialport import Port, SerialPort
from stepload_drivers.stream import JUMP_S, ClockWatch, Stream
from stepload_drivers.streamed import (
    STALE_S,
    Deadline,
    MaxAge,
    OtherSensor,
    Streamed,
    require_serial_number,
)

FROZEN_S = 0.05
LINE_SHARE = 0.95
MEASURED_FRAMES = 32
CHARACTER_S = 0.005
"""Pause after each character: the device's input buffer holds 64 bytes and is emptied slowly."""

RESET = "#"
CONFIGURE = "C"
RUN = "R"
_log = logging.getLogger(__name__)
_BANNER = re.compile(
    rb"name: (?P<name>[^\r\n]*)[\r\n]+.*?S/N: (?P<serial>[^\r\n]*)[\r\n]+"
    rb".*?FW version: (?P<firmware>[^\r\n]*)[\r\n]",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class BotaOptions:
    """Options of a Bota sensor with serial interface."""

    port: Port
    baud: Annotated[Baud, key("the sensor's bit rate")] = 460800
    rate_hz: Annotated[float, Setting("Hz", 100.0, 1000.0), key("sample rate")] = 1000.0
    fir: Annotated[Flag, key("the sensor's FIR filter (lower noise, more lag)")] = False
    serial_number: OtherSensor = ""
    max_age_s: MaxAge = STALE_S


class BotaSerial(Streamed[ForceSample], ForceSensor):
    """Rokubi or SensONE on a serial port; losses are found from the device's own clock."""

    DRIVER = "bota_serial"
    OPTIONS: ClassVar[type] = BotaOptions

    def __init__(self, **options: Any) -> None:
        told = BotaOptions(**options)
        baud, rate = told.baud, told.rate_hz
        if rate not in SINC_OF_RATE:
            listed = ", ".join(f"{value:g}" for value in sorted(SINC_OF_RATE))
            raise BadInputError(f"rate {rate:g} Hz: a Bota serial sensor has {listed} Hz")
        if baud not in BAUD_CODES:
            raise BadInputError(f"baud {baud}: a Bota serial sensor has {sorted(BAUD_CODES)}")
        if FRAME_BYTES * 10 * rate > LINE_SHARE * baud:
            raise BadInputError(
                f"{rate:g} Hz needs {FRAME_BYTES * 10 * rate:.0f} bit/s, more than {baud} Bd carry",
                hint="use 460800 Bd or a lower rate",
            )
        self._path, self._baud, self._fir = told.port, baud, told.fir
        self._serial_number = told.serial_number
        self._max_age_s = told.max_age_s
        self._requested_hz = self.rate_hz = rate
        self._name = f"Bota sensor on {told.port}"
        self._link: SerialPort | None = None

    def _connect(self, deadline: Deadline) -> Identity:
        port = self._link = SerialPort(self._path, self._baud, refuse_latency=False)
        model, serial_number, firmware = reset(port, deadline)
        require_serial_number(self._name, serial_number, self._serial_number)
        sinc = SINC_OF_RATE[self._requested_hz]
        for command in (
            CONFIGURE,
            communication_command(BAUD_CODES[self._baud]),
            filter_command(sinc, fir=self._fir),
            RUN,
        ):
            ask(port, command, deadline)
        self.rate_hz = self._measured_rate(port, deadline)
        self._period_s = 1.0 / self.rate_hz
        return Identity(self.DRIVER, model, serial_number, firmware, "calibrated by the device")

    def _measured_rate(self, port: SerialPort, deadline: Deadline) -> float:
        """The rate by the device's own clock: some units deliver 800 Hz when asked for 1000."""
        decoder, clock = Decoder(), DeviceClock()
        steps: list[float] = []
        while len(steps) < MEASURED_FRAMES:
            deadline.left_s(f"{self._name}: frames after the settings")
            steps += [clock.advance(frame.clock_us)[1] for frame in decoder.feed(port.read())]
        period_s = sorted(steps[1:])[len(steps) // 2]
        for rate_hz, sinc in SINC_OF_RATE.items():
            if abs(period_s - sinc * SINC_STEP_S) < 0.05 * sinc * SINC_STEP_S:
                if rate_hz > self._requested_hz:
                    break
                return rate_hz if rate_hz == self._requested_hz else 1.0 / period_s
        raise DeviceError(
            f"{self._name}: a frame every {period_s * 1e3:.3f} ms by its own clock after asking "
            f"for {self._requested_hz:g} Hz",
            code=FaultCode.REFUSED_COMMAND,
            hint="check the firmware; see docs/devices/bota.md",
        )

    def _new_stream(self) -> Stream[ForceSample]:
        self._decoder, self._clock = Decoder(), DeviceClock()
        self._sequence = 0
        self._watch = ClockWatch(self._max_age_s)
        return self._empty_stream(self._max_age_s, FROZEN_S)

    def _read(self, stream: Stream[ForceSample]) -> None:
        assert self._link is not None
        data = self._link.read()
        arrival_s = time.monotonic()
        frames = self._decoder.feed(data)
        stream.total("checksum", self._decoder.damaged, corrupt=True)
        stream.total("skipped_bytes", self._decoder.skipped)
        if not frames:
            return
        times = [self._tick(frame, stream) for frame in frames]
        arrivals_s = self._watch.arrivals([device_s for device_s, _ in times], arrival_s, stream)
        samples = [
            ForceSample(
                sequence, device_s, time_s, self._status(f, stream), f.wrench, f.temperature_c
            )
            for f, (device_s, sequence), time_s in zip(frames, times, arrivals_s, strict=True)
        ]
        stream.put(samples, arrival_s)

    def _tick(self, frame: Frame, stream: Stream[ForceSample]) -> tuple[float, int]:
        """Device time and sequence of the next frame, found with the device's clock."""
        device_s, step_s = self._clock.advance(frame.clock_us)
        steps = round(step_s / self._period_s) if self._sequence else 1
        if self._sequence and (steps < 1 or step_s > JUMP_S):
            stream.latch(
                FaultCode.CLOCK,
                f"{self._name}: its clock went on by {step_s:.6f} s from one frame to the next "
                f"(period {self._period_s:.6f} s)",
                "the sensor has restarted or its clock stands still: start anew, tare again",
            )
            steps = 1
        stream.lose(steps - 1)
        self._sequence += steps
        return device_s, self._sequence

    def _status(self, frame: Frame, stream: Stream[ForceSample]) -> int:
        status = 0
        if frame.status & FrameStatus.OVERRANGE:
            status |= Status.OVERRANGE
            stream.latch(
                FaultCode.OVERLOAD,
                f"{self._name} reports overrange at Fz {frame.wrench[2]:.1f} N",
                "unload, and check the sensor's zero before going on",
            )
        if frame.status & (FrameStatus.INVALID | FrameStatus.RAW):
            status |= Status.INVALID
            stream.latch(
                FaultCode.DEVICE_REPORTS,
                f"{self._name} reports invalid data (status {frame.status:#06x})",
                "the sensor may be damaged: check it unloaded with the vendor's tool",
            )
        if frame.status & FrameStatus.APP_TOOK_TOO_LONG:
            stream.count("app_took_too_long")
        if not all(map(math.isfinite, frame.wrench)):
            status |= Status.INVALID
            stream.latch(
                FaultCode.NOT_FINITE,
                f"{self._name}: wrench {frame.wrench} is not finite",
                "power the sensor off and on; if it stays, it is damaged",
            )
        return int(status)


def communication_command(baud_code: int) -> str:
    """No temperature compensation, calibrated values, binary frames."""
    return f"c,0,1,0,{baud_code}"


def filter_command(sinc: int, *, fir: bool) -> str:
    """Sinc length (sets the rate), no chopping, no fast filter, FIR filter on or off."""
    return f"f,{sinc},0,0,{0 if fir else 1}"


def send(port: SerialPort, command: str) -> None:
    """Send `command` character by character."""
    _log.debug("%s <- %s", port.path, command)
    for character in command:
        port.write(character.encode("ascii"))
        time.sleep(CHARACTER_S)


def ask(port: SerialPort, command: str, deadline: Deadline) -> None:
    """Send `command` and wait for its reply `r,0,<letter>,0`, which may come amid binary frames.

    Raises:
        DeviceError: refused, or no reply in time.
    """
    reply = re.compile(rb"r,\d+,%c,(\d+)" % command[0].encode("ascii"))
    send(port, command)
    refusal = int(_received(port, reply, 64, f"reply to {command!r}", deadline)[1])
    if refusal:
        raise DeviceError(
            f"{port.path}: sensor refused {command!r} with code {refusal}",
            code=FaultCode.REFUSED_COMMAND,
            hint="check that the firmware knows this setting",
        )


def reset(port: SerialPort, deadline: Deadline) -> tuple[str, str, str]:
    """Restart the sensor; product name, serial number and firmware version from its boot text.

    Raises:
        DeviceError: no boot text in time.
    """
    port.discard_input()
    send(port, RESET)
    match = _received(port, _BANNER, 4096, "boot text of the sensor", deadline)
    name, serial_number, firmware = (
        match[group].decode("ascii", "replace").strip() for group in ("name", "serial", "firmware")
    )
    return name, serial_number, firmware


def _received(
    port: SerialPort, pattern: re.Pattern[bytes], longest: int, what: str, deadline: Deadline
) -> re.Match[bytes]:
    """Read until `pattern`, of at most `longest` bytes and one read, is found."""
    received = b""
    while True:
        deadline.left_s(f"{port.path}: {what}")
        received = received[-longest:] + port.read()
        if match := pattern.search(received):
            _log.debug("%s -> %r", port.path, match[0])
            return match
