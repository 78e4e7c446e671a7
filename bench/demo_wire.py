"""A whole plan in real time: the real drivers, against emulators of their devices on this machine.

    python bench/demo_wire.py [--out DIRECTORY]

Emulates the rig of `procedures/demo-wire.yaml` and runs `stepload run` on that plan. Ends with a
report, and with the exit code of the run.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from stepload.errors import SteploadError
from stepload.plan.load import load_plan
from stepload.rehearse import world_for
from stepload_drivers.emulators.rig_process import RigProcess

PLAN = Path(__file__).parents[1] / "procedures" / "demo-wire.yaml"
STEPLOAD = "from stepload.cli.main import main; main()"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--out", help="directory for the run's files; default: a new one")
    out = parser.parse_args().out
    plan = load_plan(PLAN)
    arm, force = plan.rig.arm.driver, plan.rig.force.driver
    port = Path(str(force.options["port"]))
    try:
        rig = RigProcess(
            world_for(plan),
            ur=str(arm.options["host"]),
            sensors=(force.name,),
            links={force.name: port},
        )
    except SteploadError as error:
        print(f"error: {error}", file=sys.stderr)
        return int(error.exit_code)
    with rig:
        print(f"emulated: ur at {arm.options['host']}, {force.name} at {port}\n", flush=True)
        words = ["run", str(PLAN), *(["--out", out] if out else [])]
        return subprocess.call([sys.executable, "-c", STEPLOAD, *words])


if __name__ == "__main__":
    sys.exit(main())
