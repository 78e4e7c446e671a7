"""`stepload run` killed by SIGKILL while the arm presses: what is left takes the force off."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from stepload.engine.rehearse import world_for
from stepload.feasibility.preflight import preflight_of
from stepload.plan.load import load_plan
from stepload_verify.emulators.rig_process import RigProcess

DEMO = Path(__file__).parents[3] / "procedures" / "demo-wire.yaml"
QUICK = {
    "payload: payloads": f"payload: {DEMO.parent}/payloads",
    "tare: 3 s": "tare: 0.5 s",
    "warm_up: 1 s": "warm_up: 0 s",
    "touches: 2": "touches: 1",
    "surface_distance: 5 mm": "surface_distance: 0.3 mm",
    "surface_uncertainty: 0.5 mm": "surface_uncertainty: 0.05 mm",
}
PRESSING_N, FREE_N = 5.0, 0.5
LIMIT_S = 60.0


def wait_for(condition):
    give_up_s = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < give_up_s, "did not happen in time"
        time.sleep(0.02)


@pytest.mark.long
def test_a_killed_run_leaves_no_force_and_no_process(tmp_path, free_host):
    text = DEMO.read_text()
    for old, new in QUICK.items():
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    plan = load_plan(path)
    spec = replace(world_for(preflight_of(plan)), surface_m=plan.procedure.surface_distance_m)
    port = tmp_path / "sensor.tty"
    with RigProcess(spec, ur=free_host, links={"bota_serial": port}) as rig:
        host = rig.options["ur"]["host"]
        path.write_text(text.replace("127.0.10.1", host).replace("runs/demo-wire.tty", str(port)))
        command = [sys.executable, "-m", "stepload", "run", str(path), "--out", str(tmp_path / "r")]
        with subprocess.Popen(command, start_new_session=True) as run:
            try:
                wait_for(lambda: run.poll() is not None or rig.state()["contact_n"] > PRESSING_N)
                assert run.poll() is None
                children = processes_below(run.pid)
                assert children, "ur_rtde has a process of its own"
            finally:
                os.kill(run.pid, signal.SIGKILL)
        wait_for(lambda: rig.state()["contact_n"] < FREE_N and not rig.state()["moving"])
        wait_for(lambda: not any(alive(pid) for pid in children))
        assert rig.state()["peak_n"] < plan.payload.declared_force_limit_n
        assert rig.state()["runtime_state"] == 1


def processes_below(pid):
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True)
    return [int(word) for word in found.stdout.split()]


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
