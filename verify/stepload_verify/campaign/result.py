"""Stored result of each run: one line of JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass

NOT_OPENED = "not opened"
KILLED = "killed"
REFUSED = "refused"
"""Status of a plan of a healthy run that preflight refuses: nothing was run."""


@dataclass(frozen=True, slots=True)
class Job:
    """One run to be done; with the seed of the work its series and number decide all draws."""

    series: str
    index: int


@dataclass(frozen=True, slots=True)
class Result:
    """One run. `rule` is what stopped it, "" if nothing did; times in s of world time.

    `wrong` are the kinds of its faults, `beside` what the plant had besides. `detection_s` is from
    the beginning of the only fault to the stop; None where several things were wrong, or nothing.
    `phase` is where the run was when it stopped. `hazard` names why the run is outside the claim.
    `peak_n` is what counts against `elastic_limit_n`, the counted F_c: the largest contact force,
    with six axes the largest |f|/g(t) of a share t across the axis, and `resultant_n` is then the
    largest |f|. `levels_missed` counts the levels that were given up below their force.
    """

    series: str
    index: int
    rig_class: str
    healthy: bool
    wrong: tuple[str, ...]
    beside: tuple[str, ...]
    hazard: str
    rule: str
    message: str
    phase: str
    status: str
    stop_s: float
    detection_s: float | None
    end_s: float
    peak_n: float
    elastic_limit_n: float
    top_n: float
    resultant_n: float | None = None
    levels_missed: int = 0

    @property
    def peak_ratio(self) -> float:
        """True peak force over F_c."""
        return self.peak_n / self.elastic_limit_n

    @property
    def j(self) -> float:
        """(peak − F_top)/(F_c − F_top): 0 in a healthy run, above 1 where F_c was passed."""
        return (self.peak_n - self.top_n) / (self.elastic_limit_n - self.top_n)

    @property
    def false_trip(self) -> bool:
        """Whether it was stopped without any fault."""
        return self.healthy and self.status not in ("completed", REFUSED)

    def to_line(self) -> str:
        """One line of JSON, without its line end."""
        data = asdict(self)
        if self.resultant_n is None:
            del data["resultant_n"]
        return json.dumps(data, separators=(",", ":"), allow_nan=False)

    @classmethod
    def from_line(cls, line: str) -> Result:
        """The inverse of `to_line`.

        Raises:
            ValueError: not such a line.
        """
        try:
            data = json.loads(line)
            lists = {"wrong": tuple(data["wrong"]), "beside": tuple(data["beside"])}
            row = cls(**{**data, **lists})
            whole = 0.0 <= row.peak_n < math.inf and 0.0 < row.elastic_limit_n < math.inf
        except (TypeError, KeyError) as error:
            raise ValueError(f"not a result of a campaign: {error}") from error
        if not whole:
            raise ValueError("not a result of a campaign: its forces are none")
        return row
