"""Healthy runs: a drawn plan of a lab in full length, on a rig that is as the plan says."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from stepload.envelope.bounds import stuck_ratio
from stepload.envelope.envelope import Envelope, derive
from stepload.envelope.reason import PlanVerdict, Severity
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.lab_plans import lab_plan
from stepload_verify.campaign.mounts import draw_stance, fits, mounted
from stepload_verify.campaign.result import REFUSED, Result
from stepload_verify.campaign.scenario import SIX_AXES, Scenario
from stepload_verify.campaign.truth import draw_truth

CREEP_SHARE, MOST_CREEP = 0.5, 0.08
"""Share of the payloads that creep, and the largest growth of their deformation."""
STANCES = 50
"""Draws for a stance within the plan."""


def healthy(seed: int, series: str, index: int) -> Scenario | Result:
    """The healthy run `index` of a series; its result where its plan is refused."""
    chance = Random(f"stepload {seed} {series} {index} healthy")
    six = series == SIX_AXES
    envelope = derive(lab_plan(chance, six))
    if envelope.verdict is PlanVerdict.REFUSED or envelope.limits is None:
        reason = next(r for r in envelope.reasons if r.severity is Severity.REFUSE)
        return _refused(series, index, reason.code, reason.message)
    truth = draw_truth(chance, envelope, (), chance.getrandbits(32))
    if chance.random() < CREEP_SHARE:
        creep = chance.uniform(0.0, MOST_CREEP)
        payload = replace(truth.payload, creep=creep, creep_time_s=0.3, creep_decades=2)
        truth = replace(truth, payload=payload)
    if six:
        truth = _held(chance, envelope, truth)
    return Scenario(series, index, envelope, truth, (), (), (), "")


def _held(chance: Random, envelope: Envelope, truth: WorldSpec) -> WorldSpec:
    """An arm whose tip gives way to the side no more than the plan says."""
    largest, _ = stuck_ratio(envelope.plan.rig)
    for _ in range(STANCES):
        stance = replace(draw_stance(chance, ur=True), dry_ratio=1.0)
        if stance.stuck_ratio <= largest and fits(envelope, stance):
            return mounted(truth, envelope, stance, ())
    return truth


def _refused(series: str, index: int, code: str, message: str) -> Result:
    return Result(
        series=series, index=index, rig_class="", healthy=True, wrong=(), beside=(), hazard="",
        rule=code, message=message, phase="", status=REFUSED, stop_s=0.0, detection_s=None,
        end_s=0.0, peak_n=0.0, elastic_limit_n=1.0, top_n=0.0,
    )  # fmt: skip
