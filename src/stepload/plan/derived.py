"""Values that follow from others where the plan does not give them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise

from stepload.contact.elastic import law_for
from stepload.contact.material_range import softest
from stepload.declaration.sections import DERIVED, UnknownError, known, put
from stepload.errors import DomainError, printable
from stepload.plan.model import Plan

MAX_LEVELS = 1000
RAMP_S = 1.0
"""Time over which the largest load step is applied where the plan does not say."""


def fill(plan: Plan) -> None:
    """Fill derived values into a draft where they were not given."""
    for section, field, rule in RULES:
        with suppress(UnknownError):
            part = getattr(plan, section) if section else plan
            if getattr(part, field) is DERIVED:
                put(part, field, rule(plan))


def elastic_travel(plan: Plan) -> float:
    """Travel in m of the arm from first contact to the top force, lost motion included.

    Raises:
        UnknownError: a value that it needs is not known, or it is too large to compute with.
    """
    return _travel(plan, plan.procedure.top_force_n)


def _travel(plan: Plan, force_n: float) -> float:
    stiffness, lost_m = plan.rig.system_stiffness.stiffness_n_per_m, plan.rig.arm.lost_motion_m
    try:
        payload = plan.payload
        shape, body, plate = known(payload.geometry, payload.material, payload.plate)
        law = law_for(shape, softest(body), softest(plate))
        travel_m = force_n / stiffness + law.deformation(force_n) + lost_m
    except (DomainError, ArithmeticError):
        raise UnknownError from None
    if not math.isfinite(travel_m):
        raise UnknownError
    return travel_m


def _levels(plan: Plan) -> tuple[float, ...]:
    """Every step up to the top force; what is left over makes a last, smaller one.

    Levels that do not exceed the touch force are left out: they would be passed before loading.
    """
    step, top = plan.procedure.step_n, plan.procedure.top_force_n
    if step > top or top / step > MAX_LEVELS:
        raise UnknownError
    count = math.floor(top / step * (1.0 + 1e-9))
    levels = [step * (i + 1) for i in range(count)]
    if top - levels[-1] > 0.01 * step:
        levels.append(top)
    touch = 0.0
    with suppress(UnknownError):
        touch = plan.procedure.touch_force_n
    return (*(level for level in levels[:-1] if level > touch), top)


def _largest_step(plan: Plan) -> float:
    levels = plan.procedure.levels_n
    if not levels:
        raise UnknownError
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
    first_n = top_n
    with suppress(UnknownError, IndexError):
        first_n = plan.procedure.levels_n[0]
    return touch_n if touch_n < first_n else max(least_n, TOUCH_SHARE * first_n)


def _max_drift(plan: Plan) -> float:
    return max(0.01 * plan.procedure.top_force_n, 1.0, 3.0 * plan.rig.force.resolution_n)


def _search_distance(plan: Plan) -> float:
    pressed_m = 0.0
    with suppress(UnknownError):
        pressed_m = _travel(plan, plan.procedure.touch_force_n)
    return 3.0 * plan.procedure.surface_uncertainty_m + 2.0 * pressed_m


def _retract(plan: Plan) -> float:
    return max(5e-4, 2.0 * elastic_travel(plan))


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
    for of, name, rule in RULES:
        if (of, name) == (section, field):
            with suppress(UnknownError):
                return bool(getattr(getattr(plan, of), name) == rule(plan))
    return False
