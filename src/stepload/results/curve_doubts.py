"""Doubts about a curve from elsewhere before any law is fitted, and its smooth error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.fit import FloatArray
from stepload.estimators.inverse_law import joint
from stepload.estimators.selection import Selected
from stepload.estimators.smooth import smooth_leftover
from stepload.record.curves import Curve
from stepload.results.curve_zero import TOUCH_NOISE, Zeroed
from stepload.results.wishes import Wishes
from stepload.units import format_quantity

SMOOTH_LENGTH_SHARE = 1.0 / 6.0
"""Assumed correlation length for estimating an unstated smooth error from residuals, as a share of
the peak force: 50 N of 300 N on the step-load rigs."""
NO_FREE_AIR = (
    "no free air before the touch: the zero of the force is the file's word, and a preload that "
    "was tared away would falsify this figure (--tared, if it was tared in free air)"
)
BELOW_ZERO = 0.02
"""Negative forces of this share of the peak are no noise; from one row in a hundred on they are no
accident."""
CLIPPED, AS_FAST, STANDS = 0.01, 0.5, 0.2
"""A force stands where the deformation goes on by more than the first share of all of it, at more
than the second of its pace before, and the force rises by less than the third of what it did."""
FEWEST_CLIPPED = 6
"""Samples that a standing force has at least."""
LEAST_UNCERTAINTY = 1e-5
"""Residuals below this share of the deformation are rounding errors, no measurement."""


def check_stiffness(curve: Curve, wishes: Wishes) -> None:
    """Refuse a K_s that is missing, or that the curve is already corrected for.

    Raises:
        BadInputError: either of the two.
    """
    compensated = curve.displacement_m is not None
    if compensated and wishes.system_stiffness_n_per_m is not None:
        raise BadInputError(
            "--system-stiffness with a column displacement_m: that column is the payload's "
            "deformation, K_s is out of it already",
            hint="call the column position_m if it is the travel of the arm",
        )
    if not compensated and wishes.system_stiffness_n_per_m is None:
        raise BadInputError(
            "a column position_m holds the deflection of the system too",
            hint='give --system-stiffness "3.49e6 N/m", or a column displacement_m',
        )


def check_what_is_left(
    selected: Selected, travel_m: FloatArray, force_n: FloatArray, stiffness: float
) -> None:
    """Refuse a K_s whose deflection takes up all of the travel.

    Raises:
        BadInputError: at the highest forces nothing is left for the payload.
    """
    top = force_n >= 0.9 * force_n.max()
    start = force_n <= 0.1 * force_n.max()
    begin_m = float(np.median(selected.deformation_m[start])) if start.any() else 0.0
    left_m = float(np.median(selected.deformation_m[top])) - begin_m
    if left_m <= 0.0:
        moved_m, force = float(np.median(travel_m[top])), float(np.median(force_n[top]))
        raise BadInputError(
            f"K_s leaves the payload no deformation: of {format_quantity(moved_m, 'm')} of travel "
            f"at {format_quantity(force, 'N')} it takes {format_quantity(force / stiffness, 'm')}",
            hint="the system is stiffer than stated, or the payload too stiff to be told from it",
        )


def machine_doubts(curve: Curve) -> Iterator[str]:
    """Doubt about a travel that may include the machine's own deflection."""
    if curve.perhaps_machine:
        yield (
            f"the column {curve.perhaps_machine!r} may hold the machine's own deflection: call it "
            "displacement_m if that is out of it, or give --system-stiffness"
        )


def zero_doubts(zeroed: Zeroed) -> Iterator[str]:
    """Doubt about a force far below zero, if there is no free air to define its zero."""
    force_n = zeroed.whole.force_n
    low_n = -max(BELOW_ZERO * float(force_n.max()), TOUCH_NOISE * zeroed.noise_n)
    if not zeroed.seen_free and np.mean(force_n < low_n) > BELOW_ZERO / 2.0:
        yield (
            f"the force goes down to {format_quantity(float(force_n.min()), 'N')} and no free air "
            "comes before the touch: its zero is not that of free air, and every force is off by "
            "it (give the whole test, from free air on)"
        )


def clipped_doubts(selected: Selected, noise_n: float, quantum_n: float) -> Iterator[str]:
    """Doubt about a force that stands at the end of a loading while the travel goes on as before.

    In a hold the travel all but stops; a sensor at the end of its range does not stop it.
    """
    force_n, deformation_m = selected.force_n, selected.deformation_m
    band_n = TOUCH_NOISE * noise_n + quantum_n + LEAST_UNCERTAINTY * float(force_n.max())
    first = int(np.argmax(force_n >= force_n.max() - band_n))
    top_m = float(deformation_m[first:].max()) - CLIPPED * float(np.ptp(deformation_m))
    stands = int(np.flatnonzero(deformation_m[first:] >= top_m)[-1])  # then the travel goes back
    before = min(stands, first)
    if before < FEWEST_CLIPPED:
        return
    pace_m = float(deformation_m[first] - deformation_m[first - before]) / before
    pace_n = float(force_n[first] - force_n[first - before]) / before
    part = stands // 3
    early, late = slice(first, first + part), slice(first + stands - part, first + stands)
    gone_m, rose_n = (float(x[late].mean() - x[early].mean()) for x in (deformation_m, force_n))
    most_m = max(CLIPPED * float(np.ptp(deformation_m)), AS_FAST * pace_m * stands)
    goes_on = gone_m > most_m * (stands - part) / stands
    if goes_on and rose_n * pace_m < STANDS * pace_n * gone_m:
        yield (
            f"the force stands at {format_quantity(float(force_n.max()), 'N')} while the "
            f"deformation goes on by {format_quantity(gone_m, 'm')}: the sensor is at the end of "
            "its range, or the payload gives way"
        )


def with_leftover(
    selected: Selected, conditions: Conditions, noise_m: float, wishes: Wishes
) -> tuple[Conditions, list[str], bool]:
    """Estimate the smooth error from the residuals of the run, unless it is stated.

    Returns:
        The conditions with it, notes about it, and whether it is known.
    """
    if wishes.smooth_error_m is not None:
        if wishes.smooth_length_n is not None:
            return conditions, [], True
        note = "how fast the smooth error changes is not stated (--smooth-length): a range is tried"
        return conditions, [note], True
    missing = "smooth deformation error not given (--msde)"
    batch = selected.samples(selected.batch)
    x, y = batch.deformation_m, batch.force_n
    length_n = wishes.smooth_length_n or SMOOTH_LENGTH_SHARE * float(y.max(initial=0.0))
    try:
        found = smooth_leftover(joint(x, y), x, y, white_sd_m=noise_m, length_n=length_n)
    except DomainError:
        found = None
    if found is None:
        return conditions, [f"{missing}: the interval leaves it out"], False
    sources = replace(
        conditions.sources, smooth_error_m=found.smooth_error_m, smooth_degrees=found.degrees
    )
    note = (
        f"{missing}: taken from the residuals, {format_quantity(found.smooth_error_m, 'm')} with "
        f"{found.degrees:.2g} degrees of freedom"
    )
    speaks = found.smooth_error_m > LEAST_UNCERTAINTY * float(np.ptp(x))
    return replace(conditions, sources=sources), [note], speaks
