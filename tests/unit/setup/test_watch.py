"""What the doctor says of a stream, and of the computer that reads it."""

from __future__ import annotations

from types import SimpleNamespace

from bench_fakes import FakeArm, Rig

from stepload.plan.load import load_plan
from stepload.plan.shipped import plan_path
from stepload.setup.check_line import Mark
from stepload.setup.streams import SETTLE_S, Watched, check_stream, watch

SECONDS = 2.0


class LossyArm(FakeArm):
    """Has lost `before_n` samples by the end of the pause, and one in `every` of what follows."""

    def __init__(self, rig: Rig, before_n: int, every: int = 0) -> None:
        super().__init__(rig)
        self.before_n, self.every, self.lost = before_n, every, 0

    def drain(self):
        found = super().drain()
        if self.every and self._count % self.every == 0:
            self.lost += 1
            return []
        return found

    def health(self):
        settled = self.rig.clock.now_s() >= SETTLE_S
        lost = self.lost + (self.before_n if settled else 0)
        return SimpleNamespace(lost=lost, errors={})


def watched(arm: LossyArm, stalls: int = 0) -> Watched:
    """Watch an arm on a computer that wakes 5 ms late so many times."""
    clock = arm.rig.clock
    clock.virtual = False
    punctual, left = clock.sleep_until, [stalls]

    def sleep_until(time_s):
        late_s = 5e-3 if left[0] > 0 and clock.now_s() > 1.0 else 0.0
        left[0] -= late_s > 0.0
        punctual(time_s + late_s)

    clock.sleep_until = sleep_until
    rig = SimpleNamespace(arm=arm, force=None, second_force=None, displacement=None, clock=clock)
    return watch(rig, SECONDS)


def lost_line(seen: Watched):
    spec = load_plan(plan_path("demo-wire")).rig.arm
    return next(line for line in check_stream("arm", spec, seen, SECONDS) if "lost" in line.name)


def test_what_was_lost_before_the_watch_began_is_not_counted():
    seen = watched(LossyArm(Rig(), before_n=500))
    assert seen.lost["arm"] == 0
    assert lost_line(seen).mark is Mark.OK


def test_losses_on_a_punctual_computer_are_the_devices():
    line = lost_line(watched(LossyArm(Rig(), before_n=0, every=20)))
    assert line.mark is Mark.FAIL
    assert "late" not in line.message
    assert line.remedy.startswith("check cable, bit rate and network")


def test_losses_on_a_late_computer_are_first_its_own():
    seen = watched(LossyArm(Rig(), before_n=0, every=20), stalls=7)
    assert seen.late_ticks == 7
    line = lost_line(seen)
    assert line.mark is Mark.FAIL
    assert f"late by a period in 7 of {len(seen.late_s)} ticks" in line.message
    assert line.remedy.startswith("this computer first")
