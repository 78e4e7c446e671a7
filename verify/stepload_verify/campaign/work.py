"""One run of the campaign from its numbers: draw it, run it, keep a row."""

from __future__ import annotations

import hashlib
import inspect
from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from typing import NamedTuple

import stepload
from stepload.feasibility.bounds import stuck_ratio
from stepload.feasibility.preflight import Preflight, derive
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.plan.compose import SIMULATED
from stepload.plan.model import Plan
from stepload.rig.world import WorldSpec, load_world
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.lab_plans import lab_plan
from stepload_verify.campaign.mounts import draw_stance, fits, mounted
from stepload_verify.campaign.result import REFUSED, Job, Result
from stepload_verify.campaign.scenario import SIX_AXES, Scenario, draw
from stepload_verify.campaign.single import run_scenario
from stepload_verify.campaign.truth import draw_truth

NOT_DECIDING = ("campaign.py", "replay.py", "summary.py")
"""Files of this package that only order, store and count runs."""
DECIDING = ("contact", "engine", "feasibility", "identification", "plan", "rig")
"""Packages of stepload whose code determines the result of a simulated run."""


def fingerprint(*more: Path) -> str:
    """SHA-256 over the code, of campaign and simulator, that determines the result of a run.

    Args:
        more: further directories of such code.
    """
    product, here = Path(stepload.__file__).parent, Path(__file__).parent
    simulator = Path(inspect.getfile(type(load_world()))).parent
    rooms = (*(product / name for name in DECIDING), here, simulator, *more)
    without = {here / name for name in NOT_DECIDING}
    digest = hashlib.sha256()
    for room in rooms:
        for file in sorted(set(room.rglob("*.py")) - without):
            digest.update(file.relative_to(room.parent).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def loaded(*more: Path) -> str:
    """The same, computed once in this process, whose loaded code does not change."""
    return fingerprint(*more)


CREEP_SHARE, MOST_CREEP = 0.5, 0.08
"""Share of the payloads that creep, and the largest growth of their deformation."""
STANCES = 50
"""Draws for a stance within the plan."""


def healthy(seed: int, series: str, index: int) -> Scenario | Result:
    """The healthy run `index` of a series; its result where its plan is refused."""
    chance = Random(f"stepload {seed} {series} {index} healthy")
    six = series == SIX_AXES
    preflight = derive(lab_plan(chance, six))
    if preflight.verdict is PlanVerdict.REFUSED or preflight.limits is None:
        reason = next(r for r in preflight.reasons if r.severity is Severity.REFUSE)
        return _refused(series, index, reason.code, reason.message)
    truth = draw_truth(chance, preflight, (), chance.getrandbits(32))
    if chance.random() < CREEP_SHARE:
        creep = chance.uniform(0.0, MOST_CREEP)
        payload = replace(truth.payload, creep=creep, creep_time_s=0.3, creep_decades=2)
        truth = replace(truth, payload=payload)
    if six:
        truth = _held(chance, preflight, truth)
    return Scenario(series, index, preflight, truth, (), (), (), "")


def _held(chance: Random, preflight: Preflight, truth: WorldSpec) -> WorldSpec:
    """An arm whose tip gives way to the side no more than the plan says."""
    largest, _ = stuck_ratio(preflight.plan.rig)
    for _ in range(STANCES):
        stance = replace(draw_stance(chance, ur=True), dry_ratio=1.0)
        if stance.stuck_ratio <= largest and fits(preflight, stance):
            return mounted(truth, preflight, stance, ())
    return truth


def _refused(series: str, index: int, code: str, message: str) -> Result:
    return Result(
        series=series, index=index, rig_class="", healthy=True, wrong=(), beside=(), hazard="",
        rule=code, message=message, phase="", status=REFUSED, stop_s=0.0, detection_s=None,
        end_s=0.0, peak_n=0.0, elastic_limit_n=1.0, top_n=0.0,
    )  # fmt: skip


class Work(NamedTuple):
    """Common settings of all runs of a campaign."""

    template: Plan
    seed: int
    kinds: tuple[str, ...]
    at_once: int = 1
    ablation: str = ""
    world: str = SIMULATED

    @property
    def digest(self) -> str:
        """Digest of the code that determines the result of a run."""
        return loaded()

    def run(self, job: Job, /) -> Result:
        """Do one run; its draws are made here, from the numbers of the job."""
        scenario = self.scenario(job)
        if isinstance(scenario, Result):
            return scenario
        return run_scenario(scenario, _without(self.ablation), world=self.world)[0]

    def scenario(self, job: Job) -> Scenario | Result:
        """The run of a job; its result where preflight refuses the plan of a healthy run."""
        if not self.kinds:
            return healthy(self.seed, job.series, job.index)
        return draw(self.template, self.seed, job.series, job.index, self.kinds, self.at_once)


@cache
def _without(name: str) -> Ablation | None:
    return Ablation(name) if name else None
