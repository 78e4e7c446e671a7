"""A curve from elsewhere, made ready: turned, tared, zeroed, split into cycles, and doubted."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.errors import BadInputError, DomainError
from stepload.identify.conditions import Conditions
from stepload.identify.curve_cycles import CycleParts, cycles_of
from stepload.identify.curve_jumps import largest_jump
from stepload.identify.curve_parts import (
    LEAST_SLOPE,
    FreeAir,
    first_touch,
    free_air,
    is_exact,
    quantum,
    white_noise,
)
from stepload.identify.curve_signs import signs
from stepload.identify.inverse_law import joint
from stepload.identify.leftover import smooth_leftover
from stepload.identify.linearity import ASSUMED_NONLINEARITY
from stepload.identify.plausibility import plausibility
from stepload.identify.sampling import uniform_in_force
from stepload.identify.selection import Selected, select
from stepload.identify.sources import Sources
from stepload.record.curves import Curve
from stepload.results.curve_glitches import without_glitches
from stepload.results.wishes import Wishes
from stepload.units import format_quantity

FloatArray = NDArray[np.float64]

SECANT_FORCE_N = 300.0
LEAST_SECANT_SHARE = 0.1
"""Below this share of the peak, 300 N is no force to quote a secant at."""
TOUCH_SHARE = 0.01
"""A curve's touch is where the force passes this share of its peak, at least six times noise."""
TOUCH_NOISE = 6.0
SAME_PEAK = 0.95
"""The first cycle that reaches this share of the largest force is the loading; where cycles grow,
only what is above all earlier peaks is loaded for the first time."""
LIGHT_TOUCH = 0.1
"""A press below this share of the largest, and left again, is a search for the touch."""
ADHESION = 0.02
"""A pull before the touch of this share of the peak is adhesion."""
SMOOTH_LENGTH_SHARE = 1.0 / 6.0
"""The size of a smooth error that nobody has stated is read from the residuals as one that changes
over this share of the peak force: 50 N of 300 N on the step-load rigs."""
LEAST_SPAN = 0.3
"""A loading covers at least this share of the peak force, or there is none in the data."""
NO_FREE_AIR = (
    "no free air before the touch: the zero of the force is the file's word, and a preload that "
    "was tared away would falsify this figure (--tared, if it was tared in free air)"
)
BELOW_ZERO = 0.02
"""Forces so far below zero, as a share of the peak, are no noise; one row in a hundred of them no
accident."""
LEAST_UNCERTAINTY = 1e-5
"""Residuals below this share of the deformation are of rounding, not of a measurement."""


@dataclass(frozen=True, slots=True)
class Branch:
    """Samples (L,) in the order of time: tared force, travel from the common zero.

    `lateral_n` is the size of the lateral force, tared; None where the file has none.
    """

    time_s: FloatArray | None
    travel_m: FloatArray
    force_n: FloatArray
    lateral_n: FloatArray | None


@dataclass(frozen=True, slots=True)
class CurveCycle:
    """One cycle; `hold` may be empty, `unloading` is None where the data end before it.

    The loading of the first cycle begins at the touch.
    """

    number: int
    loading: Branch
    hold: Branch
    unloading: Branch | None


