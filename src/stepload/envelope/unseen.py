"""How long a frozen force channel goes unseen, and what force can build up beside it meanwhile."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from stepload.envelope.leash import leash_travel
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
WAITS = 4.0
"""Times `leash_time_s`, in which R6 ends half a step whose only answer is a drift."""
LEADS_SHARE = 0.3
"""Of the drift that this is reckoned from: the least that led an arm on where the worst was looked
for, with small load steps."""
TELLS_WITHIN_S = 20.0
"""A sound channel that may repeat itself for longer is not waited for: it says something new after
a 25th of that in the mean (`limits.FALSE_FREEZE_ODDS`)."""


@dataclass(frozen=True, slots=True)
class Tells:
    """Which force channels an approach waits for until they have told something new.

    Not for one that is not there, or that is sound and may stand for long. None of the others
    stands for `patience_s`.
    """

    main: bool
    second: bool
    patience_s: float = TELLS_WITHIN_S


EVERY = Tells(main=True, second=True)


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
    main_s, second_s = _equal_times(plan, limits)
    sensor = plan.rig.second_force.sensor
    return Unseen(
        main_s=main_s,
        second_s=second_s,
        forces_n=tuple(_force_n(limits, second_s, gain, moves=bool(sensor)) for gain in GAINS),
    )


def tells_of(plan: Plan, limits: RunLimits) -> Tells:
    """Which force channels an approach waits for."""
    main_s, second_s = _equal_times(plan, limits)
    told_s = [each_s for each_s in (main_s, second_s) if each_s <= TELLS_WITHIN_S]
    return Tells(main_s in told_s, second_s in told_s, max(told_s, default=TELLS_WITHIN_S))


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


def _equal_times(plan: Plan, limits: RunLimits) -> tuple[float, float]:
    """After how long in s equal samples tell of the main and of the second channel."""
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


def both_silent_reasons(limits: RunLimits) -> Iterator[Reason]:
    """What a load step on a soft payload comes to where every force channel falls silent.

    The arm goes on by `leash_proved` of the way that something rigid could bear: a soft payload, or
    an arm with coarse positions, needs more of it, and the payload bears that itself. A position
    that is read in steps adds one, half of it where the leash is tied and half at its end. An arm
    that is held back meanwhile, and springs free, adds what is taken for an error of its position.
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
    """Channels that an approach cannot wait for, and what can build up beside them.

    One that is frozen is then not told from a sound one until the force moves it. With two channels
    the other one must be dead too, behind live noise.
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
    """What an approach comes to in which every force channel has died behind live noise.

    Args:
        plan: of the run.
        limits: its thresholds.
        shaken: whether a shake proves the channels just before the approach.
    """
    most_n, limit_n = _search_n(plan, limits), limits.counted_limit_n
    if most_n <= limit_n:
        return
    dead = "both force channels have" if limits.cross_check else "the only force channel has"
    since = "the shake before the approach" if shaken else "the last push by hand, if there was one"
    way_m = limit_n / limits.stiffness_n_per_m
    proof = "" if shaken else "rig.force.tool_mass, for a shake that proves it before an approach; "
    yield Reason(
        "deaf_approach", _severity(limits),
        f"where {dead} died since {since}, behind noise that goes on, nothing tells of the surface:"
        f" the arm presses on to the end of the search, with up to {format_quantity(most_n, 'N')}"
        f" on something rigid (the arm's own push: {_push(plan)})",
        f"{proof}the arm's own force limit below {format_quantity(limit_n, 'N')}; or a surface"
        f" known so well that search_distance may be below {format_quantity(way_m, 'm')}",
        most_n, limit_n, "N",
    )  # fmt: skip


def dead_drift_reasons(plan: Plan, limits: RunLimits) -> Iterator[Reason]:
    """The rise of a dead channel that passes for a payload that answers.

    What rises while the arm stands is no answer, nor is a rise that it explains. But where answers
    are found on the way nothing has stood yet: near a level, two answers below it, the arm takes
    its time for a leash, and a drift that is worth an answer by then has it go on. And a level that
    is reached before R6 has waited leaves the next one a leash of its own.
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
    """What an arm that searches to the end comes to on something rigid at the near edge."""
    reach_n = limits.stiffness_n_per_m * plan.procedure.search_distance_m
    return min(reach_n, plan.rig.arm.max_push_n)


def _severity(limits: RunLimits) -> Severity:
    """Of what takes the death of every force channel: with two of them both must die."""
    return Severity.NOTE if limits.cross_check else Severity.WARN


def _push(plan: Plan) -> str:
    return f"{format_quantity(plan.rig.arm.max_push_n, 'N')} (rig.arm.max_push)"


def _after(time_s: float) -> str:
    return f"after {time_s:.3g} s" if math.isfinite(time_s) else "never"
