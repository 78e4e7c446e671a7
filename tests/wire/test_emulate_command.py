"""`stepload emulate …` as a process: address out, faults in, one world for a whole rig."""

import json
import signal
import subprocess
import time
from dataclasses import replace

import pytest
from processes import python

from stepload.rig.world import DEFAULT_SPEC
from stepload_drivers.bota.sensor import BotaSerial
from stepload_drivers.gauge.sensor import GaugeSerial
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.live_rig import LiveRig, dump_spec, load_spec
from stepload_verify.emulators.service import obey

PROGRAM = "import sys; from stepload_verify.emulators.command import app; app(sys.argv[1:])"


def emulate(*arguments):
    return python(PROGRAM, *arguments, stdin=subprocess.PIPE)


def test_prints_the_drivers_options_takes_faults_and_quits():
    with emulate("bota", "--fault", "status:0@0+0.5") as process:
        told = json.loads(process.stdout.readline())
        assert told["driver"] == "bota_serial"
        sensor = BotaSerial(**told["options"])
        try:
            sensor.open(5.0)
            process.stdin.write("silent\n")
            process.stdin.flush()
            assert process.stdout.readline() == "ok\n"
            give_up_s = time.monotonic() + 10.0
            while sensor.fault() is None and time.monotonic() < give_up_s:
                time.sleep(0.01)
            assert sensor.fault().code == "stale"
        finally:
            sensor.close()
        process.stdin.write("quit\n")
        process.stdin.flush()
        assert process.wait(10.0) == 0


def test_ends_on_sigterm():
    with emulate("gauge") as process:
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        assert process.wait(10.0) == 0


def test_faults_begin_end_and_clear():
    board = FaultBoard()
    assert obey(board, "drop:0.5+0.05\n") == "ok"
    assert board.magnitude("drop") == 0.5
    time.sleep(0.06)
    assert board.magnitude("drop") is None
    assert obey(board, "zero") == "ok"
    assert obey(board, "clear") == "ok"
    assert not board.on("zero")
    assert obey(board, "nonsense").startswith("error")


def test_a_rig_shares_one_world(tmp_path):
    """Pressing with the arm shows on force sensor and gauge alike."""
    spec = replace(DEFAULT_SPEC, surface_m=0.5e-3, start_force_bias_n=0.0, force_noise_n=0.02)
    path = tmp_path / "world.json"
    path.write_text(dump_spec(spec))
    assert load_spec(path) == spec
    rig = LiveRig(spec, ("bota_serial", "gauge_serial"), {})
    rig.start()
    force = BotaSerial(port=rig.emulators["bota_serial"].address)
    gauge = GaugeSerial(port=rig.emulators["gauge_serial"].address)
    try:
        force.open(5.0)
        gauge.open(5.0)
        force.drain()
        rig.axis.command(0.52e-3)
        felt_n, closed_m = 0.0, 0.0
        give_up_s = time.monotonic() + 10.0
        while True:
            time.sleep(0.05)
            felt_n = next((each.wrench[2] for each in reversed(force.drain())), felt_n)
            closed_m = next((each.displacement_m for each in reversed(gauge.drain())), closed_m)
            state = rig.world.state()
            same_n = pytest.approx(state.force_n, rel=0.05)
            same_m = pytest.approx(state.deformation_m, abs=2e-6)
            alike = state.force_n > 20.0 and felt_n == same_n and closed_m == same_m
            if alike or time.monotonic() > give_up_s:
                break
        assert state.force_n > 20.0
        assert felt_n == same_n
        assert closed_m == same_m
        assert closed_m > 0.0
    finally:
        force.close()
        gauge.close()
        rig.stop()
