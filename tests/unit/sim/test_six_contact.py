"""What a tip with six axes does at the contact, and what the estimators say of it."""

from __future__ import annotations

import numpy as np
import pytest
from six_rigs import SURFACE_M, go, plant, rig, rub

from stepload.contact.lateral import left_of_limit
from stepload.identification.contact_quality import ContactQuality, Wrench, contact_quality
from stepload.rig.mount import Mount
from stepload_drivers.sim.six_plant import SixPlant

K, NOISE_N, TOP_N = 3.2e6, 0.03, 50.0


class Press:
    """Presses step by step and keeps what a sensor without mounting errors reads, at 500 Hz."""

    def __init__(self, mount: Mount) -> None:
        self.six: SixPlant = plant(rig(k=K), mount)
        go(self.six, SURFACE_M - 1e-6, 0.2)
        self.rows: list[tuple[float, ...]] = []

    def ramp(self, force_n: float, *, rising: bool, shift_m: float = 0.0, hold: int = 0) -> None:
        """To about this force in 0.5 s, the drive across to a shift; then a hold of 0.5 s."""
        six, begin_m, begin = self.six, self.six.drive_m, self.six.shift_m[0]
        goal_m = SURFACE_M + force_n / 9e4 + (force_n / K) ** (2.0 / 3.0)
        for i in range(1, 1001):
            part = min(i / 500.0, 1.0)
            six.command(six.time_s, begin_m + (goal_m - begin_m) * part)
            if shift_m:
                six.command_shift(six.time_s, begin + (shift_m - begin) * part, 0.0)
            six.step()
            if i % 2 == 0:
                self.rows.append((six.time_s, *six.load, rising, hold if i > 500 else 0))

    def told(self, seed: int = 0) -> ContactQuality:
        table = np.array(self.rows)
        table[:, 1:4] += np.random.default_rng(seed).normal(0.0, NOISE_N, (len(table), 3))
        table = table[table[:, 3] > 0.5]
        found = contact_quality(
            Wrench(
                table[:, 0], table[:, 3], table[:, 1:3], table[:, 4] > 0.0,
                np.ones(len(table), int), table[:, 5].astype(int), NOISE_N,
            ),
            None,
        )  # fmt: skip
        assert isinstance(found, ContactQuality)
        return found


def pressed(mount: Mount) -> ContactQuality:
    """Up to 50 N in five steps, and back."""
    press = Press(mount)
    for number, level_n in enumerate(np.linspace(10.0, TOP_N, 5), 1):
        press.ramp(float(level_n), rising=True, hold=number)
    for number, level_n in enumerate(np.linspace(40.0, 10.0, 4), 6):
        press.ramp(float(level_n), rising=False, hold=number)
    return press.told()


def test_a_contact_that_slides_has_the_share_of_its_friction_a_loop_and_no_jump() -> None:
    found = pressed(rub(0.1, x=0.5))
    up, down = (each.share for each in found.branches)
    assert found.branches[0].size == pytest.approx(0.1, abs=0.01)
    assert float(np.hypot(*(up - down))) > 0.1
    assert found.slips == ()


@pytest.mark.parametrize(("k", "n"), [(8e6, 1.5), (9e6, 1.0)])
def test_friction_follows_the_size_of_the_contact_where_a_payload_loses_work(
    k: float, n: float
) -> None:
    """At a turn the normal force falls on another, steeper curve; the contact is what it was."""
    six = plant(rig(k=k, n=n, payload={"hysteresis": 0.1}), rub(0.6, x=0.3))
    go(six, SURFACE_M + 6e-4)
    share = six.friction_n / six.tip.normal_n
    assert 0.1 < share < 0.5
    for _ in range(3):
        go(six, six.drive_m - 1e-5, 0.02, settle_s=0.0)
        go(six, six.drive_m + 5e-6, 0.02, settle_s=0.05)
        assert six.friction_n / six.tip.normal_n == pytest.approx(share, rel=0.1)
    go(six, SURFACE_M + 3e-4, 0.2, settle_s=0.0)
    assert six.friction_n / six.tip.normal_n < 1.05 * share
    assert six.peak_equivalent_n < 1.05 * six.peak_n / left_of_limit(0.3, share)


@pytest.mark.parametrize("friction", [0.6, 5.0])
def test_a_contact_that_sticks_has_the_same_share_both_ways_and_no_jump(friction: float) -> None:
    found = pressed(rub(friction, x=0.5))
    up, down = found.branches
    assert 0.1 < up.size < 0.4
    assert float(np.hypot(*(up.share - down.share))) < 0.25 * up.size
    assert found.slips == ()


def test_a_tip_that_is_dragged_until_it_lets_go_is_seen_to_slip() -> None:
    """Static friction holds it, kinetic friction does not: the force across jumps down."""
    press = Press(rub(0.3, 0.15, x=0.1))
    for number, level_n in enumerate((10.0, 20.0, 40.0), 1):
        press.ramp(level_n, rising=True, hold=number)
    assert press.told().slips == ()
    press.ramp(40.0, rising=True, shift_m=4e-4, hold=4)
    slips = press.told().slips
    assert slips
    assert slips[0].force_n == pytest.approx(40.0, rel=0.1)
    assert 1.0 < max(slip.jump_n for slip in slips) < 2.0 * 0.3 * 40.0
