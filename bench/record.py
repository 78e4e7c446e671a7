"""What recording costs, against the plain way, side by side in one run.

python bench/record.py

Every figure is a ratio to its baseline measured in alternation on the same data; medians of rounds.
The plain way is `mcap.writer.Writer` with default settings, written to in the loop, and
`iter_decoded_messages` with mcap-ros2-support to read.
"""

from __future__ import annotations

import io
import os
import random
import statistics
import struct
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory

from stepload.record.container import Appender
from stepload.record.layout import STREAMS
from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder
from stepload.record.recovery import recover
from stepload.record.ring import Shared, capacities
from stepload.record.rows import Phase, TickRow
from stepload.record.writer_process import PERIOD_S, Writer
from stepload.rig.clock import MonotonicClock
from stepload.rig.samples import ArmSample, ForceSample

RATES_HZ = {"force": 1000.0, "arm": 500.0, "tick": 500.0}
WRENCH = struct.Struct("<IiiI6s2x6d")
SAMPLE = struct.Struct("<Iqdddq")
ROUNDS = 5


def samples(seconds: int) -> tuple[list[ForceSample], list[ArmSample], list[TickRow]]:
    """A loading as a real rig would give it: noise in the last digits, one axis in use."""
    rng = random.Random(0)
    force, arm, ticks = [], [], []
    for i in range(seconds * 1000):
        t = 1000.0 + i * 1e-3
        wrench = tuple(round(rng.gauss(mean, 0.05), 4) for mean in (0, 0, 50 + 0.01 * i, 0, 0, 0))
        force.append(ForceSample(i, t, t + rng.uniform(1e-4, 3e-4), 0, wrench, 21.0))
        if i % 2:
            x = round(1e-8 * i + rng.gauss(0, 1e-7), 8)
            arm.append(ArmSample(i // 2, t, t + rng.uniform(1e-4, 3e-4), 0, x, 0.0, (0.0,) * 6))
            ticks.append(
                TickRow(t, x, wrench[2], 0.0, 60.0, 300.0, 1e-6, 50.0, 1e-5, Phase.LOAD, 1, 1)
            )
    return force, arm, ticks


class Unsynced(Appender):
    """Leaves the disk out: syncing costs both sides the same and drowns what is compared."""

    def sync(self) -> None:
        pass


def write_bulk(path: Path, seconds: int, period_s: float = PERIOD_S) -> tuple[int, float]:
    """Our writer, a chunk every `period_s` of the run, in this process; (messages, CPU s)."""
    force, arm, ticks = samples(seconds)
    shared, memory_fd = Shared.create(capacities(RATES_HZ))
    os.close(memory_fd)
    push = {name: shared.producer(name, lambda _: False) for name in RATES_HZ}
    used_s = 0.0
    with path.open("wb") as file:
        out = Unsynced(file.fileno())
        out.start()
        out.add_metadata("run", {})
        writer = Writer(out, shared, 10**18)
        per_chunk = round(1000 * period_s)
        for first in range(0, len(force), per_chunk):
            half = slice(first // 2, (first + per_chunk) // 2)
            for sample in force[first : first + per_chunk]:
                push["force"](sample)
            for state in arm[half]:
                push["arm"](state)
            for row in ticks[half]:
                push["tick"](row)
            before_s = time.process_time()
            writer.drain()
            used_s += time.process_time() - before_s
        writer.finish("identified", b"{}")
        messages = sum(out.counts.values())
    del push
    shared.close()
    return messages, used_s


def raw_messages(path: Path) -> list[tuple[str, str, bytes, int, int, bytes]]:
    """(topic, type, definition, log time, publish time, data) of a whole file."""
    with path.open("rb") as file:
        return [
            (c.topic, s.name, s.data, m.log_time, m.publish_time, m.data)
            for s, c, m in make_reader(file).iter_messages()
            if s is not None
        ]


def write_plain(
    path: Path, messages: list[tuple[str, str, bytes, int, int, bytes]], period_ns: int | None
) -> float:
    """mcap's writer, flushed each `period_ns` (None: its default chunks); CPU s."""
    with path.open("wb") as file:
        before_s = time.process_time()
        writer = McapWriter(file)
        writer.start("ros2")
        channels: dict[str, int] = {}
        due_ns = 0
        for i, (topic, schema, definition, log_ns, publish_ns, data) in enumerate(messages):
            if topic not in channels:
                schema_id = writer.register_schema(schema, "ros2msg", definition)
                channels[topic] = writer.register_channel(topic, "cdr", schema_id)
            writer.add_message(channels[topic], log_ns, data, publish_ns, i)
            if period_ns is not None and log_ns >= due_ns:
                writer.flush()
                due_ns = log_ns + period_ns
        writer.finish()
        return time.process_time() - before_s


def timed(function: Callable[[], object]) -> float:
    before_s = time.perf_counter()
    function()
    return time.perf_counter() - before_s


def cpu_s(function: Callable[[], object]) -> float:
    """CPU seconds, which other programs on the machine disturb least."""
    before_s = time.process_time()
    function()
    return time.process_time() - before_s


def start(directory: Path, rates_hz: dict[str, float]) -> Recorder:
    return Recorder(
        directory,
        rates_hz=rates_hz,
        clock=MonotonicClock(),
        metadata={},
        attachments={},
        lossless=False,
    )


def push_against_inline(directory: Path) -> tuple[list[float], list[float], float, float]:
    """Seconds per force sample: ring push, pack + add_message twice; and the longest calls."""
    force, _, _ = samples(15)
    pushed, inline, longest_push, longest_inline = [], [], [], []
    for round_number in range(ROUNDS):
        where = directory / f"push{round_number}"
        where.mkdir()
        recorder = start(where, {"force": 1000.0})
        push, clock = recorder.force, time.perf_counter
        before_s = clock()
        for sample in force:
            push(sample)
        pushed.append((clock() - before_s) / len(force))
        recorder.finish({}, "identified")
        writer = McapWriter(io.BytesIO())
        writer.start("ros2")
        channels = []
        for topic in STREAMS["force"].topics:
            schema = writer.register_schema(topic.schema, "ros2msg", topic.definition.encode())
            channels.append(writer.register_channel(topic.name, "cdr", schema))

        def add(
            sample: ForceSample, writer: McapWriter = writer, ids: list[int] = channels
        ) -> None:
            ns = int(sample[2] * 1e9)
            data = WRENCH.pack(256, ns // 10**9, ns % 10**9, 6, b"force", *sample[4])
            writer.add_message(ids[0], ns, data, ns, sample[0])
            data = SAMPLE.pack(256, sample[0], sample[1], sample[2], sample[5], sample[3])
            writer.add_message(ids[1], ns, data, ns, sample[0])

        before_s = clock()
        for sample in force:
            add(sample)
        inline.append((clock() - before_s) / len(force))
        longest_inline.append(max(timed(lambda s=s: add(s)) for s in force))
        where = directory / f"worst{round_number}"
        where.mkdir()
        recorder = start(where, {"force": 1000.0})
        push = recorder.force
        longest_push.append(max(timed(lambda s=s, push=push: push(s)) for s in force))
        recorder.finish({}, "identified")
    return pushed, inline, statistics.median(longest_push), statistics.median(longest_inline)


def lateness_s(directory: Path | None, seconds: float) -> float:
    """p99.9 of how late a 1 kHz loop wakes up, recording or empty."""
    clock = MonotonicClock()
    force, arm, ticks = samples(1)
    recorder = None
    if directory is not None:
        directory.mkdir()
        recorder = start(directory, RATES_HZ)
    late = []
    start_s = clock.now_s() + 0.01
    for i in range(int(seconds * 1000)):
        due_s = start_s + i * 1e-3
        clock.sleep_until(due_s)
        now_s = clock.now_s()
        late.append(now_s - due_s)
        if recorder is not None:
            recorder.force(force[i % 1000]._replace(receive_time_s=now_s))
            if i % 2:
                recorder.arm(arm[i // 2 % 500])
                recorder.tick(ticks[i // 2 % 500])
    if recorder is not None:
        recorder.finish({}, "identified")
    return float(np.percentile(late, 99.9))


def repaired_per_s(directory: Path, seconds: int, rounds: int) -> list[float]:
    """Messages that are repaired and counted in a CPU second, of a record so long."""
    whole, rates = directory / "whole.mcap", []
    messages, _ = write_bulk(whole, seconds)
    for _ in range(rounds):
        out = directory / "whole.repaired.mcap"
        rates.append(messages / cpu_s(lambda out=out: recover(whole, out)))
        out.unlink()
    return rates


def decoded_per_s(path: Path, rounds: int) -> list[float]:
    """Messages that mcap with mcap-ros2-support decodes in a CPU second."""

    def decode() -> int:
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            return sum(1 for _ in reader.iter_decoded_messages())

    number = decode()
    return [number / cpu_s(decode) for _ in range(rounds)]


def line(name: str, ours: str, plain: str, ratio: float, target: str) -> None:
    print(f"{name:44} {ours:>16} {plain:>16} {ratio:8.2f}  {target}")


def main() -> None:
    print(f"{'':44} {'stepload':>16} {'plain':>16} {'ratio':>8}  target")
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        pushed, inline, worst, worst_inline = push_against_inline(directory)
        ours, plain = statistics.median(pushed), statistics.median(inline)
        line(
            "in the loop, one force sample, us",
            f"{ours * 1e6:.2f}",
            f"{plain * 1e6:.2f}",
            plain / ours,
            ">= 8, push <= 0.5 us",
        )
        line(
            "longest call of 15,000, us",
            f"{worst * 1e6:.0f}",
            f"{worst_inline * 1e6:.0f}",
            worst_inline / worst,
            ">= 30",
        )

        bulk, flushed, default = (directory / n for n in ("bulk.mcap", "flushed.mcap", "d.mcap"))
        cpu, cpu_plain = [], []
        for _ in range(ROUNDS):
            messages, used_s = write_bulk(bulk, 20)
            cpu.append(used_s / messages)
            all_messages = raw_messages(bulk)
            cpu_plain.append(write_plain(flushed, all_messages, int(PERIOD_S * 1e9)) / messages)
        ours, plain = statistics.median(cpu), statistics.median(cpu_plain)
        line(
            "writer CPU per message, us",
            f"{ours * 1e6:.2f}",
            f"{plain * 1e6:.2f}",
            plain / ours,
            ">= 3",
        )
        write_plain(default, all_messages, None)
        sizes = [p.stat().st_size / messages for p in (bulk, default)]
        line(
            "bytes per message, 50 ms chunks / 1 MiB",
            f"{sizes[0]:.1f}",
            f"{sizes[1]:.1f}",
            sizes[0] / sizes[1],
            "<= 1.10",
        )

        big, dry = directory / "big.mcap", directory / "dry.mcap"
        messages, _ = write_bulk(big, 330)
        write_bulk(dry, 330, 1.0)
        reads, dry_reads, decoded = [], [], []
        for _ in range(ROUNDS):
            decoded += decoded_per_s(flushed, 1)
            reads.append(messages / cpu_s(lambda: read_recording(big)))
            dry_reads.append(messages / cpu_s(lambda: read_recording(dry)))
        plain = statistics.median(decoded)
        for name, rates in (("50 ms chunks", reads), ("1 s chunks (dry run)", dry_reads)):
            ours = statistics.median(rates)
            line(
                f"messages read per CPU s, {name}",
                f"{ours:.3g}",
                f"{plain:.3g}",
                ours / plain,
                ">= 30, stretch 40",
            )
        ours = statistics.median(repaired_per_s(directory, 330, ROUNDS))
        line(
            "messages repaired and counted per CPU s",
            f"{ours:.3g}",
            f"{1e6:.3g}",
            ours / 1e6,
            ">= 1",
        )

        empty, recording = [], []
        for i in range(ROUNDS):
            empty.append(lateness_s(None, 4.0))
            recording.append(lateness_s(directory / f"loop{i}", 4.0))
        ours, plain = statistics.median(recording), statistics.median(empty)
        line(
            "loop lateness p99.9, us (plain: empty loop)",
            f"{ours * 1e6:.0f}",
            f"{plain * 1e6:.0f}",
            ours / plain,
            "<= 1.3",
        )


if __name__ == "__main__":
    main()
