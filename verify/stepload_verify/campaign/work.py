"""One run of the campaign from its numbers: draw it, run it, keep a row."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from stepload.plan.model import Plan
from stepload.runner.jobs import Job
from stepload_verify.campaign.ablation import Ablation
from stepload_verify.campaign.digest import loaded
from stepload_verify.campaign.healthy import healthy
from stepload_verify.campaign.result import Result
from stepload_verify.campaign.scenario import Scenario, draw
from stepload_verify.campaign.single import run_scenario


class Work(NamedTuple):
    """Common settings of all runs of a campaign."""

    template: Plan
    seed: int
    kinds: tuple[str, ...]
    at_once: int = 1
    ablation: str = ""

    @property
    def digest(self) -> str:
        """Digest of the code that determines the result of a run."""
        return loaded()

    def run(self, job: Job, /) -> Result:
        """Do one run; its draws are made here, from the numbers of the job."""
        scenario = self.scenario(job)
        if isinstance(scenario, Result):
            return scenario
        return run_scenario(scenario, _without(self.ablation))[0]

    def scenario(self, job: Job) -> Scenario | Result:
        """The run of a job; its result where preflight refuses the plan of a healthy run."""
        if not self.kinds:
            return healthy(self.seed, job.series, job.index)
        return draw(self.template, self.seed, job.series, job.index, self.kinds, self.at_once)


@cache
def _without(name: str) -> Ablation | None:
    return Ablation(name) if name else None
