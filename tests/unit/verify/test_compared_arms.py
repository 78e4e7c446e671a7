"""Groups of runs on an arm that friction stiffens, compared: the trial behind docs/compare.md."""

from __future__ import annotations

import numpy as np
import pytest

from stepload.evidence.difference import Agreement
from stepload_verify.trials.coupling import compared as trial
from stepload_verify.trials.coupling.compared import PAIRS, SETTINGS, WAYS, compared


@pytest.mark.long
def test_payloads_that_rub_alike_are_told_apart_as_well_as_their_shares_are_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(trial, "REPEATS", 1)
    said = compared(SETTINGS[0], PAIRS[0], np.random.default_rng(1))
    found = {way: each for way in WAYS if (each := said[way]) is not None}
    assert set(found) == set(WAYS)
    assert all(each.covered for each in found.values())
    assert found["three"].verdict is Agreement.AGREE
    assert found["three"].half_width < found["one"].half_width < found["one axis"].half_width
