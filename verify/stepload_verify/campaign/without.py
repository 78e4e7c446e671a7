"""Effect of removing a layer, compared with the same runs with everything in place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from stepload.runner.jobs import Job
from stepload_verify.campaign.ablation import named_rules
from stepload_verify.campaign.result import Result
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
