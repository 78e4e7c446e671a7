"""How a contact was made, from series made by hand: share, slips, place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from stepload.identification.contact_quality import (
    ContactQuality,
    Wrench,
    contact_quality,
    turn_of,
)
from stepload.identification.fit import Missing

TOP_N, RATE_HZ, NOISE_N = 50.0, 500.0, 0.03
AXES = ("+fx", "-fx", "+fy", "-fy", "+fz", "-fz")


def made(
    up: float = 0.1, down: float = 0.1, *, cycles: int = 1, again: float | None = None,
    jump_n: float = 0.0, at_s: float = 3.2, falling: bool = False, noise_n: float = NOISE_N,
    seed: int = 0,
) -> Wrench:  # fmt: skip
    """Ramps and holds of 1 s to 10, 20 … 50 N and back; the share across is all on the first axis.

    `again` is the share of the second loading; a jump of the force across comes `at_s` after the
    begin of the first loading, or unloading.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for cycle in range(1, cycles + 1):
        for rising, levels in ((True, range(10, 51, 10)), (False, range(40, 0, -10))):
            before = 1.0 if rising else 50.0
            for level in levels:
                ramp = np.linspace(before, level, int(RATE_HZ))
                for force, held in ((ramp, 0), (np.full(int(RATE_HZ), float(level)), 1)):
                    rows.append((force, cycle, rising, held))
                before = float(level)
    force_n = np.concatenate([row[0] for row in rows])
    sizes = [row[0].size for row in rows]
    cycle, rising, resting = (np.repeat([row[i] for row in rows], sizes) for i in (1, 2, 3))
    held = np.where(resting, np.repeat(np.arange(1, len(rows) + 1), sizes), 0)
    time_s = np.arange(force_n.size) / RATE_HZ
    share = np.where(rising, up, down)
    if again is not None:
        share = np.where(rising & (cycle == 2), again, share)
    across_n = np.zeros((force_n.size, 2))
    across_n[:, 0] = share * force_n
    begin_s = float(time_s[~rising][0]) if falling else 0.0
    slipped = (rising != falling) & (cycle == 1) & (time_s >= begin_s + at_s)
    across_n[:, 0] -= jump_n * slipped
    noise = rng.normal(0.0, noise_n, (force_n.size, 3))
    return Wrench(time_s, force_n + noise[:, 0], across_n + noise[:, 1:], rising, cycle, held,
                  noise_n)  # fmt: skip


def told(wrench: Wrench | None, lever_m: float | None = None) -> ContactQuality:
    found = contact_quality(wrench, lever_m)
    assert isinstance(found, ContactQuality)
    return found


def test_the_share_is_told_with_its_sign_for_each_way() -> None:
    found = told(made(0.12, -0.05, cycles=2, again=0.02))
    assert [each[:2] for each in found.branches] == [(1, True), (1, False), (2, True), (2, False)]
    for each, share in zip(found.branches, (0.12, -0.05, 0.02, -0.05), strict=True):
        assert each.share == pytest.approx([share, 0.0], abs=1e-3)
        assert each.size == pytest.approx(abs(share), abs=1e-3)


def test_a_jump_is_told_with_time_force_and_size() -> None:
    [slip] = told(made(jump_n=1.9)).slips
    assert slip.time_s == pytest.approx(3.2, abs=0.01)
    assert slip.force_n == pytest.approx(20.0, abs=0.5)
    assert slip.jump_n == pytest.approx(1.9, abs=0.15)
    assert slip.rising


def test_a_jump_on_a_ramp_and_on_the_way_down_are_seen_too() -> None:
    [slip] = told(made(jump_n=1.0, at_s=4.5)).slips
    assert slip.time_s == pytest.approx(4.5, abs=0.01)
    [slip] = told(made(jump_n=1.0, at_s=1.5, falling=True)).slips
    assert not slip.rising


