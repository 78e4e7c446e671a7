"""What the plugin for real-time tests makes of failures with and without a stall of the host."""

from __future__ import annotations

import os
import socket
import threading
import time

import pytest
from stall_meter import StallMeter, longest_s

FAKE = """
from collections import deque
import realtime
from stall_meter import Stall, StallMeter

STALLS = deque()

class FakeMeter(StallMeter):
    def __init__(self):
        self._stalls, self._under_way = STALLS, deque()

    def close(self):
        pass

realtime.StallMeter = FakeMeter
"""

HEAD = """
import time
import pytest
from conftest import STALLS, Stall

def stall(length_s):
    now_s = time.monotonic()
    STALLS.append(Stall(now_s - length_s, length_s))

runs = []
"""

LONG, SHORT = "stall(0.05)", "stall(0.01)"


@pytest.fixture
def run(pytester, monkeypatch):
    """Runs these tests under the plugin, whose meter sees what they say it does."""
    pytester.makeconftest(FAKE)
    pytester.makeini("[pytest]\naddopts = -p realtime\nmarkers = realtime")
    monkeypatch.setattr("realtime.StallMeter", StallMeter)  # put back after the fake

    def started(text, *arguments):
        pytester.makepyfile(HEAD + text)
        return pytester.runpytest_inprocess(*arguments)

    return started


def of_a_test(body, mark="@pytest.mark.realtime(tolerates_s=0.02)"):
    return f"{mark}\ndef test_it():\n    runs.append(1)\n    {body}\n"


@pytest.mark.parametrize("stall", ["pass", SHORT], ids=["none", "short"])
def test_a_failure_without_a_long_stall_fails_at_once(run, stall):
    result = run(of_a_test(f"{stall}; assert not runs"))
    assert result.ret == 1
    result.assert_outcomes(failed=1)
    result.stdout.no_fnmatch_line("*stalls of the host*")


def test_a_failure_in_a_stall_is_run_again_and_told(run):
    result = run(of_a_test(f"{LONG}; assert len(runs) == 3"))
    assert result.ret == 0
    result.stdout.fnmatch_lines(
        ["rerun: *::test_it: the host stalled for 50 ms; *", "*1 passed, 2 rerun in*"]
    )


def test_a_failure_in_three_stalled_reruns_is_inconclusive(run):
    result = run(of_a_test(f"{LONG}; assert False, len(runs)"))
    assert result.ret == 0
    result.stdout.fnmatch_lines(
        ["inconclusive: *::test_it: the host stalled for 50 ms, 50 ms, 50 ms, 50 ms; *",
         "*3 rerun, 1 inconclusive in*"],
    )  # fmt: skip


def test_a_test_that_does_not_run_in_real_time_is_never_run_again(run):
    result = run(of_a_test(f"{LONG}; assert False", mark=""))
    assert result.ret == 1
    result.assert_outcomes(failed=1)


@pytest.mark.parametrize(("survives_s", "runs"), [(0.02, 1), (0.005, 0)])
def test_only_what_survives_a_long_stall_runs_beside_another(run, survives_s, runs):
    mark = f"@pytest.mark.realtime(tolerates_s={survives_s})"
    result = run(of_a_test("pass", mark=mark), "-m", "patient")
    result.assert_outcomes(passed=runs, deselected=1 - runs)


@pytest.mark.parametrize("arrives", [True, False])
def test_the_meter_sees_that_a_line_was_held(monkeypatch, arrives):
    (far, slow), (fast, near) = socket.socketpair(), socket.socketpair()
    monkeypatch.setattr(os, "openpty", lambda: (far.detach(), near.detach()))
    monkeypatch.setattr("tty.setraw", lambda fd: None)
    held, let_go = threading.Event(), threading.Event()

    def hand_on():
        while data := slow.recv(4096):
            if held.is_set():
                let_go.wait(2.0)
            fast.sendall(data)

    line = threading.Thread(target=hand_on, daemon=True)
    line.start()
    meter = StallMeter()
    held.set()
    began_s = time.monotonic()
    time.sleep(0.2)
    if arrives:
        let_go.set()
        time.sleep(0.02)
    assert longest_s(meter.between(began_s, time.monotonic())) > 0.15
    let_go.set()
    meter.close()
    line.join()
    slow.close()
    fast.close()
