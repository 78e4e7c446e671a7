"""Every wrong sign and axis of the force channels: the true peak force, and what was said.

    python -m stepload_verify.trials.wrong_signs [--short] [--back RUNS]

Dry, in virtual time. The believed plan is always the same; the simulated rig is wired otherwise.
Rows: how the main channel is wired, how the second one is, and the machine.
Ends with exit code 1 where a wrong wiring was pressed beyond a quarter of F_lim, passed for sound
or was said to be clear under load, and where a right one was stopped. Where nothing
is alive no rule can see it: such a run is only counted.

`--back` draws runs instead in which the arm may be turned round too, over the true distance of the
surface, the payload's stiffness, and every phase in which something goes back. A rig that is wired
right may press at its start. Rows: the largest J = (peak - F_top)/(F_c - F_top) of each wiring and
machine. A force of the start is not of the run: where it is above F_top, J counts from it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from random import Random

from stepload.engine.loop import run_loop
from stepload.engine.operator import Operator, StopLevel
from stepload.engine.rehearse import world_for
from stepload.engine.tick import Engine
from stepload.envelope.envelope import Envelope, envelope_of
from stepload.plan.derived import rederived
from stepload.plan.load import load_plan
from stepload.plan.model import ForceSpec, Plan, SecondForce, SecondForceSource
from stepload.plan.shipped import plan_path
from stepload.record.outcome import Cause
from stepload.record.rows import Phase, TickRow
from stepload.rig.world import WorldFault, load_world
from stepload.runner.pool import interruptible
from stepload_verify.campaign.incidents import NullRecorder
from stepload_verify.campaign.mounts import draw_stance, mounted

MACHINES = {"stiff": "plastic-sphere", "soft": "ur5e-silicone-sphere"}
WIRINGS: dict[str, tuple[str, ...]] = {
    "right": (),
    "sign": ("reversed",),
    "axis": ("swapped",),
    "axis and sign": ("reversed", "swapped"),
    "dead": ("stuck_mean",),
}
"""How a channel is wired, as faults of the simulated rig; dead: live noise, standing mean."""
SECONDS = ("none", "arm", "sensor")
FOR_GOOD_S = 3600.0
PRESSED_SHARE = 0.25
"""Of F_lim: more than a touch, and than the tolerance of R5."""
LONGEST_WORDS = 140


@dataclass(frozen=True, slots=True)
class Case:
    """One rig and its wiring."""

    machine: str
    second: str
    main_wiring: str
    second_wiring: str

    @property
    def right(self) -> bool:
        """Whether the rig is as the plan says."""
        return self.main_wiring == self.second_wiring == "right"

    @property
    def dead(self) -> bool:
        """Whether no channel is alive."""
        alive = (
            {self.main_wiring} if self.second == "none" else {self.main_wiring, self.second_wiring}
        )
        return alive == {"dead"}


@dataclass(frozen=True, slots=True)
class Found:
    """How a case ended; the shares of F_c and of F_lim are those of the true peak force."""

    case: Case
    share_of_limit: float
    share_of_f_lim: float
    left_n: float
    status: str
    rule: str
    said: str

    @property
    def bad(self) -> str:
        """What went wrong; "" where the case ended as it must."""
        if self.case.right:
            return "" if self.status == "completed" else "a sound rig was stopped"
        if self.share_of_f_lim > PRESSED_SHARE:
            return "" if self.case.dead else "pressed"
        if self.status == "completed":
            return "passed for sound"
        if self.left_n > 0.0 and "clear of the surface" in self.said:
            return "said to be clear under load"
        return ""


def cases() -> Iterator[Case]:
    """Every combination of machine and wirings that makes a different rig."""
    for machine, second in product(MACHINES, SECONDS):
        for main, other in product(WIRINGS, WIRINGS):
            if second == "none" and other != "right":
                continue
            if second == "arm" and "axis" in other:  # one component has no other axis
                continue
            yield Case(machine, second, main, other)


def believed(case: Case, distance_m: float = 1e-3, uncertainty_m: float = 3e-4) -> Envelope:
    """The envelope of the plan that is run, whatever the wiring is."""
    plan = load_plan(plan_path(MACHINES[case.machine]))
    quick = replace(
        plan.procedure, tare_s=0.5, warm_up_s=0.0, touches=1, cycles=1, unload=False, hold_s=0.2,
        settle_timeout_s=0.5, surface_distance_m=distance_m, surface_uncertainty_m=uncertainty_m,
    )  # fmt: skip
    rig = replace(plan.rig, second_force=_second(plan, case.second, plan.rig.force))
    changed = replace(plan, procedure=quick, rig=rig)
    return envelope_of(rederived(plan, changed))


def _second(plan: Plan, kind: str, force: ForceSpec) -> SecondForce:
    second = plan.rig.second_force
    if kind == "none":
        return SecondForce()
    if kind == "arm":
        return second
    return replace(second, source=SecondForceSource.SENSOR, noise_n=force.noise_n, sensor=force)


def run(case: Case) -> Found:
    """One run to its end."""
    envelope = believed(case)
    prefix = "arm_force_" if case.second == "arm" else "second_"
    kinds = [f"force_{kind}" for kind in WIRINGS[case.main_wiring]]
    kinds += [_kind(prefix, kind) for kind in WIRINGS[case.second_wiring]]
    faults = [WorldFault(kind, 0.0, FOR_GOOD_S, 0.0) for kind in kinds]
    rig = load_world()(world_for(envelope, faults=faults))
    for device in (rig.force, rig.second_force, rig.arm):
        if device is not None:
            device.open(1.0)
    with interruptible():
        outcome = run_loop(Engine(envelope, Operator()), rig, NullRecorder())
    peak_n, cause = rig.world.true_peak_force_n, outcome.cause
    return Found(
        case,
        peak_n / envelope.theory.elastic_limit_n,
        peak_n / envelope.force_limit_n,
        rig.world.true_force_n,
        outcome.status.value,
        cause.rule if cause else "",
        outcome.why,
    )


def _kind(prefix: str, kind: str) -> str:
    """Name of the simulated fault; for a dead force of the arm it is `arm_force_deaf`."""
    return "arm_force_deaf" if (prefix, kind) == ("arm_force_", "stuck_mean") else prefix + kind


WAYS = ("end", "stop", "stop now", "pause", "trip", "loop")
"""Who asks for the way back: the run itself, the operator, a rule, or an error of the program."""
PHASES = (
    Phase.WARM_UP, Phase.FREE_AIR, Phase.TARE, Phase.FAST_APPROACH,
    Phase.GUARDED_APPROACH, Phase.DWELL, Phase.TOUCH_RETRACT, Phase.LOAD, Phase.HOLD, Phase.RETRACT,
)  # fmt: skip
STATED_M = {"near": (1e-3, 0.5e-3), "far": (5e-3, 1e-3)}
"""Distance of the surface and its uncertainty in the plan."""


@dataclass(frozen=True, slots=True)
class BackCase:
    """A rig whose "back" may be a push; true distance over the stated one, softness over stated.

    `pressed` is the force at the start over F_c; 0: the start pose is free.
    """

    case: Case
    turned: bool
    six: bool
    stated: str
    distance: float
    softness: float
    way: str
    phase: Phase
    after: float
    pressed: float

    @property
    def cell(self) -> tuple[str, ...]:
        """What the rows of the search are grouped by."""
        axes = "six" if self.six else "one"
        wired = f"{self.case.main_wiring}/{self.case.second_wiring}"
        arm = "turned" if self.turned else "pressed" if self.pressed else ""
        return axes, self.case.machine, self.case.second, wired, arm


def draw_back(chance: Random) -> BackCase:
    """One run of the search; where several wires are wrong the surface lies where it is stated."""
    machine = chance.choice(sorted(MACHINES))
    second = chance.choice(SECONDS)
    wirings = ("right", "sign", "axis")
    main, other = chance.choice(wirings), chance.choice(wirings[:2])
    case = Case(machine, second, main, other if second != "none" else "right")
    turned = chance.random() < 0.6
    stated = chance.choice(sorted(STATED_M))
    share = chance.choice((0.0, chance.uniform(0.0, 0.1), 0.5, 1.0, chance.uniform(0.0, 1.2)))
    wrong = (main != "right") + (case.second_wiring != "right") + turned
    if wrong > 1:
        distance_m, uncertainty_m = STATED_M[stated]
        share = 1.0 + chance.uniform(-1.0, 1.0) * uncertainty_m / distance_m
    return BackCase(
        case, turned, machine == "soft" and chance.random() < 0.5, stated,
        max(0.01, share), 10.0 ** chance.uniform(-1.0, 1.0),
        chance.choice(WAYS), chance.choice(PHASES), chance.random(),
        0.0 if wrong else chance.choice((0.0, chance.uniform(0.0, 0.7))),
    )  # fmt: skip


def run_back(one: BackCase) -> tuple[float, float, str]:
    """One run: J, the force that is left, and the rule that ended it."""
    distance_m, uncertainty_m = STATED_M[one.stated]
    envelope = believed(one.case, distance_m, uncertainty_m)
    prefix = "arm_force_" if one.case.second == "arm" else "second_"
    kinds = [f"force_{kind}" for kind in WIRINGS[one.case.main_wiring]]
    kinds += [_kind(prefix, kind) for kind in WIRINGS[one.case.second_wiring]]
    kinds += ["arm_turned"] if one.turned else []
    faults = [WorldFault(kind, 0.0, FOR_GOOD_S, 0.0) for kind in kinds]
    spec = world_for(envelope, faults=faults)
    if one.six:
        stance = draw_stance(Random(round(1e6 * one.after)), ur=True)
        spec = mounted(spec, envelope, stance, ())
    payload = replace(spec.payload, k=spec.payload.k / one.softness)
    most_n = envelope.run_limits.counted_limit_n
    surface_m = one.distance * distance_m
    if one.pressed:
        start_n = one.pressed * most_n
        surface_m = -((start_n / payload.k) ** (1.0 / payload.n))
        surface_m -= start_n / spec.system_stiffness_n_per_m
    rig = load_world()(replace(spec, payload=payload, surface_m=surface_m))
    for device in (rig.force, rig.second_force, rig.arm):
        if device is not None:
            device.open(1.0)
    least_n = max(envelope.plan.procedure.top_force_n, rig.world.true_peak_equivalent_n)
    engine = Engine(envelope, Operator())
    begun: list[float] = []

    def at_tick(row: TickRow) -> None:
        if row.phase == one.phase and one.way != "end":
            begun.append(row.time_s)
            if begun[-1] - begun[0] >= one.after * 0.5:
                _ask(engine, one.way, row.time_s)

    with interruptible():
        outcome = run_loop(engine, rig, NullRecorder(at_tick))
    j = (rig.world.true_peak_equivalent_n - least_n) / (most_n - least_n)
    return j, rig.world.true_force_n, outcome.cause.rule if outcome.cause else outcome.status.value


def _ask(engine: Engine, way: str, now_s: float) -> None:
    if way == "pause":
        engine.operator.paused = True
        engine.operator.request_stop(StopLevel.AFTER_STEP)
    elif way in ("stop", "stop now"):
        engine.operator.request_stop(StopLevel.NOW if way == "stop now" else StopLevel.AFTER_STEP)
    elif way == "trip":
        engine.trip(Cause("device", 1.0, 0.0, "", 0.0, now_s, "drawn"))
    elif not engine.safing:
        raise RuntimeError("drawn")


def search_back(runs: int, seed: int = 1) -> int:
    """Print the largest J of each cell; 1 where one is not below 1."""
    chance = Random(seed)
    worst: dict[tuple[str, ...], tuple[float, float, str, BackCase]] = {}
    count: dict[tuple[str, ...], int] = {}
    left = 0
    for _ in range(runs):
        one = draw_back(chance)
        j, left_n, rule = run_back(one)
        left += left_n > 0.0
        count[one.cell] = count.get(one.cell, 0) + 1
        if one.cell not in worst or j > worst[one.cell][0]:
            worst[one.cell] = j, left_n, rule, one
    print("| axes | machine | second | wired | arm | runs | largest J | left, N | ended by |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for cell, (j, left_n, rule, _) in sorted(worst.items()):
        print(f"| {' | '.join(cell)} | {count[cell]} | {j:.2f} | {left_n:.1f} | {rule} |")
    most = max(worst.values(), key=lambda row: row[0])
    print(f"\n{runs} runs, {left} end under load, largest J {most[0]:.3f}: {most[3]}")
    return 1 if most[0] >= 1.0 else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--short", action="store_true", help="worst row of each kind only")
    parser.add_argument("--back", type=int, metavar="RUNS", help="search over the ways back")
    options = parser.parse_args()
    if options.back:
        return search_back(options.back)
    print("| machine | second | main wired | second wired | peak / F_c | stopped by | said |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    found = []
    for case in cases():
        found.append(run(case))
        if not options.short:
            print(_row(found[-1]), flush=True)
    for one in _worst(found) if options.short else ():
        print(_row(one))
    dead = [one for one in found if one.case.dead]
    worst = max(one.share_of_limit for one in dead)
    print(f"\n{len(dead)} rigs with no channel alive, up to {worst:.2f} F_c")
    wrong = [one for one in found if one.bad]
    print(f"\n{len(found)} runs, {len(wrong)} of them as they must not be")
    for one in wrong:
        print(f"  {one.bad}: {one.case}: {one.share_of_limit:.3g} F_c, {one.said}")
    return 1 if wrong else 0


def _row(one: Found) -> str:
    case, said = one.case, one.said[:LONGEST_WORDS]
    return (
        f"| {case.machine} | {case.second} | {case.main_wiring} | {case.second_wiring} |"
        f" {one.share_of_limit:.3f} | {one.rule or one.status} | {said} |"
    )


def _worst(found: list[Found]) -> list[Found]:
    """The largest peak of every wiring."""
    worst: dict[tuple[str, str], Found] = {}
    for one in found:
        key = one.case.main_wiring, one.case.second_wiring
        if key not in worst or one.share_of_limit > worst[key].share_of_limit:
            worst[key] = one
    return list(worst.values())


if __name__ == "__main__":
    sys.exit(main())
