"""How soon a slip is seen in the data, and how soon the rules on the whole wrench end a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stepload.engine.supervisor import Supervisor
from stepload.envelope.limits import RunLimits
from stepload.estimators.slips import Slip, slips_of
from stepload.estimators.wrench import Wrench
from stepload.record.rows import Phase
from stepload.rig.samples import ArmSample, ForceSample

RATE_HZ = 500.0
JUMPS_N, NOISES_N = (1.9, 0.5, 0.0), (0.03, 0.1, 0.3)
LASTS_S, TOP_N, SHARE = 10.0, 50.0, 0.15
BEFORE_S = AFTER_S = 2.0
HOLD = int(Phase.HOLD)
LEVER_M, ECCENTRICITY_M = 0.05, 0.01
Six = tuple[float, float, float, float, float, float]
NEAR_S = 0.06
"""A slip found within this time of the true one is counted as that slip."""


@dataclass(frozen=True, slots=True)
class Seen:
    """Slips of one size at one noise: delays until they were seen and their reported sizes, how
    many were missed, and how many false ones were reported."""

    jump_n: float
    noise_n: float
    latency_s: tuple[float, ...]
    sizes_n: tuple[float, ...]
    missed: int
    false: int


def slips_seen(runs: int, seed: int) -> Iterator[Seen]:
    """Look for a jump at a random time in runs up to 50 N in 10 s; a jump of 0 N is no jump."""
    for jump_n in JUMPS_N:
        for noise_n in NOISES_N:
            rng = np.random.default_rng([seed, round(10 * jump_n), round(100 * noise_n)])
            latency, sizes, missed, false = [], [], 0, 0
            for _ in range(runs):
                at_s, found = _with_jump(jump_n, noise_n, rng)
                hits = [slip for slip in found if abs(slip.time_s - at_s) < NEAR_S and jump_n > 0.0]
                false += len(found) - len(hits)
                missed += not hits
                latency += [slip.seen_s - at_s for slip in hits[:1]]
                sizes += [slip.jump_n for slip in hits[:1]]
            yield Seen(jump_n, noise_n, tuple(latency), tuple(sizes), missed, false)


def _with_jump(
    jump_n: float, noise_n: float, rng: np.random.Generator
) -> tuple[float, tuple[Slip, ...]]:
    time_s = np.arange(0.0, LASTS_S, 1.0 / RATE_HZ)
    force_n = np.interp(time_s, np.linspace(0.0, LASTS_S, 6), [5.0, 20.0, 20.0, 40.0, 40.0, TOP_N])
    at_s = float(rng.uniform(1.0, LASTS_S - 1.0))
    across_n = np.zeros((time_s.size, 2))
    across_n[:, 0] = SHARE * force_n * (1.0 - 0.1 * force_n / TOP_N) - jump_n * (time_s >= at_s)
    size = time_s.size
    wrench = Wrench(
        time_s, force_n + rng.normal(0.0, noise_n, size),
        across_n + rng.normal(0.0, noise_n, (size, 2)), np.ones(size, bool), np.ones(size, int),
        np.zeros(size, int), noise_n,
    )  # fmt: skip
    return at_s, slips_of(wrench, TOP_N)


@dataclass(frozen=True, slots=True)
class Step:
    """A sudden change of the wrench, and the rule that must stop the run for it ("" for none).

    `before` and `after` are fx … tz in N and N·m, tared, +fz along the press.
    """

    name: str
    rule: str
    before: Six
    after: Six

    @property
    def quiet(self) -> bool:
        """Whether the wrench stays within limits, so that no rule may stop the run."""
        return not self.rule


@dataclass(frozen=True, slots=True)
class Told:
    """Runs with one kind of step: delays until its rule stopped them, how many it did not stop
    within `AFTER_S`, and how many were stopped by another rule or before the step."""

    step: Step
    latency_s: tuple[float, ...]
    missed: int
    false: int


def alone(limits: RunLimits) -> RunLimits:
    """The limits with one force channel, F_allowed at F_lim, and with ratings, a lever and an
    eccentricity, so that every rule on the whole wrench is active."""
    return replace(
        limits, cross_check="", second_stands_n=0.0, allowed_n=limits.force_limit_n,
        overload_fx_n=0.5 * limits.force_limit_n, overload_tx_n_m=0.05 * limits.force_limit_n,
        lever_m=LEVER_M, eccentricity_m=limits.eccentricity_m or ECCENTRICITY_M,
    )  # fmt: skip


def steps_of(limits: RunLimits) -> tuple[Step, ...]:
    """A step beyond each threshold of the rules on the whole wrench, and one just within."""
    share, off_m = limits.lateral_share, limits.eccentricity_m

    def pressed(along_n: float, across: float = 0.0, off_m: float = 0.0) -> Six:
        """Wrench of a press with a lateral share `across` and a contact `off_m` beside the axis."""
        across_n = across * along_n
        return (across_n, 0.0, along_n, 0.0, across_n * limits.lever_m - off_m * along_n, 0.0)

    low_n, edge = 0.3 * limits.force_limit_n, 0.95 * share
    left = 1.0 - limits.lateral_weakening * edge * (edge + 2.0 * limits.lateral_askew)
    high_n = left * limits.allowed_n / math.hypot(1.0, edge)
    little_n, much_n = 1.03 * high_n, 4.0 / 3.0 * high_n
    straight = pressed(low_n)
    pulled = (1.05 * limits.overload_fx_n, *straight[1:])
    turned = (*straight[:3], 1.05 * limits.overload_tx_n_m, *straight[4:])
    return (
        Step("share, a third above", "R12", straight, pressed(low_n, 4.0 * share / 3.0)),
        Step("share, twice", "R12", straight, pressed(low_n, 2.0 * share)),
        Step("share, nine tenths", "", straight, pressed(low_n, 0.9 * share)),
        Step("whole force, 3 % above", "R12", pressed(little_n), pressed(little_n, edge)),
        Step("whole force, a third above", "R12", pressed(much_n), pressed(much_n, edge)),
        Step("a force's rating, 5 % above", "R13", straight, pulled),
        Step("a torque's rating, 5 % above", "R13", straight, turned),
        Step("beside, a third above", "R14", straight, pressed(low_n, 0.0, 4.0 * off_m / 3.0)),
        Step("beside, nine tenths", "", straight, pressed(low_n, 0.0, 0.9 * off_m)),
    )


def told(limits: RunLimits, step: Step, runs: int, noise: tuple[float, float], seed: int) -> Told:
    """Let the supervisor watch `runs` runs, from two seconds before the step to two after it.

    Args:
        limits: of a plan with one force channel.
        step: what happens.
        runs: number of runs.
        noise: noise (sd) of a force in N and of a torque in N·m.
        seed: seed of the noise.
    """
    rng = np.random.default_rng([seed, len(step.name), round(step.after[2])])
    latency, missed, false = [], 0, 0
    for _ in range(runs):
        rule, late_s = _ended(limits, step, noise, rng)
        if rule == "":
            missed += not step.quiet
        elif rule == step.rule and late_s > 0.0:
            latency.append(late_s)
        else:
            false += 1
    return Told(step, tuple(latency), missed, false)


def _ended(
    limits: RunLimits, step: Step, noise: tuple[float, float], rng: np.random.Generator
) -> tuple[str, float]:
    """The rule that ended a run, and how long after the step; ("", inf) where none did."""
    supervisor, period_s = Supervisor(limits, "+fz"), limits.period_s
    before = round(BEFORE_S / period_s)
    ticks = before + round(AFTER_S / period_s)
    climb = np.clip(2.0 * np.arange(ticks) / before - 0.1, 0.0, 1.0)[:, None]
    there = np.arange(ticks)[:, None] < before
    wrenches = np.where(there, climb * np.array(step.before), step.after)
    wrenches += rng.normal(0.0, 1.0, (ticks, 6)) * np.repeat(noise, 3)
    zero = round(0.03 * before)
    for tick, wrench in enumerate(wrenches.tolist()):
        now_s = (tick + 1) * period_s
        force = ForceSample(tick, now_s, now_s, 0, tuple(wrench), math.nan)
        arm = ArmSample(tick, now_s, now_s, 0, 0.0, math.nan, (0.0,) * 6)
        cause = supervisor.check(now_s, [force], [arm], [], 0.0, 1e-6, HOLD)
        if tick == zero:
            supervisor.tare(0.0, 0.0, (0.0,) * 6)
        if cause is not None:
            return cause.rule, (tick + 1 - before) * period_s
    return "", math.inf
