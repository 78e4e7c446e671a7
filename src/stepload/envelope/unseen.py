"""How long a frozen force channel goes undetected, and what force can build up meanwhile."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from stepload.envelope.bounds import cross_blind_n
from stepload.envelope.leash import leash_travel
from stepload.envelope.limits import RunLimits
from stepload.envelope.reason import Reason, Severity
from stepload.plan.model import Plan
from stepload.units import format_quantity

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


def unseen_reasons(plan: Plan, limits: RunLimits) -> Iterator[Reason]:
    """How long a frozen channel goes undetected; a refusal where F_c can be passed meanwhile."""
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


def both_silent_reasons(limits: RunLimits) -> Iterator[Reason]:
    """The force that a load step on a soft payload reaches if every force channel falls silent.

    The arm goes on by `leash_proved` times the travel that is safe on a rigid surface: a soft
    payload, or an arm with coarse positions, needs more of it, and the payload itself bears that. A
    position that is read in steps adds one, half of it at the start of the leash and half at its
    end. An arm that is held back meanwhile, and springs free, adds the lead that counts as an error
    of its position.
    """
    stiffness = limits.stiffness_n_per_m
    most_n = limits.leash_proved * limits.force_limit_n + stiffness * limits.position_resolution_m
    held_n = most_n + stiffness * limits.lead_m
    limit_n = limits.counted_limit_n
    if held_n <= limit_n:
        return
    silent = "both force channels fall" if limits.cross_check else "the force channel falls"
    yield Reason(
        "both_silent", Severity.WARN if most_n > limit_n else _severity(limits),
        f"where {silent} silent in a load step, and the payload is much stiffer than the plan says"
        f" or rests on something hard, the arm goes on to {format_quantity(most_n, 'N')},"
        f" {most_n / limit_n:.3g} times the counted F_c, before it stands; to"
        f" {format_quantity(held_n, 'N')} where friction holds it back until then",
        "",
        most_n, limit_n, "N",
    )  # fmt: skip


def silent_reasons(plan: Plan, limits: RunLimits) -> Iterator[Reason]:
    """Reasons on channels that an approach cannot wait for, with the force that can build up.

    A frozen one cannot be distinguished from a sound one until the force moves it. With two
    channels the other one must be dead too, under live noise.
    """
    tells = tells_of(plan, limits)
    silent = [] if tells.main else ["force"]
    if limits.cross_check and not tells.second:
        silent.append("second_force")
    most_n = limits.cross_tolerance_n + _search_n(plan, limits)
    limit_n = limits.counted_limit_n
    if not silent or most_n <= limit_n:
        return
    beside = (
        "where one is frozen and the other dead behind live noise"
        if limits.cross_check
        else "where it is frozen"
    )
    yield Reason(
        "silent_channel", _severity(limits),
        f"in free air a sound {' or '.join(silent)} may read the same for more than"
        f" {TELLS_WITHIN_S:g} s, too long for an approach to wait for: {beside}, the arm goes to"
        f" the end of its search, and presses with up to {format_quantity(most_n, 'N')}",
        "take a sensor whose resolution is finer beside its noise, or a shorter search_distance",
        most_n, limit_n, "N",
    )  # fmt: skip


def deaf_approach_reasons(plan: Plan, limits: RunLimits, *, shaken: bool) -> Iterator[Reason]:
    """The force that an approach reaches if every force channel has died under live noise.

    `shaken`: whether a shake proves the channels just before the approach.
    """
    most_n, limit_n = _search_n(plan, limits), limits.counted_limit_n
    if most_n <= limit_n:
        return
    dead = "both force channels have" if limits.cross_check else "the only force channel has"
    since = "the shake before the approach" if shaken else "the last push by hand, if there was one"
    way_m = limit_n / limits.stiffness_n_per_m
    proof = (
        ""
        if shaken
        else "state rig.force.tool_mass, for a shake that proves it before an approach; "
    )
    yield Reason(
        "deaf_approach", _severity(limits),
        f"if {dead} died while the noise goes on (unseen since {since}), nothing stops the arm at"
        f" the surface: it presses on to the end of the search, with up to"
        f" {format_quantity(most_n, 'N')} on something rigid (the arm's own push: {_push(plan)})",
        f"{proof}the arm's own force limit below {format_quantity(limit_n, 'N')}; or a surface"
        f" known so well that search_distance may be below {format_quantity(way_m, 'm')}",
        most_n, limit_n, "N",
    )  # fmt: skip


def dead_drift_reasons(plan: Plan, limits: RunLimits) -> Iterator[Reason]:
    """The drift of a dead channel that is mistaken for the answers of a payload.

    A rise while the arm stands is no answer, nor is a rise in motion that such a drift explains.
    But where answers are found in motion the arm has not stood yet: near a level, two answers below
    it, the arm takes some time for a leash, and a drift that amounts to an answer by then keeps it
    going. And a level that is reached before R6 trips gives the next one a new leash.
    """
    room_n = limits.stiffness_n_per_m * leash_travel(
        limits.force_limit_n, limits.top_force_n, limits.noise_n, limits.stiffness_n_per_m
    )
    leash_n = limits.leash_proved * room_n
    answer_n = limits.answer_top_n_per_m * leash_n / limits.stiffness_n_per_m
    drift = 0.5 * plan.procedure.step_n / (WAITS * limits.leash_time_s)
    if limits.leash_share >= limits.leash_proved:
        drift = min(drift, 2.0 * limits.step_rate_per_s * answer_n**2 / leash_n)
    dead = "both force channels are" if limits.cross_check else "the only force channel is"
    push = f"nothing bounds the force but the arm's own push of {_push(plan)}"
    yield Reason(
        "dead_drift", _severity(limits),
        f"where {dead} dead in a load step and the reading rises on by itself, by more than"
        f" about {LEADS_SHARE * drift:.2g} N/s or in jumps of {answer_n:.2g} N, it passes for a"
        f" payload that answers: {push}",
        "channels with supplies and links of their own; the arm's own force limit",
        LEADS_SHARE * drift, 0.0, "N/s",
    )  # fmt: skip


def _search_n(plan: Plan, limits: RunLimits) -> float:
    """Force in N on a rigid surface at the near edge if the arm searches to the end."""
    reach_n = limits.stiffness_n_per_m * plan.procedure.search_distance_m
    return min(reach_n, plan.rig.arm.max_push_n)


def _severity(limits: RunLimits) -> Severity:
    """Severity of what needs every force channel to be dead: with two of them both must be."""
    return Severity.NOTE if limits.cross_check else Severity.WARN


def _push(plan: Plan) -> str:
    return f"{format_quantity(plan.rig.arm.max_push_n, 'N')} (rig.arm.max_push)"


def _after(time_s: float) -> str:
    return f"after {time_s:.3g} s" if math.isfinite(time_s) else "never"
