"""Design of a plan: simulate every plan of the grid, judge the best ones again, choose."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from stepload.design.answers import REQUIRED, Can, gain
from stepload.design.atlas import CHECK_EVERY, Start
from stepload.design.ceiling import Ceiling, ceiling
from stepload.design.changes import AS_IT_IS, BY_A_TABLE, for_sale
from stepload.design.front import Tried, choose, finalists, front
from stepload.design.grid import HOLDS_S, SHARES, STEPS, Candidate, Grid, grid
from stepload.design.work import Row, Work, run_all
from stepload.envelope.order import Order
from stepload.errors import RefusedError
from stepload.runner.pool import Pool

AGAIN = 4
"""The best plans are judged again with this multiple of runs, all of them new."""
LONGER = 2.0
"""Plans up to this multiple of the given time are tried, to show what more time would gain."""
CALIBRATE = "stepload calibrate measures that table, in the pose of the experiment"


@dataclass(frozen=True, slots=True)
class Design:
    """A designed plan, and the plans that it was chosen from.

    Attributes:
        ceiling: the largest top force and its reason.
        within_s: time that was given.
        grid: the plans that were looked at.
        tried: their results.
        again: the best ones, judged again.
        chosen: the plan.
        seed, samples: of the draws.
    """

    ceiling: Ceiling
    within_s: float
    grid: Grid
    tried: Sequence[Tried]
    again: Sequence[Tried]
    chosen: Tried
    seed: int
    samples: int

    @property
    def curve(self) -> list[Tried]:
        """Time against half width: the front of the plans that were judged again."""
        return front([each for each in self.again if each.can is self.chosen.can])

    @property
    def rows(self) -> list[Row]:
        """Every row, of both rounds."""
        return [each.row for each in (*self.tried, *self.again)]


def design(
    rig: str,
    payload: Path,
    *,
    within_s: float,
    surface: str,
    samples: int,
    seed: int,
    pool: Pool,
    on_start: Start | None = None,
) -> Design:
    """The plan with the narrowest interval, below F_c and within a time.

    Args:
        rig: a profile that comes with stepload, or a rig file.
        payload: a payload file.
        within_s: largest duration of the plan, as computed by preflight.
        surface: travel to the surface, with its unit.
        samples: simulated runs of each plan of the grid.
        seed: the same seed gives the same plan, whatever the number of processes.
        pool: the worker pool.
        on_start: called with the number of plans before they are tried.

    Raises:
        BadInputError: no such rig or payload.
        PlanError: one of their files is invalid.
        RefusedError: no plan is fast enough, or none was shown to be IDENTIFIED often enough.
    """
    limit = ceiling(rig, payload, Order(min(STEPS), max(HOLDS_S)))
    found = grid(rig, payload, limit, surface)
    soon = [each for each in found.candidates if each.duration_s <= LONGER * within_s]
    map_verb = shlex.join(["stepload", "map", rig, "--payload", str(payload)])
    _check_time(limit, found, within_s, map_verb)
    if on_start is not None:
        on_start(len(soon))
    tried = _try(soon, Work(seed, samples, CHECK_EVERY), pool)
    best = [each.candidate for each in finalists(tried)]
    final = Work(seed + 1, AGAIN * samples, 1)
    again = _try(best, final, pool)
    chosen = choose(again, within_s)
    if chosen is None:
        raise _refusal(limit, tried, again, within_s, final, pool)
    return Design(limit, within_s, found, tried, again, chosen, seed, samples)


def _try(candidates: Sequence[Candidate], work: Work, pool: Pool) -> list[Tried]:
    cells = [each.point(index, each.conditions) for index, each in enumerate(candidates)]
    rows = run_all(work, cells, pool)
    return [Tried(each, row) for each, row in zip(candidates, rows, strict=True)]


def _check_time(limit: Ceiling, found: Grid, within_s: float, map_verb: str) -> None:
    """Refuse where no plan may run, or none is fast enough."""
    if not found.candidates:
        raise RefusedError(
            f"none of {found.refused} plans for {limit.payload} on {limit.rig} will do: preflight "
            "refuses it, or says that a level may not be reached. About the one with the largest "
            f"top force it says: {found.because}",
            hint=found.hint or f"{map_verb} says what to buy",
        )
    fastest = min(found.candidates, key=lambda each: each.duration_s)
    if fastest.duration_s > within_s:
        raise RefusedError(
            f"no plan for {limit.payload} on {limit.rig} takes only {within_s:.0f} s: the fastest "
            f"one that was looked at is {fastest.text}",
            hint="give a longer --time, or begin nearer to the surface (--surface-distance)",
        )


def _refusal(
    limit: Ceiling,
    tried: Sequence[Tried],
    again: Sequence[Tried],
    within_s: float,
    work: Work,
    pool: Pool,
) -> RefusedError:
    """Why there is no plan, and what to buy."""
    what = f"no plan for {limit.payload} on {limit.rig} that takes {within_s:.0f} s or less"
    later = choose(again, LONGER * within_s)
    if later is not None:
        return RefusedError(
            f"{what} was shown to be rightly IDENTIFIED in {REQUIRED:.0%} of its runs",
            hint=f"give it more --time: {later.candidate.text}, {later.text}",
        )
    soon = [each for each in tried if each.duration_s <= within_s]
    kept = [max(soon, key=lambda each: gain(each.row)).candidate]
    for share in SHARES:
        best = _best(soon, share)
        if best is not None and best not in kept:
            kept.append(best)
    changes = for_sale(kept[0].conditions)
    cells = [
        each.point(index, change(each.conditions), name)
        for index, (each, (name, change)) in enumerate(product(kept, changes.items()))
    ]
    rows = run_all(work, cells, pool)
    found = [Tried(each, row) for (each, _), row in zip(product(kept, changes), rows, strict=True)]
    own = max((e for e in found if e.row.point.change == AS_IT_IS), key=_gain)
    return RefusedError(
        f"{what} was shown to be rightly IDENTIFIED in {REQUIRED:.0%} of its runs; the best is "
        f"{own.candidate.text}, {own.text}",
        hint=_to_buy(own, found, limit),
    )


def _gain(each: Tried) -> tuple[float, float]:
    return gain(each.row)


def _best(tried: Sequence[Tried], share: float) -> Candidate | None:
    """The plan of a top force with the narrowest interval, or the one that is right most often."""
    own = [each for each in tried if each.candidate.share == share]
    best = min(own, key=lambda each: (each.half_width, -each.row.measured.low), default=None)
    return best.candidate if best is not None else None


def _to_buy(own: Tried, found: Sequence[Tried], limit: Ceiling) -> str:
    """What would change the refusal, as a sentence."""
    if own.can is Can.UNSURE:
        return "so few runs do not show it either way: more --samples would tell"
    changed: dict[str, Tried] = {}
    for each in found:
        name = each.row.point.change
        changed[name] = max((changed.get(name, each), each), key=_gain)
    enough = [_changed(each) for each in changed.values() if each.can is Can.YES]
    if enough:
        return f"any one of these would do: {'; or '.join(enough)}"
    best = max(found, key=_gain)
    if _gain(best) > _gain(own):
        return f"no single change will do; most is gained by {_changed(best)}; {limit.why}"
    return f"none of the changes looked at gains anything; {limit.why}"


def _changed(each: Tried) -> str:
    name = each.row.point.change
    table = f"; {CALIBRATE}" if name.endswith(BY_A_TABLE) else ""
    return f"{name} ({each.candidate.text}, {each.text}{table})"