@pytest.mark.parametrize("down", [0.1, -0.1, 0.0])
def test_ramps_holds_and_the_turn_of_friction_are_no_slips(down: float) -> None:
    for seed in range(5):
        assert told(made(0.1, down, cycles=2, seed=seed)).slips == ()


def test_a_step_of_the_load_that_the_force_across_follows_is_no_slip() -> None:
    wrench = made(0.25, 0.25)
    step_n = np.interp(wrench.time_s, [3.2, 3.22, 3.7, 3.72], [0.0, 15.0, 15.0, 0.0])
    across = wrench.across_n + np.stack([0.25 * step_n, 0.0 * step_n], axis=1)
    stepped = replace(wrench, force_n=wrench.force_n + step_n, across_n=across)
    assert told(stepped).slips == ()
    assert told(replace(stepped, across_n=wrench.across_n)).slips != ()


def test_what_is_smaller_than_what_can_be_seen_is_told_as_that() -> None:
    loud = told(made(jump_n=0.5, noise_n=0.3))
    assert loud.slips == ()
    assert loud.undetected_n > 0.5
    quiet = told(made())
    assert quiet.undetected_n == pytest.approx(
        0.01 * TOP_N + 2.0 * NOISE_N / math.sqrt(2.0), rel=0.02
    )
    for seed in range(20):
        assert told(made(jump_n=loud.undetected_n, noise_n=0.3, seed=seed)).slips


@pytest.mark.parametrize("axis", AXES)
def test_the_place_is_found_for_every_pressing_axis(axis: str) -> None:
    """T = (r + e) × f with the vectors written out, the sensor's frame right-handed."""
    plain, lever_m, beside = made(0.15, 0.15), 0.12, (1.5e-3, -2.5e-3)
    index, sign = "xyz".index(axis[2]), -1.0 if axis[0] == "-" else 1.0
    others = [i for i in range(3) if i != index]
    force = np.zeros((plain.force_n.size, 3))
    force[:, index], force[:, others] = sign * plain.force_n, plain.across_n
    place = np.zeros(3)
    place[index] = -sign * lever_m  # the plate pushes towards the sensor
    place[others] = beside
    torque = np.cross(place, force)[:, others]
    torque += np.random.default_rng(1).normal(0.0, 0.002, torque.shape)
    wrench = replace(plain, torque_n_m=torque, torque_noise_n_m=0.002, turn=turn_of(axis))
    found = told(wrench, lever_m)
    best = found.place
    assert not isinstance(best, Missing)
    off = np.subtract(best.beside_m, beside)
    assert np.abs(off).max() < 5.0 * best.sigma_m
    assert best.force_n == pytest.approx(TOP_N, rel=1e-3)
    assert best.size_m == pytest.approx(math.hypot(*beside), abs=3e-5)
    assert best.sigma_m == pytest.approx(
        math.hypot(0.002, 0.12 * NOISE_N) / TOP_N / math.sqrt(RATE_HZ), rel=0.01
    )


def test_too_little_contact_tells_nothing() -> None:
    wrench = made()
    few = Wrench(*(getattr(wrench, name)[:10] for name in (
        "time_s", "force_n", "across_n", "rising", "cycle", "held")), NOISE_N)  # fmt: skip
    assert isinstance(contact_quality(few, None), Missing)
    only_down = replace(wrench, rising=np.zeros_like(wrench.rising))
    assert isinstance(contact_quality(only_down, None), Missing)


def test_samples_that_are_no_numbers_are_left_out() -> None:
    wrench = made(0.12, -0.05)
    across, force = wrench.across_n.copy(), wrench.force_n.copy()
    across[::97, 1], force[5::101] = np.nan, np.inf
    found = told(replace(wrench, across_n=across, force_n=force))
    assert found.branches[0].size == pytest.approx(0.12, abs=1e-3)
    assert found.slips == ()
    nothing = np.full_like(wrench.across_n, np.nan)
    assert isinstance(contact_quality(replace(wrench, across_n=nothing), None), Missing)
