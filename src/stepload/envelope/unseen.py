"""How long a frozen force channel goes unseen, and what force can build up beside it meanwhile."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from stepload.envelope.limits import RunLimits
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan
from stepload.units import format_quantity

LEAST_GAIN = 0.3
"""The main channel is feared to read as little as this of the force; less shows as no answer."""
GAINS = tuple(LEAST_GAIN + 0.05 * step for step in range(15))
"""Of the main channel, up to one that is right."""
FILTERS = 8.0
"""Time constants after which R4 has forgotten what was before the freeze (`engine.cross_check`)."""


@dataclass(frozen=True, slots=True)
class Unseen:
    """What a frozen force channel comes to.

    Attributes:
        main_s, second_s: time in s after which equal samples of this channel stop the run; inf
            where a sound one may repeat itself for ever, or is not there.
        forces_n: true force in N that a run can come to, in contact, beside a second channel that
            froze, with a main one that reads too little, by what R5 let pass until then; for each
            of `GAINS`.
    """

    main_s: float
    second_s: float
    forces_n: tuple[float, ...]

    @property
    def force_n(self) -> float:
        """The largest of these forces."""
        return max(self.forces_n)


def unseen(plan: Plan, limits: RunLimits) -> Unseen | None:
    """The figures of a plan; None with one force channel, where nothing is compared."""
    if not limits.cross_check:
        return None
    sensor = plan.rig.second_force.sensor
    second_hz = sensor.rate_hz if sensor else plan.rig.arm.rate_hz
    second_s = _equal_s(limits.second_identical_counts, second_hz)
    return Unseen(
        main_s=_equal_s(limits.identical_counts, plan.rig.force.rate_hz),
        second_s=second_s,
        forces_n=tuple(_force_n(limits, second_s, gain, moves=bool(sensor)) for gain in GAINS),
    )


def _force_n(limits: RunLimits, second_s: float, gain: float, *, moves: bool) -> float:
    """True force in N that a main channel of this gain comes to beside a frozen second one.

    The second one froze at a true force F that it and R5 had let pass: F (1 − g) = tol_abs +
    tol_rel g F; or earlier, which comes to less. From there the true force grows no faster than
    the speed cap in contact lets a surface as stiff as K_s answer, and the main reading no faster
    than the load rate, until one of these ends it: equal samples; the main reading having moved by
    `second_stands_n` (where the second channel is a sensor, `moves`); R5, whose tolerance the main
    reading leaves on the other side of F; or the top force in that reading.
    """
    tolerance_n, relative = limits.cross_tolerance_n, limits.cross_relative
    unlike = 1.0 - gain - gain * relative
    most_n = limits.top_force_n / gain
    frozen_n = min(most_n, tolerance_n / unlike) if unlike > 0.0 else most_n
    read_n = gain * frozen_n
    room_n = limits.force_limit_n - read_n
    rate = min(
        limits.stiffness_n_per_m * room_n / limits.contact_n_s_per_m,
        limits.load_rate_n_per_s / gain,
    )
    react_n = rate * limits.reaction_s
    r5_n = ((frozen_n + tolerance_n) / (1.0 - relative) - read_n) / gain
    ends_n = [most_n - frozen_n, r5_n + rate * limits.cross_time_s + react_n]
    if math.isfinite(second_s):
        ends_n.append(rate * second_s + react_n)
    if moves:
        forgets_s = 2.0 * limits.channel_skew_s + FILTERS * limits.cross_filter_s
        ends_n.append(limits.second_stands_n / gain + rate * forgets_s + react_n)
    return frozen_n + min(ends_n)


def _equal_s(counts: int, rate_hz: float) -> float:
    return counts / rate_hz if counts else math.inf


def unseen_reasons(plan: Plan, limits: RunLimits) -> Iterator[Reason]:
    """How long a frozen channel goes unseen; a refusal where F_c can be passed meanwhile."""
    found = unseen(plan, limits)
    if found is None:
        return
    limit_n = limits.counted_limit_n
    refused = found.force_n > limit_n
    yield Reason(
        "frozen_channel", Severity.REFUSE if refused else Severity.NOTE,
        f"equal samples tell a frozen main force channel {_after(found.main_s)} and a frozen second"
        f" one {_after(found.second_s)}; beside that one a main channel that reads too little, by"
        f" what R5 lets pass, can press up to {format_quantity(found.force_n, 'N')}",
        "take less second_force.tolerance, a lower load_rate, or a second sensor whose resolution"
        " is finer beside its noise" if refused else "",
        found.force_n, limit_n, "N",
    )  # fmt: skip


def _after(time_s: float) -> str:
    return f"after {time_s:.3g} s" if math.isfinite(time_s) else "never"
