"""Preparation of a curve from elsewhere: signs, tare, zero, cycles, and doubts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from stepload.errors import BadInputError, DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.curve_channels import is_exact, quantum
from stepload.estimators.fit import FloatArray
from stepload.estimators.inverse_law import joint
from stepload.estimators.selection import Selected, select, uniform_in_force
from stepload.estimators.sources import ASSUMED_NONLINEARITY, Sources
from stepload.evidence.plausibility import plausibility
from stepload.record.curves import Curve
from stepload.results.curve_doubts import (
    NO_FREE_AIR,
    check_stiffness,
    check_what_is_left,
    clipped_doubts,
    machine_doubts,
    with_leftover,
    zero_doubts,
)
from stepload.results.curve_zero import CurveCycle, cycles, first_loading, zero
from stepload.results.wishes import Wishes
from stepload.units import format_quantity

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
        conditions: what is known of the errors, as stated or as the data show them.
        cycles: all cycles, with one zero of travel; the travel still holds the deflection of the
            system where `conditions.sources.system_stiffness_n_per_m` is not None.
        notes: sign changes, corrections and assumptions, in sentences.
        doubts: doubts that block every figure, in sentences.
        law_doubts: doubts that block figures that need the zero of the force.
        error_known: False where neither the data nor the caller give the accuracy of the channels:
            there is no interval then, and no K_max.
        adhesion_n: how far the force was pulled down before the touch; 0 where it was not.
    """

    selected: Selected
    conditions: Conditions
    cycles: tuple[CurveCycle, ...]
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    law_doubts: tuple[str, ...]
    error_known: bool
    adhesion_n: float


def prepare(curve: Curve, wishes: Wishes) -> PreparedCurve:
    """Make a curve ready for identification.

    Raises:
        BadInputError: K_s is missing, superfluous or too small, or there is no pressing in the
            data.
    """
    if curve.perhaps_machine and wishes.system_stiffness_n_per_m is not None:
        curve = replace(
            curve, position_m=curve.displacement_m, displacement_m=None, perhaps_machine=""
        )
    check_stiffness(curve, wishes)
    compensated = curve.displacement_m is not None
    zeroed = zero(curve, keep_zero=compensated)
    loading, notes = first_loading(zeroed)
    notes = [*curve.notes, *zeroed.notes, *notes]
    whole = zeroed.whole
    first = whole.part(loading)
    force_n, travel_m = first.force_n, first.travel_m
    if not compensated and not wishes.system_stiffness_sigma_n_per_m:
        notes.append("σ(K_s) not given (--system-stiffness-sigma): K_s counts as known to 5 %")
    top_n = float(force_n.max())
    secant_n = SECANT_FORCE_N
    if not LEAST_SECANT_SHARE * top_n <= SECANT_FORCE_N <= top_n:
        secant_n = top_n
        if not wishes.secant_force_n:
            notes.append(f"secant at the peak force of {format_quantity(secant_n, 'N', 4)}")
    quantum_m, quantum_n = quantum(whole.travel_m), quantum(whole.force_n)
    # Neither steps nor noise: the travel was computed or smoothed, or is short.
    hidden = not wishes.position_noise_m and is_exact(travel_m)
    conditions = wishes.applied(
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
    selected = select(travel_m - conditions.bend(force_n), force_n, time_s=first.time_s)
    if stiffness is not None:
        check_what_is_left(selected, travel_m, force_n, stiffness)
        notes.append(TAKEN_AS_GUIDED)
    conditions, note, leftover = with_leftover(selected, conditions, zeroed.noise_m, wishes)
    notes += note
    notes.append(_about_resolution(conditions, wishes))
    exact = is_exact(travel_m) and is_exact(force_n) and not leftover
    doubts = (
        *machine_doubts(curve),
        *zero_doubts(zeroed),
        *clipped_doubts(selected, zeroed.noise_n, quantum_n),
        *plausibility(
        selected.deformation_m, force_n, travel_m=whole.travel_m,
        system_stiffness_n_per_m=stiffness, position_quantum_m=quantum_m,
        force_quantum_n=quantum_n, theory_k=conditions.theory_k,
        theory_n=conditions.theory_n,
    ))  # fmt: skip
    if zeroed.adhesion_n:
        notes.append(
            f"the force is pulled to −{format_quantity(zeroed.adhesion_n, 'N')} before the touch, "
            f"{zeroed.adhesion_n / top_n:.0%} of the peak: a law with adhesion is tried too"
        )
    return PreparedCurve(
        selected=selected,
        conditions=conditions,
        cycles=tuple(cycles(zeroed)),
        notes=tuple(notes),
        doubts=tuple(doubts),
        law_doubts=() if zeroed.seen_free or wishes.tared else (NO_FREE_AIR,),
        error_known=wishes.states_an_error or not exact,
        adhesion_n=zeroed.adhesion_n,
    )


def deformation_curve(curve: Curve) -> Curve:
    """The first loading of a curve of deformation, turned, tared and zeroed as for identification.

    Raises:
        BadInputError: the system's deflection is still in it, or there is no pressing.
    """
    if curve.displacement_m is None:
        raise BadInputError(
            "the curve has no column displacement_m",
            hint="its system stiffness must be out of it: columns displacement_m, force_n",
        )
    zeroed = zero(curve, keep_zero=True)
    loading, notes = first_loading(zeroed)
    notes += machine_doubts(curve)
    first = zeroed.whole.part(loading)
    travel_m, force_n = first.travel_m, first.force_n
    if zeroed.touch_n > 0.0:
        zero_m = _fitted_zero(travel_m, force_n)
        travel_m = travel_m - zero_m
        notes.append(f"its zero is fitted, {format_quantity(zero_m, 'm')} from the touch")
    return Curve(
        time_s=first.time_s,
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


def _about_resolution(conditions: Conditions, wishes: Wishes) -> str:
    seen_m = conditions.position_resolution_m
    if math.isnan(seen_m):
        return (
            "the travel does not show its resolution, neither by steps nor by noise: K_max (34) is "
            "not known (--position-noise)"
        )
    noise_m = 2.0 * conditions.sources.position_noise_m
    whose = "the stated" if wishes.position_noise_m else "its"
    what = f"twice {whose} noise" if noise_m > seen_m else "its least step"
    return (
        f"position resolution for K_max (34): {format_quantity(max(seen_m, noise_m), 'm', 2)}, "
        f"{what}"
    )
