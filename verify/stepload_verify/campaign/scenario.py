"""One run of the campaign before it is executed; all of it follows from (seed, series, index)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from random import Random

from stepload.envelope.dragged import believed_tilt_rad
from stepload.envelope.envelope import Envelope
from stepload.envelope.limits import RunLimits
from stepload.errors import BadInputError
from stepload.plan.model import Plan
from stepload.rig.world import WorldFault, WorldSpec, load_world
from stepload_verify.campaign.mishaps import (
    INCIDENTS,
    SIX_FAULTS,
    WIDER_FAULTS,
    Incident,
    Times,
    applicable,
    both_channels_blind,
    draw_fault,
    draw_incidents,
)
from stepload_verify.campaign.mounts import STEEPEST_RAD, Stance, draw_stance, fits, mounted, told
from stepload_verify.campaign.plants import ARM_CLASSES, draw_plan
from stepload_verify.campaign.truth import (
    ANOMALIES,
    SIX_ANOMALIES,
    Anomaly,
    draw_anomaly,
    draw_truth,
)

TWO_CHANNELS, ONE_CHANNEL = "two", "one"
"""The two series of a campaign: the claim is made for the first, the second is reported apart."""
ONE_AXIS, SIX_AXES = "one", "six"
BLIND = "both_channels_alike"
"""A named hazard: no rule can stop such a run."""
SIDEWAYS_UNSEEN = "sideways_unseen"
"""Hazard: more lateral force than planned, and the only lateral sensor dead from the beginning."""
TILTED = "plate_tilted"
"""A named hazard: the plate is tilted by more than the plan says, and nothing measures it."""
STEEP = (0, 5, 9)
"""Of ten rigs with six axes of a class, those whose plan states the plate's largest tilt."""
HEALTHY_SHARE = 0.15
PLANTS = "plants"
"""Name of the anomalies of plants among the kinds."""
INCIDENT_SHARE = 0.2
LONGEST_RUN_S = 8.0
"""Longest run; longer ones are drawn again, a few times."""
_SHORT_DRAWS = 20
_STEP_RATES = 5.0
_LOOKS_S = 0.6
"""Time to measure the force before and after backing off, and rest between them."""
_DRIFT_CHECK_S = 0.5
_SETTLE_S = 0.4


@dataclass(frozen=True, slots=True)
class Scenario:
    """A run: its plan, its truth, and its faults with their times."""

    series: str
    index: int
    envelope: Envelope
    truth: WorldSpec
    healthy: bool
    anomalies: tuple[Anomaly, ...]
    incidents: tuple[Incident, ...]
    hazard: str

    @property
    def plan(self) -> Plan:
        """The plan."""
        return self.envelope.plan

    @property
    def limits(self) -> RunLimits:
        """The thresholds of the run."""
        return self.envelope.run_limits

    @property
    def faults(self) -> tuple[WorldFault, ...]:
        """The faults of the simulated rig."""
        return self.truth.faults


def axes_from(text: str) -> str:
    """One of `ONE_AXIS` and `SIX_AXES`.

    Raises:
        BadInputError: it is neither.
    """
    if text not in (ONE_AXIS, SIX_AXES):
        raise BadInputError(f"--axes {text!r}: rigs have one axis or six", hint="one or six")
    return text


def kinds_from(text: str, axes: str = ONE_AXIS) -> tuple[str, ...]:
    """The kinds named in `--faults`: "all" of the claim, "none", or names separated by commas.

    Args:
        text: what was written.
        axes: of the rigs; those with one axis lack some kinds.

    Raises:
        BadInputError: a name that is none.
    """
    absent = SIX_FAULTS if axes == ONE_AXIS else ()
    known = [k for k in (*load_world().faults, *INCIDENTS, PLANTS) if k not in absent]
    names = [name.strip() for name in text.split(",")]
    if names == ["all"]:
        return tuple(name for name in known if name not in WIDER_FAULTS)
    if names == ["none"]:
        return ()
    for name in names:
        if name not in known:
            raise BadInputError(
                f"unknown fault {name!r}", hint=f"all, none, or some of {', '.join(known)}"
            )
    return tuple(dict.fromkeys(names))


