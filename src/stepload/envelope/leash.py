"""The leash: how far the arm may press on without a new answer, and whether that is enough.

The arm may go no farther than is safe on a rigid surface just ahead. A payload much softer than the
rig hardly answers to so little travel, and an arm with coarse positions hardly resolves it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from stepload.contact.power_law import ContactLaw
from stepload.envelope.press import NOISE_MULTIPLE, series_stiffness
from stepload.errors import RefusedError
from stepload.plan.model import Rig

PLENTY = 16.0
"""Ratio of the payload's answer to the resolvable force, from which on answers are found in motion:
twice what two answers of `ANCHOR_WINDOW_S` need."""
PLAIN_ANSWER = 4.0
"""The same ratio, from which on half of the leash is enough for an answer to be found at once."""
ANCHOR_WINDOW_S = 0.04
"""Time in s over which the force is averaged before it counts as an answer."""
END_WINDOW_S = 0.1
"""The same at the end of the leash, at least: the noise of an answer would hide the next one."""
ANSWER_SIGMAS = 4.5
"""Standard deviations by which a mean must rise to be an answer, also for R6. Of noise alone few
means in a hundred thousand rise so far."""
ANSWER_SHARE = 0.3
"""Share of the softest payload's answer to the travel since the last answer: a smaller rise is a
drift of the sensor, noise that is correlated between readings, or a sensor that lost its gain."""
DRIFT_SHARE = 0.5
"""Share of an answer at the end of the leash that may be a drift which goes on while the arm
stands."""
DRIFT_SIGMAS = 1.5
"""Standard deviations added to that drift; a steady drift then passes in one look of 700."""
ANSWER_WINDOW_S = 0.6
"""Time in s over which the force is averaged when an answer is looked for (R6)."""
LEAST_ANSWER = 4.0
"""Least ratio of answer to resolvable force; below it sound payloads were missed."""
LEAST_TOP_ANSWER = 2.5
"""The same just below a load level, where the leash is shortest; below it sound runs crept for
minutes, gave levels up, or ended with R6."""
LEAD_SIGMAS = 2.0
"""Factor on the smooth error of the position: a target that leads it by more may be ahead of an arm
that is held back."""
SURE_SIGMAS = 3.0
"""The same factor, where no sound run may be held up."""
PLAIN_STEPS = 2.0
"""Ratio of the leash for one answer to half a step of the position, above which the step hardly
slows the arm."""
LEAST_QUANTA = 2.0
"""Least ratio of the leash to the position resolution; below it the arm may see no progress."""


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
    told_n: float,
    position_resolution_m: float,
    share: float,
) -> None:
    """Refuse a payload too soft to answer, and positions too coarse to see.

    Args:
        leash_m: `leash_travel`.
        law: of the payload.
        touch_force_n: contact threshold.
        told_n: smallest change of the mean force that can be resolved.
        position_resolution_m: of the arm.
        share: share of the leash that the arm may travel on one answer.

    Raises:
        RefusedError: the run would end with R6 (no answer in force) or R7 (no progress).
    """
    if leash_m < LEAST_QUANTA * position_resolution_m:
        raise RefusedError(
            f"the arm may press on by {leash_m * 1e6:.3g} um at a time, less than"
            f" {LEAST_QUANTA:g} position resolutions of {position_resolution_m * 1e6:.3g} um",
            hint="raise the top force, or use an arm that is less stiff or finer",
        )
    travel_m = share * leash_m
    answer_n = law.force(law.deformation(touch_force_n) + travel_m) - touch_force_n
    if answer_n < LEAST_ANSWER * told_n:
        raise RefusedError(
            f"the payload is too soft for this rig: {travel_m * 1e6:.3g} um, all the arm may press"
            f" on at a time, change the force by {answer_n:.2g} N, and noise leaves"
            f" {LEAST_ANSWER * told_n:.2g} N to be told",
            hint="use a quieter force sensor, a higher top force, or an arm that is less stiff",
        )


def lead_m(rig: Rig, sigmas: float = LEAD_SIGMAS) -> float:
    """How far in m the target may lead the measured position of an arm that rests where it should.

    Half a step of the position, and the smooth error of the arm's travel, or the misfit of K_s
    where nothing better is known. Up to this much of the lead at rest counts as an error of
    measurement.
    """
    system = rig.system_stiffness
    smooth_m = system.msde_m if system.smooth_error_m is None else system.smooth_error_m
    return 0.5 * rig.arm.position_resolution_m + sigmas * smooth_m


def uncounted_lead_m(rig: Rig) -> float:
    """By how much in m such a lead may exceed what is allowed for, at `SURE_SIGMAS`."""
    return lead_m(rig, SURE_SIGMAS) - lead_m(rig)


class Leash(NamedTuple):
    """How far the arm may press on, as a multiple of the leash on a rigid surface.

    Attributes:
        share: from the last answer of the payload.
        proved: from the answer before it, which the last one has proved.
    """

    share: float
    proved: float


def leash_of(
    answers: Sequence[LevelAnswer], *, told_n: float, half_step_m: float, tangent: float
) -> Leash:
    """How far the arm may press on after the last answers of a payload.

    The last answer may be noise, so the arm may only go as far as is safe from the one before. A
    payload that answers clearly gives two answers in motion. With a softer one the arm stops
    halfway; where that is too short for an answer, or for an arm with coarse positions, it may go
    further than is safe on a rigid surface: as far as is safe on a payload as stiff as it is
    believed to be.

    Args:
        answers: of the payload at its levels, to travel over the whole leash.
        told_n: smallest change that the mean over `ANSWER_WINDOW_S` resolves.
        half_step_m: half a resolution of the arm's position.
        tangent: largest tangent stiffness of the payload over the largest K_s.
    """
    plain = all(each.answer_n >= PLENTY * told_n for each in answers)
    answer = 0.5 * PLENTY if plain else 2.0 * PLAIN_ANSWER
    steps = PLAIN_STEPS * (1.0 if plain else 2.0)
    needed = max(
        answer * told_n / each.answer_n + steps * half_step_m / each.leash_m for each in answers
    )
    borne = min(2.0, 1.0 + 1.0 / tangent)
    proved = min(borne, max(1.0, needed))
    return Leash(proved if plain else 0.5 * proved, proved)


class LevelAnswer(NamedTuple):
    """A payload's answer to travel over the whole leash just below a load level."""

    level_n: float
    leash_m: float
    answer_n: float


