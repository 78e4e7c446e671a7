"""Values that follow from others where the plan does not give them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

from stepload.contact.elastic import law_for
from stepload.contact.material_range import softest
from stepload.declaration.sections import DERIVED, Contradiction, key_of, put
from stepload.errors import DomainError, printable
from stepload.plan.model import MAX_LEVELS, Plan

RAMP_S = 1.0
"""Time over which the largest load step is applied where the plan does not say."""


def fill(plan: Plan) -> Iterator[Contradiction]:
    """Fill values that were left out into a plan that is read; yields those that do not follow."""
    for section, field, rule in RULES:
        part = getattr(plan, section) if section else plan
        if getattr(part, field) is DERIVED and (value := rule(plan)) is not DERIVED:
            put(part, field, value)
        elif getattr(part, field) is DERIVED:
            name = key_of(field)
            hint = "it does not follow from the other keys here: write it"
            yield f"{section}.{name}", f"missing key {name!r}", hint


def elastic_travel(plan: Plan) -> float:
    """Travel in m of the arm from first contact to the top force, lost motion included.

    Infinite where it cannot be computed.
    """
    return _travel(plan, plan.procedure.top_force_n)


def _travel(plan: Plan, force_n: float) -> float:
    payload, stiffness = plan.payload, plan.rig.system_stiffness.stiffness_n_per_m
    try:
        law = law_for(payload.geometry, softest(payload.material), softest(payload.plate))
        deformation_m = law.deformation(force_n)
    except (DomainError, ArithmeticError):
        return math.inf
    return force_n / stiffness + deformation_m + plan.rig.arm.lost_motion_m


def _levels(plan: Plan) -> Any:
    """Every step up to the top force; what is left over makes a last, smaller one.

    Levels that do not exceed the touch force are left out: they would be passed before loading.
    """
    step, top = plan.procedure.step_n, plan.procedure.top_force_n
    if step > top or top / step > MAX_LEVELS:
        return DERIVED
    count = math.floor(top / step * (1.0 + 1e-9))
    levels = [step * (i + 1) for i in range(count)]
    if top - levels[-1] > 0.01 * step:
        levels.append(top)
    touch = plan.procedure.touch_force_n
    return (*(level for level in levels[:-1] if level > touch), top)


def _largest_step(plan: Plan) -> Any:
    levels = plan.procedure.levels_n
    if levels is DERIVED:
        return DERIVED
    return max(high - low for low, high in pairwise((0.0, *levels)))


TOUCH_SHARE = 0.8
"""Touch force over the first level, where that lies lower than the usual touch force."""


def _touch_force(plan: Plan) -> float:
    """The default touch force in N: at least six times the scatter of a quantised reading.

    Below low levels it is as much less as the noise of the force allows.
    """
    force = plan.rig.force
    scatter_n = math.hypot(force.noise_n, force.resolution_n / math.sqrt(12.0))
    top_n = plan.procedure.top_force_n
    touch_n = max(0.01 * top_n, 1.0, 2.0 * force.resolution_n, 6.0 * scatter_n)
    least_n = max(force.resolution_n, 6.0 * scatter_n)
    levels = plan.procedure.levels_n
    first_n = top_n if levels is DERIVED else levels[0]
    return touch_n if touch_n < first_n else max(least_n, TOUCH_SHARE * first_n)


def _max_drift(plan: Plan) -> float:
    return max(0.01 * plan.procedure.top_force_n, 1.0, 3.0 * plan.rig.force.resolution_n)


def _search_distance(plan: Plan) -> float:
    pressed_m = _travel(plan, plan.procedure.touch_force_n)
    extra_m = 2.0 * pressed_m if math.isfinite(pressed_m) else 0.0
    return 3.0 * plan.procedure.surface_uncertainty_m + extra_m


def _retract(plan: Plan) -> Any:
    travel_m = elastic_travel(plan)
    return max(5e-4, 2.0 * travel_m) if math.isfinite(travel_m) else DERIVED


RULES: tuple[tuple[str, str, Callable[[Plan], object]], ...] = (
    ("", "name", lambda plan: printable(plan.path.stem, 100)),
    ("procedure", "touch_force_n", _touch_force),
    ("procedure", "levels_n", _levels),
    ("procedure", "step_n", _largest_step),
    ("procedure", "load_rate_n_per_s", lambda plan: plan.procedure.step_n / RAMP_S),
    ("procedure", "max_drift_n", _max_drift),
    ("procedure", "search_distance_m", _search_distance),
    ("procedure", "retract_m", _retract),
    ("identify", "secant_force_n", lambda plan: min(300.0, plan.procedure.top_force_n)),
)
"""Section, field and rule, in an order in which each may need those before it."""


def follows(plan: Plan, section: str, field: str) -> bool:
    """Whether a value equals the one that is derived from others where a plan leaves it out."""
    rule = next((rule for of, name, rule in RULES if (of, name) == (section, field)), None)
    return rule is not None and bool(getattr(getattr(plan, section), field) == rule(plan))


def rederived(before: Plan, after: Plan) -> Plan:
    """`after`, a changed `before`, with the values derived anew that were derived in `before`.

    Values that were changed themselves are kept.
    """
    for section, field, rule in RULES:
        if section and follows(before, section, field):
            part = getattr(after, section)
            same = getattr(getattr(before, section), field) == getattr(part, field)
            if same and (value := rule(after)) is not DERIVED:
                after = replace(after, **{section: replace(part, **{field: value})})
    return after
