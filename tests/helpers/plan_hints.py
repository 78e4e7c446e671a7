"""What a hint of a plan speaks of."""

from __future__ import annotations

from typing import Any, get_args

from stepload.declaration.quantities import Quantity


def quantity_in(hint: Any) -> Quantity | None:
    """The quantity that a hint speaks of."""
    if isinstance(hint, Quantity):
        return hint
    found = map(quantity_in, (*get_args(hint), *getattr(hint, "__metadata__", ())))
    return next((each for each in found if each), None)
