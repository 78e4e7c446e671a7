"""A sensor that is frozen, flagged or silent is not sound, whatever its stamps say."""

from __future__ import annotations

import math
from dataclasses import replace
from random import Random

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import DisplacementSpec
from stepload.plan.shipped import plan_path
from stepload.rig.samples import ArmSample, DisplacementSample, ForceSample
from stepload.setup.check_line import Mark
from stepload.setup.streams import Watched, check_live

RIG = load_plan(plan_path("demo-wire")).rig
FORCE = replace(RIG.force, resolution_n=0.0)
NUMBER = 2000


def readings(force_n=None, status=0):
    chance = Random(3)

    def one(index):
        newton = chance.gauss(0.0, 0.1) if force_n is None else force_n
        time_s = 1e-3 * index
        wrench = (chance.gauss(0.0, 0.1), 0.0, newton, 0.0, 0.0, 0.0)  # another axis may live on
        return ForceSample(index, math.nan, time_s, status, wrench, math.nan)

    return [one(index) for index in range(NUMBER)]


def found(samples, spec=FORCE, ages_s=(0.0,)):
    seen = Watched(samples={"force": samples}, ages_s={"force": list(ages_s)})
    return list(check_live("force", spec, seen, RIG))


@pytest.mark.parametrize("part", [NUMBER, 500])
def test_equal_readings_in_a_row_are_a_frozen_sensor(part):
    samples = readings()[part:] + readings(3.0)[:part]
    [line] = found(samples)
    assert line.mark is Mark.FAIL
    assert line.finding.text.startswith("force: readings")


def test_one_flagged_sample_is_one_too_many():
    samples = readings()
    samples[700] = samples[700]._replace(status=6)
    [line] = found(samples)
    assert line.mark is Mark.FAIL
    assert "1 of 2000 samples" in line.finding.text
    assert "saturated, invalid" in line.finding.text


@pytest.mark.parametrize(("silent_s", "failed"), [(0.4, False), (0.6, True)])
def test_a_gauge_that_falls_silent_is_found(silent_s, failed):
    spec = DisplacementSpec(driver="sim", rate_hz=100.0, resolution_m=1e-6)
    samples = [DisplacementSample(i, math.nan, 0.01 * i, 0, 1e-6 * i) for i in range(100)]
    assert bool(found(samples, spec, (0.01, silent_s))) is failed


@pytest.mark.parametrize("frozen", [False, True])
def test_the_arms_own_force_channel_must_live_too(frozen):
    chance = Random(5)

    def one(index):
        newton = 12.3 if frozen else chance.gauss(0.0, 1.0)
        return ArmSample(index, math.nan, 2e-3 * index, 0, 0.0, newton, (0.0,) * 6)

    seen = Watched(samples={"arm": [one(i) for i in range(300)]}, ages_s={"arm": [0.0]})
    lines = list(check_live("arm", RIG.arm, seen, RIG))
    assert [line.name for line in lines] == (["second_force: readings"] if frozen else [])
