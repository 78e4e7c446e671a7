"""Counting: of what is called IDENTIFIED how much is true, and how much is called so at all."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from stepload_verify.trials.honest.answer import QUANTITIES, Outcome, Scored

OVERALL, PER_WORLD, IDEAL = 0.95, 0.90, 0.90
"""Least shares: true ones of all identified, the same in each world, identified of the ideal."""
ENOUGH = 50
"""From this number of identified runs on, the share of a world is judged by itself."""
SHOWN = 12
_Z = 1.959964


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927); (0, 1) of nothing."""
    if of == 0:
        return 0.0, 1.0
    share, unit = hits / of, _Z**2 / of
    centre = (share + unit / 2.0) / (1.0 + unit)
    half = _Z / (1.0 + unit) * math.sqrt(share * (1.0 - share) / of + unit / (4.0 * of))
    return max(centre - half, 0.0), min(centre + half, 1.0)


@dataclass(frozen=True, slots=True)
class Row:
    """One world, or several, and one quantity.

    `stated` counts answers of any verdict, `held` those of them that are true, `identified` and
    `true` the believed ones; `half_width` and `bias` are medians over the believed ones. What is
    wrong in a row that is `unseen` leaves no trace in any record: such a row counts in the total,
    but it is marked and need not reach a share of its own.
    """

    name: str
    runs: int
    refused: int
    stated: int
    held: int
    identified: int
    true: int
    half_width: float
    bias: float
    undetected: bool = False

    @property
    def coverage(self) -> float:
        """True ones of the identified; NaN of none."""
        return self.true / self.identified if self.identified else math.nan

    def less_than(self, least: float) -> bool:
        """Whether fewer are true than must be; of few runs only where chance cannot explain it."""
        if self.identified < ENOUGH:
            return wilson(self.true, self.identified)[1] < least
        return self.coverage < least


def _median(values: Iterable[float]) -> float:
    ordered = sorted(values)
    if not ordered:
        return math.nan
    middle = len(ordered) // 2
    return ordered[middle] if len(ordered) % 2 else 0.5 * (ordered[middle - 1] + ordered[middle])


def row(name: str, outcomes: Sequence[Outcome], quantity: str) -> Row:
    """Count the answers for one quantity."""
    found = [each for outcome in outcomes for each in outcome.scored if each.quantity == quantity]
    expected = [each for each in found if each.expected]
    return Row(
        name=name,
        runs=len(outcomes),
        refused=sum(not outcome.scored for outcome in outcomes),
        stated=len(found),
        held=sum(each.true for each in found),
        identified=len(expected),
        true=sum(each.true for each in expected),
        half_width=_median(each.answer.half_width for each in expected),
        bias=_median(each.off for each in expected if not math.isnan(each.off)),
        undetected=bool(outcomes) and all(outcome.undetected for outcome in outcomes),
    )


HEADER = (
    f"{'':20s} {'runs':>5s} {'refused':>7s} {'held':>6s} {'called':>7s}  "
    f"{'true of called':>14s} {'95 %':>13s} {'half width':>10s} {'bias':>7s}"
)


def line(counted: Row, least: float | None = None) -> str:
    """A row as text, with a mark where fewer than `least` of the called ones are true."""
    low, high = wilson(counted.true, counted.identified)
    held = counted.held / counted.stated if counted.stated else math.nan
    called = counted.identified / counted.runs if counted.runs else math.nan
    poor = least is not None and counted.identified > 0 and counted.coverage < least
    mark = ("  !!" if counted.less_than(least) else "  !") if poor and least is not None else ""
    mark += "  (leaves no trace)" if counted.undetected else ""
    return (
        f"{counted.name:20s} {counted.runs:5d} {counted.refused:7d} {held:6.3f} {called:7.3f}  "
        f"{counted.true:5d}/{counted.identified:<4d} {counted.coverage:5.3f} "
        f"{low:.3f}..{high:.3f} {100 * counted.half_width:8.1f} % "
        f"{100 * counted.bias:+6.1f} %{mark}"
    )


def worst(outcomes: Sequence[Outcome], quantity: str) -> list[tuple[Outcome, Scored]]:
    """What is called identified and is not true, the farthest outside its interval first."""
    false = [
        (outcome, each)
        for outcome in outcomes
        for each in outcome.scored
        if each.quantity == quantity and each.expected and not each.true
    ]

    def distance(pair: tuple[Outcome, Scored]) -> float:
        each = pair[1]
        half = max(each.answer.half_width, 1e-9)
        return math.inf if math.isnan(each.off) else abs(each.off) / half

    return sorted(false, key=distance, reverse=True)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Counts for one quantity; `met` says whether its shares are as large as required."""

    quantity: str
    overall: Row
    seen: Row
    ideal: Row
    worlds: tuple[Row, ...]

    @property
    def met(self) -> bool:
        """Overall, ideal and per-world shares as wanted."""
        return (
            not self.overall.less_than(OVERALL if len(self.worlds) > 1 else PER_WORLD)
            and self.ideal.identified >= IDEAL * self.ideal.runs
            and not any(each.less_than(PER_WORLD) for each in self.worlds if not each.undetected)
        )


def verdict(outcomes: Sequence[Outcome], quantity: str) -> Verdict:
    """Count one quantity over all, over what can be seen, over the ideal ones, and per world."""
    names = list(dict.fromkeys(outcome.world for outcome in outcomes))
    worlds = [
        row(name, [outcome for outcome in outcomes if outcome.world == name], quantity)
        for name in names
    ]
    return Verdict(
        quantity,
        row("all", outcomes, quantity),
        row("all that can be seen", [each for each in outcomes if not each.undetected], quantity),
        row("ideal", [each for each in outcomes if each.ideal], quantity),
        tuple(worlds),
    )


def report(outcomes: Sequence[Outcome]) -> str:
    """The tables and the worst false ones."""
    lines = []
    for quantity in QUANTITIES:
        if not any(each.quantity == quantity for outcome in outcomes for each in outcome.scored):
            continue
        found = verdict(outcomes, quantity)
        lines += [f"\n{quantity}: {'met' if found.met else 'NOT MET'}", HEADER]
        lines += [line(each, PER_WORLD) for each in found.worlds if each.stated]
        lines += [line(found.ideal), line(found.seen, OVERALL), line(found.overall, OVERALL)]
        lines += [_false(*pair) for pair in worst(outcomes, quantity)[:SHOWN]]
    broken = [each for each in outcomes if each.broken]
    lines += [f"broken: {name(each)}\n{each.problem}" for each in broken]
    return "\n".join(lines)


def name(outcome: Outcome) -> str:
    """Options of the command line that repeat a case."""
    return f"--world {outcome.world} --seed {outcome.seed}"


def _false(outcome: Outcome, each: Scored) -> str:
    half = each.answer.half_width
    return (
        f"  false: {name(outcome):44s} {100 * each.off:+6.1f} % (± {100 * half:.1f} %) "
        f"{outcome.family}, {outcome.top_n:.3g} N; {outcome.story}"
    )
