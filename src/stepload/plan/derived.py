"""Values that follow from others where the plan does not give them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from stepload.contact.elastic import law_for
from stepload.errors import DomainError
from stepload.plan.model import Payload
from stepload.plan.validate import Values

MAX_LEVELS = 1000
RAMP_S = 1.0
"""Time over which the largest load step is applied where the plan does not say."""


def number(values: Values, *path: str) -> float | None:
    """The good value at `path`, or None."""
    found: Any = values
    for key in path:
        found = found.get(key) if isinstance(found, dict) else None
    return found if isinstance(found, (int, float)) else None


def fill(values: Values, payload: Payload | None) -> None:
    """Fill in what was not given and can be known, in place."""
    procedure, identify = values.get("procedure"), values.get("identify")
    top = number(values, "procedure", "top_force")
    if not isinstance(procedure, dict) or top is None:
        return
    _fill_levels(procedure, top)
    levels = procedure.get("levels")
    if isinstance(levels, list) and levels:
        gaps = (high - low for low, high in pairwise([0.0, *levels]))
        _fill(procedure, "load_rate", max(gaps) / RAMP_S)
    resolution, noise = (
        number(values, "rig", "force", "resolution"),
        number(values, "rig", "force", "noise"),
    )
    if resolution is not None and noise is not None:
        scatter = math.hypot(noise, resolution / math.sqrt(12.0))
        _fill(procedure, "touch_force", max(0.01 * top, 1.0, 2.0 * resolution, 6.0 * scatter))
        _fill(procedure, "max_drift", max(0.01 * top, 1.0, 3.0 * resolution))
    travel = elastic_travel(values, payload)
    uncertainty, touch = (
        number(procedure, "surface_uncertainty"),
        number(procedure, "touch_force"),
    )
    if uncertainty is not None:
        pressed = _travel(values, payload, touch) or 0.0
        _fill(procedure, "search_distance", 3.0 * uncertainty + 2.0 * pressed)
    if travel is not None:
        _fill(procedure, "retract", max(5e-4, 2.0 * travel))
    if isinstance(identify, dict):
        _fill(identify, "secant_force", min(300.0, top))


def elastic_travel(values: Values, payload: Payload | None) -> float | None:
    """Travel in m of the arm from first contact to the top force, lost motion included."""
    return _travel(values, payload, number(values, "procedure", "top_force"))


def _travel(values: Values, payload: Payload | None, force: float | None) -> float | None:
    stiffness = number(values, "rig", "system_stiffness", "value")
    lost = number(values, "rig", "arm", "lost_motion")
    if force is None or stiffness is None or lost is None or payload is None:
        return None
    try:
        law = law_for(payload.geometry, payload.material, payload.plate)
        travel = force / stiffness + law.deformation(force) + lost
    except (DomainError, OverflowError):
        return None
    return travel if math.isfinite(travel) else None


def _fill_levels(procedure: Values, top: float) -> None:
    levels, step = procedure.get("levels"), procedure.get("step")
    if levels is None and step is not None and step <= top and top / step <= MAX_LEVELS:
        count = math.floor(top / step * (1.0 + 1e-9))
        levels = [step * (i + 1) for i in range(count)]
        if levels[-1] < top * (1.0 - 1e-9):
            levels.append(top)
        levels[-1] = top
        procedure["levels"] = levels
    elif levels and step is None:
        procedure["step"] = max(b - a for a, b in zip([0.0, *levels], levels, strict=False))


def _fill(section: Values, key: str, value: float | None) -> None:
    if key in section and section[key] is None and value is not None:
        section[key] = value