@dataclass(frozen=True, slots=True)
class PreparedCurve:
    """What can be said of a curve before any law is fitted.

    Attributes:
        selected: the first loading, from the touch to the end of its hold; deformation of the
            payload.
        conditions: what is known of the errors, as stated or as the data show them.
        cycles: all cycles, with one zero of travel; the travel still holds the deflection of the
            system where `conditions.sources.system_stiffness_n_per_m` is not None.
        notes: what was turned, taken out and assumed, in sentences.
        doubts: what stands against an identification, in sentences.
        law_doubts: what stands against a figure that needs the zero of the force.
        error_known: False where neither the data nor the caller tell how good the channels are:
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


@dataclass(frozen=True, slots=True)
class _Zeroed:
    """Whole channels, turned, tared and zeroed; where the touch is and which force found it.

    `touch_n` is 0 and `begin` 0 where the zero of the file is kept; `seen_free` says whether free
    air before the touch tells the zero of the force.
    """

    whole: Branch
    parts: tuple[CycleParts, ...]
    begin: int
    touch_n: float
    noise_n: float
    noise_m: float
    adhesion_n: float
    notes: tuple[str, ...]
    seen_free: bool


def prepare(curve: Curve, wishes: Wishes) -> PreparedCurve:
    """Make a curve ready for identification.

    Raises:
        BadInputError: K_s is missing or too much, or there is no pressing in the data.
    """
    if curve.perhaps_machine and wishes.system_stiffness_n_per_m is not None:
        curve = replace(
            curve, position_m=curve.displacement_m, displacement_m=None, perhaps_machine=""
        )
    _check_stiffness(curve, wishes)
    compensated = curve.displacement_m is not None
    zeroed = _zeroed(curve, keep_zero=compensated)
    loading, notes = _first_loading(zeroed)
    notes = [*curve.notes, *zeroed.notes, *notes]
    whole = zeroed.whole
    force_n, travel_m = whole.force_n[loading], whole.travel_m[loading]
    if not compensated and not wishes.system_stiffness_sigma_n_per_m:
        notes.append("σ(K_s) not given (--system-stiffness-sigma): K_s counts as known to 5 %")
    top_n = float(force_n.max())
    secant_n = SECANT_FORCE_N
    if not LEAST_SECANT_SHARE * top_n <= SECANT_FORCE_N <= top_n:
        secant_n = top_n
        if not wishes.secant_force_n:
            notes.append(f"secant at the peak force of {format_quantity(secant_n, 'N', 4)}")
    quantum_m, quantum_n = quantum(whole.travel_m), quantum(whole.force_n)
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
            position_resolution_m=_resolution(travel_m, quantum_m, wishes),
        )
    )
    time_s = None if whole.time_s is None else whole.time_s[loading]
    stiffness = conditions.sources.system_stiffness_n_per_m
    selected = select(travel_m, force_n, system_stiffness_n_per_m=stiffness, time_s=time_s)
    if stiffness is not None:
        _check_what_is_left(selected, travel_m, force_n, stiffness)
    conditions, note, leftover = _with_leftover(selected, conditions, zeroed.noise_m, wishes)
    notes += note
    notes.append(_about_resolution(conditions, wishes))
    exact = is_exact(travel_m) and is_exact(force_n) and not leftover
    doubts = (
        *_machine_doubts(curve),
        *_zero_doubts(zeroed),
        *_jump_doubts(selected, quantum_m),
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
        cycles=tuple(_cycles(zeroed)),
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
    zeroed = _zeroed(curve, keep_zero=True)
    loading, notes = _first_loading(zeroed)
    notes += _machine_doubts(curve)
    whole = zeroed.whole
    travel_m, force_n = whole.travel_m[loading], whole.force_n[loading]
    if zeroed.touch_n > 0.0:
        zero_m = _fitted_zero(travel_m, force_n)
        travel_m = travel_m - zero_m
        notes.append(f"its zero is fitted, {format_quantity(zero_m, 'm')} from the touch")
    return Curve(
        time_s=None if whole.time_s is None else whole.time_s[loading],
        position_m=None,
        displacement_m=travel_m,
        force_n=force_n,
        notes=(*curve.notes, *zeroed.notes, *notes),
    )


def pressed_system(curve: Curve) -> Branch:
    """A curve of the system alone, turned and tared; travel from its touch.

    Raises:
        BadInputError: there is no pressing.
    """
    return _zeroed(curve, keep_zero=False).whole


def _fitted_zero(travel_m: FloatArray, force_n: FloatArray) -> float:
    """Zero of a law fitted with it; 0 where none can be fitted."""
    chosen = uniform_in_force(force_n)
    try:
        return joint(travel_m[chosen], force_n[chosen]).zero_m
    except DomainError:
        return 0.0


def _resolution(travel_m: FloatArray, quantum_m: float, wishes: Wishes) -> float:
    """Position resolution (29) in m as the steps of the travel show it, beside its noise.

    NaN where neither is seen nor noise stated: such a travel was computed or smoothed, or is short.
    """
    return math.nan if not wishes.position_noise_m and is_exact(travel_m) else quantum_m


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


def _check_stiffness(curve: Curve, wishes: Wishes) -> None:
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


def _check_what_is_left(
    selected: Selected, travel_m: FloatArray, force_n: FloatArray, stiffness: float
) -> None:
    """Refuse a K_s that takes all of the travel.

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


