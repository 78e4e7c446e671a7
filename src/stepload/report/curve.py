"""A curve from elsewhere ready for identification: its conditions, its cycles, and doubts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stepload.errors import BadInputError, DomainError
from stepload.identification.conditions import ASSUMED_NONLINEARITY, Conditions, Sources
from stepload.identification.curve_channels import is_exact, plausibility, quantum
from stepload.identification.fit import FloatArray
from stepload.identification.inverse_law import joint
from stepload.identification.lateral import GUIDED_COMPLIANCE, LateralForce
from stepload.identification.run_data import RunData
from stepload.identification.samples import Selected, select, uniform_in_force
from stepload.identification.smooth import smooth_leftover
from stepload.record.curves import Curve
from stepload.report.conditions import Stated
from stepload.report.curve_zero import TOUCH_NOISE, Zeroed, first_loading, zero
from stepload.report.run_data import above_limit
from stepload.units import format_quantity, percent

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


def check_stiffness(curve: Curve, stated: Stated) -> None:
    """Refuse a K_s that is missing, or that the curve is already corrected for.

    Raises:
        BadInputError: either of the two.
    """
    compensated = curve.displacement_m is not None
    if compensated and stated.system_stiffness_n_per_m is not None:
        raise BadInputError(
            "--system-stiffness with a column displacement_m: that column is the payload's "
            "deformation, K_s is out of it already",
            hint="--columns position=… if it is the travel of the machine",
        )
    if not compensated and stated.system_stiffness_n_per_m is None:
        raise BadInputError(
            "the travel (position) holds the deflection of the machine too",
            hint="give --system-stiffness, K_s of the machine, or --columns displacement=… if that "
            "is out of it",
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
            f"the column {curve.perhaps_machine!r} may hold the machine's own deflection: give "
            "--system-stiffness, or --columns displacement=… if that is out of it"
        )


def zero_doubts(zeroed: Zeroed) -> Iterator[str]:
    """Doubt about a force far below zero, if there is no free air to define its zero."""
    force_n = zeroed.force_n
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
    selected: Selected, conditions: Conditions, noise_m: float, stated: Stated
) -> tuple[Conditions, list[str], bool]:
    """Estimate the smooth error from the residuals of the run, unless it is stated.

    Returns:
        The conditions with it, notes about it, and whether it is known.
    """
    if stated.smooth_error_m is not None:
        if stated.smooth_length_n is not None:
            return conditions, [], True
        note = "how fast the smooth error changes is not stated (--smooth-length): a range is tried"
        return conditions, [note], True
    missing = "smooth deformation error not given (--msde)"
    batch = selected.samples(selected.batch)
    x, y = batch.deformation_m, batch.force_n
    length_n = stated.smooth_length_n or SMOOTH_LENGTH_SHARE * float(y.max(initial=0.0))
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


SECANT_FORCE_N = 300.0
LEAST_SECANT_SHARE = 0.1
"""Least share of a curve's peak force at which the default secant force of 300 N is used."""

TAKEN_AS_GUIDED = (
    "a curve does not say what pressed: taken as a guided axis. A serial arm is stiffer where "
    "friction holds its tip, which no interval here counts"
)


@dataclass(frozen=True, slots=True)
class PreparedCurve:
    """A curve before any law is fitted.

    Attributes:
        selected: the first loading, from the touch to the end of its hold; deformation of the
            payload.
        run: its cycles, with what is known of the errors, as stated or as the data show them;
            nothing is where neither gives the accuracy of the channels.
        notes: sign changes, corrections and assumptions, in sentences.
    """

    selected: Selected
    run: RunData
    notes: tuple[str, ...]


