"""Does the contact pull? The force about a touch, where it closes and where it opens."""

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
"""A pull this many times the noise of one sample is none of its extremes."""


def pulls(data: PressData) -> bool:
    """Whether the tared force falls below zero by more than noise where a contact closes or opens.

    An arm that shakes its sensor while it turns back looks the same; then one law more is tried,
    which widens what rests on a zero and hides nothing.
    """
    about = np.isin(data.phase, CLOSING_OPENING)
    if not about.any():
        return False
    return bool(float(data.force_n[about].min()) < -SIGMAS * data.noise_n)
