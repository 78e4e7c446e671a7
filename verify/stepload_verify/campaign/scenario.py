"""One run of the campaign before it is executed; all of it follows from (seed, series, index)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from random import Random

from stepload.errors import BadInputError
from stepload.feasibility.lateral import expected_tilt_rad
from stepload.feasibility.limits import RunLimits
from stepload.feasibility.preflight import Preflight
from stepload.plan.model import Plan, SecondForceSource
from stepload.rig import world as worlds
from stepload.rig.world import WorldFault, WorldSpec, load_world
from stepload_verify.campaign.mishaps import (
    COMMON,
    FIRST_DAY,
    INCIDENTS,
    SIX_FAULTS,
    Incident,
    Times,
    applicable,
    faults_of,
    incidents_of,
    lies_of,
)
from stepload_verify.campaign.mounts import STEEPEST_RAD, Stance, draw_stance, fits, mounted, told
from stepload_verify.campaign.plants import ARM_CLASSES, draw_plan
from stepload_verify.campaign.truth import (
    MISTAKES,
    RIGID_STOP,
    SIX_MISTAKES,
    Anomaly,
    draw_beside,
    draw_truth,
    mistake_of,
)

ONE_AXIS, SIX_AXES, BOTH_AXES = "one", "six", "both"
"""A series of a campaign holds the rigs with one axis, or those with six."""
ONE_CHANNEL_EVERY = 4
"""Of so many pairs of runs in a series one is on rigs with one force channel."""
PLATE_MOVES = "plate_moves"
"""Hazard: the plate moves towards the arm, and nothing measures it."""
HELD_BACK = "held_back_commands"
"""Hazard: a link holds commands back and delivers them together, before a hidden rigid stop."""
HEAVIER = "heavier_arm"
"""Hazard: the arm is heavier than stated, before a hidden rigid stop."""
TILTED = "plate_tilted"
"""Hazard: the plate is tilted by more than the plan says, and nothing measures it."""
SIDEWAYS_UNSEEN = "sideways_unseen"
"""Hazard of two faults: a load to the side, and the lateral sensor dead from the beginning."""
WITHIN_PLAN = ("common_gain", "common_drift")
"""Errors of both channels that the plan states: they are no hazard."""
STEEP = (0, 5, 9)
"""Of ten rigs with six axes of a class, those whose plan states the plate's largest tilt."""
LONGEST_RUN_S = 6.0
"""Longest run; longer ones are drawn again, a few times."""
_SHORT_DRAWS = 20
_STEP_RATES = 5.0
_LOOKS_S = 0.6
"""Time to measure the force before and after backing off, and rest between them."""
_DRIFT_CHECK_S = 0.5
_SETTLE_S = 0.4


@dataclass(frozen=True, slots=True)
class Scenario:
    """A run: its plan, its truth, and its faults with their times.

    `wrong` names the kinds of its faults, one or two; `anomalies` are the ways in which its plant
    differs from the plan, with those that accompany a fault; `hazard` is a named one, or "".
    """

    series: str
    index: int
    preflight: Preflight
    truth: WorldSpec
    wrong: tuple[str, ...]
    anomalies: tuple[Anomaly, ...]
    incidents: tuple[Incident, ...]
    hazard: str

    @property
    def healthy(self) -> bool:
        """Whether nothing is wrong."""
        return not (self.wrong or self.anomalies)

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.preflight.plan

    @property
    def limits(self) -> RunLimits:
        """The thresholds of the run."""
        return self.preflight.run_limits

    @property
    def faults(self) -> tuple[WorldFault, ...]:
        """The faults of the simulated rig."""
        return self.truth.faults

    @property
    def rig_class(self) -> str:
        """Axes and force channels, as in "six axes, two channels"."""
        axes = "one axis" if self.truth.mount is None else "six axes"
        alone = self.plan.rig.second_force.source is SecondForceSource.NONE
        return f"{axes}, {'one channel' if alone else 'two channels'}"


def series_from(text: str) -> tuple[str, ...]:
    """The series of `--axes`: one, six or both.

    Raises:
        BadInputError: it is none of these.
    """
    if text not in (ONE_AXIS, SIX_AXES, BOTH_AXES):
        raise BadInputError(f"--axes {text!r}: rigs have one axis or six", hint="one, six or both")
    return (ONE_AXIS, SIX_AXES) if text == BOTH_AXES else (text,)


@cache
def known_kinds(six: bool) -> tuple[str, ...]:
    """Every kind of fault that a rig can have."""
    kinds = (
        *worlds.faults_of(load_world()),
        *INCIDENTS,
        *COMMON,
        *FIRST_DAY,
        *MISTAKES,
        *SIX_MISTAKES,
    )
    return kinds if six else tuple(k for k in kinds if k not in (*SIX_FAULTS, *SIX_MISTAKES))


def kinds_from(text: str) -> tuple[str, ...]:
    """The kinds named in `--faults`: "all", or names separated by commas.

    Raises:
        BadInputError: a name that is none.
    """
    known = known_kinds(six=True)
    names = [name.strip() for name in text.split(",")]
    if names == ["all"]:
        return known
    for name in names:
        if name not in known:
            raise BadInputError(
                f"unknown fault {name!r}", hint=f"all, none, or some of {', '.join(known)}"
            )
    return tuple(dict.fromkeys(names))


