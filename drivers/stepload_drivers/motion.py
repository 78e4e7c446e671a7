"""Numbers that become a motion are checked before any of them reaches an arm."""

from __future__ import annotations

import math

from stepload.errors import BadInputError, DeviceError
from stepload.rig.faults import FaultCode


def require_finite_target(position_m: float) -> None:
    """Refuse a position target that is no number.

    Raises:
        DeviceError: NaN or infinite.
    """
    if not math.isfinite(position_m):
        raise DeviceError(
            f"position target {position_m} m is not finite", code=FaultCode.NOT_FINITE
        )


def require_positive(what: str, **values: float) -> None:
    """Refuse a motion whose distance, speed or time is not a positive number.

    Raises:
        BadInputError: zero, negative, NaN or infinite, with the value's name.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise BadInputError(f"{what}: {name} {value} is not a positive number")
