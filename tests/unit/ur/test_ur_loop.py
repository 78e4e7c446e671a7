"""The child's loop: what it sends, when it falls silent, and what it dies of."""

from __future__ import annotations

import itertools
import math
import re
from types import SimpleNamespace

import pytest
from ur_fakes import PERIOD_S, Died

from stepload.rig.faults import FaultCode
from stepload_drivers.ur import loop as loop_module
from stepload_drivers.ur import procedures, wire
from stepload_drivers.ur import watch as watch_module
from stepload_drivers.ur.state import PAUSED, PLAYING

WATCHDOG_S = 0.1


def requested(remote):
    """Remote control as the dashboard tells it."""
    return SimpleNamespace(
        done=lambda: True, poll=lambda: None, end_program=lambda: None, remote=remote
    )


def targets(ur) -> list[float]:
    return [target_m for target_m, _ in ur.of("servo")]


def test_every_package_goes_to_the_run_once_with_the_time_it_was_seen(
    make_loop, link, clock, step_for
):
    loop = make_loop()
    step_for(loop, 0.02)
    samples = [wire.unpack_sample(m) for m in link.sent if m[:1] == wire.SAMPLE]
    stamps = [package.timestamp_s for _, package in samples]
    assert stamps == sorted(set(stamps))
    assert len(stamps) >= 10
    assert samples[-1][0] == pytest.approx(clock.now_s, abs=2 * PERIOD_S)


def test_a_target_goes_out_at_once_along_the_approach(make_loop, ur, link, clock):
    loop = make_loop()
    link.arrives(0.0, wire.pack_target(1e-3))
    before_s = clock.now_s
    loop.step()
    ((target_m, sent_s),) = ur.of("servo")
    assert target_m == pytest.approx(1e-3)
    assert sent_s - before_s < 2 * loop_module.POLL_S
    assert loop.commanded_m == 1e-3


def test_without_a_target_the_watchdog_is_fed_in_time(make_loop, ur, step_for):
    step_for(make_loop(), 0.5)
    times = [time_s for _, time_s in ur.of("kick")]
    assert targets(ur) == []
    assert max(b - a for a, b in itertools.pairwise(times)) < 0.5 * WATCHDOG_S
    assert len(times) < 40


def test_the_last_target_is_repeated_while_the_run_lives(make_loop, ur, link, step_for):
    loop = make_loop(command_timeout=0.1)
    link.arrives(0.0, wire.pack_target(1e-3))
    for tick in range(1, 20):
        link.arrives(0.05 * tick, wire.BEAT)
    step_for(loop, 1.0)
    times = [time_s for _, time_s in ur.of("servo")]
    assert max(b - a for a, b in itertools.pairwise(times)) < 0.5 * WATCHDOG_S
    assert ur.of("kick") == []


def test_a_silent_run_leaves_an_arm_under_way_to_the_controllers_watchdog(
    make_loop, ur, link, clock, step_for
):
    loop = make_loop(command_timeout=0.1)
    link.arrives(0.0, wire.pack_target(1e-3))
    received_s = clock.now_s
    step_for(loop, 1.0)
    assert ur.inputs[-1][2] <= received_s + 0.1 + 2 * PERIOD_S


def test_a_silent_run_that_follows_no_target_keeps_its_program(make_loop, ur, clock, step_for):
    step_for(make_loop(command_timeout=0.1), 1.0)
    assert clock.now_s - ur.inputs[-1][2] < WATCHDOG_S


def test_a_muted_loop_sends_nothing_until_the_next_target(make_loop, ur, link, step_for):
    loop = make_loop()
    loop.muted = True
    step_for(loop, 0.3)
    assert ur.inputs == []
    link.arrives(0.0, wire.pack_target(0.0))
    step_for(loop, 0.01)
    assert len(targets(ur)) == 1


@pytest.mark.parametrize(
    "target",
    [(math.nan,), (math.inf,), (-math.inf,), (1e-3, (math.nan, 0.0)), (1e-3, (0.0, math.inf))],
)
def test_a_target_that_is_not_finite_never_reaches_the_controller(
    make_loop, ur, link, step_for, target
):
    loop = make_loop()
    link.arrives(0.0, wire.pack_target(*target))
    with pytest.raises(Died):
        step_for(loop, 0.01)
    assert targets(ur) == []
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.NOT_FINITE


