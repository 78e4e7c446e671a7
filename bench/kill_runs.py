"""Kills whole runs of `stepload` at random times and counts what is lost.

python bench/kill_runs.py --kills 200

Dry runs of the plastic sphere (virtual time) and runs on the simulated rig in real time, in turn;
half of the kills hit the runner alone, half its whole process group with the record's writer. The
time of a kill is uniform from the first sample to the end of the program, so some hit the
evaluation. After each, what the next start would do is done: find, repair, read back, identify.
Lost time is wall-clock time of the force stream: from the last sample found to the last pushed.
"""

from __future__ import annotations

import argparse
import json
import mmap
import os
import random
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stepload.record.reader import read_recording
from stepload.record.recovery import is_being_written
from stepload.session.unfinished import repair_all

ROOT = Path(__file__).parents[1]
BOUND_MS = 100.0
ROWS = 1 << 20
HEAD = struct.Struct("<qq")
PROGRESS_BYTES = HEAD.size + 8 * ROWS
DURATION_S = {"dry": 2.0, "real time": 8.5}
"""From the first sample to the end of the program, about."""

REAL_TIME = f"""
stepload: 1
payload: {ROOT}/procedures/payloads/plastic-sphere.yaml
rig:
  profile: stvf
  arm:
    options: {{rate: 1 kHz, command_delay: 1 ms, lag: 2 ms, force_noise: 0.5 N}}
  force:
    options: {{noise: 0.5 N, quantum: 1.5 N, delay: 1 ms, bias: 3 N}}
procedure:
  step: 100 N
  top_force: 300 N
  hold: 0.3 s
  touches: 1
  unload: false
  surface_distance: 2 mm
  surface_uncertainty: 0.3 mm
  tare: 0.3 s
  warm_up: 0 s
  settle_timeout: 0.3 s
"""


@dataclass(frozen=True)
class Kill:
    """One killed run; counts are force samples."""

    tier: str
    target: str
    after_s: float
    pushed: int
    durable: int
    kept: int
    lost_ms: float
    state: str
    identified: bool


def victim(progress: str, arguments: Sequence[str]) -> None:
    """The `stepload` command that tells in a memory file when it pushed each sample."""
    from stepload.cli.main import main
    from stepload.record.recorder import Recorder

    with open(progress, "r+b") as file:
        memory = mmap.mmap(file.fileno(), PROGRESS_BYTES)
    times = np.frombuffer(memory, np.float64, ROWS, HEAD.size)
    original = Recorder.__init__

    def watched(self: Recorder, *args: Any, **kwargs: Any) -> None:
        original(self, *args, **kwargs)
        push, count = self.force, 0

        def counted(sample: Any) -> None:
            nonlocal count
            push(sample)
            times[count] = time.monotonic()
            count += 1
            HEAD.pack_into(memory, 0, count, self.recorded("force"))

        self.force = counted  # type: ignore[method-assign]

    Recorder.__init__ = watched  # type: ignore[method-assign]
    sys.argv = ["stepload", *arguments]
    main()


def kill_once(place: Path, tier: str, target: str, share: float) -> Kill:
    """One run, killed after `share` of its duration."""
    progress, runs, plan = place / "progress", place / "runs", place / "plan.yaml"
    progress.write_bytes(bytes(PROGRESS_BYTES))
    plan.write_text(REAL_TIME)
    command = ["run", str(plan), "--quiet", "--out", str(runs / "run")]
    if tier == "dry":
        command[1] = str(ROOT / "procedures" / "plastic-sphere.yaml")
        command.append("--dry-run")
    runner = subprocess.Popen(
        [sys.executable, __file__, "--victim", str(progress), *command],
        start_new_session=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    after_s = share * DURATION_S[tier]
    with progress.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), PROGRESS_BYTES)
    try:
        while HEAD.unpack_from(memory)[0] == 0:
            if runner.poll() is not None:
                raise SystemExit(f"the run ended by itself with code {runner.returncode}")
            time.sleep(0.005)
        time.sleep(after_s)
    finally:
        if target == "group":
            os.killpg(runner.pid, signal.SIGKILL)
        else:
            runner.kill()
        code = runner.wait()
    pushed, durable = HEAD.unpack_from(memory)
    times = np.frombuffer(memory, np.float64, ROWS, HEAD.size)
    part = runs / "run" / "run.mcap.part"
    while part.exists() and is_being_written(part):
        time.sleep(0.01)
    repaired = repair_all(runs)
    record = read_recording(runs / "run" / "run.mcap")
    sequence = record.force.sequence
    kept = len(sequence)
    if not (np.diff(sequence) == 1).all():
        raise SystemExit("samples are missing in the middle of a repaired record")
    lost_ms = 1e3 * (times[pushed - 1] - times[min(kept, pushed) - 1]) if kept else float("inf")
    state = "repaired" if repaired else "ended before" if code == 0 else "whole already"
    return Kill(
        tier, target, after_s, pushed, durable, kept, float(lost_ms), state,
        bool(repaired and repaired[0].identification),
    )  # fmt: skip


def campaign(kills: int, seed: int, dry_share: float) -> list[Kill]:
    """Kills in turn on runner and group, of dry and real-time runs."""
    chance, done = random.Random(seed), []
    dry = round(kills * dry_share)
    for i in range(kills):
        with tempfile.TemporaryDirectory() as place:
            done.append(
                kill_once(
                    Path(place),
                    "dry" if i < dry else "real time",
                    ("runner", "group")[i % 2],
                    chance.random(),
                )
            )
    return done


def table(done: list[Kill]) -> str:
    """The kill table."""
    lines = [
        f"{'run':10} {'killed':8} {'kills':>5} {'repaired':>9} {'whole':>6} {'identified':>11} "
        f"{'lost ms: median':>16} {'max':>6} {'durable rows lost':>18}"
    ]
    for tier in ("dry", "real time"):
        for target in ("runner", "group"):
            some = [k for k in done if (k.tier, k.target) == (tier, target)]
            if not some:
                continue
            lost = [k.lost_ms for k in some]
            lines.append(
                f"{tier:10} {target:8} {len(some):5} "
                f"{sum(k.state == 'repaired' for k in some):9} "
                f"{sum(k.state != 'repaired' for k in some):6} "
                f"{sum(k.identified for k in some):11} {statistics.median(lost):16.1f} "
                f"{max(lost):6.1f} {sum(max(k.durable - k.kept, 0) for k in some):18}"
            )
    return "\n".join(lines)


def main() -> int:
    if sys.argv[1:2] == ["--victim"]:
        victim(sys.argv[2], sys.argv[3:])
        return 0
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--dry-share", type=float, default=0.6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    done = campaign(options.kills, options.seed, options.dry_share)
    print(json.dumps([asdict(kill) for kill in done]) if options.json else table(done))
    worst_ms = max(kill.lost_ms for kill in done)
    return int(worst_ms > BOUND_MS or any(kill.kept < kill.durable for kill in done))


if __name__ == "__main__":
    sys.exit(main())
