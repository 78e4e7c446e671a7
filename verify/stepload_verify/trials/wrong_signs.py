"""Wrong ways back: every wrong sign and axis of the force channels, and an arm turned round.

    python -m stepload_verify.trials.wrong_signs RUNS

Dry, in virtual time. The believed plan is always the same; the simulated rig is wired otherwise,
over the true distance of the surface, the payload's stiffness, and every phase in which something
goes back. A rig that is wired right may press at its start. Rows: the largest
J = (peak - F_top)/(F_c - F_top) of each wiring and machine. A force of the start is not of the run:
where it is above F_top, J counts from it. Ends with exit code 1 where J is not below 1.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
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
}
"""How a channel is wired, as faults of the simulated rig."""
SECONDS = ("none", "arm", "sensor")
FOR_GOOD_S = 3600.0


@dataclass(frozen=True, slots=True)
class Case:
    """One rig and its wiring."""

    machine: str
    second: str
    main_wiring: str
    second_wiring: str


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
    kinds += [prefix + kind for kind in WIRINGS[one.case.second_wiring]]
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


if __name__ == "__main__":
    sys.exit(search_back(int(sys.argv[1])))
