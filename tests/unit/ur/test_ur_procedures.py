"""What the child does on request, at its start, and when its run is gone."""

from __future__ import annotations

import pytest
from ur_fakes import HOME

from stepload_drivers.ur import child, procedures, wire
from stepload_drivers.ur.procedures import RequestError
from stepload_drivers.ur.state import PLAYING

AT_M = 1e-3


@pytest.fixture
def pressing(make_loop, link, step_for):
    """Makes a loop whose arm follows a target at AT_M."""

    def make(**options):
        loop = make_loop(**options)
        step_for(loop, 0.1)
        link.arrives(0.0, wire.pack_target(AT_M))
        step_for(loop, 0.01)
        return loop

    return make


def names(ur) -> list[str]:
    return [what for what, _, _ in ur.inputs]


def test_connect_prepares_proves_the_watchdog_and_prepares_again(make_loop, ur, clock):
    loop = make_loop(control=False)
    ur.watchdog_s = 0.1
    procedures.connect(loop)
    assert names(ur)[0] == "prepare"
    uploaded = names(ur).index("upload")
    assert set(names(ur)[1:uploaded]) <= {"kick"}
    assert names(ur)[uploaded + 1 :].count("prepare") == 1
    assert ur.inputs[uploaded][2] - ur.inputs[uploaded - 1][2] > 0.1
    assert not loop.muted
    assert not loop.expect_stop


def test_without_the_proof_the_program_is_left_running(make_loop, ur):
    procedures.connect(make_loop(control=False, prove_watchdog=False))
    assert set(names(ur)) <= {"prepare", "kick"}


def test_a_watchdog_that_does_not_act_is_refused(make_loop, ur):
    with pytest.raises(RequestError, match="must not be used"):
        procedures.connect(make_loop(control=False))


def test_commands_wait_until_the_control_connection_sees_the_program(make_loop, ur, clock):
    loop, seen = make_loop(control=False), []
    ur.watchdog_s = 0.1
    ur.program_runs = lambda: seen.append(clock.now_s) or len(seen) > 5
    procedures.connect(loop)
    last_prepare_s = max(time_s for what, _, time_s in ur.inputs if what == "prepare")
    assert len(seen) > 5
    assert last_prepare_s >= seen[-1]


@pytest.mark.parametrize("prove_watchdog", [False, True])
@pytest.mark.parametrize("late_s", [0.002, 0.02])
def test_a_program_that_the_data_show_late_is_no_stop_and_proves_no_watchdog(
    make_loop, ur, link, clock, late_s, prove_watchdog
):
    """The control connection already says PLAYING while the data still say STOPPED."""
    ur.fields["runtime_state"] = 1
    loop = make_loop(control=False, prove_watchdog=prove_watchdog)
    ur.program_runs = lambda: True
    began_s = clock.now_s

    def begin() -> None:
        ur.fields["runtime_state"], ur.watchdog_s = PLAYING, 0.1

    clock.at(began_s + late_s, begin)
    procedures.connect(loop)
    assert ur.inputs[0][0] == "prepare"
    assert ur.inputs[0][2] >= began_s + late_s
    assert link.told(wire.FAULT) == []


@pytest.mark.parametrize(
    ("options", "told_after", "says"),
    [
        ({"payload_mass": 2.0}, {}, r"payload mass from 2\.000 kg to 1\.200 kg"),
        ({"tcp_offset": (0, 0, 0.2)}, {}, r"TCP from \(0, 0, 200\) mm.* to \(0, 0, 100\) mm"),
        ({}, {"speed_fraction": 0.9}, "speed slider from 100 % to 90 %"),
    ],
)
def test_a_setting_that_the_controller_does_not_take_over_is_refused(
    make_loop, told, options, told_after, says
):
    loop = make_loop(control=False, prove_watchdog=False, **options)
    told.set(**told_after)
    with pytest.raises(RequestError, match=says):
        procedures.connect(loop)


def test_what_is_told_from_before_the_program_began_is_not_taken(make_loop, ur, told, clock):
    """A package with the settings of before may still be under way when they are set."""
    loop = make_loop(control=False, prove_watchdog=False, payload_mass=2.0)
    clock.at(clock.now_s + 0.03, lambda: told.set(payload_kg=2.0, payload_cog_m=(0, 0, 0)))
    procedures.connect(loop)
    assert loop.watch.armed.payload_kg == 2.0


