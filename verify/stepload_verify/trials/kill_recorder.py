"""Kills a recording runner at random times and counts what is lost.

python -m stepload_verify.trials.kill_recorder --kills 200

Half of the kills hit the runner alone, half its whole process group with the writer. After each,
the record is repaired and compared with what the runner had pushed, and with what the recorder had
said to be on the disk. Prints the counts of each kill as JSON.
"""

from __future__ import annotations

import argparse
import json
import mmap
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from stepload.record.reader import read_recording
from stepload.record.recorder import Recorder
from stepload.record.recovery import is_being_written, recover
from stepload.record.rows import Phase, TickRow
from stepload.rig.clock import MonotonicClock
from stepload.rig.samples import ArmSample, ForceSample

PROGRESS = struct.Struct("<qq")
FORCE_HZ = 1000.0


def run_until_killed(directory: Path) -> None:
    """Record 1 kHz force, 500 Hz arm and ticks, and write the progress to a memory file."""
    clock = MonotonicClock()
    recorder = Recorder(
        directory,
        rates_hz={"force": FORCE_HZ, "arm": 500.0, "tick": 500.0},
        clock=clock,
        metadata={"force_axis": "+fz"},
        attachments={"plan.yaml": b"payload: {}\n" * 100},
        lossless=False,
    )
    rng = random.Random(0)
    with (directory / "progress").open("r+b") as file:
        progress = mmap.mmap(file.fileno(), PROGRESS.size)
    start_s = clock.now_s()
    for i in range(10**9):
        due_s = start_s + i / FORCE_HZ
        clock.sleep_until(due_s)
        wrench = (0.0, 0.0, rng.gauss(50.0, 0.1), 0.0, 0.0, 0.0)
        recorder.force(ForceSample(i, due_s, clock.now_s(), 0, wrench, 21.0))
        if i % 2:
            now_s = clock.now_s()
            recorder.arm(ArmSample(i // 2, due_s, now_s, 0, i * 1e-9, 50.0, (0.0,) * 6))
            recorder.tick(TickRow(now_s, *(0.0,) * 8, Phase.LOAD, 1, i))
        PROGRESS.pack_into(progress, 0, i + 1, recorder.recorded("force"))


def kill_once(directory: Path, whole_group: bool, after_s: float) -> tuple[int, int, int]:
    """(pushed, said to be on the disk, found after repair) force samples of one killed runner."""
    (directory / "progress").write_bytes(bytes(PROGRESS.size))
    runner = subprocess.Popen(
        [sys.executable, __file__, "--victim", str(directory)], start_new_session=True
    )
    try:
        with (directory / "progress").open("r+b") as file:
            progress = mmap.mmap(file.fileno(), PROGRESS.size)
        while PROGRESS.unpack_from(progress)[1] == 0:
            if runner.poll() is not None:
                raise SystemExit(f"the runner ended by itself with code {runner.returncode}")
            time.sleep(0.01)
        time.sleep(after_s)
    finally:
        if whole_group:
            os.killpg(runner.pid, signal.SIGKILL)
        else:
            runner.kill()
        runner.wait()
    pushed, durable = PROGRESS.unpack_from(progress)
    part = directory / "run.mcap.part"
    while is_being_written(part):
        time.sleep(0.01)
    recovered = recover(part)
    got = read_recording(recovered.path)
    sequence = got.force.sequence
    assert got.partial
    assert len(sequence) == recovered.counts["/force"]
    assert np.array_equal(sequence, np.arange(len(sequence)))
    return pushed, durable, len(sequence)


def campaign(kills: int, seed: int) -> dict[str, list[dict[str, int]]]:
    """Alternating kills; per target the counts of each kill."""
    rng = random.Random(seed)
    found: dict[str, list[dict[str, int]]] = {"runner": [], "group": []}
    for i in range(kills):
        target = ("runner", "group")[i % 2]
        with tempfile.TemporaryDirectory() as directory:
            pushed, durable, kept = kill_once(
                Path(directory), target == "group", rng.uniform(0.0, 0.5)
            )
        found[target].append({"pushed": pushed, "durable": durable, "kept": kept})
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--victim", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.victim:
        run_until_killed(options.victim)
        return
    found = campaign(options.kills, options.seed)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
