"""How the contact of a run was made, as an object and as words for people."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from stepload.estimators.contact_quality import ContactQuality, contact_quality
from stepload.estimators.fit import Missing
from stepload.estimators.lateral import BranchShare, Wrench, turn_of
from stepload.results.model import Table
from stepload.results.press_data import LOADING, UNLOADING, PressData, holds_of
from stepload.units import format_quantity as f


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


def quality_data(found: ContactQuality | Missing) -> dict[str, Any]:
    """The object for programs: `missing` says why there is no result; all else is then null."""
    if isinstance(found, Missing):
        keys = ("share", "branches", "loop", "share_change", "share_change_sigma", "slips",
                "unseen_slip_n", "points", "points_missing")  # fmt: skip
        return {"missing": found.why, **dict.fromkeys(keys)}
    change, sigma = found.change or (None, None)
    return {
        "missing": "",
        "share": found.share,
        "branches": [_branch(branch) for branch in found.branches],
        "loop": asdict(found.loop),
        "share_change": change,
        "share_change_sigma": sigma,
        "slips": [asdict(slip) for slip in found.slips],
        "unseen_slip_n": found.unseen_n,
        "points": None if isinstance(found.points, Missing) else [asdict(p) for p in found.points],
        "points_missing": _why(found),
    }


def _branch(branch: BranchShare) -> dict[str, Any]:
    return {
        "cycle": branch.cycle,
        "loading": branch.rising,
        "median": branch.median.tolist(),
        "force_n": branch.force_n.tolist(),
        "share": branch.share.tolist(),
        "sigma": branch.sigma.tolist(),
    }


def _why(found: ContactQuality) -> str:
    return found.points.why if isinstance(found.points, Missing) else ""


def summary(found: ContactQuality | Missing) -> str:
    """One line for people; "" where the sensor has no lateral axes."""
    if isinstance(found, Missing):
        return ""
    slips = len(found.slips)
    slipped = f"{slips} slip event{'s' if slips > 1 else ''}" if slips else "no slip event"
    parts = [f"lateral force {found.share:.1%} of that along it", slipped]
    if found.loop.friction:
        parts.insert(1, "a friction loop")
    if (point := found.eccentric) is not None:
        parts.append(f"touched {f(point.size_m, 'm', 2)} beside the axis")
    return f"contact: {', '.join(parts)}"


def quality_table(found: ContactQuality) -> Table:
    """Sentences on the contact for people."""
    rows = [(_name(branch), _share(branch)) for branch in found.branches]
    loop = found.loop
    if loop.at_half is not None:
        said = ": the contact slides, or its edge slips" if loop.friction else ""
        rows.append(
            ("difference at half the top force", f"{loop.at_half:.1%} ± {loop.sigma:.1%}{said}")
        )
    if found.change is not None:
        change, sigma = found.change
        rows.append(("change from cycle 1 to 2", f"{change:.1%} ± {sigma:.1%}"))
    rows += [
        (
            f"slip in cycle {slip.cycle}",
            f"the force across jumped by {f(slip.jump_n, 'N', 2)} at {f(slip.force_n, 'N')} while "
            + ("loading" if slip.rising else "unloading"),
        )
        for slip in found.slips
    ]
    if not found.slips:
        rows.append(("slip", "none was seen"))
    rows.append(("slip that might not be seen", f"up to {f(found.unseen_n, 'N', 2)}"))
    if (point := found.eccentric) is None:
        rows.append(("place of the contact", _why(found)))
    else:
        x, y = (f(each, "m", 2) for each in point.beside_m)
        rows.append(
            (
                "place of the contact",
                f"{x} and {y} beside the sensor's axis, each ± {f(point.sigma_m, 'm', 2)} by "
                f"noise alone, at {f(point.force_n, 'N')}",
            )
        )
    return Table("How the contact was made", ("of", "what was seen"), rows, page_only=True)


def _name(branch: BranchShare) -> str:
    return f"cycle {branch.cycle}, {'loading' if branch.rising else 'unloading'}"


def _share(branch: BranchShare) -> str:
    x, y = branch.median
    return (
        f"{branch.size:.1%} of the force along the axis, median over the forces ({x:+.1%} and "
        f"{y:+.1%} along the sensor's two other axes)"
    )