def draw(
    template: Plan,
    seed: int,
    series: str,
    index: int,
    kinds: tuple[str, ...],
    axes: str = ONE_AXIS,
) -> Scenario:
    """The run `index` of a series, on a rig with one axis or with six."""
    chance = Random(f"stepload {seed} {series} {index}")
    arm_class = ARM_CLASSES[index % len(ARM_CLASSES)]
    stance = stance_of(seed, series, index) if axes == SIX_AXES else None
    envelope = _draw_short(chance, template, arm_class, series == TWO_CHANNELS, stance)
    plan, limits = envelope.plan, envelope.run_limits
    healthy = chance.random() < HEALTHY_SHARE
    anomalies: tuple[Anomaly, ...] = ()
    mishaps = 0
    if not healthy:
        ways = ANOMALIES if stance is None else (*ANOMALIES, *SIX_ANOMALIES)
        anomalies, mishaps = _draw_amounts(chance, plan, kinds, ways)
    truth = draw_truth(chance, envelope, anomalies, chance.getrandbits(32))
    if stance is not None:
        truth = mounted(truth, envelope, stance, anomalies)
    times = expected_times(plan, limits, truth.surface_m)
    world_kinds = applicable((k for k in kinds if k not in (*INCIDENTS, PLANTS)), plan)
    incident_kinds = [kind for kind in kinds if kind in INCIDENTS]
    faults: list[WorldFault] = []
    incidents: tuple[Incident, ...] = ()
    for _ in range(mishaps):
        if incident_kinds and (not world_kinds or chance.random() < INCIDENT_SHARE):
            incidents += draw_incidents(chance, incident_kinds, times)
        elif world_kinds:
            faults.append(draw_fault(chance, world_kinds, times, limits.elastic_limit_n))
    return Scenario(
        series=series,
        index=index,
        envelope=envelope,
        truth=replace(truth, faults=tuple(faults)),
        healthy=not (faults or incidents or anomalies),
        anomalies=anomalies,
        incidents=tuple(sorted(incidents, key=lambda incident: incident.start_s)),
        hazard=hazard_of(faults, plan, anomalies) or _tilted(plan, anomalies),
    )


def stance_of(seed: int, series: str, index: int) -> Stance:
    """Mounting of the tip in this run with six axes."""
    aside = Random(f"stepload {seed} {series} {index} six")
    ur = ARM_CLASSES[index % len(ARM_CLASSES)] == "UR"
    steep = index // len(ARM_CLASSES) % 10 in STEEP
    return draw_stance(aside, ur, STEEPEST_RAD if steep else None)


def _tilted(plan: Plan, anomalies: Sequence[Anomaly]) -> str:
    """`TILTED` where the plate is steeper than the plan counts on."""
    steep = (one.value for one in anomalies if one.kind == "plate tilted")
    return TILTED if any(tilt_rad > believed_tilt_rad(plan) for tilt_rad in steep) else ""


def hazard_of(faults: Sequence[WorldFault], plan: Plan, anomalies: Sequence[Anomaly] = ()) -> str:
    """Name of the hazard that takes a run with these faults out of the claim, or ""."""
    if both_channels_blind(faults, plan):
        return BLIND
    dead = any(fault.kind == "force_lateral_dead" and fault.start_s == 0.0 for fault in faults)
    dragged = any(anomaly.kind in SIX_ANOMALIES[:2] for anomaly in anomalies)
    return SIDEWAYS_UNSEEN if dead and dragged else ""


def _draw_short(
    chance: Random, template: Plan, arm_class: str, two_channels: bool, stance: Stance | None
) -> Envelope:
    """A plan of short duration, if the template allows: slow rigs are safe, and cost time.

    Raises:
        RefusedError: no plan was found.
    """
    six = (lambda plan: told(plan, stance), lambda drawn: fits(drawn, stance)) if stance else ()
    for _ in range(_SHORT_DRAWS):
        envelope = draw_plan(chance, template, arm_class, two_channels, *six)
        plan, limits = envelope.plan, envelope.run_limits
        if expected_times(plan, limits, plan.procedure.surface_distance_m).end_s <= LONGEST_RUN_S:
            break
    return envelope


def _draw_amounts(
    chance: Random, plan: Plan, kinds: tuple[str, ...], ways: tuple[str, ...]
) -> tuple[tuple[Anomaly, ...], int]:
    """The plant's anomaly, and the number of additional mishaps."""
    only_plants = kinds == (PLANTS,)
    wrong = chance.choices((0, 1, 2), (0.6, 0.34, 0.06))[0] if PLANTS in kinds else 0
    wrong = max(wrong, 1) if only_plants else wrong
    found = {a.kind: a for a in (draw_anomaly(chance, plan, ways) for _ in range(wrong))}
    if only_plants:
        return tuple(found.values()), 0
    weights = (0.3, 0.5, 0.2) if found else (0.0, 0.7, 0.3)
    return tuple(found.values()), chance.choices((0, 1, 2), weights)[0]


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
