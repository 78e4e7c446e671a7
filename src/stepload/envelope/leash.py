"""The leash: how far the arm may press on what the force has proved, and whether that is enough.

The arm may go no farther than a rigid surface just ahead could bear. A payload much softer than the
rig hardly answers to so little travel, and an arm with coarse positions hardly sees it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.contact.power_law import ContactLaw
from stepload.envelope.press import NOISE_MULTIPLE, series_stiffness
from stepload.errors import RefusedError

PAIR_FILTER_S = 0.03
"""Time constant over which force and position are averaged before they move the leash's anchor."""
ANSWER_WINDOW_S = 0.6
"""The force is averaged over so long when an answer is looked for (R6)."""
LEAST_ANSWER = 4.0
"""Answer of the payload over what the average can tell; below it sound payloads were missed."""
LEAST_TOP_ANSWER = 2.0
"""The same just below a load level, where the leash is shortest; below it sound runs crept for
minutes, gave levels up, or ended with R6."""
LEAST_QUANTA = 2.0
"""Travel of the leash over the position resolution, below it the arm may see no progress."""


def leash_travel(
    limit_n: float, touch_force_n: float, noise_n: float, stiffness_n_per_m: float
) -> float:
    """Travel in m that lifts the force from the contact threshold to F_lim on a rigid surface."""
    return (limit_n - touch_force_n - NOISE_MULTIPLE * noise_n) / stiffness_n_per_m


def check_leash(
    leash_m: float,
    law: ContactLaw,
    *,
    touch_force_n: float,
    noise_n: float,
    period_s: float,
    position_resolution_m: float,
) -> None:
    """Refuse a payload too soft to answer, and positions too coarse to see.

    Args:
        leash_m: `leash_travel`.
        law: of the payload.
        touch_force_n, noise_n: contact threshold, noise of one force reading (sd).
        period_s: from one force reading to the next.
        position_resolution_m: of the arm.

    Raises:
        RefusedError: the run would end with R6 (no answer in force) or R7 (no progress).
    """
    if leash_m < LEAST_QUANTA * position_resolution_m:
        raise RefusedError(
            f"the arm may press on by {leash_m * 1e6:.3g} um at a time, less than"
            f" {LEAST_QUANTA:g} position resolutions of {position_resolution_m * 1e6:.3g} um",
            hint="raise the top force, or use an arm that is less stiff or finer",
        )
    answer_n = law.force(law.deformation(touch_force_n) + leash_m) - touch_force_n
    told_n = NOISE_MULTIPLE * noise_n * math.sqrt(period_s / ANSWER_WINDOW_S)
    if answer_n < LEAST_ANSWER * told_n:
        raise RefusedError(
            f"the payload is too soft for this rig: {leash_m * 1e6:.3g} um, all the arm may press"
            f" on at a time, change the force by {answer_n:.2g} N, and noise leaves"
            f" {LEAST_ANSWER * told_n:.2g} N to be told",
            hint="use a quieter force sensor, a higher top force, or an arm that is less stiff",
        )


def check_levels(
    law: ContactLaw,
    *,
    levels_n: Sequence[float],
    limit_n: float,
    band_n: float,
    noise_n: float,
    period_s: float,
    stiffness_n_per_m: float,
) -> None:
    """Refuse a payload too soft to be brought to its levels: there the leash is at its shortest.

    Args:
        law: of the payload.
        levels_n: the load levels; each is reached within `band_n`.
        limit_n: F_lim.
        noise_n: of one force reading (sd).
        period_s: from one force reading to the next.
        stiffness_n_per_m: largest K_s.

    Raises:
        RefusedError: a load step would creep for minutes, or end with R6 (no answer in force).
    """
    told_n = LEAST_TOP_ANSWER * NOISE_MULTIPLE * noise_n * math.sqrt(period_s / ANSWER_WINDOW_S)
    for level_n in levels_n:
        below_n = level_n - band_n
        leash_m = leash_travel(limit_n, below_n, noise_n, stiffness_n_per_m)
        answer_n = leash_m * series_stiffness(stiffness_n_per_m, law.tangent(max(below_n, band_n)))
        if answer_n < told_n:
            raise RefusedError(
                f"the payload is too soft for this rig near {level_n:.4g} N:"
                f" {leash_m * 1e6:.3g} um, all that F_lim of {limit_n:.4g} N lets the arm press on"
                f" at a time there, change the force by {answer_n:.2g} N, and noise leaves"
                f" {told_n:.2g} N to be told",
                hint="lower the top force, use a quieter force sensor, or a less stiff arm",
            )