@pytest.mark.parametrize("control", [False, True])
def test_a_closed_connection_ends_the_process(make_loop, ur, link, step_for, control):
    loop = make_loop(control=control)
    ur.is_connected = False
    with pytest.raises(Died):
        step_for(loop, 0.01)
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.NOT_CONNECTED


def test_the_control_ports_loss_alone_ends_the_process(make_loop, link, step_for):
    loop = make_loop()
    loop.control = SimpleNamespace(connected=lambda: False)
    with pytest.raises(Died):
        loop.step()


def test_old_data_end_the_process_at_the_age_limit(make_loop, ur, link, clock, step_for):
    loop = make_loop(max_age=0.05)
    step_for(loop, 0.01)
    ur.silent = True
    began_s = clock.now_s
    with pytest.raises(Died):
        step_for(loop, 1.0)
    assert 0.04 < clock.now_s - began_s < 0.06
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.STALE


@pytest.mark.parametrize("ahead_s", [-0.01, -2.0, 1.5])
def test_a_clock_that_jumps_ends_the_process(make_loop, ur, link, step_for, ahead_s):
    loop = make_loop()
    step_for(loop, 0.01)
    ur.clock_ahead_s = ahead_s
    with pytest.raises(Died):
        step_for(loop, 0.01)
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.CLOCK


def test_a_clock_that_runs_away_slowly_ends_the_process(make_loop, ur, link, clock, step_for):
    loop = make_loop()
    for _ in range(15):
        ur.clock_ahead_s += 0.1
        try:
            step_for(loop, 0.01)
        except Died:
            break
    assert ur.clock_ahead_s == pytest.approx(1.1, abs=0.11)
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.CLOCK


def test_values_that_cannot_be_true_end_the_process_and_are_not_handed_on(
    make_loop, ur, link, step_for
):
    loop = make_loop()
    ur.pose_of = lambda position_m: (math.nan, 0.0, 0.0)
    known = len(link.sent)
    with pytest.raises(Died):
        step_for(loop, 0.01)
    assert [m[:1] for m in link.sent[known:]] == [wire.FAULT]


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"safety_mode": 3}, FaultCode.PROTECTIVE_STOP),
        ({"safety_bits": 1 << 7}, FaultCode.EMERGENCY_STOP),
        ({"runtime_state": 1}, FaultCode.PROGRAM_STOPPED),
    ],
)
def test_a_stop_is_reported_once_and_mutes(make_loop, ur, link, step_for, fields, code):
    loop = make_loop()
    ur.fields.update(fields)
    step_for(loop, 0.01)
    sent = len(ur.inputs)
    step_for(loop, 0.5)
    assert [fault["code"] for fault in link.told(wire.FAULT)] == [code]
    assert len(ur.inputs) == sent
    stops = [what for what, _, _ in ur.inputs if what == "dashboard stop"]
    assert len(stops) == (0 if code is FaultCode.PROGRAM_STOPPED else 1)
    link.arrives(0.0, wire.pack_target(-1e-3))
    ur.fields.update(safety_mode=1, safety_bits=1, runtime_state=PLAYING)  # released, it goes on
    step_for(loop, 0.5)
    assert ur.of("servo") == []
    with pytest.raises(procedures.RequestError, match="no motion"):
        procedures.retract(loop, 1e-3, 0.01)


def test_a_program_that_ended_in_our_silence_was_ended_by_its_watchdog(make_loop, ur, link, clock):
    loop = make_loop(watchdog=10.0)
    loop.sent_s = clock.now_s - 0.1
    ur.fields["runtime_state"] = 1
    for _ in range(20):
        loop.step()
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.WATCHDOG_STOP
    assert not loop.taken_over
    ur.fields["safety_mode"] = 3  # a stop after the fault that was reported
    for _ in range(20):
        loop.step()
    assert loop.taken_over
    assert len(link.told(wire.FAULT)) == 1


def test_a_program_that_ended_in_half_the_watchdogs_time_may_have_been_ended_by_a_person(
    make_loop, ur, link, clock
):
    loop = make_loop(watchdog=10.0)
    loop.sent_s = clock.now_s - 0.05
    ur.fields["runtime_state"] = 1
    for _ in range(20):
        loop.step()
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.PROGRAM_STOPPED
    assert loop.taken_over


