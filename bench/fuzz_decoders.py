"""Random frames into every decoder: crashes, and corrupt frames that pass, against the odds.

Headers are right and the rest is random, which is the hardest case. A frame that passes is expected
as often as its checksum lets it: RFT 1 in 256, Bota 1 in 65536; slcan, text lines and RTDE have
none, so there only crashes, frames changed on the way and impossible values count.
    python bench/fuzz_decoders.py --frames 10000000
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
from collections.abc import Callable

from stepload.errors import DeviceError
from stepload_drivers.ati import rdt
from stepload_drivers.ati.box import read_box
from stepload_drivers.ati.poller import Poller
from stepload_drivers.bota import codec as bota
from stepload_drivers.canbus import slcan_frame
from stepload_drivers.framing import CanFrame, CanPairer
from stepload_drivers.line.codec import LineDecoder, line_pattern, number_of
from stepload_drivers.line.force import DEFAULT_PATTERN
from stepload_drivers.robotous import codec as robotous
from stepload_drivers.ur import frames as rtde
from stepload_drivers.ur import state as ur
from stepload_verify.emulators.ati_net import encode

CHUNK = 50_000


def rft_uart(chance: random.Random, count: int) -> int:
    size = robotous.UART_FRAME_BYTES
    data = bytearray(chance.randbytes(size * count))
    data[0::size] = bytes((robotous.UART_START,)) * count
    data[size - 1 :: size] = bytes((robotous.UART_END,)) * count
    return len(robotous.UartDecoder().feed(bytes(data)))


def rft_can(chance: random.Random, count: int) -> int:
    pairer, time_s, found = CanPairer((1, 2), 1e-3), 0.0, 0
    lengths = chance.choices((8, 8, 8, 7, 0), k=count)
    data = chance.randbytes(8)
    for length in lengths:
        time_s += 4e-4
        payload = pairer.feed(CanFrame(chance.randrange(4), data[:length], time_s))
        found += payload is not None and len(payload) != robotous.PAYLOAD_BYTES
    return found


def bota_serial(chance: random.Random, count: int) -> int:
    size = bota.FRAME_BYTES
    data = bytearray(chance.randbytes(size * count))
    data[0::size] = bytes((bota.HEADER,)) * count
    return len(bota.Decoder().feed(bytes(data)))


def ati_can(chance: random.Random, count: int) -> int:
    poller, now_s, wrong = Poller(0x20, 1e-3, 1e-3), 0.0, 0
    data = chance.randbytes(8)
    for length in chance.choices((8, 6, 8, 6, 0, 3), k=count):
        now_s += chance.random() * 1e-3
        poller.due(now_s)
        frame = CanFrame(0x200 + chance.randrange(3), data[:length], now_s)
        answer = poller.feed(frame, now_s)
        wrong += answer is not None and (len(answer.first), len(answer.second)) != (8, 6)
    return wrong


def rdt_records(chance: random.Random, count: int) -> int:
    """Datagrams of 36 bytes pass, as they must: what is left to find is one that changes."""
    wrong = 0
    for length in chance.choices((36, 36, 35, 72, 0), k=count):
        data = chance.randbytes(length)
        record = rdt.decode(data)
        wrong += (record is None) == (length == 36)
        wrong += record is not None and encode(record) != data
    return wrong


def rdt_pages(chance: random.Random, count: int) -> int:
    """Pages of settings with damaged entries: refused, or a scale that is a number."""
    keys = ("cfgcpf", "cfgcpt", "scfgfu", "scfgtu", "runrate", "cfgmr", "comrdte", "prodname")
    values = (
        "1000000",
        "7000",
        "N",
        "Nm",
        "lbf",
        "-1",
        "0",
        "nan",
        "1e999",
        "1;2;3",
        ";;",
        "",
        "<b>",
    )
    wrong = 0
    for _ in range(count // 10):
        text = "".join(f"<{key}>{chance.choice(values)}</{key}>" for key in keys)
        try:
            box = read_box(text, "box")
        except DeviceError:
            continue
        wrong += not (0.0 < box.scale.force < math.inf and 0.0 < box.internal_hz < math.inf)
    return wrong


def slcan_lines(chance: random.Random, count: int) -> int:
    text = chance.randbytes(12 * count).decode("latin-1")
    wrong = 0
    for start in range(0, len(text), 12):
        frame = slcan_frame("t" + text[start : start + 12])
        wrong += frame is not None and (frame[0] > 0x7FF or len(frame[1]) > 8)
    return wrong


def text_lines(chance: random.Random, count: int) -> int:
    alphabet = b"+-.0123456789eEAnaif \r\xff"
    data = bytes(chance.choices(alphabet, k=8 * count))
    number = number_of(line_pattern(DEFAULT_PATTERN, "force"), "force", 1.0)
    readings = LineDecoder(number, b"\r").feed(data)
    return sum(not math.isfinite(value) for value in readings)


def rtde_stream(chance: random.Random, count: int) -> int:
    """Sound packages cut anywhere, then noise, at which the reader must say so."""
    wrong = 0
    kinds = sorted(rtde.KNOWN_TYPES)
    for _ in range(count // 10):
        sent = [
            rtde.Frame(chance.choice(kinds), chance.randbytes(chance.randrange(60)))
            for _ in range(9)
        ]
        data = b"".join(rtde.encode(*frame) for frame in sent)
        reader, got, at = rtde.FrameReader(), [], 0
        while at < len(data):
            size = chance.randrange(1, 80)
            got += reader.feed(data[at : at + size])
            at += size
        wrong += got != sent
        try:
            noise = reader.feed(chance.randbytes(40))
        except rtde.FrameError:
            continue
        wrong += any(frame.kind not in rtde.KNOWN_TYPES for frame in noise)
    return wrong


def rtde_values(chance: random.Random, count: int) -> int:
    layout = rtde.package_struct(
        ["DOUBLE", "VECTOR6D", "VECTOR6D", "INT32", "INT32", "UINT32", "UINT32"]
    )
    data = chance.randbytes(layout.size * count)
    expected = 0
    for v in layout.iter_unpack(data):
        package = ur.UrState(v[1], v[2:8], v[8:14], v[14], v[15], v[16], v[17])
        expected += ur.data_problem(package) is None
    return expected


DECODERS: dict[str, tuple[Callable[[random.Random, int], int], float]] = {
    "RFT UART": (rft_uart, 1 / 256 + 18 / 256**3),
    "RFT CAN pairs": (rft_can, 0.0),
    "Bota": (bota_serial, (1 + 36 / 256) / 65536),
    "ATI pairs": (ati_can, 0.0),
    "RDT records": (rdt_records, 0.0),
    "RDT pages": (rdt_pages, 0.0),
    "slcan lines": (slcan_lines, 0.0),
    "text lines": (text_lines, 0.0),
    "RTDE stream": (rtde_stream, 0.0),
    "RTDE values": (rtde_values, 0.0),
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    bad = 0
    print(
        f"{'decoder':16}{'frames':>12}{'passed':>10}{'expected':>12}{'crashes':>9}{'Mframe/s':>10}"
    )
    for name, (run, odds) in DECODERS.items():
        chance, passed, crashes, done = random.Random(options.seed), 0, 0, 0
        started_s = time.perf_counter()
        while done < options.frames:
            count = min(CHUNK, options.frames - done)
            done += count
            try:
                passed += run(chance, count)
            except Exception as error:  # a crash is what this looks for
                crashes += 1
                print(f"{name}: {type(error).__name__}: {error}")
        speed = done / (time.perf_counter() - started_s) / 1e6
        expected = odds * done
        bad += crashes + (passed > expected + 5.0 * math.sqrt(expected))
        print(f"{name:16}{done:12}{passed:10}{expected:12.1f}{crashes:9}{speed:10.2f}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
