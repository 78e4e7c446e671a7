"""Contribution of lateral force to the budget, and the doubts that it raises."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from stepload.estimators.across import CROSS_COMPLIANCE
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray

GUIDED_COMPLIANCE = 0.3
"""C_xz/C_zz of a guided axis, or of a rig of unstated structure."""
LEFT_OVER = 0.05
"""Standard uncertainty of a correction with three numbers, as a share of the correction. In
simulation 1/18 to 1/20 of the bias of one number remained where all slides or all sticks, a tenth
on a plate tilted by 3 degrees: joints turn, and the plate's normal is not the tool's axis."""
UNKNOWN_FRICTION = 0.9 * 0.5 / math.sqrt(3.0)
"""Standard uncertainty of a deflection, as a share of it, on a serial arm where the friction of the
payload is not known relative to that of the calibration. Coupling C_xz/C_zz of 0.9 (90th percentile
of poses; median 0.3) times a difference of the lateral shares of up to 0.5 either way, uniformly
distributed: 0.26. With a difference of 0.3 the 95 % intervals of 128 simulated runs contained the
truth in 83 %, with 0.5 in 90 %: a tip that sticks, or a dry block and a payload that slides, differ
more than two contacts that slide (`python -m stepload_verify.trials.coupling`)."""

STATED_FRICTION = 0.33 * 0.3 / math.sqrt(3.0)
"""The same where a person states K_s for a press without lateral force: the median coupling, and a
lateral share of up to 0.3 either way, uniformly distributed."""

NOT_KNOWN = "share not known, counted as none"
"""How a share that no sensor tells stands in the budget: its line has a width of 0."""

Rule = Literal["guided", "unknown", "one number", "three numbers"]


@dataclass(frozen=True, slots=True)
class Sideways:
    """The lateral force of one run.

    Attributes:
        rule: "guided": a guided axis, or a rig of unstated structure; for an arm, "three numbers":
            the effect was corrected; "one number": the difference of its share from that of the
            calibration is known; "unknown": it is not.
        share: size of lateral over axial force; None where the sensor does not measure it.
        away: the same less the share that K_s was measured at.
        relative: standard uncertainty of the deflection that it leaves, as a share of it.
        taken: the correction by the three numbers, as a share of the deflection.
        errors: the independent parts of `relative` with their signs, which give the correlation
            between runs of one rig; empty where they are not known.
    """

    rule: Rule
    share: float | None = None
    away: float = 0.0
    relative: float = 0.0
    taken: float = 0.0
    errors: tuple[float, ...] = ()

    @property
    def size(self) -> str:
        """Its size, as shown in the budget."""
        if self.rule == "unknown":
            return "friction of the contact, not measured"
        if self.rule == "one number":
            return f"{self.away:.1%} away from that of K_s"
        if self.share is None:
            return NOT_KNOWN
        taken = f", {self.taken:.1%} of the deflection taken out"
        return f"{self.share:.1%}" + (taken if self.rule == "three numbers" else "")

    @property
    def note(self) -> str:
        """What this run cannot show because of it; "" where nothing is missing."""
        if self.rule == "unknown":
            return (
                "friction holds an arm's tip sideways and makes it stiffer along the axis; whether "
                "it did so as in the calibration is not known: record all six axes of the force "
                "sensor and calibrate dry and greased, or measure with a gauge across the contact"
            )
        return "lateral force is not in the data: its share is not known"


def expected_sideways(told: Conditions) -> Sideways:
    """Expectation before a run: no contribution where its share can be compared with that of the
    calibration, otherwise that of unknown friction."""
    known = told.across.at_share is not None and not told.across.stated
    if known or told.across.per_newton_m is not None:
        return Sideways("guided")
    return sideways(told, None, None, 0.0)


def sideways(
    told: Conditions, share: FloatArray | None, size: float | None, away: float
) -> Sideways:
    """Choose the rule for a run, and evaluate it.

    Args:
        told: the conditions, with what is known of the arm.
        share: (2,) signed lateral over axial force; None where the sensor does not measure it.
        size: its size, noise taken out.
        away: size of the share less that of the calibration, noise taken out.
    """
    across, stiffness_n_per_m = told.across, told.sources.system_stiffness_n_per_m
    if stiffness_n_per_m is None:
        return Sideways("guided", size)
    if share is not None:
        if across.per_newton_m is not None:
            taken = stiffness_n_per_m * float(across.away(share) @ across.per_newton_m)
            own = across.errors_m_per_n(share, stiffness_n_per_m)
            errors = (*(stiffness_n_per_m * each for each in own), LEFT_OVER * taken)
            left = math.hypot(*errors)
            return Sideways("three numbers", size, away, left, abs(taken), errors=errors)
        if told.arm and across.at_share is not None:
            errors = _along(across.away(share))
            return Sideways("one number", size, away, CROSS_COMPLIANCE * away, errors=errors)
    if told.arm:
        relative = STATED_FRICTION if across.stated else UNKNOWN_FRICTION
        return Sideways("unknown", size, relative=relative)
    errors = () if share is None else _along(share)
    return Sideways("guided", size, relative=GUIDED_COMPLIANCE * (size or 0.0), errors=errors)


def _along(share: FloatArray) -> tuple[float, ...]:
    """Signed errors for shares (2,): the coupling of the rig is not known, but constant between
    runs."""
    return tuple(map(float, share))
