"""How the contact of a run was made, as an object and as a table."""

from __future__ import annotations

import math

import numpy as np

from stepload.identification.contact_quality import (
    ContactQuality,
    Wrench,
    contact_quality,
    turn_of,
)
from stepload.identification.fit import Missing
from stepload.report.model import Table
from stepload.report.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.units import format_quantity as f
from stepload.units import percent


def wrench_of(data: PressData) -> Wrench | None:
    """The samples in contact with their lateral components; None for a sensor with one axis."""
    if data.across_n is None:
        return None
    mask = data.branch((*LOADING, *UNLOADING))
    phase = data.phase[mask]
    noise_n, torque_noise = data.lateral_noise_n, data.torque_noise_n_m
    torque = None if data.torque_n_m is None else data.torque_n_m[mask, :2]
    return Wrench(
        time_s=data.time_s[mask],
        force_n=data.force_n[mask],
        across_n=data.across_n[mask],
        rising=np.isin(phase, LOADING),
        cycle=data.cycle[mask],
        held=holds_of(phase),
        noise_n=noise_n / math.sqrt(2.0) if math.isfinite(noise_n) else data.noise_n,
        torque_n_m=torque,
        torque_noise_n_m=torque_noise / math.sqrt(2.0) if math.isfinite(torque_noise) else 0.0,
        turn=turn_of(data.axis),
    )


def quality_of(data: PressData, lever_m: float | None) -> ContactQuality | Missing:
    """Evaluate how the contact of a run was made."""
    return contact_quality(wrench_of(data), lever_m)


def summary(found: ContactQuality | Missing) -> str:
    """One line for people; "" where the sensor has no lateral axes."""
    if isinstance(found, Missing):
        return ""
    slips = len(found.slips)
    slipped = f"{slips} slip event{'s' if slips > 1 else ''}" if slips else "no slip event"
    parts = [f"lateral force {percent(found.branches[0].size, 2)} of that along it", slipped]
    if not isinstance(found.place, Missing):
        parts.append(f"touched {f(found.place.size_m, 'm', 2)} beside the axis")
    return f"contact: {', '.join(parts)}"


def quality_table(found: ContactQuality) -> Table:
    """Sentences on the contact for people."""
    rows = [
        (
            f"cycle {branch.cycle}, {_way(branch.rising)}",
            f"{percent(branch.size, 2)} of the force along the axis"
            " ({:+.1f} % and {:+.1f} % along the sensor's two other axes)".format(
                *(100.0 * each for each in branch.share)
            ),
        )
        for branch in found.branches
    ]
    rows += [
        (
            f"slip in cycle {slip.cycle}",
            f"the force across jumped by {f(slip.jump_n, 'N', 2)} at {f(slip.force_n, 'N')} while "
            + _way(slip.rising),
        )
        for slip in found.slips
    ]
    rows.append(("slip that might not be seen", f"up to {f(found.undetected_n, 'N', 2)}"))
    if isinstance(found.place, Missing):
        place = found.place.why
    else:
        x, y = (f(each, "m", 2) for each in found.place.beside_m)
        place = (
            f"{x} and {y} beside the sensor's axis, each ± {f(found.place.sigma_m, 'm', 2)} by "
            f"noise alone, at {f(found.place.force_n, 'N')}"
        )
    rows.append(("place of the contact", place))
    return Table("How the contact was made", ("of", "what was seen"), rows, page_only=True)


def _way(rising: bool) -> str:
    return "loading" if rising else "unloading"
