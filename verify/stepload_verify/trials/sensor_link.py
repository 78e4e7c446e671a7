"""Every 1 kHz sensor driver on its emulator in another process: lost, repeated, longest gap, CPU.

python -m stepload_verify.trials.sensor_link --seconds 600
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time

from stepload.rig.device import ForceSensor
from stepload.rig.plugins import load_driver

LINKS = {
    "bota": [],
    "robotous-uart": [],
    "robotous-can": ["--transport", "slcan"],
    "robotous-can socketcand": ["--transport", "socketcand"],
    "ati": ["--transport", "slcan"],
}


def measure(name: str, arguments: list[str], seconds: float) -> bool:
    """Print one line; whether nothing was lost or repeated."""
    with subprocess.Popen(
        [sys.executable, "-m", "stepload", "emulate", name.split()[0], *arguments, "--until-eof"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        told = json.loads(process.stdout.readline())
        driver = load_driver("stepload.force_sensors", told["driver"])
        sensor = driver(**told["options"], rate=1000.0)  # type: ignore[call-arg]
        assert isinstance(sensor, ForceSensor)
        try:
            sensor.open(10.0)
            cpu_s, last, repeated, count = time.process_time(), 0, 0, 0
            end_s = time.monotonic() + seconds
            while time.monotonic() < end_s:
                time.sleep(0.002)
                for sample in sensor.drain():
                    repeated += sample.sequence <= last
                    last = sample.sequence
                    count += 1
            share = (time.process_time() - cpu_s) / seconds
            health, fault = sensor.health(), sensor.fault()
        finally:
            sensor.close()
            assert process.stdin is not None
            process.stdin.close()
    print(
        f"{name:24}{count:9} samples {health.rate_hz:8.2f} Hz  "
        f"lost {health.lost}  repeated {repeated}  errors {dict(health.errors)}  "
        f"longest gap {health.longest_gap_s * 1e3:.1f} ms  "
        f"CPU {100 * share:.0f} %  {fault.code if fault else 'no fault'}"
    )
    return health.lost == repeated == 0 and fault is None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    results = [measure(name, rest, options.seconds) for name, rest in LINKS.items()]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
