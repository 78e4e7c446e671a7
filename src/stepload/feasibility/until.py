"""How far a payload must be pressed for an interval that is asked for, level by level.

Most errors of a chord are a fixed length, whatever the payload: errors of the position, and of the
system's share of the travel. So the uncertainty of a chord follows from the deformation between its
two forces, and every level of a plan has a deformation that is enough there. The run finds out by
pressing which level has it; it uses neither the fitted stiffness nor theory's, except for the shape
of its law.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

from stepload.feasibility.conditions import conditions_of, each_of, schedule_of
from stepload.feasibility.reason import Reason, Severity
from stepload.feasibility.theory import Theory
from stepload.identification.chord import REFERENCE_SHARE
from stepload.identification.conditions import BRANCHES, Conditions
from stepload.identification.expected import expect
from stepload.identification.smooth import NORMAL_95
from stepload.plan.checks import LEAST_LEVELS
from stepload.plan.model import Plan
from stepload.units import beside_limit, format_quantity

MARGIN = 1.5
"""Factor by which the half width from the sources of error alone must be smaller than the one asked
for: errors of the contact itself, such as creep, come on top."""
LEAST, MOST = 1e-2, 1e2
"""Range of factors on theory's deformation in which the one that is enough is searched for."""


@dataclass(frozen=True, slots=True)
class Need:
    """The deformation that one level needs; lengths are from 10 % of the level to the level.

    Attributes:
        level_n: the level.
        needed_m: deformation that is enough, margin included; inf where none is, as below the
            forces at which the table of the system's deflection says enough.
        least_m: the same without the margin: less cannot be enough.
        sigma_m: standard uncertainty of `expected_m`.
        expected_m: deformation there by the believed law.
        half_width: of the interval at `expected_m`, margin included.
    """

    level_n: float
    needed_m: float
    least_m: float
    sigma_m: float
    expected_m: float
    half_width: float

    def is_enough(self, index: int, deformation_m: float) -> bool:
        """Whether this deformation at this level, of this index, is enough to end the loading."""
        return index + 1 >= LEAST_LEVELS and deformation_m >= self.needed_m


@dataclass(frozen=True, slots=True)
class Until:
    """Where a run may end its first loading.

    `asked` is the half width of the plan, `needs` has one entry per level, `conditions` give the
    system's share of the travel.
    """

    requested: float
    needs: tuple[Need, ...]
    conditions: Conditions

    @property
    def expected(self) -> int | None:
        """Index of the first level that will do by the believed law."""
        return next(
            (i for i, need in enumerate(self.needs) if need.is_enough(i, need.expected_m)), None
        )

    @property
    def expected_level_n(self) -> float | None:
        """That level; None where no level will do."""
        return None if self.expected is None else self.needs[self.expected].level_n


def until_of(plan: Plan, theory: Theory) -> Until | None:
    """What every level of a plan needs; None where the plan does not ask.

    Raises:
        DomainError: there is no contact law, or no loading, to predict from.
    """
    requested = plan.procedure.until
    if requested is None:
        return None
    conditions = conditions_of(plan, theory)
    levels = plan.procedure.levels_n
    needs = (
        _need(plan, theory, conditions, levels[: i + 1], requested) for i in range(len(levels))
    )
    return Until(requested, tuple(needs), conditions)


def _need(
    plan: Plan,
    theory: Theory,
    conditions: Conditions,
    levels_n: tuple[float, ...],
    requested: float,
) -> Need:
    top_n = levels_n[-1]
    conditions = replace(conditions, branch=BRANCHES[0])  # the first loading is what it ends
    schedule = replace(schedule_of(plan, levels_n), unloads=False)
    deformation = each_of(lru_cache(maxsize=None)(theory.law.deformation))

    def relative(factor: float) -> float:
        found = expect(conditions, schedule, lambda n: factor * deformation(n), looked=True)
        return found.chord.relative

    expected_m = theory.law.deformation(top_n) - theory.law.deformation(REFERENCE_SHARE * top_n)
    by_theory = relative(1.0)
    needed = _factor(relative, math.asinh(requested / MARGIN) / NORMAL_95)
    least = _factor(relative, math.asinh(requested) / NORMAL_95)
    return Need(
        level_n=top_n,
        needed_m=expected_m * needed,
        least_m=expected_m * least,
        sigma_m=expected_m * by_theory,
        expected_m=expected_m,
        half_width=MARGIN * math.sinh(NORMAL_95 * by_theory),
    )


def _factor(relative: Callable[[float], float], wanted: float) -> float:
    """Factor on theory's deformation that gives this relative uncertainty; inf where none does.

    The squared uncertainty is nearly linear in the inverse square of the deformation, so its root
    is easily found in that variable.
    """
    from scipy.optimize import brentq

    def beyond(inverse_square: float) -> float:
        return relative(inverse_square**-0.5) ** 2 - wanted**2

    low, high = MOST**-2, LEAST**-2
    if beyond(low) > 0.0:
        return math.inf
    if beyond(high) <= 0.0:
        return LEAST
    found = float(brentq(beyond, low, high, xtol=1e-9, rtol=1e-3))
    return math.sqrt(1.0 / found)


def until_reasons(until: Until) -> Iterator[Reason]:
    """Reasons on whether an early end of the loading is to be expected."""
    top, requested = until.needs[-1], f"±{100.0 * until.requested:g} %"
    if all(math.isinf(need.needed_m) for need in until.needs):
        yield Reason(
            "until_impossible", Severity.REFUSE,
            f"until {requested}: no deformation up to {format_quantity(top.level_n, 'N')} gives"
            " that; an error of this rig grows with it.",
            "a wider interval, or a calibrated gain and linearity of the force sensor",
            key="procedure.until",
        )  # fmt: skip
        return
    if until.expected is None:
        half = beside_limit(top.half_width, until.requested)[0]
        yield Reason(
            "until_not_expected", Severity.WARN,
            f"until {requested}: ±{half} is to be expected at the top force,"
            f" {format_quantity(top.level_n, 'N')}.",
            "a wider interval, a higher top_force, or calibrate K_s with its table",
            top.half_width, until.requested, "", top.half_width, "procedure.until",
        )  # fmt: skip
