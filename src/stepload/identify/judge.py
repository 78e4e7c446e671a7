"""What the data of a run have shown about the payload."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from stepload.identify.identifiability import Identifiability


class ResultVerdict(StrEnum):
    """What the data have shown about the payload."""

    IDENTIFIED = "identified"
    MARGINAL = "marginal"
    NOT_IDENTIFIABLE = "not identifiable"


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the data are good for, and why."""

    verdict: ResultVerdict
    reasons: tuple[str, ...]
    identifiability: Identifiability
