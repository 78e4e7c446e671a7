"""Coverage-guided fuzzing of every decoder (needs the `fuzz` extra).

python bench/_fuzz_atheris.py -runs=1000000
"""

from __future__ import annotations

import math
import sys

import atheris  # type: ignore[import-not-found, unused-ignore]

with atheris.instrument_imports():
    from stepload_drivers.ati.poller import Poller
    from stepload_drivers.bota import codec as bota
    from stepload_drivers.canbus import slcan_frame
    from stepload_drivers.framing import CanFrame, CanPairer
    from stepload_drivers.line.codec import LineDecoder, line_pattern, number_of
    from stepload_drivers.line.force import DEFAULT_PATTERN
    from stepload_drivers.robotous import codec as robotous
    from stepload_drivers.ur import frames as rtde


def _rtde(data: bytes) -> None:
    reader, got = rtde.FrameReader(), b""
    try:
        for start in range(0, len(data), 7):
            got += b"".join(rtde.encode(*frame) for frame in reader.feed(data[start : start + 7]))
    except rtde.FrameError:
        pass
    if not data.startswith(got):
        raise AssertionError("RTDE packages that were not in the input")


def one_input(data: bytes) -> None:
    """Any exception is a finding."""
    for payload in robotous.UartDecoder().feed(data):
        if robotous.uart_frame(payload) not in data:
            raise AssertionError("an RFT frame that was not in the input")
    for frame in bota.Decoder().feed(data):
        if len(frame.wrench) != 6:
            raise AssertionError("a Bota frame without six values")
    number = number_of(line_pattern(DEFAULT_PATTERN, "force"), "force", 1.0)
    if not all(map(math.isfinite, LineDecoder(number, b"\r").feed(data))):
        raise AssertionError("a reading that is not finite")
    slcan_frame(data.decode("ascii", "replace"))
    _rtde(data)
    poller, pairer, now_s = Poller(0x20, 1e-3, 1e-3), CanPairer((1, 2), 1e-3), 0.0
    for start in range(0, len(data), 10):
        piece = data[start : start + 10]
        now_s += piece[0] * 1e-5
        poller.due(now_s)
        poller.feed(CanFrame(0x200 + piece[0] % 3, piece[2:], now_s), now_s)
        pairer.feed(CanFrame(piece[0] % 4, piece[2:], now_s))


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
