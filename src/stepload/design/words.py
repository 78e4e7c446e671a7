"""A design in words: the plan, its expected result, what more time or force would gain."""

from __future__ import annotations

from stepload.design.answers import half_text, narrowing_text
from stepload.design.grid import SHARES
from stepload.design.make import ALIKE, LONGER, Design, choose
from stepload.units import format_quantity


def sentences(found: Design) -> list[str]:
    """Sentences on a design, each item one or two."""
    limit, chosen = found.ceiling, found.chosen
    told = narrowing_text(found.narrowing)
    return [
        f"The plan for {limit.payload} on {limit.rig}: {chosen.text}.",
        f"To expect: a 95 % interval of {half_text(chosen.half_width)} of the chord stiffness.",
        *([f"{told}."] if told else []),
        f"The top force cannot be larger: {limit.why}.",
        _time(found),
        _what_matters(found),
    ]


def _time(found: Design) -> str:
    chosen, longer_s = found.chosen, LONGER * found.within_s
    longest_s = max(each.duration_s for each in found.tried)
    longer = choose(found.tried, longer_s)
    if longest_s <= found.within_s:
        more = f"no plan that was looked at takes longer than {longest_s:.0f} s"
    elif not longer.half_width * ALIKE < chosen.half_width:
        most_s = min(longer_s, longest_s)
        more = f"up to {most_s:.0f} s would narrow the interval by less than {ALIKE - 1.0:.0%}"
    else:
        more = f"{longer.text}, gives {half_text(longer.half_width)}"
    said = f"More time than the {found.within_s:.0f} s given: {more}."
    quick = found.curve[0]
    if quick.duration_s >= chosen.duration_s:
        return said
    return (
        f"{said} With less time: the fastest plan that will do takes {quick.duration_s:.0f} s and "
        f"gives {half_text(quick.half_width)}."
    )


def _what_matters(found: Design) -> str:
    """Effect of the top force on the interval, and of steps and holds."""
    told = []
    for share in sorted(SHARES, reverse=True):
        own = [each for each in found.tried if each.share == share]
        half = [each.half_width for each in own]
        if half:
            top = format_quantity(max(each.top_n for each in own), "N")
            told.append(f"{top}: {half_text(min(half))} to {half_text(max(half))}")
    return f"Half widths by top force, over all steps and holds tried: {'; '.join(told)}."
