"""Removal of rows with failed readings from a curve from elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stepload.estimators.curve_spikes import spikes
from stepload.estimators.fit import FloatArray
from stepload.record.curves import Curve
from stepload.units import format_quantity


def without_glitches(curve: Curve) -> tuple[Curve, list[str]]:
    """The rows without a glitch of force or travel, and notes on the others."""
    travel_m = curve.displacement_m if curve.displacement_m is not None else curve.position_m
    assert travel_m is not None
    off = {"force": spikes(curve.force_n), "travel": spikes(travel_m)}
    bad = off["force"] | off["travel"]
    if not bad.any():
        return curve, []

    def left(values: FloatArray | None) -> FloatArray | None:
        return None if values is None else values[..., ~bad]

    kept = replace(
        curve,
        time_s=left(curve.time_s),
        position_m=left(curve.position_m),
        displacement_m=left(curve.displacement_m),
        force_n=curve.force_n[~bad],
        lateral_n=left(curve.lateral_n),
    )
    first, what = int(np.argmax(bad)), " or ".join(name for name, each in off.items() if each.any())
    rows = "row" if bad.sum() == 1 else "rows"
    return kept, [
        f"{bad.sum()} of {bad.size} {rows} dropped: the {what} jumps away and comes back within "
        f"two samples (first in row {first + 1}, {format_quantity(curve.force_n[first], 'N')})"
    ]
