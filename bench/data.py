"""What it costs to get data out: bulk reading, the catalogue, the import; each against a plain way.

python bench/data.py [--messages N] [--runs N]

Bulk reading: `stepload.open` with every stream and the curve as columns, every checksum verified,
against mcap's decoded iteration (mcap-ros2-support) over the same record, CRC on. The record is
written by our writer from made samples; the two ways take turns. The catalogue: `rows` over so many
links to one record against what mcap offers for the same metadata and attachments. The import: a
fresh interpreter with and without `import stepload`.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from record import write_bulk

import stepload
from stepload.data.catalog import rows

ROUNDS = 5
MESSAGES_A_SECOND = 3000.0


def cpu_s(function: Callable[[], object]) -> float:
    """CPU seconds, which other programs on the machine disturb least."""
    before_s = time.process_time()
    function()
    return time.process_time() - before_s


def decoded(path: Path) -> int:
    """How many messages mcap decodes from a record."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return sum(1 for _ in reader.iter_decoded_messages())


def streams(path: Path) -> None:
    """Every stream of a record as columns."""
    run = stepload.open(path)
    for table in (run.force, run.arm, run.ticks):
        for name in table:
            table[name]


def plain_row(path: Path) -> object:
    """What a catalogue needs of one record, the way mcap offers it."""
    with path.open("rb") as file:
        reader = make_reader(file)
        found = {metadata.name: metadata.metadata for metadata in reader.iter_metadata()}
        for attachment in reader.iter_attachments():
            if attachment.name == "results.json":
                return found, json.loads(attachment.data)
    return found, None


def bulk(directory: Path, messages: int) -> None:
    path = directory / "bulk.mcap"
    written, _ = write_bulk(path, round(messages / MESSAGES_A_SECOND))
    ours, theirs = [], []
    for _ in range(ROUNDS):
        ours.append(cpu_s(lambda: streams(path)))
        theirs.append(cpu_s(lambda: decoded(path)))
    one, other = min(ours), min(theirs)  # the rounds that the host disturbed least
    ratios = sorted(b / a for a, b in zip(ours, theirs, strict=True))
    print(
        f"bulk reading, {written} messages: {one / written * 1e9:.0f} ns each against"
        f" {other / written * 1e6:.1f} us decoded by mcap: {other / one:.0f} times"
        f" ({ratios[0]:.0f} to {ratios[-1]:.0f} in {ROUNDS} rounds); goal 45, at least 30"
    )


def catalogue(directory: Path, runs: int) -> None:
    made, place = directory / "one", directory / "runs"
    plan = Path(__file__).parents[1] / "procedures" / "plastic-sphere.yaml"
    stepload.run(stepload.load_plan(plan), dry_run=True, out=made)
    for i in range(runs):
        (place / f"{i:05}").mkdir(parents=True)
        os.link(made / "run.mcap", place / f"{i:05}" / "run.mcap")
    before_s = time.perf_counter()
    found = rows(place)
    took_s = time.perf_counter() - before_s
    assert len(found) == runs
    assert not found[0].problem
    some = [place / f"{i:05}" / "run.mcap" for i in range(0, runs, max(1, runs // 100))]
    plain_s = cpu_s(lambda: [plain_row(path) for path in some]) / len(some)
    whole_s = cpu_s(lambda: [stepload.open(path) for path in some[:3]]) / 3
    print(
        f"catalogue of {runs} runs: {took_s:.2f} s, {took_s / runs * 1e3:.2f} ms each; mcap's"
        f" reader {plain_s * 1e3:.2f} ms ({plain_s / took_s * runs:.1f} times), the whole record"
        f" {whole_s * 1e3:.0f} ms"
    )


def importing() -> None:
    def once(code: str) -> float:
        before_s = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - before_s

    pairs = [(once("pass"), once("import stepload")) for _ in range(15)]
    extra = statistics.median(b - a for a, b in pairs)
    ratio = statistics.median(b / a for a, b in pairs)
    print(f"import stepload: {extra * 1e3:.1f} ms, {ratio:.2f} times an empty interpreter; < 50 ms")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--messages", type=int, default=1_000_000)
    parser.add_argument("--runs", type=int, default=5000)
    wanted = parser.parse_args()
    importing()
    with tempfile.TemporaryDirectory() as name:
        bulk(Path(name), wanted.messages)
        catalogue(Path(name), wanted.runs)


if __name__ == "__main__":
    main()
