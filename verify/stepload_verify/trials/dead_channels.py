"""Every force channel dies at one moment of a load step: how far the arm presses on.

    python -m stepload_verify.trials.dead_channels [--seeds N] [--only TEXT] [--processes P]

Dry, in virtual time, all rules on. All channels of a rig die together (one supply, one hub), when
the true force first passes a level drawn at random, behind noise that goes on: white, or coloured
by a filter of 20 ms to 0.3 s; some drift then, sway, wander or rise in steps, some fade over
seconds, some have had a filter that no plan states since the beginning; of some the main one still
shows a part of what the force changes by. The payload is as planned, or a hundred times stiffer.
Prints the largest true force of each kind as a share of the counted F_c and of F_lim, and how the
runs ended ("nothing died" where the force never came to that level); exit code 1 where one passed
`leash_proved` times F_lim, to which the leash holds it. Channels that fade or lost a part of their
gain still answer, with too little: those are only counted, and so are those that drift faster than
preflight says (`dead_drift`). The rig is as stiff as the leash believes it to be at most.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, NamedTuple, cast

from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.envelope.envelope import Envelope, envelope_of
from stepload.plan.changed import rederived
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.shipped import plan_path
from stepload.record.rows import Phase
from stepload.rig.samples import ArmSample, ForceSample, SixFloats
from stepload.rig.world import SimulatedRig, load_world
from stepload_verify.campaign.incidents import NullRecorder
from stepload_verify.trials.each import for_each

MACHINES = {
    "stiff": "plastic-sphere",
    "UR, soft": "ur5e-silicone-sphere",
    "UR, softer": "ur5e-silicone-sphere",
    "UR, hard": "ur16e-polyurethane-sphere",
}
SOFTER = "UR, softer"
"""With a payload of 1 MPa that bears 60 N, pressed with 30 N."""
STIFFER = {"as planned": 1.0, "rigid": 100.0}
STEP_S, SWAY_S = 2.0, 10.0
ROOM = 1.05
"""Over what the leash allows: the arm's own overshoot."""


class Death(NamedTuple):
    """What a channel shows from its death on, and what it had before.

    Attributes:
        coloured_s: time constant of its noise, 0 for white noise.
        drift_n_per_s: drift of its reading.
        step_n, sway_n: height of its steps, one every `STEP_S`, and of its swaying, one turn in
            `SWAY_S`.
        walk_n: sd of its random walk after one second; it grows with the root of the time.
        gain: share of a change of force that the main channel still shows.
        fade_s: time constant with which its response to force fades, 0 at once.
        filter_s: time constant of an undeclared low-pass filter, there from the beginning.
    """

    coloured_s: float = 0.0
    drift_n_per_s: float = 0.0
    step_n: float = 0.0
    sway_n: float = 0.0
    walk_n: float = 0.0
    gain: float = 0.0
    fade_s: float = 0.0
    filter_s: float = 0.0


DEATHS = {
    "white noise": Death(),
    "noise of 20 ms": Death(coloured_s=0.02),
    "noise of 0.1 s": Death(coloured_s=0.1),
    "noise of 0.3 s": Death(coloured_s=0.3),
    "drift of 5 mN/s": Death(drift_n_per_s=0.005),
    "drift of 15 mN/s": Death(drift_n_per_s=0.015),
    "drift of 50 mN/s": Death(drift_n_per_s=0.05),
    "drift of 0.2 N/s": Death(drift_n_per_s=0.2),
    "drift of 0.5 N/s": Death(drift_n_per_s=0.5),
    "drift of 1 N/s": Death(drift_n_per_s=1.0),
    "drift of -50 mN/s": Death(drift_n_per_s=-0.05),
    "noise of 0.1 s, drift of 50 mN/s": Death(coloured_s=0.1, drift_n_per_s=0.05),
    "steps of 0.5 N": Death(step_n=0.5),
    "sways by 1 N": Death(sway_n=1.0),
    "wanders by 0.1 N": Death(walk_n=0.1),
    "wanders by 0.3 N": Death(walk_n=0.3),
    "a twentieth of its gain": Death(gain=0.05),
    "a tenth of its gain": Death(gain=0.1),
    "a seventh of its gain": Death(gain=0.15),
    "a fifth of its gain": Death(gain=0.2),
    "a quarter of its gain": Death(gain=0.25),
    "fades in 0.3 s": Death(fade_s=0.3),
    "fades in 2 s": Death(fade_s=2.0),
    "fades in 5 s": Death(fade_s=5.0),
    "filter of 50 ms": Death(filter_s=0.05),
    "filter of 0.1 s": Death(filter_s=0.1),
    "filter of 0.1 s, noise of 0.1 s": Death(filter_s=0.1, coloured_s=0.1),
}