def _zeroed(curve: Curve, *, keep_zero: bool) -> _Zeroed:
    """Turn, tare and zero. `keep_zero`: a zero that the file states stays where data begin in
    contact."""
    curve, notes = without_glitches(curve)
    given = curve.displacement_m if curve.displacement_m is not None else curve.position_m
    assert given is not None
    turn = signs(given, curve.force_n)
    travel_m, force_n = turn.travel * given, turn.force * curve.force_n
    if turn.force < 0.0:
        notes.append("pressing is negative in the file: the force was turned")
    if turn.travel < 0.0:
        notes.append("the travel falls towards the payload in the file: it was turned")
    noise_n, noise_m = white_noise(force_n), white_noise(travel_m)
    span_n = turn.deep_n - turn.shallow_n
    offset_n = turn.shallow_n if turn.shallow_n < -TOUCH_SHARE * span_n else 0.0
    parts = _presses(force_n - offset_n, travel_m)
    if not parts:
        top_n = float(force_n.max())
        raise BadInputError(
            f"the largest force is {top_n + 0.0:.3g} N", hint="there is no pressing in these data"
        )
    first = slice(parts[0].loading.start, parts[0].hold.stop)
    x, f = travel_m[first], force_n[first]
    band_n = max(TOUCH_SHARE * float(np.ptp(f)), TOUCH_NOISE * noise_n)
    air = free_air(x, f, band_n)
    if air is not None:
        force_n = force_n - air.at(travel_m)
        if air.slope_n_per_m or abs(air.mean_n - offset_n) > TOUCH_SHARE * span_n:
            parts = _presses(force_n, travel_m) or parts
            first = slice(parts[0].loading.start, parts[0].hold.stop)
            x = travel_m[first]
        f = force_n[first]
        notes += _tare_notes(air, x, band_n)
    touch = first_touch(f, band_n)
    lead_in = air is not None or _is_soft(x, f, touch)
    begin, touch_n = 0, 0.0
    if lead_in or not keep_zero:
        begin, touch_n = first.start + touch, band_n
        if touch == 0:
            touch_n = max(band_n, float(f[0]))
            there = format_quantity(float(f[0]), "N")
            notes.append(f"the data begin in contact, at {there}: the zero is that of the fit")
        else:
            notes.append(f"touch taken where the force passes {format_quantity(band_n, 'N')}")
        travel_m = travel_m - travel_m[begin]
    if first.start:
        notes.append(f"the first {first.start} samples hold touches only: left out")
    return _Zeroed(
        Branch(curve.time_s, travel_m, force_n, _lateral(curve.lateral_n, begin)),
        tuple(parts),
        max(begin, first.start),
        touch_n,
        noise_n,
        noise_m,
        _pull(f[:touch], max(ADHESION * float(f.max()), TOUCH_NOISE * noise_n)) if lead_in else 0.0,
        tuple(notes),
        air is not None,
    )


def _presses(force_n: FloatArray, travel_m: FloatArray) -> list[CycleParts]:
    """The cycles without the light touches that may come before them."""
    parts = cycles_of(force_n, travel_m)
    top_n = float(force_n.max())
    while len(parts) > 1:
        peak_n = float(force_n[parts[0].loading.start : parts[0].hold.stop].max())
        after = parts[0].unloading
        left = after is not None and float(force_n[after].min()) < LIGHT_TOUCH * peak_n
        if not left or peak_n > LIGHT_TOUCH * top_n:
            break
        parts.pop(0)
    return parts


def _tare_notes(air: FreeAir, travel_m: FloatArray, band_n: float) -> Iterator[str]:
    if abs(air.mean_n) > band_n:
        yield f"the force in free air is {format_quantity(air.mean_n, 'N')}: taken out"
    if air.slope_n_per_m:
        drift_n = air.slope_n_per_m * float(np.ptp(travel_m))
        yield (
            f"the force in free air changes by {format_quantity(drift_n, 'N')} over the "
            "travel: taken out as a straight line"
        )


def _pull(before_n: FloatArray, least_n: float) -> float:
    """How far the force was pulled down before the touch, three samples at least; 0 for less."""
    if before_n.size < 3:
        return 0.0
    pull_n = -float(np.partition(before_n, 2)[2])
    return pull_n if pull_n > least_n else 0.0


def _is_soft(travel_m: FloatArray, force_n: FloatArray, touch: int) -> bool:
    """Whether what is before the touch is too soft for any contact; it may be a few samples."""
    if touch == 0:
        return False
    moved_m = float(travel_m[touch] - travel_m[0])
    mean = float(np.ptp(force_n)) / max(float(np.ptp(travel_m)), math.ulp(0.0))
    return moved_m > 0.0 and float(force_n[touch] - force_n[0]) < 0.3 * LEAST_SLOPE * mean * moved_m


