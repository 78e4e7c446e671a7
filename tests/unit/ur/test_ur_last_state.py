"""What an arm can have done by itself since it was last seen, and what only a person can have."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from ur_fakes import APPROACH, HOME

from stepload.rig.device import ArmConfiguration
from stepload.rig.samples import ArmSample
from stepload_drivers.ur.last_state import BENT_RAD, SETTLED_M, TURNED_RAD, LastState, Reach
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, STOPPED, UrState, target_pose

SETTINGS = Settings(host="10.0.0.2", approach=APPROACH, watchdog=10.0)
TOLD = ArmConfiguration((0.1, -1.5, 1.5, 0.0, -1.5, 0.0), (0.0,) * 6, 1.2, (0.0, 0.0, 0.05), 1.0)
AT_M, SEEN_S = 5e-3, 1000.0


def pose(position_m: float = AT_M, aside_m: float = 0.0, turned_rad: float = 0.0):
    x, y, z, rx, ry, rz = target_pose(HOME, APPROACH, position_m)
    return (x + aside_m, y, z, rx, ry + turned_rad, rz)


def package(
    *place_m: float, stamp_s: float = SEEN_S + 3.0, runs: bool = False, turned_rad: float = 0.0
) -> UrState:
    at = pose(*place_m, turned_rad=turned_rad)
    return UrState(stamp_s, at, (0.0,) * 6, ROBOT_RUNNING, 1, PLAYING if runs else STOPPED, 1)


def sample() -> ArmSample:
    return ArmSample(1, SEEN_S, SEEN_S, 0, AT_M, 8.1, pose())


def seen(low_m: float = 0.0, high_m: float = 0.0, **options) -> LastState:
    settings = Settings(host="10.0.0.2", approach=APPROACH, **options)
    return LastState(settings, sample(), (low_m, high_m), TOLD)


# how far its targets take it


def test_an_arm_that_follows_no_target_goes_nowhere():
    assert Reach(SETTINGS).after(sample()) == (0.0, 0.0)


def test_it_goes_no_further_than_its_outermost_late_targets():
    reach = Reach(SETTINGS)
    for after_s, ahead_m in ((-0.1, -3e-4), (0.0, 4e-4), (0.05, -1e-4)):
        reach.sent(AT_M + ahead_m, SEEN_S + after_s)
    assert reach.after(sample()) == pytest.approx((-3e-4, 4e-4))


def test_a_target_that_is_older_than_look_ahead_and_watchdog_counts_no_more():
    reach = Reach(SETTINGS)
    reach.sent(AT_M - 2e-3, SEEN_S - 0.25)
    reach.sent(AT_M, SEEN_S - 0.15)
    assert reach.after(sample()) == pytest.approx((0.0, 0.0))


def test_the_last_target_counts_however_old_it_is():
    reach = Reach(SETTINGS)
    reach.sent(AT_M + 1e-3, SEEN_S - 60.0)
    assert reach.after(sample()) == pytest.approx((0.0, 1e-3))


def test_a_retract_that_was_asked_for_may_be_under_way_until_it_is_done():
    reach = Reach(SETTINGS)
    reach.sent(AT_M - 1e-4, SEEN_S)
    reach.requested_back(2e-3)
    assert reach.after(sample()) == pytest.approx((-2.1e-3, 0.0))
    reach.arrived()
    assert reach.after(sample()) == (0.0, 0.0)


# what only a person can have done


@pytest.mark.parametrize("place", [(AT_M,), (AT_M + 6e-4,), (AT_M - 9e-4,), (AT_M, 2e-4)])
def test_what_targets_and_settling_explain_is_nobodys_work(place):
    assert seen(-7e-4, 4e-4).moved(package(*place), TOLD) == ""


@pytest.mark.parametrize(
    ("place", "words"),
    [((AT_M + 9e-4,), "0.50 mm"), ((AT_M - 1.2e-3,), "0.50 mm"), ((AT_M, 5e-4), "0.50 mm")],
)
def test_an_arm_further_away_than_that_was_moved(place, words):
    told = seen(-7e-4, 4e-4).moved(package(*place), TOLD)
    assert f"stands {words} from where it can have come by itself, limit 0.3 mm" in told


def test_an_arm_that_was_seen_at_rest_goes_nowhere_any_more():
    last = seen(-1e-3, 1e-3)
    last.take(package(AT_M + 1e-3))
    assert last.moved(package(AT_M + 1e-3), TOLD) == ""
    assert "1.00 mm" in last.moved(package(AT_M), TOLD)


def test_a_program_that_runs_still_may_take_it_where_it_might_go_before():
    last = seen(-1e-3, 1e-3)
    last.take(package(AT_M + 5e-4, runs=True))
    assert last.moved(package(AT_M - 1e-3), TOLD) == ""
    assert last.moved(package(AT_M + 1e-3), TOLD) == ""
    assert "0.50 mm" in last.moved(package(AT_M + 1.5e-3), TOLD)


def test_a_retract_that_was_handed_over_may_take_it_back():
    last = seen()
    last.sent_back(2e-3)
    assert last.moved(package(AT_M - 2e-3), TOLD) == ""
    assert last.moved(package(AT_M + 1e-3), TOLD) != ""


@pytest.mark.parametrize(("turned_rad", "by"), [(2 * TURNED_RAD, True), (0.4 * TURNED_RAD, False)])
def test_a_tool_that_was_turned_in_its_place(turned_rad, by):
    told = seen().moved(package(turned_rad=turned_rad), TOLD)
    assert ("the tool is turned by 0.010 rad" in told) is by
    assert bool(told) is by


def test_one_rotation_written_two_ways_is_no_turn():
    """The tool points down: its rotation vector is near half a turn, and may change its sign."""
    other = (*pose()[:3], 0.0, HOME[4] - 2.0 * math.pi, 0.0)
    assert seen().moved(package()._replace(pose=other), TOLD) == ""


@pytest.mark.parametrize(("bent_rad", "by"), [(BENT_RAD + 0.01, True), (BENT_RAD - 0.01, False)])
def test_joints_tell_where_the_tcp_of_the_options_ended_with_our_program(bent_rad, by):
    joints_rad = (0.1, -1.5 - bent_rad, 1.5, 0.0, -1.5, 0.0)
    last = seen(tcp_offset=(0.0, 0.0, 0.1), payload_mass=1.2, payload_cog=(0.0, 0.0, 0.05))
    now = replace(TOLD, joints_rad=joints_rad, tcp_offset=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    assert bool(last.moved(package(AT_M + 2e-2), now)) is by


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"speed_fraction": 0.5}, "speed slider from 100 % to 50 %"),
        ({"payload_kg": 2.0}, "payload mass from 1.200 kg"),
        ({"tcp_offset": (0.0, 0.0, 0.1, 0.0, 0.0, 0.0)}, "TCP from"),
    ],
)
def test_a_setting_that_changed_is_a_persons_work(fields, words):
    assert words in seen().moved(package(), replace(TOLD, **fields))


def test_a_controller_whose_clock_began_anew_was_switched_on_by_somebody():
    assert "started anew" in seen().moved(package(stamp_s=SEEN_S - 1.0), TOLD)


def test_an_arm_that_was_never_seen_cannot_be_compared():
    last = LastState(SETTINGS, None)
    assert last.moved(package(), None) == ""
    last.take(package())
    assert last.moved(package(AT_M + 2 * SETTLED_M), None) != ""
