"""Detection of adhesion, from the force where a contact closes and opens."""

from __future__ import annotations

import numpy as np

from stepload.record.rows import Phase
from stepload.results.press_data import PressData

CLOSING_OPENING = (
    Phase.GUARDED_APPROACH,
    Phase.LISTENING,
    Phase.DWELL,
    Phase.TOUCH_RETRACT,
    Phase.UNLOAD,
    Phase.RETRACT,
)
SIGMAS = 6.0
"""Least pull, in standard deviations of one sample, that is not an extreme of the noise."""


def pulls(data: PressData) -> bool:
    """Whether the tared force falls below zero by more than noise where a contact closes or opens.

    An arm that shakes its sensor at a reversal looks the same; then an additional law is tried,
    which can only widen the intervals of figures that rest on a zero.
    """
    about = np.isin(data.phase, CLOSING_OPENING)
    if not about.any():
        return False
    return bool(float(data.force_n[about].min()) < -SIGMAS * data.noise_n)
