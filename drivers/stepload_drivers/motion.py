"""Checks of all numbers that become a motion, before any of them reaches an arm."""

from __future__ import annotations

import math

from stepload.errors import BadInputError, DeviceError
from stepload.rig.device import LARGEST_SHIFT_M
from stepload.rig.faults import FaultCode

Shift = tuple[float, float]
NO_SHIFT: Shift = (0.0, 0.0)


def require_finite_target(position_m: float) -> None:
    """Refuse a position target that is no number.

    Raises:
        DeviceError: NaN or infinite.
    """
    if not math.isfinite(position_m):
        raise DeviceError(
            f"position target {position_m} m is not finite", code=FaultCode.NOT_FINITE
        )


def require_shift(shift_m: Shift, from_m: Shift, lead_m: float) -> None:
    """Refuse a shift across the approach that no arm may be sent.

    Args:
        shift_m: what is asked for.
        from_m: the last shift that was asked for.
        lead_m: largest distance of the new one from it.

    Raises:
        DeviceError: not finite, beyond `LARGEST_SHIFT_M`, or too far ahead.
    """
    if shift_m == from_m == NO_SHIFT:
        return
    x_m, y_m = shift_m
    if not (math.isfinite(x_m) and math.isfinite(y_m)):
        raise DeviceError(f"shift {shift_m} m is not finite", code=FaultCode.NOT_FINITE)
    ahead_m = math.dist(shift_m, from_m)
    for way_m, limit_m, what in (
        (math.hypot(x_m, y_m), LARGEST_SHIFT_M * (1.0 + 1e-9), "off the approach axis"),
        (ahead_m, lead_m, "ahead of the arm or of its last target"),
    ):
        if way_m > limit_m:
            raise DeviceError(
                f"shift {way_m * 1e3:.2f} mm {what}, limit {limit_m * 1e3:.2f} mm",
                code=FaultCode.OUT_OF_RANGE,
                hint="shift in smaller steps, or touch on a smaller circle",
            )


def require_positive(what: str, **values: float) -> None:
    """Refuse a motion whose distance, speed or time is not a positive number.

    Raises:
        BadInputError: zero, negative, NaN or infinite, with the value's name.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise BadInputError(f"{what}: {name} {value} is not a positive number")
