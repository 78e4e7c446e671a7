"""Tags of a run in addition to those of its plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from stepload.declaration.quantities import Tag
from stepload.errors import BadInputError
from stepload.plan.model import Plan
from stepload.plan.reader import checked

FIELDS = ("specimen", "batch", "operator")
"""A tag `specimen=S7` says which specimen, in place of what the plan says."""


def tagged(plan: Plan, tags: Sequence[str]) -> Plan:
    """The plan with more tags; `specimen=…`, `batch=…` and `operator=…` set those of its record.

    Raises:
        BadInputError: a tag is empty, too long or of more than one line, or sets something twice.
    """
    told: dict[str, Any] = {}
    more: list[str] = []
    for text in tags:
        try:
            tag = checked(Tag, text)
        except BadInputError as error:
            raise BadInputError(f"--tag {text!r}: {error.message}", hint=error.hint) from None
        name, equals, value = (part.strip() for part in tag.partition("="))
        if not equals or name not in FIELDS:
            more.append(tag)
        elif name in told:
            raise BadInputError(f"--tag {tag}: there is {name}={told[name]} already")
        elif not value:
            raise BadInputError(f"--tag {tag}: there is nothing behind the =")
        else:
            told[name] = value
    tags = tuple(dict.fromkeys((*plan.record.tags, *more)))
    return replace(plan, record=replace(plan.record, tags=tags, **told))
