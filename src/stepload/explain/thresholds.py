"""Thresholds of a run by the names that `preflight --verbose` and `limits.json` give them."""

from __future__ import annotations

from dataclasses import fields

from stepload.envelope.limits import RunLimits
from stepload.explain.model import Explanation

THRESHOLD = "threshold"
"""Group name of thresholds, which are no codes."""


def thresholds_called(name: str) -> tuple[Explanation, ...]:
    """The threshold with this name, if there is one."""
    return tuple(
        Explanation(
            THRESHOLD,
            each.name,
            f"{each.metadata['source']}"
            + (f" [{each.metadata['unit']}]" if each.metadata["unit"] else "")
            + (f"; rule {each.metadata['rule']} judges by it" if each.metadata["rule"] else "")
            + ".",
            "Nothing: limits.json says what it is in a run, and for the rules' own also"
            " `stepload preflight PLAN --verbose`;"
            " `stepload replay RECORD --limit` judges a record by another.",
            "safety.md",
        )
        for each in fields(RunLimits)
        if each.name == name and "source" in each.metadata
    )