def level_answers(
    law: ContactLaw,
    *,
    levels_n: Sequence[float],
    limit_n: float,
    band_n: float,
    noise_n: float,
    stiffness_n_per_m: float,
) -> tuple[LevelAnswer, ...]:
    """The answers of a payload near its levels.

    Args:
        law: of the payload.
        levels_n: the load levels; each is reached within `band_n`.
        limit_n: F_lim.
        noise_n: of one force reading (sd).
        stiffness_n_per_m: largest K_s.
    """
    answers = []
    for level_n in levels_n:
        below_n = level_n - band_n
        leash_m = leash_travel(limit_n, below_n, noise_n, stiffness_n_per_m)
        series = series_stiffness(stiffness_n_per_m, law.tangent(max(below_n, band_n)))
        answers.append(LevelAnswer(level_n, leash_m, leash_m * series))
    return tuple(answers)


def told_force(noise_n: float, period_s: float) -> float:
    """Smallest change in N of the mean over `ANSWER_WINDOW_S` that noise does not hide."""
    return NOISE_MULTIPLE * noise_n * math.sqrt(period_s / ANSWER_WINDOW_S)


def check_levels(
    answers: Sequence[LevelAnswer], *, told_n: float, share: float, limit_n: float
) -> None:
    """Refuse a payload too soft to be brought to its levels: there the leash is at its shortest.

    Args:
        answers: of the payload, to travel over the whole leash.
        told_n: smallest change of the mean force that can be resolved.
        share: share of the leash that the arm may travel on one answer.
        limit_n: F_lim.

    Raises:
        RefusedError: a load step would creep for minutes, or end with R6 (no answer in force).
    """
    least_n = LEAST_TOP_ANSWER * told_n
    for level_n, leash_m, answer_n in answers:
        if share * answer_n < least_n:
            raise RefusedError(
                f"the payload is too soft for this rig near {level_n:.4g} N:"
                f" {share * leash_m * 1e6:.3g} um, all that F_lim of {limit_n:.4g} N lets the arm"
                f" press on at a time there, change the force by {share * answer_n:.2g} N, and"
                f" noise leaves {least_n:.2g} N to be told",
                hint="lower the top force, use a quieter force sensor, or a less stiff arm",
            )
