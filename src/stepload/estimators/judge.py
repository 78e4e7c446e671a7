"""Verdict on what the data of a run show about the payload."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class ResultVerdict(StrEnum):
    """What the data have shown about the payload: the possible verdicts."""

    IDENTIFIED = "identified"
    MARGINAL = "marginal"
    NOT_IDENTIFIABLE = "not identifiable"


@dataclass(frozen=True, slots=True)
class Judgement:
    """The verdict on the data, and its reasons.

    `k_max_n_per_m` is (34) in N/m with the force that was reached; NaN where the position
    resolution is neither stated nor seen in the data.
    """

    verdict: ResultVerdict
    reasons: tuple[str, ...]
    k_max_n_per_m: float
