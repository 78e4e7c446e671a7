"""Ten minutes of a 1 kHz force sensor and a 500 Hz arm through the real drivers, on the emulator.

    python -m stepload_verify.trials.soak [--seconds 600] [--sensor bota_serial]

Force: nothing lost, nothing repeated (Bota: by its own clock, so exact). Arm: every gap counted
from the controller's time stamps, since ur_rtde keeps only the newest waiting package; at least
98 % must arrive. Exit 1 where that is missed. On a busy machine the arm needs the right to
real-time priority (`ulimit -r`).
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from itertools import pairwise

import numpy as np

from stepload.engine.undisturbed import undisturbed
from stepload.rig.clock import MonotonicClock
from stepload.rig.clockmap import fit_clock
from stepload.rig.device import Arm, ForceSensor, Health
from stepload.rig.plugins import load_driver
from stepload.rig.samples import ArmSample, ForceSample
from stepload_drivers.sim.live import DEFAULT_SPEC
from stepload_verify.emulators.rig_process import RigProcess

HOST = "127.0.10.2"
PATIENT = {"max_age": 2.0, "leash": 2.0, "watchdog": 1.0}
LEAST_SHARE = 0.98


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--sensor", default="bota_serial")
    options = parser.parse_args()
    with RigProcess(DEFAULT_SPEC, ur=HOST, sensors=(options.sensor,)) as rig:
        force = load_driver("stepload.force_sensors", options.sensor)(**rig.options[options.sensor])
        arm = load_driver("stepload.arms", "ur")(**rig.options["ur"], **PATIENT)
        assert isinstance(force, ForceSensor)
        assert isinstance(arm, Arm)
        try:
            print(force.open(15.0), arm.open(15.0), sep="\n", flush=True)
            return _soak(force, arm, options.seconds)
        finally:
            arm.close()
            force.close()


def _soak(force: ForceSensor, arm: Arm, seconds: float) -> int:
    clock, forces, states, late_s = MonotonicClock(), force.drain(), arm.drain(), []
    with undisturbed(virtual=False):
        deadline_s = clock.now_s()
        end_s = deadline_s + seconds
        while deadline_s < end_s and force.fault() is None and arm.fault() is None:
            deadline_s = max(deadline_s + arm.period_s, clock.now_s() - arm.period_s)
            clock.sleep_until(deadline_s)
            late_s.append(clock.now_s() - deadline_s)
            forces += force.drain()
            states += arm.drain()
            arm.command(1e-6 * (len(late_s) // 500 % 2))
        faults = [fault for fault in (force.fault(), arm.fault()) if fault]
        health = force.health(), arm.health()
    arm.close()  # what follows keeps the interpreter busy for seconds
    force.close()
    late_s.sort()
    p50_s, p999_s = late_s[len(late_s) // 2], late_s[int(len(late_s) * 0.999)]
    print(
        f"{len(late_s)} ticks, late p50 {p50_s * 1e6:.0f} µs, p99.9 {p999_s * 1e3:.2f} ms, worst "
        f"{late_s[-1] * 1e3:.1f} ms"
    )
    good = all([_report_force(health[0], forces), _report_arm(health[1], states)])
    for fault in faults:
        print(f"fault: {fault.code}: {fault.message}")
    return 0 if good and not faults else 1


def _report_force(health: Health, samples: list[ForceSample]) -> bool:
    steps = Counter(b.sequence - a.sequence for a, b in pairwise(samples))
    repeated = sum(count for step, count in steps.items() if step < 1)
    print(f"force: {len(samples)} samples, {health.rate_hz:.2f} Hz, lost {health.lost}, repeated "
          f"{repeated}, errors {dict(health.errors)}, longest gap "
          f"{health.longest_gap_s * 1e3:.1f} ms{_clock(samples)}")  # fmt: skip
    return repeated == 0 and health.lost == 0


def _report_arm(health: Health, samples: list[ArmSample]) -> bool:
    steps = Counter(b.sequence - a.sequence for a, b in pairwise(samples))
    repeated = sum(count for step, count in steps.items() if step < 1)
    share = health.received / (health.received + health.lost)
    missing = {step - 1: count for step, count in sorted(steps.items()) if step > 1}
    print(f"arm: received {health.received} of {health.received + health.lost} ({share:.2%}), "
          f"repeated {repeated}, {sum(missing.values())} gaps (missing: times) {missing}, longest "
          f"{health.longest_gap_s * 1e3:.0f} ms{_clock(samples)}")  # fmt: skip
    counted = sum(size * count for size, count in missing.items())
    return share >= LEAST_SHARE and repeated == 0 and counted <= health.lost


def _clock(samples: list[ForceSample] | list[ArmSample]) -> str:
    device_s = np.array([sample.device_time_s for sample in samples])
    if not np.isfinite(device_s).all():
        return ""
    fit = fit_clock(device_s, np.array([sample.receive_time_s for sample in samples]))
    return (
        f"; clock skew {fit.skew * 1e6:+.2f} ppm, residual p50 {fit.residual_median_us:.0f} µs, "
        f"p99 {fit.residual_p99_us:.0f} µs"
    )


if __name__ == "__main__":
    sys.exit(main())
