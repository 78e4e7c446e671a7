"""The blind retract when the measured position lies: never towards the plate."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace

import pytest

from stepload_drivers.ur import loop as loop_module
from stepload_drivers.ur import procedures
from stepload_drivers.ur.rescue import retract_script
from stepload_drivers.ur.settings import settings_from
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState, travel_m
from stepload_verify.emulators.ur_axis import AxisState
from stepload_verify.emulators.ur_program import UserScript
from stepload_verify.emulators.ur_robot import Robot

Lie = Callable[[float, float], float]
"""(true position, seconds since the lie began) to measured position, all in m and s."""

APPROACH = (0.0, 0.0, -1.0)
HOME = (0.4, -0.1, 0.3, 0.0, 3.14, 0.0)
AT_M, BACK_M, SPEED_M_S = 1e-3, 2e-3, 0.1


class LyingArm:
    """An arm that goes where it is sent at once, behind ports of ur_rtde that may lie."""

    def __init__(self) -> None:
        self.true_m = self.furthest_m = 0.0
        self._lie: Lie = lambda true_m, _: true_m
        self._since_s = time.monotonic()

    def begin(self, lie: Lie) -> None:
        self._lie, self._since_s, self.furthest_m = lie, time.monotonic(), self.true_m

    def connected(self) -> bool:
        return True

    def read_new(self, _known: UrState | None) -> UrState:
        now_s = time.monotonic()
        measured_m = self._lie(self.true_m, now_s - self._since_s)
        pose = (*(h + a * measured_m for h, a in zip(HOME, APPROACH, strict=False)), *HOME[3:])
        return UrState(now_s, pose, (0.0,) * 6, ROBOT_RUNNING, 1, PLAYING, 1)

    def servo(self, pose: list[float], _period_s: float) -> bool:
        self.true_m = travel_m(tuple(pose), HOME, APPROACH)
        self.furthest_m = max(self.furthest_m, self.true_m)
        return True

    def kick(self) -> bool:
        return True

    def stop_servo(self, _deceleration: float) -> bool:
        return True


@pytest.fixture
def arm() -> LyingArm:
    return LyingArm()


@pytest.fixture
def loop(arm: LyingArm, monkeypatch: pytest.MonkeyPatch) -> loop_module.Loop:
    """The child's loop, having followed a target to AT_M."""
    monkeypatch.setattr(loop_module, "ReceivePort", lambda settings: arm)
    monkeypatch.setattr(loop_module, "stay_alive_for", lambda seconds: None)
    link = SimpleNamespace(
        receive=lambda wait_s: time.sleep(wait_s) or [], send=lambda message: True, closed=False
    )
    settings = settings_from({"host": "127.0.0.1", "approach": APPROACH})
    loop = loop_module.Loop(link, settings, 0.002)
    loop.control = arm
    loop.follow(AT_M)
    while arm.true_m != pytest.approx(AT_M):
        loop.step()
    return loop


LIES: dict[str, Lie] = {
    "20 mm ahead": lambda true_m, _: true_m + 20e-3,
    "0.3 mm ahead": lambda true_m, _: true_m + 0.3e-3,
    "0.3 mm behind": lambda true_m, _: true_m - 0.3e-3,
    "frozen ahead": lambda *_: AT_M + 0.5e-3,
    "frozen behind": lambda *_: AT_M - 0.5e-3,
    "runs away ahead": lambda true_m, after_s: true_m + after_s,
    "runs away behind": lambda true_m, after_s: true_m - after_s,
}


@pytest.mark.parametrize("following", [True, False])
@pytest.mark.parametrize("lie", LIES.values(), ids=LIES.keys())
def test_a_lying_position_cannot_turn_the_retract_round(arm, loop, lie, following):
    if not following:
        procedures.stop_servo(loop)
    arm.begin(lie)
    loop.step()
    procedures._back_away(loop, BACK_M, SPEED_M_S)
    assert arm.furthest_m <= AT_M + 1e-9
    assert arm.true_m <= AT_M - BACK_M + 1e-9


def test_a_position_far_behind_leaves_the_retract_to_the_controller(arm, loop):
    arm.begin(lambda true_m, _: true_m - 20e-3)
    loop.step()
    with pytest.raises(procedures.RequestError, match=r"20.00 mm behind .*limit 2.00 mm"):
        procedures.retract(loop, BACK_M, SPEED_M_S)
    assert arm.true_m == pytest.approx(AT_M)


def test_an_orphan_backs_away_from_its_last_target(arm, loop, monkeypatch):
    monkeypatch.setattr(procedures, "ORPHAN_M_S", SPEED_M_S)
    monkeypatch.setattr(procedures, "ORPHAN_WAIT_S", 0.01)
    arm.begin(LIES["20 mm ahead"])
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
