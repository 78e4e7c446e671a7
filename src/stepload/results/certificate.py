"""The first sheet of a run's report."""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.evidence.identification import Identification
from stepload.results import fields
from stepload.results.analyse import Evaluation
from stepload.results.facts import Facts, rig_facts, short, specimen_facts
from stepload.results.level_tables import sheet_table
from stepload.results.levels import Level
from stepload.results.model import Certificate, Figure, Table
from stepload.results.quality import summary

MOST_REMARKS, LONGEST_REMARK = 3, 170
"""Largest number of reasons on the first sheet; all of them are on the next."""


def run_certificate(
    run: Evaluation,
    levels: Sequence[Level],
    reasons: Sequence[str],
    law: Figure | None,
    system: Table | None,
) -> Certificate:
    """The sheet of a run.

    Args:
        run: its evaluation.
        levels: its holds.
        reasons: all remarks on the result.
        law: the figure that shows the result; None where there is none.
        system: the table of the system stiffness where the run measures that.
    """
    envelope, recording = run.envelope, run.recording
    tables = []
    if run.identification is not None:
        tables.append(numbers_table(run.identification))
    if system is not None:
        tables.append(system)
    beside = None
    if levels and run.data is not None:
        arm, gauge = envelope.plan.rig.arm, envelope.plan.rig.displacement
        resolution_m = gauge.resolution_m if gauge else arm.position_resolution_m
        way = "travel" if run.system is not None else "deformation"
        beside = sheet_table(levels, run.data.touches, resolution_m, way)
    told = recording.metadata
    operator = short(told.get("operator", ""))[:60]
    return Certificate(
        heading="Test report: system stiffness of a rig"
        if envelope.plan.identify.kind == "system"
        else "Test report: contact stiffness of a payload",
        facts=(
            specimen_facts(envelope, recording, run.identification),
            [*rig_facts(envelope, recording, run.identification), *_contact(run.identification)],
        ),
        tables=tables,
        levels=beside,
        figure=law,
        remarks=few(reasons),
        signatures=(("Operator", operator), ("Checked by", "")),
        foot=f"stepload {told.get('stepload', '')} · run {told.get('run_id') or 'without an id'}",
    )


def _contact(found: Identification | None) -> Facts:
    """How the contact was made, where the run recorded it."""
    line = "" if found is None else summary(found.run.askew.quality).removeprefix("contact: ")
    return [("Contact", line)] if line else []


def few(reasons: Sequence[str]) -> list[str]:
    """The first reasons, shortened, and how many more there are."""
    shown = [short(reason, LONGEST_REMARK) for reason in reasons[:MOST_REMARKS]]
    cut = any(len(reason) > len(each) for reason, each in zip(reasons, shown, strict=False))
    left = len(reasons) - len(shown)
    if left or cut:
        more = f"{left} more" if left else "In full"
        shown.append(f"{more} below, under what is to be said about this result.")
    return shown


def numbers_table(found: Identification) -> Table:
    """Every stiffness with its interval, and the exponent."""
    columns = ("result", "from", "to", "value", "95 % interval", "half width", "verdict")
    shown = [each for each in fields.QUANTITY if each.label]
    rows = [[each.text(item) for each in shown] for item in found.quantities.values()]
    evidence = found.evidence
    if evidence is not None and (n := evidence.exponent) is not None:
        low, high = n.interval
        known = math.isfinite(low) and math.isfinite(high)
        rows.append(
            ["exponent n (2)", "touch", rows[0][2] if rows else "", f"{n.value:.2f}",
             f"[{low:.2f}, {high:.2f}]" if known else "none", "", n.verdict.value]
        )  # fmt: skip
    return Table("Result, secants by (28)", columns, rows)
