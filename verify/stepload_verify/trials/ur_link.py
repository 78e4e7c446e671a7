"""How much of the arm's data arrives through the real driver, on the emulator.

    python -m stepload_verify.trials.ur_link [seconds]

Prints the share of the controller's periods received, the gaps as counted from its time stamps, and
how old a sample is, from its receipt on, when the loop reads it.
"""

from __future__ import annotations

import sys
import time

from stepload_drivers.ur.arm import UrArm
from stepload_verify.emulators.ur_process import UrEmulatorProcess


def main(seconds: float) -> None:
    with UrEmulatorProcess("127.10.0.1") as emulator:
        arm = UrArm(host=emulator.host, max_age=1.0, leash=1.0, watchdog=2.0)
        arm.open(15.0)
        samples = arm.drain()
        end_s = time.monotonic() + seconds
        tick_s = time.monotonic()
        lateness_s = []
        while tick_s < end_s and arm.fault() is None:
            tick_s += arm.period_s
            time.sleep(max(0.0, tick_s - time.monotonic()))
            batch = arm.drain()
            now_s = time.monotonic()
            lateness_s += [now_s - sample.receive_time_s for sample in batch]
            samples += batch
            arm.command(1e-6)
        health, fault = arm.health(), arm.fault()
        arm.close()
    sequences = [sample.sequence for sample in samples]
    assert sequences == sorted(set(sequences))
    lateness_s.sort()
    share = health.received / (health.received + health.lost)
    print(f"received {health.received} of {health.received + health.lost} ({share:.2%})")
    print(f"gaps {health.errors['gaps']}, longest {health.longest_gap_s * 1e3:.0f} ms")
    for percent in (50, 99, 99.9):
        value = lateness_s[min(len(lateness_s) - 1, int(len(lateness_s) * percent / 100))]
        print(f"age of a sample when drained, p{percent}: {value * 1e3:.2f} ms")
    print(f"fault: {fault}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)
