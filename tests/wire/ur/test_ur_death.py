"""Death and silence on our side: the run's process, the child, or only the loop."""

from __future__ import annotations

import os
import signal
import time

import pytest
from long_ones import long_rows
from processes import python

from stepload.rig.faults import FaultCode
from stepload_drivers.ur.process import ChildProcess
from stepload_drivers.ur.settings import Settings

RUN = """
import sys, time
from stepload_drivers.ur.arm import UrArm
arm = UrArm(host=sys.argv[1], max_age=0.5, command_timeout=0.5, watchdog=5.0, prove_watchdog=False)
arm.open(15.0)
target_m = 0.0
print(arm._child.pid, flush=True)
while True:
    arm.drain()
    target_m += 1e-5
    arm.command(target_m)
    time.sleep(0.005)
"""


def gone(pid):
    """Whether a process has ended (a zombie has)."""
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_for(condition, limit_s=5.0):
    give_up_s = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < give_up_s, "did not happen in time"
        time.sleep(0.02)


def stopped_by_watchdog(emulator):
    truth = emulator.state()
    return truth["watchdog_trips"] == 1 and truth["runtime_state"] == 1 and not truth["moving"]


@pytest.fixture
def run(start_emulator):
    emulator = start_emulator()
    with python(RUN, emulator.host) as process:
        child = int(process.stdout.readline())
        wait_for(lambda: emulator.state()["position_m"] > 5e-5)
        yield emulator, process, child


def test_kill_of_the_run_ends_child_and_motion(run):
    emulator, process, child = run
    process.send_signal(signal.SIGKILL)
    wait_for(lambda: gone(child))
    wait_for(lambda: emulator.state()["runtime_state"] == 1)
    before = emulator.state()["position_m"]
    assert before < 0.0
    time.sleep(0.2)
    assert emulator.state()["position_m"] == pytest.approx(before, abs=1e-9)


def test_kill_of_the_run_under_load_unloads(start_emulator):
    world = {"surface_m": 2e-4, "system_stiffness_n_per_m": 1e5, "effective_mass_kg": 5.0,
             "system_damping_n_s_per_m": 1.5e3, "arm_force_noise_n": 0.1}  # fmt: skip
    emulator = start_emulator(world=world)
    with python(RUN, emulator.host) as process:
        child = int(process.stdout.readline())
        wait_for(lambda: emulator.state()["force_n"] > 10.0)
        process.send_signal(signal.SIGKILL)
    before = emulator.state()["position_m"]
    wait_for(lambda: gone(child))
    after = emulator.state()
    assert after["position_m"] == pytest.approx(before - 5e-3, abs=0.5e-3)
    assert after["force_n"] < 1.0
    assert after["runtime_state"] == 1


def test_kill_of_run_and_child_at_once_leaves_the_stop_to_the_watchdog(run):
    emulator, process, child = run
    os.kill(child, signal.SIGSTOP)
    process.send_signal(signal.SIGKILL)
    os.kill(child, signal.SIGKILL)
    wait_for(lambda: stopped_by_watchdog(emulator))


def test_hung_run_is_left_to_the_watchdog(run):
    emulator, process, child = run
    process.send_signal(signal.SIGSTOP)
    wait_for(lambda: stopped_by_watchdog(emulator))
    assert not gone(child)


def test_ctrl_c_in_the_terminal_does_not_reach_the_child(run):
    _, process, child = run
    assert os.getsid(child) != os.getsid(process.pid)


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGKILL, FaultCode.DRIVER), (signal.SIGSTOP, FaultCode.STALE),
     *long_rows([(signal.SIGSEGV, FaultCode.DRIVER)])],
)  # fmt: skip
def test_death_of_the_child_is_a_fault_and_the_arm_can_still_be_stopped(
    start_emulator, make_arm, follow, after, number, code
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    arm.open(15.0)
    follow(arm, after(0.2))
    os.kill(arm._child.pid, number)
    follow(arm, lambda: arm.fault() is not None, 3.0)
    assert arm.fault().code == code
    arm.safe(3.0)
    assert emulator.state()["runtime_state"] == 1


def test_silent_run_trips_the_watchdog_and_is_told_so(start_emulator, make_arm, follow, after):
    emulator = start_emulator()
    arm = make_arm(emulator.host, command_timeout=0.1)
    arm.open(15.0)
    follow(arm, after(0.2))
    wait_for(lambda: stopped_by_watchdog(emulator))
    wait_for(lambda: arm.fault() is not None)
    assert arm.fault().code == FaultCode.WATCHDOG_STOP


def test_a_constructor_that_hangs_with_the_interpreter_held_is_ended(start_emulator):
    emulator = start_emulator(commands=["blackhole on"])
    settings = Settings(host=emulator.host)
    child = ChildProcess(settings, 0.002, connect_s=0.7)
    wait_for(lambda: child.receive(0.01) is not None and child.ended)
    words = child.last_words()
    child.kill()
    assert "hung" in words