@dataclass(frozen=True, slots=True)
class Case:
    """One death on one rig."""

    machine: str
    payload: str
    death: str
    seed: int


class Found(NamedTuple):
    """How a case ended.

    `allowed` is the largest share of F_lim that the leash allows; `named` whether preflight names
    this death as one that nothing bounds.
    """

    case: Case
    share_of_limit: float
    share_of_f_lim: float
    allowed: float
    named: bool
    ended: str


class Dying:
    """What one channel reads, alive and dead.

    Args:
        dies: says whether it dies now; asked until it has died.
        death: the way it dies.
        noise_n, period_s: noise (sd) and period of its readings.
        seed: seed of its noise.
    """

    def __init__(
        self, dies: Callable[[], bool], death: Death, noise_n: float, period_s: float, seed: int
    ) -> None:
        self._dies, self._death = dies, death
        self._noise_n, self._period_s = noise_n, period_s
        self._chance = random.Random(seed)
        self._filtered_n = self._last_n = math.nan
        self._dead_s, self._stood_n, self._colour_n = math.nan, 0.0, 0.0

    @property
    def dead(self) -> bool:
        """Whether it has died."""
        return not math.isnan(self._dead_s)

    def read(self, live_n: float) -> float:
        """Turn the reading of a sound channel into that of this one, in N."""
        filtered_n = self._low_pass(live_n)
        if not self.dead:
            if not self._dies():
                return filtered_n
            self._dead_s, self._stood_n = 0.0, filtered_n
        death, period_s = self._death, self._period_s
        self._dead_s += period_s
        alive = math.exp(-self._dead_s / death.fade_s) if death.fade_s else death.gain
        # a fading channel follows changes by ever less
        self._stood_n += alive * (filtered_n - self._last_n) + self._risen(period_s)
        self._last_n = filtered_n
        kept = math.exp(-period_s / death.coloured_s) if death.coloured_s else 0.0
        white_n = self._chance.gauss(0.0, self._noise_n)
        self._colour_n = kept * self._colour_n + math.sqrt(1.0 - kept * kept) * white_n
        return self._stood_n + (1.0 - alive) * self._colour_n

    def _risen(self, period_s: float) -> float:
        """By how much it rises by itself in one period, in N."""
        death, turn = self._death, 2.0 * math.pi / SWAY_S
        risen_n = death.drift_n_per_s * period_s
        risen_n += death.sway_n * turn * period_s * math.cos(turn * self._dead_s)
        if death.walk_n:
            risen_n += self._chance.gauss(0.0, death.walk_n * math.sqrt(period_s))
        if self._dead_s % STEP_S < period_s:
            risen_n += death.step_n
        return risen_n

    def _low_pass(self, live_n: float) -> float:
        share = 1.0
        if self._death.filter_s and not math.isnan(self._filtered_n):
            share = 1.0 - math.exp(-self._period_s / self._death.filter_s)
            self._filtered_n += share * (live_n - self._filtered_n)
        else:
            self._filtered_n = live_n
        if not self.dead:
            self._last_n = self._filtered_n
        return self._filtered_n


class DyingSensor:
    """A force sensor whose reading along its axis is that of a `Dying`."""

    def __init__(self, inner: Any, axis: str, channel: Dying) -> None:
        self._inner, self._channel = inner, channel
        self._at = "xyz".index(axis[-1])
        self._sign = -1.0 if axis[0] == "-" else 1.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def drain(self) -> list[ForceSample]:
        """Samples since the last call, with the changed force."""
        return [self._changed(sample) for sample in self._inner.drain()]

    def _changed(self, sample: ForceSample) -> ForceSample:
        wrench = list(sample.wrench)
        wrench[self._at] = self._sign * self._channel.read(self._sign * wrench[self._at])
        return sample._replace(wrench=cast(SixFloats, tuple(wrench)))


class DyingArm:
    """An arm whose own force is that of a `Dying`."""

    def __init__(self, inner: Any, channel: Dying) -> None:
        self._inner, self._channel = inner, channel

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def drain(self) -> list[ArmSample]:
        """Samples since the last call, with the changed force."""
        return [
            sample._replace(force_n=self._channel.read(sample.force_n))
            for sample in self._inner.drain()
        ]


def cases(deaths: Sequence[str], seeds: int) -> Iterator[Case]:
    """Every one of these deaths on every rig, `seeds` times."""
    for machine, payload, death in product(MACHINES, STIFFER, deaths):
        for seed in range(seeds):
            yield Case(machine, payload, death, seed)


@cache
def believed(machine: str) -> Envelope:
    """The envelope of the plan that is run, shortened."""
    plan = load_plan(plan_path(MACHINES[machine]))
    if machine == SOFTER:
        plan = rederived(plan, softer(plan))
    quick = replace(
        plan.procedure, tare_s=0.5, warm_up_s=0.0, touches=1, cycles=1, unload=False, hold_s=0.3,
        settle_timeout_s=0.5, surface_distance_m=1e-3, surface_uncertainty_m=3e-4,
    )  # fmt: skip
    return envelope_of(rederived(plan, replace(plan, procedure=quick)))


