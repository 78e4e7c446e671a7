"""From a vector to a run within the limits of a campaign: rig, truth, faults and their times.

The vector has one part for each of these, so that a step in one shifts nothing in another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from stepload.envelope.envelope import Envelope, derive
from stepload.plan.model import Plan
from stepload.rig.world import WorldFault
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.mishaps import (
    INCIDENTS,
    Incident,
    fault_of,
    incidents_of,
)
from stepload_verify.campaign.mounts import Stance, any_stance, fits, mounted, told
from stepload_verify.campaign.plants import ARM_CLASSES, plan_from, travel_to
from stepload_verify.campaign.scenario import BLIND, Scenario, expected_times, hazard_of
from stepload_verify.campaign.truth import (
    ALL_ANOMALIES,
    Anomaly,
    anomaly_of,
    draw_truth,
)
from stepload_verify.falsify.onset import Onset, draw_onset, placed
from stepload_verify.falsify.strata import Stratum
from stepload_verify.falsify.tape import Tape

RIG, TRUTH, WRONG, STANCE = 34, 10, 11, 19
"""Numbers that a rig with its plan, its truth, each thing that goes wrong, and how a rig with six
axes holds its tip may read."""
LONGEST_S, LONGEST_FROZEN_S = 8.0, 20.0
"""Longest run; slow rigs are safe, and cost time.

A channel that stands may be believed for as many samples as may be equal, which takes a longer run.
"""
SHORT_RETRACT_M = 1e-4
"""Retract of a run that is searched, where twice the travel is not more: less free air."""


def length(stratum: Stratum) -> int:
    """How many numbers a run of this stratum is made of."""
    return RIG + TRUTH + WRONG * len(stratum.wrong) + (STANCE if stratum.six else 0)


def scenario_at(
    template: Plan,
    stratum: Stratum,
    index: int,
    point: Sequence[float],
    ablation: Ablation | None = None,
) -> Scenario | None:
    """The run at a point of the unit cube; None where that is no rig that can press, or too long.

    Faults that begin at a force make it look at the run without them first (`onset`).

    Args:
        template: order, times and distances of the run.
        stratum: second channel, and what goes wrong.
        index: number of the run in its stratum; a name and no more.
        point: `length(stratum)` numbers between 0 and 1.
        ablation: what is left out of the run, where it is looked at.

    Raises:
        DomainError: the point is too short.
    """
    envelope = believed(template, stratum, point)
    if envelope is None:
        return None
    plan, limits = envelope.plan, envelope.run_limits
    truth_tape, rest = Tape(point[RIG : RIG + TRUTH], "truth"), point[RIG + TRUTH :]
    tapes = [Tape(rest[WRONG * i : WRONG * (i + 1)], kind) for i, kind in enumerate(stratum.wrong)]
    anomalies: tuple[Anomaly, ...] = ()
    for kind, tape in zip(stratum.wrong, tapes, strict=True):
        if kind in ALL_ANOMALIES:
            anomalies += (anomaly_of(kind, tape, plan),)
    truth = draw_truth(truth_tape, envelope, anomalies, truth_tape.getrandbits(32))
    if (stance := _stance(stratum, point)) is not None:
        truth = mounted(truth, envelope, stance, anomalies)
    times = expected_times(plan, limits, truth.surface_m)
    if times.end_s > longest_s(stratum):
        return None
    faults: list[WorldFault] = []
    onsets: list[Onset | None] = []
    incidents: tuple[Incident, ...] = ()
    for kind, tape in zip(stratum.wrong, tapes, strict=True):
        if kind in INCIDENTS:
            incidents += incidents_of(kind, tape, times)
        elif kind not in ALL_ANOMALIES:
            onsets.append(draw_onset(tape))
            faults.append(fault_of(kind, tape, times, limits.elastic_limit_n))
    scenario = Scenario(
        series=stratum.name,
        index=index,
        envelope=envelope,
        truth=replace(truth, faults=tuple(faults)),
        healthy=False,
        anomalies=anomalies,
        incidents=tuple(sorted(incidents, key=lambda incident: incident.start_s)),
        hazard=hazard_of(faults, plan, anomalies),
    )
    return scenario if scenario.hazard == BLIND else placed(scenario, onsets, ablation)


def believed(template: Plan, stratum: Stratum, point: Sequence[float]) -> Envelope | None:
    """The rig at a point, with what follows from it; None where it cannot press, or takes long."""
    stance = _stance(stratum, point)
    if stance is not None and not stance.sound:
        return None
    rig = Tape(point[:RIG], "rig")
    plan = plan_from(rig, template, rig.choice(ARM_CLASSES), stratum.source)
    if plan is None:
        return None
    plan = _shorter(plan)
    envelope = derive(told(plan, stance) if stance else plan)
    if envelope.limits is None or (stance is not None and not fits(envelope, stance)):
        return None
    nearest_m = plan.procedure.surface_distance_m - plan.procedure.surface_uncertainty_m
    times = expected_times(envelope.plan, envelope.limits, nearest_m)
    return envelope if times.end_s <= longest_s(stratum) else None


def _stance(stratum: Stratum, point: Sequence[float]) -> Stance | None:
    """How the rig at a point holds its tip; None where it has one axis."""
    if not stratum.six:
        return None
    arm_class = Tape(point[:1], "rig").choice(ARM_CLASSES)
    return any_stance(Tape(point[-STANCE:], "stance"), arm_class == "UR")


def longest_s(stratum: Stratum) -> float:
    """How long a run of this stratum may take."""
    frozen = any(kind.endswith("_freeze") for kind in stratum.wrong)
    return LONGEST_FROZEN_S if frozen else LONGEST_S


def with_faults(scenario: Scenario, faults: Sequence[WorldFault]) -> Scenario:
    """The same run with these faults instead, and the hazard that they are."""
    truth = replace(scenario.truth, faults=tuple(faults))
    return replace(
        scenario, truth=truth, hazard=hazard_of(faults, scenario.plan, scenario.anomalies)
    )


def _shorter(plan: Plan) -> Plan:
    """The same plan with less free air to cross."""
    procedure = plan.procedure
    travel_m = travel_to(plan.rig, plan.payload, procedure.top_force_n)
    retract_m = max(SHORT_RETRACT_M, 2.0 * travel_m)
    return replace(plan, procedure=replace(procedure, retract_m=retract_m))
