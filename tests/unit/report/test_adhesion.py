"""A contact that pulls is seen where it closes and opens, and its law is tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stepload.record.rows import Phase
from stepload.report.analyse import identify_payload
from stepload.report.run_data import pressed, pulls
from stepload_verify.trials.honest.measure import record
from stepload_verify.trials.honest.worlds import KNOWN, make

ADHESIVE = "Hertz with adhesion"


@pytest.mark.parametrize("seed", [4000013, 4000041])
def test_a_contact_that_pulls_is_tried_as_one(seed):
    data, conditions = record(make(KNOWN, "adhesion", seed))
    assert pulls(data)
    assert pressed(data, conditions).adhesive
    found = identify_payload(data, conditions)
    assert found.judgement is not None
    assert ADHESIVE in {row.name for row in found.judgement.laws}


@pytest.mark.parametrize("seed", range(6))
def test_noise_about_a_touch_is_no_pull(seed):
    data, conditions = record(make(KNOWN, "sphere", seed))
    assert not pulls(data)
    assert not pressed(data, conditions).adhesive


def test_only_the_force_where_a_contact_closes_or_opens_counts():
    data, _ = record(make(KNOWN, "sphere", 1))
    deep = np.where(data.phase == Phase.TARE, -50.0 * data.noise_n, data.force_n)
    assert not pulls(replace(data, force_n=deep))
    deep = np.where(data.phase == Phase.TOUCH_RETRACT, -50.0 * data.noise_n, data.force_n)
    assert pulls(replace(data, force_n=deep))
    assert not pulls(replace(data, force_n=deep, phase=np.full_like(data.phase, Phase.TARE)))
