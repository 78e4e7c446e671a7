"""The first sheet of a comparison."""

from __future__ import annotations

from collections.abc import Sequence

import stepload
from stepload.estimators.difference import Difference
from stepload.results.certificate import Facts, few, shared
from stepload.results.comparison import Comparison
from stepload.results.model import (
    Certificate,
    Field,
    Figure,
    first_rows,
    number,
    quantity,
    table,
)
from stepload.results.table_one import table_one

_DIFFERENCE: tuple[Field[Difference], ...] = (
    Field(lambda each: " + ".join(each.first), label="group 1"),
    Field(lambda each: " + ".join(each.second), label="group 2"),
    Field(lambda each: each.quantity, label="of"),
    Field(lambda each: each.from_n or None, label="from", show=quantity("N")),
    Field(lambda each: each.to_n, label="to", show=quantity("N")),
    Field(lambda each: each.relative, label="2 against 1", show=number("+.2%")),
    Field(
        lambda each: f"[{each.interval[0]:+.2%}, {each.interval[1]:+.2%}]", label="95 % interval"
    ),
    Field(lambda each: each.smallest_detectable, label="could show", show=number(".2%")),
    Field(lambda each: each.verdict.value, label="verdict"),
)


def comparison_sheet(
    found: Comparison, reasons: Sequence[str], figure: Figure | None
) -> Certificate:
    """The sheet of a comparison; `figure` is the one with all laws."""
    told = [each.run.metadata for each in found.runs]

    def common(key: str) -> str:
        return shared(each.get(key, "") for each in told)

    what: Facts = [
        ("Payload", common("payload")),
        ("Specimens", common("specimen")),
        ("Batch", common("batch")),
        ("Plan", common("plan")),
        ("Compared", f"{len(told)} runs in {len(found.groups)} groups"),
        ("Tolerance", f"{found.tolerance:.2%} of the stiffness"),
    ]
    rig: Facts = [
        ("Rig", common("rig")),
        ("Arm", common("arm")),
        ("Force sensor", common("force_sensor")),
        ("K_s from", common("calibration")),
        ("Operator", common("operator")),
        ("Days", shared(each.get("started", "")[:10] for each in told)),
    ]
    tables = [table_one(found)]
    if found.differences:
        tables.insert(0, table("Differences", _DIFFERENCE, found.differences))
    return Certificate(
        heading="Comparison of contact stiffness",
        facts=(what, rig),
        tables=[first_rows(each) for each in tables],
        figure=figure,
        remarks=few(reasons),
        signatures=(("Compared by", ""), ("Checked by", "")),
        foot=f"stepload {stepload.__version__} · comparison of {len(told)} runs",
    )
