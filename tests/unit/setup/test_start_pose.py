"""Start pose and first motion: only back, only with consent, and only where nothing is."""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import pytest
from bench_fakes import FakeArm, FakeSensor, Rig, setup_of

from stepload.errors import DeviceError, RefusedError
from stepload.rig.faults import Fault, FaultCode
from stepload.setup import start_pose
from stepload.setup.bench import FORCE, Bench
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value


def ready(rig, approach="[0, 0, -1]", person=None, **answers):
    setup = setup_of(rig, person, **answers)
    setup.state.done["arm"] = Found({"arm.options.approach": Value(approach, "")})
    return setup


def test_the_arm_only_backs_away_and_returns():
    rig = Rig()
    found = start_pose.way(ready(rig, hazards_read_by="A. Tester", back="4 mm"))
    assert max(rig.targets) <= 0.0
    assert min(rig.targets) == pytest.approx(-4e-3, abs=2e-5)
    assert rig.position_m == pytest.approx(0.0, abs=1e-5)
    assert found.values["hazards_read_by"].text == "A. Tester"
    assert found.values["hazards_read_on"].text == "2026-11-22"


def test_the_arm_stops_where_something_is_in_the_way():
    rig = Rig(obstacle_m=1e-3)
    with pytest.raises(RefusedError, match="the force changed by 50"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester"))
    assert rig.safe_calls == 1
    assert min(rig.targets) > -1.1e-3


def test_an_arm_that_does_not_follow_is_stopped():
    rig = Rig(follows=False)
    with pytest.raises(RefusedError, match="from where it was sent"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester"))
    assert rig.safe_calls == 1
    assert min(rig.targets) > -2.1e-3


def test_where_the_arm_stands_after_the_way_is_not_judged_by_an_old_sample(monkeypatch):
    """A host that stalls hears late that the arm is back."""
    rig, received = Rig(), deque(maxlen=200)

    def late(arm):
        received.append(sound(arm)[0])
        return [received[0]]

    sound = FakeArm.drain
    monkeypatch.setattr(FakeArm, "drain", late)
    start_pose.way(ready(rig, hazards_read_by="A. Tester", back="4 mm"))
    assert rig.position_m == pytest.approx(0.0, abs=1e-5)


def test_nothing_moves_without_consent_or_a_name():
    rig = Rig()
    with pytest.raises(RefusedError, match="The answer was no"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester", may_back="no"))
    setup = ready(rig, hazards_read_by="A. Tester")
    setup.answers.yes = False
    with pytest.raises(Exception, match="no terminal to ask at"):
        start_pose.way(setup)
    with pytest.raises(Exception, match="no terminal to ask at"):
        start_pose.way(ready(rig))
    assert not rig.targets
    assert not rig.openings


def test_a_way_back_that_is_too_long_is_refused():
    rig = Rig()
    with pytest.raises(RefusedError, match="at most 20 mm"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester", back="30 mm"))
    assert math.isclose(rig.position_m, 0.0)


def test_a_touch_begins_only_where_the_arm_was_led():
    rig = Rig()
    setup = ready(rig)
    setup.state.done["start"] = start_pose.start(setup)
    start_pose.stands_at_start(setup)
    rig.tool.turned = (0.0, math.pi - 0.1, 0.0)
    with pytest.raises(RefusedError, match=r"0.00 mm and 5.7 degrees from the start pose"):
        start_pose.stands_at_start(setup)


@pytest.mark.parametrize(("tilt_deg", "taken"), [(4.0, True), (6.0, False)])
def test_the_approach_is_the_tools_within_five_degrees(tilt_deg, taken):
    tilt_rad = math.radians(tilt_deg)
    setup = ready(Rig(), approach=f"[{math.sin(tilt_rad):.6f}, 0, {-math.cos(tilt_rad):.6f}]")
    if taken:
        start_pose.start(setup)
    else:
        with pytest.raises(RefusedError, match="6 degrees off"):
            start_pose.start(setup)


def test_the_start_is_read_once_the_arm_is_led_there():
    rig = Rig()
    with pytest.raises(RefusedError, match="The answer was no"):
        start_pose.start(ready(rig, led_to_start="no"))
    assert not rig.openings


class LedArm(FakeArm):
    """An arm that stands off its start pose."""

    off = (0.0,) * 6

    def drain(self):
        return [
            sample._replace(pose=tuple(a + b for a, b in zip(sample.pose, self.off, strict=True)))
            for sample in super().drain()
        ]


@pytest.mark.parametrize(
    ("off", "stands"),
    [
        ((3e-4, 0.0, -3e-4, 0.0, 0.0, 0.0), True),
        ((0.0, 6e-4, 0.0, 0.0, 0.0, 0.0), False),
        ((0.0, 0.0, 0.0, 0.0, math.radians(-0.8), 0.0), True),
        ((0.0, 0.0, 0.0, 0.0, math.radians(-2.0), 0.0), False),
        ((0.0, 0.0, 0.0, 0.0, -2.0 * math.pi + 1e-3, 0.0), True),  # written the other way round
        ((math.nan, 0.0, 0.0, 0.0, 0.0, 0.0), False),
        ((0.0, 0.0, 0.0, 0.0, math.nan, 0.0), False),
    ],
)
def test_the_start_pose_is_where_a_touch_begins(monkeypatch, off, stands):
    setup = ready(Rig())
    setup.state.done["start"] = start_pose.start(setup)
    monkeypatch.setattr(LedArm, "off", off)
    monkeypatch.setattr("bench_fakes.FakeArm", LedArm)
    if stands:
        start_pose.stands_at_start(setup)
    else:
        with pytest.raises(RefusedError, match="from the start pose it was led to"):
            start_pose.stands_at_start(setup)


def test_the_first_motion_is_slow():
    rig = Rig()
    start_pose.way(ready(rig, hazards_read_by="A. Tester", back="4 mm"))
    steps = [abs(b - a) for a, b in pairwise(rig.targets)]
    assert max(steps) * rig.rate_hz == pytest.approx(4e-3, rel=0.01)


@pytest.mark.parametrize("across_n", [8.0, -8.0])
def test_the_arm_stops_at_a_small_force_either_way(across_n):
    rig = Rig()
    rig.feel = lambda f: (f[0] + (across_n if rig.position_m < -1e-3 else 0.0), f[1], f[2])
    with pytest.raises(RefusedError, match=r"the force changed by [78]\.\d N \(limit 5\.0 N\)"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester"))
    assert rig.safe_calls == 1


def test_an_arm_that_does_not_come_back_is_found():
    rig = Rig()

    class Short(FakeArm):
        def command(self, position_m):
            super().command(min(position_m, -1e-3) if len(rig.targets) > 900 else position_m)

    bench = Bench(Short(rig), {FORCE: FakeSensor(rig, rig.feel)}, rig.clock, {})
    with pytest.raises(RefusedError, match=r"-1\.00 mm from its start"):
        start_pose.back_and_forth(bench, 4e-3)


def test_a_sensor_that_fails_on_the_way_ends_it(monkeypatch):
    rig = Rig()
    fault = Fault(FaultCode.STALE, "the sensor is silent", "cable", 0.0)
    monkeypatch.setattr(FakeSensor, "fault", lambda _: fault if len(rig.targets) > 50 else None)
    with pytest.raises(DeviceError, match="the sensor is silent"):
        start_pose.way(ready(rig, hazards_read_by="A. Tester"))
    assert len(rig.targets) == 51
