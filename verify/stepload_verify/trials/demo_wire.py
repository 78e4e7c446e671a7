"""A whole plan in real time: the real drivers, against emulators of their devices on this machine.

    python -m stepload_verify.trials.demo_wire [--out DIRECTORY | --serve]

Emulates the rig of `procedures/demo-wire.yaml` and runs `stepload run` on that plan. Ends with a
report, and with the exit code of the run. With --serve it only emulates, and takes faults as lines
on standard input: run, doctor and `drivers test` can then be tried from another terminal.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
from pathlib import Path

from stepload.engine.rehearse import world_for
from stepload.errors import SteploadError
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload_verify.emulators.rig_process import RigProcess
from stepload_verify.emulators.ur_faults import HELP

PLAN = plan_path("demo-wire")


def _serve(rig: RigProcess) -> int:
    print("faults of the arm: `help`; of the sensor: `bota_serial FAULT`; `quit` or Ctrl+C ends")
    with contextlib.suppress(KeyboardInterrupt):
        for line in map(str.strip, sys.stdin):
            if line == "quit":
                break
            if line == "help":
                print(HELP)
            elif line:
                try:
                    print(rig.command(line), flush=True)
                except RuntimeError as error:
                    print(error, flush=True)
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", help="directory for the run's files; default: a new one")
    parser.add_argument("--serve", action="store_true", help="only emulate, until Ctrl+C")
    options = parser.parse_args()
    plan = load_plan(PLAN)
    arm, force = plan.rig.arm, plan.rig.force
    port = Path(str(force.options["port"]))
    try:
        rig = RigProcess(
            world_for(preflight_of(plan)),
            ur=str(arm.options["host"]),
            sensors=(force.driver,),
            links={force.driver: port},
        )
    except SteploadError as error:
        print(f"error: {error}", file=sys.stderr)
        return int(error.exit_code)
    with rig:
        print(f"emulated: ur at {arm.options['host']}, {force.driver} at {port}\n", flush=True)
        if options.serve:
            return _serve(rig)
        words = ["run", str(PLAN), *(["--out", options.out] if options.out else [])]
        return subprocess.call([sys.executable, "-m", "stepload", *words])


if __name__ == "__main__":
    sys.exit(main())
