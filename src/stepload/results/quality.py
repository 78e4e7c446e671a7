"""How the contact of a run was made, as an object and as words for people."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from stepload.estimators.contact_quality import ContactQuality, contact_quality
from stepload.estimators.fit import Missing
from stepload.estimators.lateral import Wrench, turn_of
from stepload.results.figures import BLUE, GREEN, ORANGE, RED, SAND, Line, lines
from stepload.results.model import Figure, Table
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
    keys = ("share", "branches", "loop", "share_change", "share_change_sigma", "slips",
            "unseen_slip_n", "points", "points_missing")  # fmt: skip
    if isinstance(found, Missing):
        return {"missing": found.why, **dict.fromkeys(keys)}
    branches = [
        {"loading": each.rising}
        | {key: getattr(each, key) for key in ("cycle", "median", "force_n", "share", "sigma")}
        for each in found.branches
    ]
    points = None if isinstance(found.points, Missing) else found.points
    values = (found.share, branches, found.loop, *(found.change or (None, None)), found.slips,
              found.unseen_n, points, _why(found))  # fmt: skip
    return {"missing": "", **dict(zip(keys, values, strict=True))}


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
    """How the contact was made, in words."""
    rows = [
        (
            f"cycle {branch.cycle}, {'loading' if branch.rising else 'unloading'}",
            f"{branch.size:.1%} of the force along the axis, median over the forces"
            f" ({branch.median[0]:+.1%} and {branch.median[1]:+.1%} along the two other axes)",
        )
        for branch in found.branches
    ]
    loop, place = found.loop, _why(found)
    if loop.at_half is not None:
        said = ": the contact slides, or its edge slips" if loop.friction else ""
        rows.append(
            ("difference at half the top force", f"{loop.at_half:.1%} ± {loop.sigma:.1%}{said}")
        )
    if found.change is not None:
        rows.append(("change from cycle 1 to 2", "{:.1%} ± {:.1%}".format(*found.change)))
    rows += [
        (
            f"slip in cycle {slip.cycle}",
            f"the force across jumped by {f(slip.jump_n, 'N', 2)} at {f(slip.force_n, 'N')} while "
            + ("loading" if slip.rising else "unloading"),
        )
        for slip in found.slips
    ]
    rows.append(("slip that might not be seen", f"up to {f(found.unseen_n, 'N', 2)}"))
    if (point := found.eccentric) is not None:
        x, y = (f(each, "m", 2) for each in point.beside_m)
        place = (
            f"{x} and {y} beside the sensor's axis, each ± {f(point.sigma_m, 'm', 2)} by noise "
            f"alone, at {f(point.force_n, 'N')}"
        )
    rows.append(("place of the contact", place))
    return Table("How the contact was made", ("of", "what was seen"), rows, page_only=True)


def share_over_force(found: ContactQuality) -> str:
    """Both components of the share in the first two cycles; slips as marks at the bottom."""
    curves, cycles = list[Line](), sorted({branch.cycle for branch in found.branches})[:2]
    for branch in found.branches:
        if branch.cycle not in cycles:
            continue
        first, way = branch.cycle == cycles[0], "loading" if branch.rising else "unloading"
        for axis, name in enumerate(("first", "second")):
            style = {
                "color": (BLUE, GREEN, ORANGE, SAND)[axis + 2 * (not branch.rising)],
                "ms": 3.0 if first else 2.0,
                "label": f"{way}, {name} axis across" if first else None,
            }
            share, half = branch.share[:, axis], 2.0 * branch.sigma
            form = "o-" if first else "o:"
            curves.append((branch.force_n, 100.0 * share, form, style))
            if first:
                thin = {"color": style["color"], "lw": 0.6}
                for edge in (share - half, share + half):
                    curves.append((branch.force_n, 100.0 * edge, ":", thin))
    low = min((float(np.min(y)) for _, y, _, _ in curves), default=0.0)
    for rising, mark, way in ((True, "^", "loading"), (False, "v", "unloading")):
        at_n = np.array([slip.force_n for slip in found.slips if slip.rising == rising])
        if at_n.size:
            style = {"color": RED, "ms": 7, "label": f"slip while {way}"}
            curves.append((at_n, np.full_like(at_n, low), mark, style))
    return lines(curves, "force along the axis [N]", "force across [% of it]", zero=True)


def quality_figure(found: ContactQuality) -> Figure:
    """The figure with its caption."""
    return Figure(
        "contact", "Lateral force",
        "Force along the sensor's two axes across, as a share of that along the pressing axis, "
        "within twice the standard uncertainty by noise; dotted: the second cycle. Loading and "
        "unloading that differ are sliding friction.",
        "share of the lateral force over the force",
        partial(share_over_force, found),
    )  # fmt: skip