def prepare(curve: Curve, stated: Stated) -> PreparedCurve:
    """Make a curve ready for identification.

    Raises:
        BadInputError: K_s is missing, superfluous or too small, or there is no pressing in the
            data.
    """
    if curve.perhaps_machine and stated.system_stiffness_n_per_m is not None:
        curve = replace(
            curve, position_m=curve.displacement_m, displacement_m=None, perhaps_machine=""
        )
    check_stiffness(curve, stated)
    compensated = curve.displacement_m is not None
    zeroed = zero(curve, keep_zero=compensated)
    loading, growing, notes = first_loading(zeroed)
    notes = [*curve.notes, *zeroed.notes, *notes]
    force_n, travel_m = zeroed.force_n[loading], zeroed.travel_m[loading]
    time_s = None if zeroed.time_s is None else zeroed.time_s[loading]
    if not compensated and not stated.system_stiffness_sigma_n_per_m:
        notes.append("σ(K_s) not given (--system-stiffness-sigma): K_s counts as known to 5 %")
    top_n = float(force_n.max())
    secant_n = SECANT_FORCE_N
    if not LEAST_SECANT_SHARE * top_n <= SECANT_FORCE_N <= top_n:
        secant_n = top_n
        if not stated.secant_force_n:
            notes.append(f"secant at the peak force of {format_quantity(secant_n, 'N', 4)}")
    quantum_m, quantum_n = quantum(zeroed.travel_m), quantum(zeroed.force_n)
    # Neither steps nor noise: the travel was computed or smoothed, or is short.
    hidden = not stated.position_noise_m and is_exact(travel_m)
    conditions = stated.applied(
        Conditions(
            sources=Sources(
                system_stiffness_n_per_m=None,
                force_noise_n=zeroed.noise_n,
                position_noise_m=math.sqrt(max(zeroed.noise_m**2 - quantum_m**2 / 12.0, 0.0)),
                position_resolution_m=quantum_m,
                nonlinearity=ASSUMED_NONLINEARITY,
            ),
            secant_force_n=secant_n,
            touch_force_n=zeroed.touch_n,
            position_resolution_m=math.nan if hidden else quantum_m,
        )
    )
    stiffness = conditions.sources.system_stiffness_n_per_m
    selected = select(travel_m - conditions.bend(force_n), force_n, time_s=time_s)
    if stiffness is not None:
        check_what_is_left(selected, travel_m, force_n, stiffness)
        notes.append(TAKEN_AS_GUIDED)
    conditions, note, leftover = with_leftover(selected, conditions, zeroed.noise_m, stated)
    notes += note
    notes.append(_about_resolution(conditions, stated))
    exact = is_exact(travel_m) and is_exact(force_n) and not leftover
    doubts = (
        *machine_doubts(curve),
        *zero_doubts(zeroed),
        *clipped_doubts(selected, zeroed.noise_n, quantum_n),
        *plausibility(
        selected.deformation_m, force_n, travel_m=zeroed.travel_m,
        system_stiffness_n_per_m=stiffness, position_quantum_m=quantum_m,
        force_quantum_n=quantum_n, theory_k=conditions.theory_k,
        theory_n=conditions.theory_n,
    ))  # fmt: skip
    if zeroed.adhesion_n:
        notes.append(
            f"the force is pulled to −{format_quantity(zeroed.adhesion_n, 'N')} before the touch, "
            f"{percent(zeroed.adhesion_n / top_n, 2)} of the peak: a law with adhesion is tried too"
        )
    peak_n = max(float(zeroed.force_n[up].max()) for up in zeroed.loadings)
    share = zeroed.lateral_share
    aside = LateralForce("guided", share, relative=GUIDED_COMPLIANCE * (share or 0.0))
    zero_known = zeroed.seen_free or stated.tared
    if not zero_known:
        notes.append("no free air before the touch: all forces count from the file's zero")
    run = RunData(
        tracks=zeroed.tracks(loading, growing),
        conditions=conditions,
        lateral_force=aside,
        adhesive=zeroed.adhesion_n > 0.0,
        timed=zeroed.time_s is not None,
        errors_known=stated.an_error or not exact,
        doubts=(*doubts, *above_limit(conditions, peak_n)),
        law_doubts=() if zero_known else (NO_FREE_AIR,),
    )
    return PreparedCurve(selected, run, tuple(notes))


def deformation_curve(curve: Curve, name: str = "the curve") -> Curve:
    """The first loading of a curve of deformation, turned, tared and zeroed as for identification.

    Raises:
        BadInputError: the system's deflection is still in it, or there is no pressing.
    """
    if curve.displacement_m is None:
        raise BadInputError(
            f"{name}: its travel (position) holds the deflection of the machine too",
            hint="--columns displacement=… if it is out of the travel",
        )
    if curve.perhaps_machine:
        raise BadInputError(
            f"{name}: the column {curve.perhaps_machine!r} may hold the machine's own deflection",
            hint=f"--columns 'displacement={curve.perhaps_machine}' if that is out of it",
        )
    zeroed = zero(curve, keep_zero=True)
    loading, _, notes = first_loading(zeroed)
    travel_m, force_n = zeroed.travel_m[loading], zeroed.force_n[loading]
    if zeroed.touch_n > 0.0:
        zero_m = _fitted_zero(travel_m, force_n)
        travel_m = travel_m - zero_m
        notes.append(f"its zero is fitted, {format_quantity(zero_m, 'm')} from the touch")
    return Curve(
        time_s=None if zeroed.time_s is None else zeroed.time_s[loading],
        position_m=None,
        displacement_m=travel_m,
        force_n=force_n,
        notes=(*curve.notes, *zeroed.notes, *notes),
    )


def _fitted_zero(travel_m: FloatArray, force_n: FloatArray) -> float:
    """Zero from a fitted law; 0 where none can be fitted."""
    chosen = uniform_in_force(force_n)
    try:
        return joint(travel_m[chosen], force_n[chosen]).zero_m
    except DomainError:
        return 0.0


def _about_resolution(conditions: Conditions, stated: Stated) -> str:
    seen_m = conditions.position_resolution_m
    if math.isnan(seen_m):
        return (
            "the travel does not show its resolution, neither by steps nor by noise: K_max (34) is "
            "not known (--position-noise)"
        )
    noise_m = 2.0 * conditions.sources.position_noise_m
    whose = "the stated" if stated.position_noise_m else "its"
    what = f"twice {whose} noise" if noise_m > seen_m else "its least step"
    return (
        f"position resolution for K_max (34): {format_quantity(max(seen_m, noise_m), 'm', 2)}, "
        f"{what}"
    )