def draw(
    template: Plan, seed: int, series: str, index: int, kinds: tuple[str, ...], count: int = 1
) -> Scenario:
    """The run `index` of a series, with `count` faults of these kinds that its rig can have."""
    chance = Random(f"stepload {seed} {series} {index}")
    arm_class = ARM_CLASSES[index % len(ARM_CLASSES)]
    two_channels = index // len(ARM_CLASSES) % ONE_CHANNEL_EVERY != ONE_CHANNEL_EVERY - 1
    stance = stance_of(seed, index) if series == SIX_AXES else None
    preflight = _draw_short(chance, template, arm_class, two_channels, stance)
    there = set(known_kinds(six=stance is not None))
    possible = applicable((kind for kind in kinds if kind in there), preflight.plan)
    wrong = chance.sample(possible, min(count, len(possible)))
    return scenario_of(series, index, preflight, stance, wrong, [chance] * len(wrong), chance)


def scenario_of(
    series: str,
    index: int,
    preflight: Preflight,
    stance: Stance | None,
    wrong: Sequence[str],
    chances: Sequence[Random],
    chance: Random,
) -> Scenario:
    """The run of a plan with these kinds of faults.

    Args:
        series, index: its name.
        preflight: of the plan.
        stance: how a rig with six axes holds its tip.
        wrong: kinds of its faults.
        chances: random source of each of them.
        chance: of the truth, and of what accompanies the faults.
    """
    plan, limits = preflight.plan, preflight.run_limits
    drawn = list(zip(wrong, chances, strict=True))
    anomalies = tuple(
        mistake_of(kind, source, plan)
        for kind, source in drawn
        if kind in MISTAKES or kind in SIX_MISTAKES
    )
    anomalies += draw_beside(chance) if wrong else ()
    truth = draw_truth(chance, preflight, anomalies, chance.getrandbits(32))
    if stance is not None:
        truth = mounted(truth, preflight, stance, anomalies)
    times = expected_times(plan, limits, truth.surface_m)
    faults: list[WorldFault] = []
    incidents: tuple[Incident, ...] = ()
    for kind, source in drawn:
        if kind in INCIDENTS:
            incidents += incidents_of(kind, source, times)
        elif kind not in MISTAKES and kind not in SIX_MISTAKES:
            faults += faults_of(kind, source, times, plan, limits.used_limit_n)
    return Scenario(
        series=series,
        index=index,
        preflight=preflight,
        truth=replace(truth, faults=tuple(faults)),
        wrong=tuple(wrong),
        anomalies=anomalies,
        incidents=tuple(sorted(incidents, key=lambda incident: incident.start_s)),
        hazard=hazard_of(wrong, faults, plan, anomalies),
    )


def stance_of(seed: int, index: int) -> Stance:
    """Mounting of the tip in this run with six axes."""
    aside = Random(f"stepload {seed} {SIX_AXES} {index} stance")
    ur = ARM_CLASSES[index % len(ARM_CLASSES)] == "UR"
    steep = index // len(ARM_CLASSES) % 10 in STEEP
    return draw_stance(aside, ur, STEEPEST_RAD if steep else None)


def hazard_of(
    wrong: Sequence[str], faults: Sequence[WorldFault], plan: Plan, anomalies: Sequence[Anomaly]
) -> str:
    """Named hazard that takes a run with these faults out of the claim, or "".

    It follows from what is wrong alone, not from what comes of it.
    """
    values = {anomaly.kind: anomaly.value for anomaly in anomalies}
    kinds = {fault.kind for fault in faults}
    if not any(kind in WITHIN_PLAN for kind in wrong) and (lies := lies_of(faults, plan)):
        return lies
    if PLATE_MOVES in kinds:
        return PLATE_MOVES
    if values.get("plate_tilted", 0.0) > expected_tilt_rad(plan):
        return TILTED
    if RIGID_STOP in values or "stuck_stiffer" in values:
        if kinds.intersection(("command_latency", "command_jitter")):
            return HELD_BACK
        if values.get("mass_wrong", 1.0) > 1.0:
            return HEAVIER
    dead = any(fault.kind == "force_lateral_dead" and fault.start_s == 0.0 for fault in faults)
    dragged = "stuck_stiffer" in values or "dragged_aside" in values
    return SIDEWAYS_UNSEEN if dead and dragged else ""


def _draw_short(
    chance: Random, template: Plan, arm_class: str, two_channels: bool, stance: Stance | None
) -> Preflight:
    """A plan of short duration, if the template allows: slow rigs are safe, and cost time.

    Raises:
        RefusedError: no plan was found.
    """
    six = (lambda plan: told(plan, stance), lambda drawn: fits(drawn, stance)) if stance else ()
    for _ in range(_SHORT_DRAWS):
        preflight = draw_plan(chance, template, arm_class, two_channels, *six)
        plan, limits = preflight.plan, preflight.run_limits
        if expected_times(plan, limits, plan.procedure.surface_distance_m).end_s <= LONGEST_RUN_S:
            break
    return preflight


def expected_times(plan: Plan, limits: RunLimits, surface_m: float) -> Times:
    """When the run will touch and end, if nothing goes wrong; good to some tenths of a second."""
    procedure = plan.procedure
    near_m = procedure.surface_distance_m - procedure.surface_uncertainty_m
    fast_m = near_m - 2.0 * limits.fast_speed_m_s * limits.reaction_s
    fast_m = procedure.retract_m + max(0.0, min(fast_m, surface_m))
    touch_s = (
        procedure.warm_up_s
        + _LOOKS_S
        + procedure.retract_m / limits.retract_speed_m_s
        + procedure.tare_s
        + _DRIFT_CHECK_S
        + fast_m / limits.fast_speed_m_s
        + (procedure.retract_m + surface_m - fast_m) / limits.guarded_speed_m_s
    )
    step_s = (
        procedure.step_n / procedure.load_rate_n_per_s
        + _STEP_RATES / limits.step_rate_per_s
        + procedure.hold_s
        + _SETTLE_S
    )
    return Times(touch_s, touch_s + step_s * len(procedure.levels_n))
