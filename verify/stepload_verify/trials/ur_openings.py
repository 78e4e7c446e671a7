"""Open the real driver again and again while the controller serves its clients one by one.

    python -m stepload_verify.trials.ur_openings [--openings 200] [--prove 5]

A controller sends to each RTDE client apart: what one connection of ur_rtde says is up to a few
milliseconds ahead of the other. For each gap the emulator draws the order anew at every package.
Every opening starves the watchdog and starts the program again; every `--prove`-th also stops the
arm in motion. Prints successes and failures by gap; status 1 where there was a failure.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter

from stepload.errors import SteploadError
from stepload_drivers.ur.arm import UrArm
from stepload_verify.emulators.ur_process import UrEmulatorProcess

GAPS_S = (0.0, 0.1e-3, 0.25e-3, 0.5e-3, 1e-3, 2e-3)
OPEN_S = 15.0
PATIENT = {"max_age": 0.5, "leash": 0.5}
"""Generous limits, as this machine may stall; this trial is not about old data."""


def opening(host: str, *, prove: bool) -> str:
    """Open the arm once and return what went wrong; "" if nothing did."""
    arm = UrArm(host=host, **PATIENT)
    try:
        arm.open(OPEN_S)
        if prove:
            arm.prove_stop(1e-3, 0.01, 10.0)
        if fault := arm.fault():
            return f"{fault.code}: {fault.message}"
        return "" if arm.drain() else "no sample"
    except SteploadError as error:
        return error.message
    finally:
        arm.close()


def main() -> int:
    """Run the trial as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--openings", type=int, default=200)
    parser.add_argument("--prove", type=int, default=5)
    asked = parser.parse_args()
    failed = 0
    for number, gap_s in enumerate(GAPS_S):
        count = len(range(number, asked.openings, len(GAPS_S)))
        host = f"127.12.{os.getpid() % 250}.{number + 1}"
        lines = [f"gap {gap_s}", f"gap-jitter {0.5 * gap_s}"]
        began_s, why = time.monotonic(), Counter[str]()
        with UrEmulatorProcess(host, commands=lines) as emulator:
            for turn in range(count):
                why[opening(emulator.host, prove=turn % asked.prove == 0)] += 1
        good = why.pop("", 0)
        failed += count - good
        each_s = (time.monotonic() - began_s) / max(1, count)
        print(f"gap {gap_s * 1e3:4.2f} ms: {good} of {count} opened, {each_s:.2f} s each")
        for message, times in why.most_common():
            print(f"    {times} x {message}")
        sys.stdout.flush()
    print(f"{asked.openings - failed} of {asked.openings} opened")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