def test_a_pause_in_our_silence_is_a_persons(make_loop, ur, link, clock):
    loop = make_loop(watchdog=10.0)
    loop.sent_s = clock.now_s - 0.1
    ur.fields["runtime_state"] = PAUSED
    for _ in range(20):
        loop.step()
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.PROGRAM_STOPPED
    assert loop.taken_over


def test_every_package_keeps_the_process_alive_for_a_while(make_loop, link, step_for, monkeypatch):
    loop, alive = make_loop(), []
    monkeypatch.setattr(loop_module, "stay_alive_for", alive.append)
    link.sent.clear()
    step_for(loop, 0.1)
    assert alive == [loop_module.HANG_S] * len([m for m in link.sent if m[:1] == wire.SAMPLE])
    assert alive


def test_local_control_is_told_apart_from_a_program_that_ended(
    make_loop, ur, link, step_for, monkeypatch
):
    monkeypatch.setattr(watch_module, "RemoteCheck", lambda host: requested(remote=False))
    loop = make_loop()
    ur.fields["runtime_state"] = 1
    step_for(loop, 0.01)
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.NOT_REMOTE


def test_a_stop_that_is_wanted_is_no_fault(make_loop, ur, link, step_for):
    loop = make_loop()
    loop.expect_stop = True
    ur.fields["runtime_state"] = 1
    step_for(loop, 0.1)
    assert link.told(wire.FAULT) == []


def test_refused_inputs_are_a_fault_after_a_moment_and_one_taken_forgives(
    make_loop, ur, link, step_for
):
    loop = make_loop()
    ur.accepts = False
    step_for(loop, 0.03)
    ur.accepts = True
    step_for(loop, 0.1)
    assert link.told(wire.FAULT) == []
    ur.accepts = False
    step_for(loop, 0.2)
    assert link.told(wire.FAULT)[0]["code"] == FaultCode.REFUSED_COMMAND
    assert not loop.taken_over
    assert "dashboard stop" not in [what for what, _, _ in ur.inputs]  # it may still retract


def connected(make_loop, **options):
    loop = make_loop(control=False, prove_watchdog=False, **options)
    procedures.connect(loop)
    return loop


def faults(link):
    return [(fault["code"], fault["message"]) for fault in link.told(wire.FAULT)]


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"speed_fraction": 0.5}, "speed slider from 100 % to 50 %"),
        ({"payload_kg": 3.2}, r"payload mass from 1\.200 kg to 3\.200 kg"),
        ({"payload_cog_m": (0.0, 0.0, 0.07)}, r"gravity from \(0, 0, 50\) mm to \(0, 0, 70\) mm"),
        ({"tcp_offset": (0, 0, 0.12, 0, 0, 0)}, r"TCP from \(0, 0, 100\) mm.* to \(0, 0, 120\) mm"),
        (
            {"tcp_offset": (0, 0, 0.1, 0, 0.1, 0)},
            r"to \(0, 0, 100\) mm, rotation \(0, 0.1, 0\) rad",
        ),
    ],
)
def test_a_setting_that_is_changed_is_a_fault_from_what_to_what_and_mutes(
    make_loop, ur, link, told, step_for, fields, says
):
    loop = connected(make_loop)
    step_for(loop, 0.2)
    assert faults(link) == []
    told.set(**fields)
    step_for(loop, 0.1)
    ((code, message),) = faults(link)
    assert code == FaultCode.SETTING_CHANGED
    assert re.search(says, message), message
    sent = len(ur.inputs)
    step_for(loop, 0.2)
    assert len(ur.inputs) == sent


def test_settings_that_are_no_longer_told_are_a_fault(make_loop, link, told, step_for):
    loop = connected(make_loop)
    told.silent = True
    step_for(loop, watch_module.TOLD_AGE_S - 0.1)
    assert faults(link) == []
    step_for(loop, 0.2)
    assert [code for code, _ in faults(link)] == [FaultCode.STALE]


def test_local_control_is_a_fault_although_the_program_goes_on(
    make_loop, link, step_for, monkeypatch
):
    check = requested(remote=True)
    monkeypatch.setattr(watch_module, "RemoteCheck", lambda host: check)
    loop = connected(make_loop)
    step_for(loop, 0.2)
    assert faults(link) == []
    check.poll = lambda: setattr(check, "remote", False)
    step_for(loop, 0.01)
    ((code, message),) = faults(link)
    assert code == FaultCode.NOT_REMOTE
    assert "somebody at the pendant" in message
    assert "still runs" in message
