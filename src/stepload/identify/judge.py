"""Feasibility once more, with what the run itself has measured."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from stepload.identify.identifiability import Identifiability, identifiability
from stepload.units import format_quantity


class ResultVerdict(StrEnum):
    """What the data have shown about the payload."""

    IDENTIFIED = "identified"
    MARGINAL = "marginal"
    NOT_IDENTIFIABLE = "not identifiable"


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the data are good for, and why."""

    verdict: ResultVerdict
    reasons: tuple[str, ...]
    identifiability: Identifiability


def judge(
    *,
    secant_n_per_m: float,
    interval_n_per_m: Sequence[float] | None,
    peak_force_n: float,
    resolution_m: float,
    system_stiffness_n_per_m: float | None,
    p: float = 2.0,
    s: float = 20.0,
    t: float = 5.0,
    doubts: Sequence[str] = (),
) -> Judgement:
    """Judge a result by two measures: (34) with measured values, and its interval against 1/t.

    Args:
        secant_n_per_m: secant of the believed fit at the peak force.
        interval_n_per_m: its 95 % interval [low, high]; None where there is none.
        peak_force_n: largest force measured.
        resolution_m: position resolution, the coarser of the rig's and the measured noise.
        system_stiffness_n_per_m: K_s; None where data are free of it.
        p, s, t: those of (29)–(32).
        doubts: flags of the believed fit; any makes the result marginal at best.

    Raises:
        DomainError: a number that is not finite and positive.
    """
    found = identifiability(peak_force_n, resolution_m, system_stiffness_n_per_m, p=p, s=s, t=t)
    k_max = found.k_max_n_per_m
    within = secant_n_per_m <= k_max
    reasons = [
        f"secant {format_quantity(secant_n_per_m, 'N/m')} is {secant_n_per_m / k_max:.2g} of "
        f"K_max {format_quantity(k_max, 'N/m')} with the measured peak force and noise (34)"
    ]
    narrow = False
    if interval_n_per_m is None or not all(map(math.isfinite, interval_n_per_m)):
        reasons.append("there is no interval: the uncertainty sources are not known")
    else:
        half = (interval_n_per_m[1] - interval_n_per_m[0]) / (2.0 * secant_n_per_m)
        narrow = half <= 1.0 / t
        reasons.append(
            f"the 95 % interval is ±{half:.1%} of the secant, asked for is ±{1.0 / t:.0%} (1/t)"
        )
    reasons += doubts
    if within and narrow and not doubts:
        verdict = ResultVerdict.IDENTIFIED
    elif within or narrow:
        verdict = ResultVerdict.MARGINAL
    else:
        verdict = ResultVerdict.NOT_IDENTIFIABLE
    return Judgement(verdict, tuple(reasons), found)
