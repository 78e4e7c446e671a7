"""The guided push: wiring mistakes are found, and what is not clear is refused."""

from __future__ import annotations

import pytest
from bench_fakes import Hands, Rig, setup_of

from stepload.errors import RefusedError
from stepload.setup import hand_push
from stepload.setup.hand_push import agreed


def texts(found):
    return {key: value.text for key, value in found.values.items()}


@pytest.mark.parametrize(
    ("feel", "axis"),
    [
        (lambda f: f, '"-fz"'),
        (lambda f: (f[0], f[1], -f[2]), '"+fz"'),
        (lambda f: (f[2], f[1], f[0]), '"-fx"'),
        (lambda f: (f[0], -f[2], f[1]), '"+fy"'),
    ],
)
def test_axis_and_sign_are_those_of_the_wiring(feel, axis):
    found = texts(hand_push.push(setup_of(Rig(feel=feel))))
    assert found["force.axis"] == axis
    assert found["wiring_checked_on"] == "2026-11-22"


def test_a_second_sensor_gets_an_axis_of_its_own():
    rig = Rig(second_feel=lambda f: (f[2], f[0], f[1]))
    found = texts(hand_push.push(setup_of(rig, second="sensor")))
    assert (found["force.axis"], found["second_force.sensor.axis"]) == ('"-fz"', '"-fx"')
    assert found["wiring_checked_on"] == "2026-11-22"


@pytest.mark.parametrize(
    ("rig", "what"),
    [
        (Rig(feel=lambda f: (0.0, 0.0, 0.0)), "the force sensor: it read"),
        (Rig(arm_gain=0.0), "the arm's own force: it read"),
        (Rig(arm_gain=-1.0), "as if pulled towards the plate"),
        (Rig(feel=lambda f: (0.7 * f[2], 0.0, 0.7 * f[2])), "which one is the axis is not clear"),
        (Rig(feel=lambda f: (0.0, 0.0, 2.5 * f[2])), "of the same push, which differ"),
        (Rig(feel=lambda f: (0.0, 0.0, 0.0), noise_n=0.0), "every reading at rest is the same"),
        (Rig(feel=lambda f: (0.0, 0.0, 0.0), arm_gain=0.0), "no push was seen on any channel"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_channel_is_said(rig, what):
    with pytest.raises(RefusedError, match=what):
        hand_push.push(setup_of(rig))


def test_the_hazards_are_said_before_a_hand_comes_near_the_arm():
    rig = Rig()
    hands = Hands(rig)
    with pytest.raises(RefusedError, match="The answer was no"):
        hand_push.push(setup_of(rig, hands, may_push="no"))
    assert any("crush a hand" in line for line in hands.said)
    assert not rig.openings


def test_a_push_the_wrong_way_is_not_taken_for_a_sign():
    rig = Rig()
    with pytest.raises(RefusedError, match="the push went the wrong way"):
        hand_push.push(setup_of(rig, Hands(rig, push=(0.0, 0.0, -30.0))))


def test_pushes_that_disagree_are_refused():
    rig = Rig()

    class Changing(Hands):
        def tell(self, line):
            self.push = (0.0, 0.0, 30.0) if "push 1" in line else self.push
            self.push = (0.0, 30.0, 0.0) if "push 2" in line else self.push
            super().tell(line)

    with pytest.raises(RefusedError, match="the pushes disagree"):
        hand_push.push(setup_of(rig, Changing(rig), second="none"))


def test_jerks_are_no_push():
    rig = Rig()
    rig.tool.mass_kg = 0.0
    rig.feel = lambda f: f if rig.clock.now_s() % 1.0 < 0.7 else (0.0, 0.0, 0.0)
    with pytest.raises(RefusedError, match="no push was seen"):
        hand_push.push(setup_of(rig, second="none"))


def test_two_channels_read_the_same_of_one_push():
    agreed(("one", 30.0), ("other", 22.0), 0.0)
    agreed(("one", 30.0), ("other", 18.0), 5.0)
    with pytest.raises(RefusedError, match="of the same push, which differ"):
        agreed(("one", 30.0), ("other", 20.0), 0.0)
