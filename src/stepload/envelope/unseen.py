"""How long a frozen force channel goes undetected, and what force can build up meanwhile."""

from __future__ import annotations

import math
from dataclasses import dataclass

from stepload.envelope.bounds import cross_blind_n
from stepload.envelope.limits import RunLimits
from stepload.plan.model import Plan

LEAST_GAIN = 0.3
"""Smallest gain that a faulty main channel is assumed to have; a smaller one shows as no answer."""
GAINS = tuple(LEAST_GAIN + 0.05 * step for step in range(15))
"""Gains of the main channel that are tried, up to the right one."""
FILTERS = 8.0
"""Time constants after which R4 has forgotten what was before the freeze (`engine.cross_check`)."""
WAITS = 4.0
"""Multiples of `leash_time_s` within which R6 ends half a step whose only answer is a drift."""
LEADS_SHARE = 0.3
"""Share of the computed drift: the smallest that led an arm on in a search for the worst case, with
small load steps."""
TELLS_WITHIN_S = 20.0
"""An approach does not wait for a sound channel that may repeat itself for longer than this, in s:
on average it gives a new reading after a 25th of that time (`limits.FALSE_FREEZE_ODDS`)."""


@dataclass(frozen=True, slots=True)
class Tells:
    """The force channels for whose new readings an approach waits.

    It does not wait for one that is absent, or that may repeat itself for long although it is
    sound. None of the others repeats itself for `patience_s`.
    """

    main: bool
    second: bool
    patience_s: float = TELLS_WITHIN_S


EVERY = Tells(main=True, second=True)


@dataclass(frozen=True, slots=True)
class Unseen:
    """The consequences of a frozen force channel.

    Attributes:
        main_s, second_s: time in s after which equal samples of this channel stop the run; inf
            where a sound one may repeat itself for ever, or is not there.
        forces_n: true force in N that a run can reach in contact with a frozen second channel and a
            main one that reads too little, within what R5 let pass until then; for each of `GAINS`.
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
    main_s, second_s = _equal_times(plan, limits)
    sensor = plan.rig.second_force.sensor
    tolerance_n = limits.cross_tolerance_n + cross_blind_n(plan.rig, limits.noise_n)
    return Unseen(
        main_s=main_s,
        second_s=second_s,
        forces_n=tuple(
            _force_n(limits, tolerance_n, second_s, gain, moves=bool(sensor)) for gain in GAINS
        ),
    )


def tells_of(plan: Plan, limits: RunLimits) -> Tells:
    """Which force channels an approach waits for."""
    main_s, second_s = _equal_times(plan, limits)
    told_s = [each_s for each_s in (main_s, second_s) if each_s <= TELLS_WITHIN_S]
    return Tells(main_s in told_s, second_s in told_s, max(told_s, default=TELLS_WITHIN_S))


def _force_n(
    limits: RunLimits, tolerance_n: float, second_s: float, gain: float, *, moves: bool
) -> float:
    """True force in N that is reached with a main channel of this gain and a frozen second one.

    The second one froze at a true force F that it and R5 had let pass: F (1 − g) = tol_abs +
    tol_rel g F, where tol_abs is `tolerance_n`: with what noise hides of a difference; or earlier,
    which gives less. From there the true force grows no faster than the speed cap in contact lets
    a surface as stiff as K_s answer, and the main reading no faster than the load rate, until one
    of these ends it: equal samples; the main reading having moved by
    `second_stands_n` (where the second channel is a sensor, `moves`); R5, whose tolerance the main
    reading leaves on the other side of F; or the top force in that reading.
    """
    relative = limits.cross_relative
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


def _equal_times(plan: Plan, limits: RunLimits) -> tuple[float, float]:
    """Time in s after which equal samples stop a run, of the main and of the second channel."""
    rig = plan.rig
    main_s = _equal_s(limits.identical_counts, rig.force.rate_hz)
    if not limits.cross_check:
        return main_s, math.inf
    sensor = rig.second_force.sensor
    second_hz = sensor.rate_hz if sensor else rig.arm.rate_hz
    return main_s, _equal_s(limits.second_identical_counts, second_hz)


def _equal_s(counts: int, rate_hz: float) -> float:
    return counts / rate_hz if counts else math.inf