def _lateral(components_n: FloatArray | None, touch: int) -> FloatArray | None:
    """Size (N,) of the lateral force, tared by what it was before the touch."""
    if components_n is None:
        return None
    before = components_n[:, : max(touch, 1)]
    tared = components_n - np.median(before, axis=1, keepdims=True)
    return np.asarray(np.sqrt((tared**2).sum(axis=0)))


def _first_loading(zeroed: _Zeroed) -> tuple[NDArray[np.intp], list[str]]:
    """Indices of what is loaded for the first time, and what to say of the rest."""
    force_n, parts = zeroed.whole.force_n, zeroed.parts
    total, notes = len(force_n), []
    top_n = float(force_n.max())
    chosen, reached_n = [], -math.inf
    for part in parts:
        index = np.arange(part.loading.start, part.hold.stop)
        chosen.append(index[force_n[index] > reached_n])
        if chosen[-1].size:
            reached_n = float(force_n[index].max())
        if reached_n >= SAME_PEAK * top_n:
            break
    loading = np.concatenate(chosen)
    last = int(loading[-1]) + 1
    if len(chosen) > 1:
        notes.append(
            f"first loading only: of {len(chosen)} growing cycles what is above all before, "
            f"{len(loading)} of {total} samples"
        )
    elif last < total:
        notes.append(f"first loading only: the first {last} of {total} samples")
    if len(parts) > 1:
        notes.append(f"{len(parts)} cycles found")
    loading = loading[loading >= zeroed.begin]
    span_n = float(np.ptp(force_n[loading])) if loading.size else 0.0
    if span_n < LEAST_SPAN * top_n:
        raise BadInputError(
            f"there is no loading in these data: before the force falls it changes by "
            f"{format_quantity(span_n, 'N')} of {format_quantity(top_n, 'N')}",
            hint="give the whole test, from free air on, in the order of time",
        )
    return loading, notes


def _cycles(zeroed: _Zeroed) -> Iterator[CurveCycle]:
    for number, part in enumerate(zeroed.parts, 1):
        loading = part.loading
        if number == 1:
            begin = max(loading.start, min(zeroed.begin, loading.stop - 1))
            loading = slice(begin, loading.stop)
        yield CurveCycle(
            number,
            _cut(zeroed.whole, loading),
            _cut(zeroed.whole, part.hold),
            None if part.unloading is None else _cut(zeroed.whole, part.unloading),
        )


def _cut(whole: Branch, part: slice) -> Branch:
    return Branch(
        None if whole.time_s is None else whole.time_s[part],
        whole.travel_m[part],
        whole.force_n[part],
        None if whole.lateral_n is None else whole.lateral_n[part],
    )


def _machine_doubts(curve: Curve) -> Iterator[str]:
    if curve.perhaps_machine:
        yield (
            f"the column {curve.perhaps_machine!r} may hold the machine's own deflection: call it "
            "displacement_m if that is out of it, or give --system-stiffness"
        )


def _zero_doubts(zeroed: _Zeroed) -> Iterator[str]:
    """A force far below zero, where no free air before the touch says what zero is."""
    force_n = zeroed.whole.force_n
    low_n = -max(BELOW_ZERO * float(force_n.max()), TOUCH_NOISE * zeroed.noise_n)
    if not zeroed.seen_free and np.mean(force_n < low_n) > BELOW_ZERO / 2.0:
        yield (
            f"the force goes down to {format_quantity(float(force_n.min()), 'N')} and no free air "
            "comes before the touch: its zero is not that of free air, and every force is off by "
            "it (give the whole test, from free air on)"
        )


def _jump_doubts(selected: Selected, quantum_m: float) -> Iterator[str]:
    jump = largest_jump(selected.deformation_m, selected.force_n, quantum_m=quantum_m)
    if jump is not None:
        yield (
            f"the deformation jumps by {format_quantity(jump.travel_m, 'm')} at "
            f"{format_quantity(jump.force_n, 'N')} (pop-in, slip, a crack?): no law holds across it"
        )


def _with_leftover(
    selected: Selected, conditions: Conditions, noise_m: float, wishes: Wishes
) -> tuple[Conditions, list[str], bool]:
    """The smooth error as the residuals of the run speak for it, what to say about that, and
    whether they speak of any."""
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
