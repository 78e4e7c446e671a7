"""Effect of removing a safety layer: the campaign without one rule, travel limit or speed limit.

The product has no switch for that. The engine of a simulated run gets other parts instead: a
`Trip` that ignores a rule, a controller without a layer, or other limits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from stepload.engine.controller import StepController
from stepload.engine.operator import StopLevel
from stepload.engine.rules import RULES
from stepload.engine.tick import Engine
from stepload.engine.watch import Trip
from stepload.errors import BadInputError
from stepload.feasibility.limits import RunLimits
from stepload_verify.campaign.result import Job, Result
from stepload_verify.campaign.summary import Group, claimed, group


@dataclass(frozen=True, slots=True)
class Without:
    """The runs of the claim without one layer, `done_again` of them; the others cannot differ.

    Of the runs with something wrong that were stopped with everything in place (by this rule, or by
    anything if the layer is none), `not_stopped` went on to their end, `instead` were ended by
    something else, most frequent first.
    """

    name: str
    done_again: int
    figures: Group
    not_stopped: int
    instead: Mapping[str, int]


def jobs_without(name: str, results: Sequence[Result]) -> list[Job]:
    """The runs whose result may change without a layer.

    A rule can only end a run, once, and the result names the rule that did: every other run is the
    same without it. Runs of a killed program are not repeated, since nothing acts after that. A
    layer of the controller acts in all runs.
    """
    rules = named_rules(name)
    rows = claimed(results)
    return [Job(row.series, row.index) for row in rows if not rules or row.rule in rules]


def without(name: str, results: Sequence[Result], again: Sequence[Result]) -> Without:
    """The table row of a layer: `results` with everything, `again` those of `jobs_without`."""
    there = {(row.series, row.index): row for row in again}
    pairs = [(row, there.get((row.series, row.index), row)) for row in claimed(results)]
    ended = [new for old, new in pairs if _stopped(old, name) and not old.healthy]
    return Without(
        name,
        len(again),
        group(f"without {name}", [new for _, new in pairs]),
        sum(new.status == "completed" for new in ended),
        dict(Counter(new.rule or new.status for new in ended if new.status != "completed")
             .most_common()),
    )  # fmt: skip


def _stopped(row: Result, name: str) -> bool:
    rules = named_rules(name)
    return row.rule in rules if rules else row.status == "stopped"


LAYERS = {code: f"no stop by {code}, {rule.name}" for code, rule in RULES.items()} | {
    "travel-limit": "the target is not bound to what the force has proved",
    "approach": "no force budget: approach at 10 mm/s all the way",
    "all-but-R1": "a bare threshold: R1 only, no travel limit, no cap, approach at 10 mm/s",
}
"""What can be switched off, each with one line of help."""
FIXED_SPEED_M_S = 0.01
LONGEST_S = 30.0
"""Time after which the operator ends a run, which without a layer may never end."""


def named_rules(name: str) -> frozenset[str]:
    """The rules of "R1" or "R1+R2"; none where the name is that of another layer, or unknown.

    CAP is a layer: the controller keeps to it too, so without it every run changes.
    """
    names = frozenset(name.split("+"))
    return names if names <= frozenset(RULES) - {"CAP"} else frozenset()


def told(name: str) -> str:
    """Description of the missing layer."""
    return LAYERS.get(name) or "; ".join(LAYERS[rule] for rule in name.split("+"))


@dataclass(frozen=True, slots=True)
class Ablation:
    """A campaign without this layer of `LAYERS`, or without several rules, as in "R1+R2"."""

    name: str

    def __post_init__(self) -> None:
        if self.name not in LAYERS and not named_rules(self.name):
            raise BadInputError(
                f"unknown rule or layer {self.name!r}",
                hint=f"one of {', '.join(LAYERS)}, or several rules as in R1+R2",
            )

    @property
    def rules(self) -> frozenset[str]:
        """The rules that are disabled."""
        if names := named_rules(self.name):
            return names
        if self.name == "all-but-R1":
            return frozenset(RULES) - {"R1"}
        return frozenset({"CAP"} & {self.name})

    def limits(self, limits: RunLimits) -> RunLimits:
        """The limits of a run without the layer."""
        if self.name in ("approach", "all-but-R1"):
            limits = replace(
                limits, guarded_speed_m_s=FIXED_SPEED_M_S, fast_speed_m_s=FIXED_SPEED_M_S
            )
        if self.name in ("travel-limit", "all-but-R1"):
            limits = replace(limits, travel_limit_free_m=1.0)
        return limits

    def found(self, rule: str, *rest: Any) -> Trip | None:
        """A trip, unless its rule is disabled; used by the engine in place of `Trip`."""
        return None if rule in self.rules else Trip(rule, *rest)

    def controller(self, limits: RunLimits) -> StepController:
        """A step controller without the layer; used by the engine in place of the product's."""
        if "CAP" in self.rules:
            limits = replace(limits, contact_n_s_per_m=1e-6)
        return StepController(limits, travel_limit=self.name not in ("travel-limit", "all-but-R1"))


def ends_in_time(engine: Engine, longest_s: float = LONGEST_S) -> None:
    """End a run as the operator would after a long time; called as progress."""
    row = engine.row
    if row is not None and row.time_s > longest_s:
        engine.operator.request_stop(StopLevel.NOW)
