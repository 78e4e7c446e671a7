"""Runs a command again and again on a machine made busy, and prints each run's last line.

    python tests/helpers/under_load.py [--runs 10] [--only busy|stopped] -- .venv/bin/pytest

busy      beside four endless loops
stopped   with the command and all that it started stopped for 20 to 250 ms every 0.7 s

The exit status is 0 if every run's was.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

LOOPS = 4
EVERY_S = 0.7
SHORTEST_S, LONGEST_S = 0.02, 0.25


@contextlib.contextmanager
def busy(_: int) -> Iterator[None]:
    """Endless loops beside the command."""
    loop = [sys.executable, "-c", f"import os\nwhile os.getppid() == {os.getpid()}: pass"]
    loops = [subprocess.Popen(loop) for _ in range(LOOPS)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()


@contextlib.contextmanager
def stopped(pid: int) -> Iterator[None]:
    """Stops of the process `pid` and all below it, of random lengths."""
    lengths = random.Random(1)
    over = threading.Event()

    def stall() -> None:
        while not over.wait(EVERY_S):
            frozen = freeze(pid)
            time.sleep(lengths.uniform(SHORTEST_S, LONGEST_S))
            for each in reversed(frozen):
                send(each, signal.SIGCONT)

    thread = threading.Thread(target=stall)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def freeze(pid: int) -> list[int]:
    """Stop a process and its descendants, except those that stand still already; who was stopped.

    Parents first: a process that has been stopped starts no more.
    """
    frozen = []
    if state_of(pid) not in "TZ":
        send(pid, signal.SIGSTOP)
        frozen.append(pid)
    for child in children_of(pid):
        frozen += freeze(child)
    return frozen


def state_of(pid: int) -> str:
    """One letter as in `ps`; Z also for a process that is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


def children_of(pid: int) -> list[int]:
    """The processes that any thread of `pid` has started."""
    found: list[int] = []
    with contextlib.suppress(OSError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            found += map(int, (task / "children").read_text().split())
    return found


def send(pid: int, number: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def run_once(command: list[str], how: str) -> bool:
    """Run the command under this load and print its last line; whether it ended with status 0."""
    began_s = time.monotonic()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        with {"busy": busy, "stopped": stopped}[how](process.pid):
            out, _ = process.communicate()
        status = process.returncode
    lines = out.strip().splitlines() or [""]
    told = lines if status else [x for x in lines if x.startswith(("rerun: ", "inconclusive: "))]
    print("\n".join(told), flush=True)
    took_s = time.monotonic() - began_s
    print(f"{how}: status {status}, {took_s:.0f} s: {lines[-1]}", flush=True)
    return status == 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--only", choices=["busy", "stopped"])
    parser.add_argument("command", nargs="+")
    arguments = parser.parse_args()
    kinds = [arguments.only] if arguments.only else ["busy", "stopped"]
    ends = [run_once(arguments.command, how) for how in kinds for _ in range(arguments.runs)]
    print(f"{sum(ends)} of {len(ends)} runs ended with status 0")
    sys.exit(not all(ends))


if __name__ == "__main__":
    main()
