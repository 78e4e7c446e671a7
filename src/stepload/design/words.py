"""A design in words: the plan, its expected result, what more time or force would gain."""

from __future__ import annotations

import math

from stepload.design.answers import Can
from stepload.design.front import ALIKE, choose
from stepload.design.grid import SHARES
from stepload.design.make import LONGER, Design
from stepload.units import format_quantity


def sentences(found: Design) -> list[str]:
    """Sentences on a design, each item one or two."""
    limit = found.ceiling
    return [
        f"The plan for {limit.payload} on {limit.rig}: {found.chosen.candidate.text}.",
        _expected(found),
        f"The top force cannot be larger: {limit.why}.",
        _time(found),
        _what_matters(found),
    ]


def _expected(found: Design) -> str:
    share, half = found.chosen.row.measured, found.chosen.half_width
    covered = found.chosen.row.covered
    return (
        f"To expect: IDENTIFIED, and rightly, in {share.value:.0%} of the runs ({share.low:.0%} to "
        f"{share.high:.0%}), and in half of them with a 95 % interval of ±{half:.1%} of the chord "
        f"stiffness, or a narrower one. In {covered.count} of the {covered.of} simulated runs that "
        "were IDENTIFIED the interval held the truth. Rightly: the stiffness is within 1/t of the "
        "truth (identify.t)."
    )


def _time(found: Design) -> str:
    chosen, longer_s = found.chosen, LONGER * found.within_s
    longest_s = max(each.duration_s for each in found.tried)
    longer = choose(found.again, longer_s)
    if longest_s <= found.within_s:
        more = f"no plan that was looked at takes longer than {longest_s:.0f} s"
    elif longer is None or not longer.half_width * ALIKE < chosen.half_width:
        most_s = min(longer_s, longest_s)
        more = f"up to {most_s:.0f} s would narrow the interval by less than {ALIKE - 1.0:.0%}"
    else:
        more = f"{longer.candidate.text}, gives ±{longer.half_width:.1%}"
    faster = [each for each in found.curve if each.duration_s < chosen.duration_s]
    said = f"More time than the {found.within_s:.0f} s given: {more}."
    if not faster:
        return said
    quick = faster[0]
    return (
        f"{said} With less time: the fastest plan that will do takes {quick.duration_s:.0f} s and "
        f"gives ±{quick.half_width:.1%}."
    )


def _what_matters(found: Design) -> str:
    """Effect of the top force on the interval, and of steps and holds."""
    told = []
    for share in sorted(SHARES, reverse=True):
        own = [each for each in found.tried if each.candidate.share == share]
        half = [each.half_width for each in own if math.isfinite(each.half_width)]
        if not half:
            continue
        top = format_quantity(max(each.candidate.top_n for each in own), "N")
        good = sum(each.can is not Can.NO for each in own)
        told.append(
            f"{top}: ±{min(half):.1%} to ±{max(half):.1%}, {good} of {len(own)} plans not ruled out"
        )
    return f"Half widths by top force, over all steps and holds tried: {'; '.join(told)}."
