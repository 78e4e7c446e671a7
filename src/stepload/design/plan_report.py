"""A design in words: the plan, its expected result, what more time or force would gain."""

from __future__ import annotations

import json
import os
import textwrap
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from stepload import __version__
from stepload.design.map_report import half_text, narrowing_text
from stepload.design.plan_design import ALIKE, LONGER, SHARES, Candidate, Design, choose
from stepload.errors import printable
from stepload.feasibility.draft_plan import CYCLES
from stepload.feasibility.preflight import preflight_of, refusal_of
from stepload.feasibility.reason import PlanVerdict
from stepload.plan.load import load_plan
from stepload.plan.references import names_a_file
from stepload.plan.room_to_write import check_new
from stepload.report.model import Table
from stepload.units import format_quantity, percent


def sentences(found: Design) -> list[str]:
    """Sentences on a design, each item one or two."""
    limit, chosen = found.ceiling, found.chosen
    told = narrowing_text(found.chosen.expected.narrowing)
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
        more = (
            f"up to {most_s:.0f} s would narrow the interval by less than {percent(ALIKE - 1.0, 2)}"
        )
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


def curve_table(found: Design) -> Table:
    """Time against half width."""
    rows = [
        (
            f"{each.duration_s:.0f} s" + (" *" if each is found.chosen else ""),
            format_quantity(each.top_n, "N"),
            str(each.order.steps),
            f"{each.order.ramp_s:g} s",
            f"{each.order.hold_s:g} s",
            half_text(each.half_width),
        )
        for each in found.curve
    ]
    columns = ("time", "top force", "steps", "ramp", "hold", "half width")
    return Table("What time buys (* the plan that was chosen)", columns, rows)


def data(found: Design) -> dict[str, Any]:
    """The JSON object of a design."""
    limit = found.ceiling
    return {
        "payload": limit.payload,
        "rig": limit.rig,
        "time_s": found.within_s,
        "largest_top_force_n": limit.top_n,
        "why_no_larger": limit.why,
        "refused": found.grid.refused,
        "answers": sentences(found),
        "chosen": tried(found.chosen),
        "narrowing": [asdict(each) for each in found.chosen.expected.narrowing],
        "curve": [tried(each) for each in found.curve],
        "plans": [tried(each) for each in found.tried],
    }


def tried(each: Candidate) -> dict[str, Any]:
    """A plan and its result, as flat columns."""
    return {
        "top_force_n": each.top_n,
        "step_n": each.step_n,
        "steps": each.order.steps,
        "ramp_s": each.order.ramp_s,
        "hold_s": each.order.hold_s,
        "cycles": CYCLES,
        "duration_s": each.duration_s,
        "half_width": each.half_width,
        "can": "yes" if each.can else "no",
    }


LONGEST = 96
"""Characters of a line of the comment."""


def text_of(found: Design, path: Path, payload: Path, rig: str, surface: str, command: str) -> str:
    """The plan as text for the file `path`; other files are named relative to it."""
    plan = found.chosen
    wrapped = partial(textwrap.wrap, width=LONGEST, break_long_words=False, break_on_hyphens=False)
    lines = [
        "# Designed by its expected interval. Made by:",
        f"#   {printable(command, 400)}",
        f"# (stepload {__version__}).",
        *(f"# {line}" for each in sentences(found)[:3] for line in wrapped(printable(each, 900))),
        "stepload: 1",
        f"payload: {_file(payload, path)}",
    ]
    if names_a_file(rig):
        lines.append(f"rig: {_file(Path(rig), path)}")
    else:
        lines += [
            "rig:",
            f"  profile: {rig}",
            "  arm: {driver: sim} # simulated: name the drivers of your devices to press",
            "  force: {driver: sim}",
        ]
    lines += [
        "procedure:",
        f"  step: {plan.step_n:.12g} N",
        f"  top_force: {plan.top_n:.12g} N",
        f"  load_rate: {plan.step_n / plan.order.ramp_s:.12g} N/s",
        f"  hold: {plan.order.hold_s:g} s",
        f"  cycles: {CYCLES}",
        f"  surface_distance: {surface}",
    ]
    return "\n".join(lines) + "\n"


def write(path: Path, text: str) -> None:
    """Write the plan to a new file; it is removed if preflight refuses it.

    Raises:
        BadInputError: the file exists by now, or the text is not a plan.
        RefusedError: preflight refuses it.
    """
    check_new("--out", path)
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
    try:
        preflight = preflight_of(load_plan(path))
        if preflight.verdict is PlanVerdict.REFUSED:
            raise refusal_of(preflight)
    except BaseException:
        path.unlink()
        raise


def _file(named: Path, home: Path) -> str:
    """A file as named by a plan in `home`."""
    way = Path(os.path.relpath(named.resolve(), home.resolve().parent)).as_posix()
    return json.dumps(way if "/" in way else f"./{way}", ensure_ascii=False)
