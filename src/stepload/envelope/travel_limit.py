"""The travel limit: how far the arm may press on without a rise of the force.

On a rigid surface the force must stay below F_lim. A soft payload needs more travel than that until
a rise is seen at all; the limit is then as long as such a rise needs.
"""

from __future__ import annotations

import math

from stepload.envelope.press import NOISE_MULTIPLE

ANCHOR_WINDOW_S = 0.04
"""Time in s over which the force is averaged before it counts as an answer."""
END_WINDOW_S = 0.1
"""The same at the end of the travel, at least: the noise of an answer would hide the next one."""
ANSWER_FILTER_S = 0.1
"""Time constant in s of the filter on the force in which R6 looks for an answer."""
ANSWER_SIGMAS = 4.5
"""Standard deviations by which a mean must rise to be an answer. Of noise alone few means in a
hundred thousand rise so far."""
DRIFT_SHARE = 0.5
"""Share of an answer at the end of the travel that may be a drift which goes on while the arm
stands."""
DRIFT_SIGMAS = 1.5
"""Standard deviations added to that drift; a steady drift then passes in one look of 700."""
ONE_CHANNEL = 0.3, 4.0
TWO_CHANNELS = 0.1, 20.0
"""Least share of the softest payload's rise that counts as an answer, and how many least rises that
payload shows within the travel limit. Two answers end its count, so beside a second channel a
payload ten times softer than stated is pressed all the same."""
OLD_S = 0.5
"""How old the readings of an only force channel may be while they go on arriving, fresh stamps and
all, as from a buffer that fills."""


def travel_limit(
    limit_n: float, touch_force_n: float, noise_n: float, stiffness_n_per_m: float
) -> float:
    """Travel in m that lifts the force from the contact threshold to F_lim on a rigid surface."""
    return (limit_n - touch_force_n - NOISE_MULTIPLE * noise_n) / stiffness_n_per_m


def least_rise_n(noise_n: float, reading_s: float) -> float:
    """Least rise in N of the force filtered by `ANSWER_FILTER_S` that noise does not explain."""
    return ANSWER_SIGMAS * noise_n * math.sqrt(min(1.0, 0.5 * reading_s / ANSWER_FILTER_S))
