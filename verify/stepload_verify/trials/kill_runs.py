"""Kills whole runs of `stepload` at random times and counts what is lost.

python -m stepload_verify.trials.kill_runs --kills 200 --wire 20

Dry runs of the plastic sphere (virtual time), and runs of the demo on the wire (real drivers and
emulators, real time), both with short holds. Half of the kills hit the runner alone, half its whole
process group with the record's writer. The time of a kill is uniform over the recording, as long as
one run of each kind took before, and a tenth of that longer: so some hit the evaluation. A run that
ended first is drawn again. After each kill, what the next start would do is done: find, repair,
read back, identify. Lost time is wall-clock time of the force stream: from the last sample found to
the last pushed.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import mmap
import os
import random
import runpy
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from stepload.engine.rehearse import world_for
from stepload.envelope.envelope import envelope_of
from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload.record.reader import read_recording
from stepload.record.recovery import is_being_written
from stepload.session.repair import repair_all
from stepload_verify.emulators.rig_process import RigProcess

BOUND_MS = 100.0
MOST_REFUSED = 5
LONGER = 1.1
ROWS = 1 << 20
HEAD = struct.Struct("<qq")
PROGRESS_BYTES = HEAD.size + 8 * ROWS
HOST = f"127.{192 + os.getpid() % 32}.{os.getpid() // 32 % 256}.1"
SENSOR = "bota_serial"

DRY = {"cycles": 1, "hold": "0.5 s", "tare": "2 s", "warm_up": "0 s"}
WIRE = {
    "step": "10 N", "top_force": "40 N", "hold": "0.3 s", "unload": False, "cycles": 1,
    "tare": "0.5 s", "warm_up": "0 s", "touches": 1, "surface_distance": "2 mm",
    "surface_uncertainty": "0.3 mm", "settle_timeout": "0.3 s",
}  # fmt: skip
"""What is changed in the procedure of either plan."""


@dataclass(frozen=True)
class Kill:
    """One killed run; counts are force samples. `lost_ms` of a record without any is all of it."""

    kind: str
    target: str
    after_s: float
    pushed: int
    durable: int
    kept: int
    lost_ms: float
    state: str
    identified: bool


def victim(progress: str, arguments: Sequence[str]) -> None:
    """Run the `stepload` command and write to a memory file when it pushed each sample."""
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

        self.force = counted

    Recorder.__init__ = watched  # type: ignore[method-assign]
    sys.argv = ["stepload", *arguments]
    runpy.run_module("stepload", run_name="__main__")


def _read(name: str, changes: dict[str, Any]) -> dict[str, Any]:
    path = plan_path(name)
    plan: dict[str, Any] = YAML(typ="safe").load(path)
    plan["payload"] = str(path.parent / plan["payload"])
    plan["procedure"] |= changes
    return plan


@contextmanager
def planned(kind: str, place: Path) -> Iterator[Path]:
    """A plan; the one on the wire with its rig, emulated at addresses of its own."""
    path = place / "plan.yaml"
    if kind == "dry":
        path.write_text(json.dumps(_read("plastic-sphere", DRY)))
        yield path
        return
    plan, port = _read("demo-wire", WIRE), place / "force.tty"
    plan["rig"]["arm"]["options"]["host"] = HOST
    plan["rig"]["force"]["options"]["port"] = str(port)
    path.write_text(json.dumps(plan, default=str))
    world = world_for(envelope_of(load_plan(path)))
    with RigProcess(world, ur=HOST, sensors=(SENSOR,), links={SENSOR: port}):
        yield path


class NotBegunError(Exception):
    """The run ended before its first sample: nothing to kill."""


class Run:
    """A run under way, from its first sample on."""

    def __init__(self, plan: Path, dry: bool) -> None:
        place = plan.parent
        self.directory = place / "runs" / "run"
        progress, said = place / "progress", place / "stderr"
        progress.write_bytes(bytes(PROGRESS_BYTES))
        words = ["run", str(plan), "--quiet", "--out", str(self.directory)]
        with said.open("w") as errors:
            self._process = subprocess.Popen(
                [sys.executable, __file__, "--victim", str(progress), *words]
                + (["--dry-run"] if dry else []),
                start_new_session=True, stdout=subprocess.DEVNULL, stderr=errors,
            )  # fmt: skip
        with progress.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), PROGRESS_BYTES)
        self._times = np.frombuffer(self._memory, np.float64, ROWS, HEAD.size)
        while self.pushed == 0:
            if self.ended:
                raise NotBegunError(said.read_text().strip())
            time.sleep(0.002)

    @property
    def pushed(self) -> int:
        return int(HEAD.unpack_from(self._memory)[0])

    @property
    def durable(self) -> int:
        return int(HEAD.unpack_from(self._memory)[1])

    @property
    def ended(self) -> bool:
        return self._process.poll() is not None

    def finish(self) -> float:
        """Let its record be finished; seconds from its first sample to its last."""
        while not (self.directory / "run.mcap").exists():
            if self.ended:
                raise SystemExit(f"the run ended with code {self._process.returncode}")
            time.sleep(0.01)
        return float(self._times[self.pushed - 1] - self._times[0])

    def kill(self, target: str) -> None:
        with contextlib.suppress(ProcessLookupError):
            if target == "group":
                os.killpg(self._process.pid, signal.SIGKILL)
            else:
                self._process.kill()
        self._process.wait()

    def lost_ms(self, kept: int) -> float:
        last = self._times[self.pushed - 1]
        return 1e3 * float(last - self._times[max(min(kept, self.pushed) - 1, 0)])


@contextmanager
def started(kind: str) -> Iterator[Run]:
    """A run of one kind; nothing is left of it afterwards."""
    with tempfile.TemporaryDirectory() as name, planned(kind, Path(name)) as plan:
        run = Run(plan, dry=kind == "dry")
        try:
            yield run
        finally:
            run.kill("group")


def kill_once(kind: str, target: str, after_s: float) -> Kill | None:
    """One run, killed `after_s` after its first sample; None if it had ended by then."""
    with started(kind) as run:
        time.sleep(after_s)
        if run.ended:
            return None
        run.kill(target)
        part = run.directory / "run.mcap.part"
        while part.exists() and is_being_written(part):
            time.sleep(0.01)
        repaired = repair_all(run.directory.parent)
        kept, state = 0, "repaired" if repaired else "whole"
        try:
            sequence = read_recording(run.directory / "run.mcap").force.sequence
        except BadInputError:
            state = "unreadable"
        else:
            kept = len(sequence)
            if not (np.diff(sequence) == 1).all():
                raise SystemExit("samples are missing in the middle of a repaired record")
        identified = bool(repaired and repaired[0].identification)
        return Kill(
            kind, target, after_s, run.pushed, run.durable, kept, run.lost_ms(kept), state,
            identified,
        )  # fmt: skip


def campaign(kills: int, wire: int, seed: int) -> list[Kill]:
    """Kills in turn on runner and group, first of dry runs, then on the wire."""
    chance, done, refused = random.Random(seed), [], 0
    for kind, count in (("dry", kills - wire), ("wire", wire)):
        if count < 1:
            continue
        with started(kind) as run:
            span_s = LONGER * run.finish()
        for i in range(count):
            kill = None
            while kill is None:
                after_s = chance.uniform(0.0, span_s)
                try:
                    kill = kill_once(kind, ("runner", "group")[i % 2], after_s)
                except NotBegunError as error:
                    refused += 1
                    print(f"\nnot begun, drawn again: {error}", file=sys.stderr)
                    if refused > MOST_REFUSED:
                        raise
            done.append(kill)
            print(f"\r{kind} {i + 1}/{count} ", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
    return done


def table(done: list[Kill]) -> str:
    """The kill table."""
    lines = [
        f"{'run':5} {'killed':7} {'kills':>5} {'repaired':>9} {'whole':>6} {'unreadable':>11} "
        f"{'identified':>11} {'lost ms: median':>16} {'max':>6} {'over 100':>9} "
        f"{'durable rows lost':>18}"
    ]
    groups = [(kind, target) for kind in ("dry", "wire") for target in ("runner", "group")]
    for kind, target in [*groups, ("all", "all")]:
        some = [k for k in done if kind == "all" or (k.kind, k.target) == (kind, target)]
        if not some:
            continue
        lost = [k.lost_ms for k in some]
        states = [k.state for k in some]
        lines.append(
            f"{kind:5} {target:7} {len(some):5} {states.count('repaired'):9} "
            f"{states.count('whole'):6} {states.count('unreadable'):11} "
            f"{sum(k.identified for k in some):11} {statistics.median(lost):16.1f} "
            f"{max(lost):6.1f} {sum(ms > BOUND_MS for ms in lost):9} "
            f"{sum(max(k.durable - k.kept, 0) for k in some):18}"
        )
    return "\n".join(lines)


def main() -> int:
    if sys.argv[1:2] == ["--victim"]:
        victim(sys.argv[2], sys.argv[3:])
        return 0
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--wire", type=int, default=2, help="kills of runs on the wire among them")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    done = campaign(options.kills, min(options.wire, options.kills), options.seed)
    print(json.dumps([asdict(kill) for kill in done]) if options.json else table(done))
    worst_ms = max(kill.lost_ms for kill in done)
    return int(worst_ms > BOUND_MS or any(kill.kept < kill.durable for kill in done))


if __name__ == "__main__":
    sys.exit(main())