def softer(plan: Plan) -> Plan:
    """The plan with a payload so soft that its force hardly rises when the arm presses on."""
    payload = plan.payload
    return replace(
        plan,
        payload=replace(
            payload,
            material=replace(payload.material, youngs_modulus_pa=1e6),
            declared_force_limit_n=60.0,
        ),
        procedure=replace(plan.procedure, top_force_n=30.0, step_n=10.0),
    )


def run(case: Case) -> Found:
    """One run to its end."""
    envelope = believed(case.machine)
    limits, plan = envelope.run_limits, envelope.plan
    spec = replace(
        world_for(envelope, seed=case.seed), system_stiffness_n_per_m=limits.stiffness_n_per_m
    )
    stiffer = STIFFER[case.payload]
    rig = load_world()(replace(spec, payload=replace(spec.payload, k=stiffer * spec.payload.k)))
    chance = random.Random(f"{case}")
    dies_n = chance.uniform(limits.touch_force_n, 0.97 * plan.procedure.top_force_n)
    death = DEATHS[case.death]
    force, second = plan.rig.force, plan.rig.second_force

    engine = Engine(envelope, Operator())

    def dies() -> bool:
        """Only under load: a death in an approach is the hazard `deaf_approach`, not leashed."""
        return engine.course.phase == Phase.LOAD and rig.world.true_force_n >= dies_n

    def dying(death: Death, noise_n: float, rate_hz: float) -> Dying:
        return Dying(dies, death, noise_n, 1.0 / rate_hz, chance.randrange(2**32))

    main = dying(death, force.noise_n, force.rate_hz)
    changed: dict[str, Any] = {"force": DyingSensor(rig.force, force.axis, main)}
    beside = death._replace(gain=0.0)
    if rig.second_force is not None and second.sensor is not None:
        of = second.sensor
        changed["second_force"] = DyingSensor(
            rig.second_force, of.axis, dying(beside, of.noise_n, of.rate_hz)
        )
    else:
        changed["arm"] = DyingArm(rig.arm, dying(beside, second.noise_n, plan.rig.arm.rate_hz))
    mute = _Rig(rig, changed)
    for device in (mute.force, mute.second_force, mute.arm):
        if device is not None:
            device.open(1.0)
    outcome = run_loop(engine, mute, NullRecorder())
    peak_n, cause = rig.world.true_peak_force_n, outcome.cause
    return Found(
        case,
        peak_n / limits.counted_limit_n,
        peak_n / limits.force_limit_n,
        limits.leash_proved,
        bool(death.fade_s or death.gain) or death.drift_n_per_s > named_drift(envelope),
        (cause.rule if cause else outcome.status.value) if main.dead else "nothing died",
    )


def named_drift(envelope: Envelope) -> float:
    """From this drift in N/s on preflight says that a dead channel passes for a payload."""
    return next(each.value for each in envelope.reasons if each.code == "dead_drift")


class _Rig:
    """A rig with other devices in place of some of its own."""

    def __init__(self, rig: SimulatedRig, changed: dict[str, Any]) -> None:
        self._rig = rig
        self.__dict__.update(changed)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="runs of each kind")
    parser.add_argument("--only", default="", help="deaths whose name has this text")
    parser.add_argument("--processes", type=int, default=None)
    options = parser.parse_args()
    deaths = [name for name in DEATHS if options.only in name]
    found = for_each(run, list(cases(deaths, options.seeds)), options.processes)
    print("| machine | payload | channels die | peak / F_c | peak / F_lim | ended by |")
    print("| --- | --- | --- | --- | --- | --- |")
    for machine, payload, death in product(MACHINES, STIFFER, deaths):
        rows = [
            one for one in found
            if (one.case.machine, one.case.payload, one.case.death) == (machine, payload, death)
        ]  # fmt: skip
        ended = ", ".join(f"{count} {name}" for name, count in Counter(
            one.ended for one in rows).most_common())  # fmt: skip
        print(
            f"| {machine} | {payload} | {death} | {max(one.share_of_limit for one in rows):.3f} |"
            f" {max(one.share_of_f_lim for one in rows):.3f} | {ended} |"
        )
    beyond = [one for one in found if one.share_of_f_lim > ROOM * one.allowed and not one.named]
    print(f"\n{len(found)} runs, {len(beyond)} beyond what the leash allows")
    for one in beyond:
        print(f"  {one.case}: {one.share_of_f_lim:.3f} of {one.allowed:.2f} F_lim, {one.ended}")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
