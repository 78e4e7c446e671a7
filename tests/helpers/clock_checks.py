"""The checks of the driver contract as parameters; those that compare clocks run in real time."""

from __future__ import annotations

import pytest

from stepload.rig.contract import CHECKS
from stepload.rig.contract_samples import check_drain, check_samples, check_stamps

AGAINST_THE_CLOCK = (check_samples, check_stamps, check_drain)
"""They judge a driver by its rate, or by a millisecond of the host's clock."""
CONTRACT = [
    pytest.param(
        check,
        marks=[pytest.mark.realtime(tolerates_s=0.001)] if check in AGAINST_THE_CLOCK else [],
        id=check.__name__,
    )
    for check in CHECKS
]
