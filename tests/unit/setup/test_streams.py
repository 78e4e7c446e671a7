"""Limits of a stream, from either side: rate, age, clock, noise and drift."""

from __future__ import annotations

import math
from random import Random

import pytest
from run_plans import stvf_plan

from stepload.feasibility.bounds import age_limit_s
from stepload.rig.samples import ForceSample
from stepload.setup.check_line import Mark
from stepload.setup.streams import Watched, check_force, check_stream

PLAN = stvf_plan()
SPEC = PLAN.rig.force
SECONDS = 3.0


def seen_of(rate=1.0, noise=1.0, slope=0.0, age_s=1e-3, step_s=0.0, number=3000):
    """A stream at `rate` times the plan's, `noise` times its noise, a clock that steps once."""
    chance = Random(7)

    def one(index):
        time_s = index / (rate * SPEC.rate_hz)
        force_n = chance.gauss(0.0, noise * SPEC.noise_n) + slope * time_s
        device_s = 100.0 + time_s - (step_s if time_s > 1.5 else 0.0)
        late_s = 1e-4 * abs(chance.gauss(0.0, 1.0))
        wrench = (0.0, 0.0, force_n, 0.0, 0.0, 0.0)
        return ForceSample(index, device_s, time_s + late_s, 0, wrench, math.nan)

    return Watched(
        samples={"force": [one(i) for i in range(number)]}, ages_s={"force": [1e-3, age_s]},
        lost={"force": 0}, errors={"force": {}},
    )  # fmt: skip


def mark_of(what, **how):
    seen = seen_of(**how)
    lines = [*check_stream("force", SPEC, seen, SECONDS)]
    if len(seen.samples["force"]) > 2:
        lines += check_force(PLAN, SPEC, "force", seen)[0]
    return next(line.mark for line in lines if line.name == f"force: {what}")


def test_a_burst_at_one_moment_is_no_data():
    seen = seen_of(number=50)
    seen.samples["force"] = [each._replace(receive_time_s=7.0) for each in seen.samples["force"]]
    [line] = check_stream("force", SPEC, seen, SECONDS)
    assert (line.name, line.mark) == ("force: data", Mark.FAIL)
    assert "all 50 samples came at one moment" in line.message


@pytest.mark.parametrize(
    ("rate", "mark"), [(1.01, Mark.OK), (0.95, Mark.WARN), (0.85, Mark.FAIL), (1.2, Mark.FAIL)]
)
def test_the_rate_is_the_plans(rate, mark):
    assert mark_of("rate", rate=rate) is mark


@pytest.mark.parametrize(
    ("share", "mark"), [(0.4, Mark.OK), (0.9, Mark.WARN), (1.1, Mark.FAIL), (math.nan, Mark.FAIL)]
)
def test_no_sample_is_older_than_a_run_takes(share, mark):
    assert mark_of("longest age", age_s=share * age_limit_s(SPEC)) is mark


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("step_s", "mark"), [(0.0, Mark.OK), (0.01, Mark.WARN), (0.05, Mark.FAIL)])
def test_the_devices_clock_does_not_step(step_s, sign, mark):
    assert mark_of("clock steps", step_s=sign * step_s) is mark


@pytest.mark.parametrize(
    ("noise", "mark"), [(1.0, Mark.OK), (2.0, Mark.WARN), (4.0, Mark.FAIL), (math.nan, Mark.FAIL)]
)
def test_the_noise_is_the_plans(noise, mark):
    assert mark_of("noise", noise=noise) is mark


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("share", "mark"), [(0.3, Mark.OK), (0.8, Mark.WARN), (1.5, Mark.FAIL)])
def test_a_drift_either_way_stays_below_the_plans(share, sign, mark):
    slope = sign * share * PLAN.procedure.max_drift_n / PLAN.procedure.tare_s
    assert mark_of("drift at rest", slope=slope) is mark