def test_with_another_tcp_no_pose_is_sent_any_more(pressing, ur, told):
    """The retract is left to a program that starts from the controller's own target."""
    loop = pressing()
    loop.watch.armed = told.configuration
    told.set(tcp_offset=(0.0, 0.0, 0.15, 0.0, 0.0, 0.0))
    sent = len(ur.of("servo"))
    with pytest.raises(RequestError, match="TCP was changed"):
        procedures.retract(loop, 2e-3, 0.01)
    assert len(ur.of("servo")) == sent


@pytest.mark.parametrize(
    ("after_s", "fields", "says"),
    [
        (0.03, {}, r"3\d ms after .*not by its watchdog \(100 ms\)"),
        (0.09, {"safety_mode": 3}, "protective stop"),
    ],
)
def test_a_program_stopped_by_something_else_proves_no_watchdog(
    make_loop, ur, clock, after_s, fields, says
):
    loop = make_loop()
    loop.sent_s = clock.now_s
    clock.at(clock.now_s + after_s, lambda: ur.fields.update(runtime_state=1, **fields))
    with pytest.raises(RequestError, match=says):
        procedures._trip_watchdog(loop)


def test_travel_counts_from_where_the_arm_stands_at_the_end_of_open(make_loop, ur, clock):
    """Another program moves the arm until the control interface has ended it."""
    loop = make_loop(control=False, prove_watchdog=False)
    began_s = clock.now_s
    ur.pose_of = lambda _: (HOME[0], HOME[1], HOME[2] - 0.1 * min(clock.now_s - began_s, 0.2))
    procedures.connect(loop)
    assert clock.now_s - began_s > 0.2
    assert loop.start[2] == pytest.approx(HOME[2] - 0.02)
    assert loop.position_m == pytest.approx(0.0)


def test_an_arm_that_does_not_stand_still_is_not_taken(make_loop, ur, clock):
    loop = make_loop(control=False, prove_watchdog=False)
    ur.pose_of = lambda _: (HOME[0], HOME[1], HOME[2] - 0.1 * (clock.now_s % 1.0))
    with pytest.raises(RequestError, match="does not stand still"):
        procedures.connect(loop)


def test_stop_servo_ends_the_servo_and_follows_nothing(pressing, ur, step_for):
    loop = pressing()
    reply = procedures.stop_servo(loop)
    assert reply == {"confirmed": True, "runtime_state": 2}
    assert loop.target_m is None
    stopped = names(ur).index("stop_servo")
    step_for(loop, 0.2)
    assert "servo" not in names(ur)[stopped:]


def test_stop_servo_is_not_done_before_the_arm_stands(pressing, ur, clock):
    loop = pressing()
    began_s = clock.now_s
    ur.pose_of = lambda _: (HOME[0], HOME[1], HOME[2] - 0.05 * min(clock.now_s - began_s, 0.3))
    procedures.stop_servo(loop)
    assert clock.now_s - began_s > 0.3


def test_a_retract_ramps_back_at_its_speed_and_stops(pressing, ur, clock):
    loop = pressing()
    known, began_s = len(ur.inputs), clock.now_s
    reply = procedures.retract(loop, 2e-3, 0.01)
    ramp = [target_m for what, target_m, _ in ur.inputs[known:] if what == "servo"]
    assert ramp == sorted(ramp, reverse=True)
    assert max(ramp) <= AT_M + 1e-9
    assert min(ramp) == pytest.approx(AT_M - 2e-3)
    assert 0.2 <= clock.now_s - began_s < 0.4
    assert reply["distance_m"] == pytest.approx(2e-3)
    assert names(ur)[-1] in ("stop_servo", "kick")
    assert "stop_servo" in names(ur)[known:]


def test_a_retract_that_the_arm_does_not_follow_is_an_error(pressing, ur):
    loop = pressing()
    ur.moves = False
    with pytest.raises(RequestError, match="did not follow"):
        procedures.retract(loop, 2e-3, 0.01)


@pytest.mark.parametrize("fields", [{"runtime_state": 1}, {"safety_mode": 3}])
def test_a_retract_gives_up_on_an_arm_that_was_stopped(pressing, ur, fields):
    loop = pressing()
    ur.fields.update(fields)
    with pytest.raises(RequestError, match="stopped"):
        procedures.retract(loop, 2e-3, 0.01)


