"""The ladder of forces below F_c: how far a rung must stay below the one above it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.contact.checks import require_not_negative, require_positive
from stepload.errors import RefusedError


@dataclass(frozen=True, slots=True)
class ForceLimits:
    """The ladder of forces below F_c; each lower rung leaves room for what the upper cannot see.

    `elastic_limit_n` is the lower end of F_c; `allowed_n` is the largest reading at which the true
    force is surely below it, `limit_n` is F_lim, at which the run is stopped, `largest_top_n` the
    highest top force a plan may ask for.
    """

    elastic_limit_n: float
    allowed_n: float
    limit_n: float
    largest_top_n: float


def headroom(noise_n: float, step_n: float) -> float:
    """Room in N between the top force and F_allowed, for noise and overshoot."""
    return 8.0 * noise_n + max(0.5, 0.02 * step_n)


def force_limits(
    elastic_limit_n: float,
    *,
    top_force_n: float,
    step_n: float,
    noise_n: float,
    tolerance_n: float,
    tolerance_relative: float,
    common_relative: float,
    bias_n: float,
    capacity_n: float,
    left: float = 1.0,
) -> ForceLimits:
    """F_lim and the largest safe top force, from the lower end of F_c.

    A payload dragged sideways where nothing sees or stops that has a part of F_c `left`. At that
    force all channels may read too little by what they have in common, left F_c (1 − common); the
    second one by a shift of its zero besides, and the main one less than that by what the
    cross-check lets pass: F_allowed = (left F_c (1 − common) − |bias| − tol_abs)/(1 + tol_rel), a
    reading. F_lim lies a quarter above the top force, never above F_allowed nor above `capacity_n`,
    what sensor and arm can bear.

    Raises:
        DomainError: a number is not finite and positive (or zero where that has a meaning).
        RefusedError: the elastic limit leaves no room, or the top force is above the largest safe.
    """
    require_positive(elastic_limit_n, "elastic limit F_c", "N")
    require_positive(top_force_n, "top force", "N")
    require_positive(step_n, "load step", "N")
    require_positive(noise_n, "force noise", "N")
    require_positive(capacity_n, "force capacity of arm and sensor", "N")
    require_not_negative(tolerance_n, "cross-check tolerance", "N")
    require_not_negative(tolerance_relative, "relative cross-check tolerance", "")
    require_not_negative(common_relative, "error common to the force channels", "")
    require_not_negative(bias_n, "allowed drift", "N")
    headroom_n = headroom(noise_n, step_n)
    agreed_n = left * elastic_limit_n * (1.0 - common_relative) - bias_n - tolerance_n
    allowed_n = min(agreed_n / (1.0 + tolerance_relative), capacity_n)
    largest_top_n = allowed_n - headroom_n
    arithmetic = f"{largest_top_n:.4g} N, of {elastic_limit_n:.4g} N of F_c"
    if largest_top_n <= 0.0:
        raise RefusedError(
            f"the elastic limit leaves no room to press: {arithmetic}",
            hint="use a more precise second force channel, or a mechanical fuse",
        )
    if top_force_n > largest_top_n:
        raise RefusedError(
            f"top force {top_force_n:.4g} N is above the largest safe top force, {arithmetic}",
            hint=f"reduce the top force to {math.floor(largest_top_n * 100.0) / 100.0:g} N",
        )
    limit_n = min(allowed_n, max(1.25 * top_force_n, top_force_n + headroom_n))
    return ForceLimits(elastic_limit_n, allowed_n, limit_n, largest_top_n)
