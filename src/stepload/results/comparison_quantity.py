"""The quantity by which runs are compared, with its budget and the origin of its errors."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from stepload.errors import DomainError
from stepload.estimators.measured import Measured
from stepload.evidence.answer import weigh
from stepload.evidence.quantity import Quantity
from stepload.results.origins import origin_of
from stepload.results.saved import SavedRun

if TYPE_CHECKING:
    from stepload.results.comparison import ComparedRun

CHORD = "chord stiffness"
SECANT = "secant stiffness"


def measured(run: SavedRun, quantity: str, found: Quantity) -> Measured:
    """Any stiffness of a run in the form used for comparisons."""
    return Measured(
        run=run.name,
        quantity=quantity,
        ln_value=math.log(found.value_n_per_m),
        from_n=found.from_n,
        to_n=found.to_n,
        lines={line.source: line.relative for line in found.lines},
        origin=origin_of(run),
    )


def chord_of(each: ComparedRun, from_n: float, to_n: float) -> Measured:
    """The chord stiffness of a run between two forces, computed anew where they are not its own.

    Raises:
        DomainError: the data support no chord there.
    """
    headline = each.found.headline
    if headline is None or (from_n, to_n) != (headline.from_n, headline.to_n):
        headline = weigh(replace(each.found.run, between_n=(from_n, to_n))).headline
    return measured(each.run, CHORD, headline)


def secant_of(each: ComparedRun, estimator: str, from_n: float, to_n: float) -> Measured:
    """The secant stiffness (28) of one fit in the form used for comparisons.

    Raises:
        DomainError: the fit has no budget, or the forces are not those of its secant.
    """
    fit, stated = each.found.fits[estimator], each.found.budgets.get(estimator)
    if stated is None:
        raise DomainError(f"{each.run.name}: the {estimator} fit has no interval")
    if from_n != 0.0 or to_n != fit.secant_force_n:
        raise DomainError(
            f"{each.run.name}: a secant from 0 to {fit.secant_force_n:g} N is there, asked for is "
            f"{from_n:g} to {to_n:g} N"
        )
    return Measured(
        run=each.run.name,
        quantity=f"{SECANT} ({estimator})",
        ln_value=math.log(fit.secant_n_per_m),
        from_n=from_n,
        to_n=to_n,
        lines={line.source: line.secant_relative for line in stated.lines},
        origin=origin_of(each.run),
    )
