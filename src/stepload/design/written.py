"""The file of a designed plan: written, read back, and checked by preflight."""

from __future__ import annotations

import json
import os
import textwrap
from functools import partial
from pathlib import Path

from stepload import __version__
from stepload.design.make import Design
from stepload.design.words import sentences
from stepload.envelope.envelope import envelope_of, refusal_of
from stepload.envelope.order import CYCLES
from stepload.envelope.reason import PlanVerdict
from stepload.errors import printable
from stepload.plan.load import load_plan
from stepload.plan.references import names_a_file
from stepload.plan.room_to_write import check_new

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
        envelope = envelope_of(load_plan(path))
        if envelope.verdict is PlanVerdict.REFUSED:
            raise refusal_of(envelope)
    except BaseException:
        path.unlink()
        raise


def _file(named: Path, home: Path) -> str:
    """A file as named by a plan in `home`."""
    way = Path(os.path.relpath(named.resolve(), home.resolve().parent)).as_posix()
    return json.dumps(way if "/" in way else f"./{way}", ensure_ascii=False)
