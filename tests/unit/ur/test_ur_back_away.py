"""The blind retract when the measured position lies: never towards the plate."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from ur_fakes import APPROACH, HOME

from stepload_drivers.ur import loop as loop_module
from stepload_drivers.ur import procedures
from stepload_drivers.ur.direct_control import retract_script
from stepload_verify.emulators.ur_program import UserScript
from stepload_verify.emulators.ur_robot import Robot
from stepload_verify.emulators.ur_world import AxisState

Lie = Callable[[float, float], float]
"""(true position, seconds since the lie began) to measured position, all in m and s."""

AT_M, BACK_M, SPEED_M_S = 1e-3, 2e-3, 0.1


class LyingArm:
    """Makes the fake controller tell another position than its true one."""

    def __init__(self, ur, clock) -> None:
        self._ur, self._clock = ur, clock

    @property
    def true_m(self) -> float:
        return self._ur.true_m

    @property
    def furthest_m(self) -> float:
        """Furthest target since the lie began."""
        return max([AT_M, *(target_m for target_m, _ in self._ur.of("servo"))])

    def begin(self, lie: Lie) -> None:
        since_s = self._clock.now_s
        self._ur.inputs.clear()

        def told(true_m: float) -> tuple[float, ...]:
            measured_m = lie(true_m, self._clock.now_s - since_s)
            return tuple(h + a * measured_m for h, a in zip(HOME, APPROACH, strict=False))

        self._ur.pose_of = told


@pytest.fixture
def arm(ur, clock) -> LyingArm:
    return LyingArm(ur, clock)


@pytest.fixture
def loop(ur, make_loop) -> loop_module.Loop:
    """The child's loop, having followed a target to AT_M."""
    loop = make_loop()
    loop.follow(AT_M)
    while ur.true_m != pytest.approx(AT_M):
        loop.step()
    return loop


LIES: dict[str, Lie] = {
    "20 mm ahead": lambda true_m, _: true_m + 20e-3,
    "0.3 mm ahead": lambda true_m, _: true_m + 0.3e-3,
    "0.3 mm behind": lambda true_m, _: true_m - 0.3e-3,
    "frozen ahead": lambda *_: AT_M + 0.5e-3,
    "frozen behind": lambda *_: AT_M - 0.5e-3,
    "runs away ahead": lambda true_m, after_s: true_m + after_s,
    "runs away behind": lambda true_m, after_s: true_m - 0.5 * after_s,
}


@pytest.mark.parametrize("following", [True, False])
@pytest.mark.parametrize("lie", LIES.values(), ids=LIES.keys())
def test_a_lying_position_cannot_turn_the_retract_round(arm, loop, lie, following):
    if not following:
        procedures.stop_servo(loop)
    arm.begin(lie)
    known = loop.state
    while loop.state is known:
        loop.step()
    procedures._back_away(loop, BACK_M, SPEED_M_S)
    assert arm.furthest_m <= AT_M + 1e-9
    assert arm.true_m <= AT_M - BACK_M + 1e-9


def test_a_position_far_behind_leaves_the_retract_to_the_controller(arm, loop):
    arm.begin(lambda true_m, _: true_m - 20e-3)
    known = loop.state
    while loop.state is known:
        loop.step()
    with pytest.raises(procedures.RequestError, match=r"20.00 mm behind .*limit 2.00 mm"):
        procedures.retract(loop, BACK_M, SPEED_M_S)
    assert arm.true_m == pytest.approx(AT_M)


def test_an_orphan_backs_away_from_its_last_target(arm, loop):
    arm.begin(LIES["20 mm ahead"])
    known = loop.state
    while loop.state is known:
        loop.step()
    procedures.unload(loop)
    assert arm.furthest_m <= AT_M + 1e-9
    assert arm.true_m == pytest.approx(AT_M - loop.settings.orphan_retract_m)


class LyingAxis:
    """Goes where it is sent at once and says that it is 20 mm further."""

    def __init__(self) -> None:
        self.way: list[float] = []

    def command(self, position_m: float) -> None:
        self.way.append(position_m)

    def advance_to(self, time_s: float) -> None:
        pass

    def state(self) -> AxisState:
        return AxisState(self.way[-1] + 20e-3, 0.0)


def test_the_script_of_last_resort_starts_from_the_controllers_own_target():
    axis = LyingAxis()
    robot = Robot(axis, APPROACH, 0.002)
    robot.tick()
    start_m = axis.way[-1]
    first, _stop, *rest = retract_script(APPROACH, BACK_M, SPEED_M_S).splitlines()
    program = UserScript("\n".join([first, *rest]), robot)
    for _ in range(50):
        program.tick()
        robot.tick()
    assert max(axis.way) <= start_m + 1e-9
    assert axis.way[-1] == pytest.approx(start_m - BACK_M)