@pytest.mark.parametrize("op", ["safe", "quit"])
def test_a_request_under_way_ends_a_retract(pressing, ur, link, op):
    loop = pressing()
    link.arrives(0.05, wire.pack_json(wire.REQUEST, op=op, number=2))
    with pytest.raises(RequestError, match="another request"):
        procedures.retract(loop, 2e-3, 0.01)
    assert ur.true_m > AT_M - 1e-3


@pytest.mark.parametrize("gone", [False, True])
def test_nothing_is_waited_for_against_another_request_or_without_a_run(
    pressing, ur, link, clock, gone
):
    loop = pressing()
    ur.pose_of = lambda _: (HOME[0], HOME[1], HOME[2] - 0.1 * (clock.now_s % 1.0))
    began_s = clock.now_s
    if gone:
        clock.at(began_s + 0.05, lambda: setattr(link, "closed", True))
    else:
        link.arrives(0.05, wire.pack_json(wire.REQUEST, op="quit", number=2))
    with pytest.raises(RequestError, match="another request"):
        procedures.stop_servo(loop)
    assert clock.now_s - began_s < 0.1


def test_prove_measures_the_stop_under_way(pressing, ur, clock):
    loop = pressing()
    ur.watchdog_s = 0.1
    fields = procedures.prove(loop, 2e-3, 0.01)
    assert 0.05 < fields["stop_s"] < 0.12
    assert fields["still_s"] >= fields["stop_s"]
    assert fields["travel_m"] == pytest.approx(0.0, abs=1e-4)
    assert "upload" in names(ur)


def test_an_orphan_under_way_unloads(pressing, ur):
    loop = pressing(orphan_retract=0.004)
    loop.link.closed = True
    procedures.unload(loop)
    assert ur.true_m == pytest.approx(AT_M - 0.004)


def test_an_orphan_outwaits_the_leash_while_it_unloads(pressing, ur):
    loop = pressing(orphan_retract=0.004, command_timeout=0.02)
    loop.link.closed = True
    procedures.unload(loop)
    assert ur.true_m == pytest.approx(AT_M - 0.004)


@pytest.mark.parametrize("options", [{"orphan_retract": 0.0}, {}])
def test_an_orphan_stays_where_it_is_told_to_or_stands(pressing, make_loop, ur, options):
    loop = pressing(**options)
    if not options:
        procedures.stop_servo(loop)
    loop.link.closed = True
    known = len(ur.of("servo"))
    procedures.unload(loop)
    assert len(ur.of("servo")) == known


def test_an_orphan_that_cannot_unload_ends_all_the_same(pressing, ur):
    loop = pressing()
    ur.fields["safety_mode"] = 3
    loop.link.closed = True
    procedures.unload(loop)


def test_leaving_stops_servo_then_program(pressing, ur):
    loop = pressing()
    procedures.leave(loop)
    assert names(ur)[-2:] == ["stop_servo", "end_program"]


def test_a_run_that_is_gone_makes_the_child_unload(pressing, ur, link, clock):
    loop = pressing()
    clock.at(clock.now_s + 0.05, lambda: setattr(link, "closed", True))
    child._run(loop)
    assert ur.true_m == pytest.approx(AT_M - loop.settings.orphan_retract_m)


def test_requests_are_answered_by_number(pressing, ur, link):
    loop = pressing()
    link.arrives(0.001, wire.pack_json(wire.REQUEST, op="safe", number=5))
    link.arrives(0.2, wire.pack_json(wire.REQUEST, op="dance", number=6))
    link.arrives(
        0.3, wire.pack_json(wire.REQUEST, op="retract", number=7, distance_m=1e-3, speed_m_s=0.01)
    )
    link.arrives(0.9, wire.pack_json(wire.REQUEST, op="quit", number=8))
    child._run(loop)
    replies = link.told(wire.REPLY)
    assert [(r["number"], r["ok"]) for r in replies] == [(5, True), (6, False), (7, True)]
    assert ur.true_m == pytest.approx(AT_M - 1e-3)


def test_a_request_that_failed_no_longer_hides_stops(pressing, ur, link):
    loop = pressing()
    ur.watchdog_s = None  # the proof fails
    link.arrives(
        0.0, wire.pack_json(wire.REQUEST, op="prove", number=1, distance_m=1e-3, speed_m_s=0.01)
    )
    clock_end = wire.pack_json(wire.REQUEST, op="quit", number=2)
    link.arrives(2.0, clock_end)
    child._run(loop)
    assert link.told(wire.REPLY)[0]["ok"] is False
    assert not loop.expect_stop
