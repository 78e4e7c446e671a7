"""What options a driver takes, declared as data so that plans check without a device."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

OptionKind = Literal["text", "integer", "number", "boolean", "quantity", "vector"]


@dataclass(frozen=True, slots=True)
class Option:
    """One option of a driver.

    Args:
        kind: what a plan may write. "quantity" is a number with a unit of dimension `unit`;
            "vector" a list of three plain numbers.
        help: one line for the reference.
        unit: SI unit the driver gets it in ("m", "N", "s", "Hz"); only for quantities.
        default: value when the plan says nothing; `required` when there is none.
        low, high: inclusive limits, in `unit`.
        choices: allowed texts, for "text".
        required: the plan must give it.
    """

    kind: OptionKind
    help: str
    unit: str = ""
    default: object = None
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    required: bool = False
