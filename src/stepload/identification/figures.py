"""The figures of a run: chord, secants, tangent and exponent with their lines and verdicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stepload.identification.budget import Component, middle, total
from stepload.identification.chord import Chord, Smooth, chord
from stepload.identification.conditions import Conditions
from stepload.identification.estimators import EXPONENT_HALF_WIDTH
from stepload.identification.fit import FloatArray
from stepload.identification.lawfit import (
    CANNOT_TELL,
    LawFit,
    Read,
    at_point,
    shape_interval,
    union,
)
from stepload.identification.laws import POWER, ROUGH
from stepload.identification.loops import Branch, Path
from stepload.identification.quantity import (
    Exponent,
    Line,
    Quantity,
    ResultVerdict,
    combined,
    interval_said,
    log_interval,
    wider,
)
from stepload.identification.run_data import RunData
from stepload.identification.smooth import NORMAL_95
from stepload.units import percent

OPEN = 5.0
"""A stiffness counts as undetermined if the logarithm of its interval is wider than this."""
REACHED = 1.06
"""A requested force counts as reached if it is at most this factor above the highest force of the
data: a step of small force is held within its band."""
TWO_LOOKS = 2.2414
"""Quantile of the normal distribution at 1 - 0.025/2: two looks together miss in 5 %."""
BETTER = 16.0
"""χ² by which another law must fit better to refuse one: four standard deviations."""
UPPER_SHARE = 0.7
"""The upper chord begins at this share of a tangent's force."""
SEAT = "set at small force"
FOOT, FOOT_SHARE = "foot below the data", 0.2
"""Standard uncertainty of the deformation below the data, as a share of it: a rough surface gives
way more there than the laws say. With it the secants of 13 bodies of boundary elements hold in 0.88
to 1.00, at a half width of 1.2 times 1.96 rms errors (`python bench/sharpness.py`)."""
HOPELESS = 1.0
"""Half width, as a share of the figure, above which it is not identifiable."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Inputs of the figures.

    Attributes:
        smooth: the curve that it and the tangent are of; None where the data are too few.
        branch: that they are read from.
        errors: the components of the covariance, once per correlation length that may be.
        law_sets: the laws that figures rest on, fitted with each of them; empty where there are
            none.
        power: 1/n of the power law: relative change of the deformation over that of the force.
        lines: of the budget that do not follow from `errors`: what the run itself shows.
        seat_m: what gave way once at small force; a secant from touch counts it.
        doubts: sentences that block every figure.
        law_doubts: sentences that block what rests on a law.
        exponent_doubts: sentences that block the law itself.
    """

    main: Chord
    smooth: Smooth | None
    branch: Branch
    errors: Sequence[Sequence[Component]]
    law_sets: Sequence[Mapping[str, LawFit]]
    power: float
    lines: Sequence[Line] = ()
    seat_m: float = 0.0
    doubts: Sequence[str] = ()
    law_doubts: Sequence[str] = ()
    exponent_doubts: Sequence[str] = ()


def _shared(run: RunData, read_from: Reading) -> list[Line]:
    """Lines that every figure has: what scales the force, and what the run itself shows."""
    main, q, told = read_from.main, read_from.power, run.conditions
    sources = told.sources
    bend = float(np.diff(told.bend(np.array([main.from_n, main.to_n])))[0])
    lateral = run.lateral_force.relative * abs(bend) / main.span_m
    scale = [
        Line("force calibration", percent(sources.gain_sigma, 3), q * sources.gain_sigma),
        Line(
            "temperature of the material",
            f"{sources.temperature_sigma_k:.3g} K",
            q * sources.temperature_sigma_k * sources.modulus_per_k,
        ),
    ]
    return [
        *(line for line in scale if line.relative > 0.0),
        Line("lateral force", run.lateral_force.size, lateral),
        *run.alignment.lines(q, main.from_n, main.to_n, main.span_m),
        *read_from.lines,
    ]


def quantities(run: RunData, read_from: Reading) -> dict[str, Quantity]:
    """Every stiffness by kind; the chord always, the others where there is a law."""
    main, errors = read_from.main, read_from.errors
    law_sets = read_from.law_sets
    told, doubts = run.conditions, tuple(read_from.doubts)
    secant_force_n = told.secant_force_n
    shared = _shared(run, read_from)
    beyond: tuple[str, ...] = ()
    at_n = secant_force_n
    if secant_force_n > main.to_n:
        at_n = main.to_n
        if math.isfinite(secant_force_n) and secant_force_n > REACHED * main.to_n:
            beyond = (
                f"requested at {secant_force_n:.4g} N, given at {main.to_n:.4g} N: the data end "
                "there",
            )
    elif secant_force_n < main.from_n:
        beyond = (
            f"requested at {secant_force_n:.4g} N, below the {main.from_n:.4g} N that the chord "
            "begins at: the value is that of a fitted curve",
        )

    def of_weights(
        kind: str, weights: FloatArray, length_m: float, from_n: float, to_n: float,
        more: Sequence[Line] = (), remarks: Sequence[str] = (),
    ) -> Quantity:  # fmt: skip
        own = max((_lines(parts, weights, length_m) for parts in errors), key=combined)
        lines = [*own, *shared, *more]
        lines += _of_looks(run, combined(lines))
        value = (to_n - from_n or 1.0) / length_m
        interval = log_interval(value, lines)
        return _made(kind, value, interval, from_n, to_n, lines, told.t, doubts, remarks)

    found = {"chord": of_weights("chord", main.weights, main.span_m, main.from_n, main.to_n)}
    if (smooth := read_from.smooth) is not None:
        kinked = ("the data have a kink, which the curve of the tangent has not",) * smooth.kinked
        weights = smooth.slope(at_n)
        slope = float(weights @ read_from.branch.deformation_m)
        found["tangent"] = (
            of_weights("tangent", weights, slope, at_n, at_n, [_upper(read_from, smooth, at_n)],
                       (*beyond, *kinked))
            if slope > 0.0 else _open("tangent", at_n, doubts)
        )  # fmt: skip
    if not law_sets:
        return found
    law_blocked = (*doubts, *read_from.law_doubts)
    rough = _as_rough(law_sets[middle(len(law_sets))], told)
    foot_m = _foot(_selected_law(law_sets[middle(len(law_sets))], told), read_from.branch.path)
    for kind, read in _readers(at_n, with_plane=rough).items():
        made = _of_laws(read, law_sets, errors, read_from.branch.path, told, at_n)
        if made is None:
            found[kind] = _open(kind, at_n, law_blocked)
            continue
        stiffness, low, high, own = made
        rest = list(shared)
        if read_from.seat_m > 0.0:
            size_m = read_from.seat_m / math.sqrt(3.0)
            rest.append(Line(SEAT, f"{size_m * 1e6:.2g} µm", size_m * stiffness / at_n))
        if kind == "secant_from_touch" and told.rough_length_m is None:
            size_m = FOOT_SHARE * foot_m
            rest.append(Line(FOOT, f"{size_m * 1e6:.2g} µm", size_m * stiffness / at_n))
        whole = math.hypot(math.log(high / low) / 2.0 / NORMAL_95, combined(rest))
        rest += _of_looks(run, whole)
        low, high = wider(stiffness, low, high, NORMAL_95 * combined(rest))
        found[kind] = _made(
            kind, stiffness, (low, high), 0.0, at_n, [*own, *rest], told.t, law_blocked, beyond
        )
    return found


def parameter_covariance(run: RunData, read_from: Reading, power: LawFit) -> FloatArray:
    """Covariance (3, 3) of (ln K, n, δ0) of least squares of δ0 + (F/K)^(1/n), every line in it."""
    q = power.best.shape
    shape = power.best.coefficients[1] * (read_from.branch.path.force_n / power.top_n) ** q
    columns = np.stack([-q * shape, -q * shape * np.log(shape), np.ones_like(shape)], axis=1)
    norm = np.linalg.norm(columns, axis=0)
    estimator = np.linalg.pinv(columns / norm) / norm[:, None]
    found = max(
        (estimator @ total(parts) @ estimator.T for parts in read_from.errors),
        key=lambda each: float(each[1, 1]),
    )
    found[0, 0] += (combined(_shared(run, read_from)) / q) ** 2
    return np.asarray(found)


def _of_looks(run: RunData, relative: float) -> list[Line]:
    """Line for a loading that might have ended at an earlier level because of its own deformation.

    An error that makes the deformation large may end it. Most of that error is common to all
    levels, so all looks together count as two: `TWO_LOOKS` in place of 1.96.
    """
    if not run.looked:
        return []
    more = math.sqrt((TWO_LOOKS / NORMAL_95) ** 2 - 1.0)
    return [Line("loading ended by its own deformation", "counts as 2 looks", more * relative)]


def _as_rough(laws: Mapping[str, LawFit], told: Conditions) -> bool:
    """Whether the surface is known to be rough and the data are consistent with that."""
    lowest = min(fit.chi2 for fit in laws.values())
    rough = laws.get(ROUGH.name)
    return bool(told.rough_length_m) and rough is not None and rough.chi2 <= lowest + CANNOT_TELL


def _selected_law(laws: Mapping[str, LawFit], told: Conditions) -> LawFit:
    """The law that gives the value; the other laws only widen the interval."""
    if _as_rough(laws, told):
        return laws[ROUGH.name]
    power = laws.get(POWER.name)
    if power is not None and not beaten(power, laws):
        return power
    return min(laws.values(), key=lambda fit: fit.chi2)


def _foot(law: LawFit, path: Path) -> float:
    """The deformation in m that a law puts between touch and the lowest force of the data."""
    best = law.best
    return float(law.gradient(best.shape, float(path.force_n.min())) @ best.coefficients)


def beaten(fit: LawFit, laws: Mapping[str, LawFit]) -> list[str]:
    """That the data refuse a law because another one fits them better."""
    best = min(laws.values(), key=lambda each: each.chi2, default=fit)
    if fit.chi2 <= best.chi2 + BETTER:
        return []
    return [f"{best.law.name} fits better than {fit.law.name}, by χ² {fit.chi2 - best.chi2:.3g}"]


def _open(kind: str, at_n: float, blocked: Sequence[str]) -> Quantity:
    """A stiffness that the data do not determine."""
    why = (*blocked, "the deformation from touch may be none: the data leave this open")
    interval = (0.0, math.inf)
    return Quantity(kind, math.nan, interval, 0.0, at_n, (), ResultVerdict.NOT_IDENTIFIABLE, why)


def _readers(at_n: float, *, with_plane: bool) -> dict[str, Read]:
    """Functions that read a length from a law, by kind of stiffness: stiffness = F/length."""

    readers: dict[str, Read] = {"secant_from_touch": lambda fit, shape: fit.gradient(shape, at_n)}
    if with_plane:
        readers["secant_from_mean_plane"] = lambda fit, shape: fit.plane_gradient(shape, at_n)
    return readers


def _of_laws(
    read: Read,
    law_sets: Sequence[Mapping[str, LawFit]],
    errors: Sequence[Sequence[Component]],
    path: Path,
    told: Conditions,
    at_n: float,
) -> tuple[float, float, float, list[Line]] | None:
    """Stiffness, low and high end over the laws that the data cannot distinguish, and lines."""
    laws = law_sets[middle(len(law_sets))]
    selected = _selected_law(laws, told)
    kept = [list(each.values()) for each in law_sets]
    if selected.law is ROUGH:
        # The surface is known to be rough: laws of a smooth one are known to be wrong.
        kept = [[each[ROUGH.name]] for each in law_sets if ROUGH.name in each]
    best = at_point(selected, selected.best, read)
    whole = union(kept, read)
    if best is None or whole is None or whole[1] - whole[0] > OPEN:
        return None
    length_m = math.exp(best[0])
    value = at_n / length_m
    high, low = (at_n / math.exp(end) for end in whole)
    low, high = min(low, value), max(high, value)
    lines = max((_lines(parts, _sensitivity(selected, read, path, parts), length_m)
                 for parts in errors), key=combined)  # fmt: skip
    half = math.log(high / low) / 2.0 / NORMAL_95
    model = math.sqrt(max(half**2 - combined(lines) ** 2, 0.0))
    names = sorted({fit.law.name for each in kept for fit in each})
    size = f"{len(names)} laws" if len(names) > 1 else names[0]
    if selected.law is ROUGH and told.rough_length_m:
        size += f", its roughness length known to ±{percent(told.rough_length_sigma)}"
    return value, low, high, [*lines, Line("model (laws and zero)", size, model)]


def _upper(read_from: Reading, smooth: Smooth, at_n: float) -> Line:
    """Difference of curve and data in the chord below a tangent, less the standard uncertainty
    of their errors."""
    branch, parts = read_from.branch, read_from.errors[middle(len(read_from.errors))]
    upper = chord(branch, UPPER_SHARE * at_n, at_n)
    left = smooth.left(upper.weights)
    off = abs(float(left @ branch.deformation_m)) / upper.span_m if upper.span_m > 0.0 else math.inf
    allowed = combined(_lines(parts, left, upper.span_m))
    beyond = math.sqrt(max(off**2 - allowed**2, 0.0))
    return Line("shape (upper chord against the curve's)", percent(off, 3), beyond)


def _sensitivity(fit: LawFit, read: Read, path: Path, parts: Sequence[Component]) -> FloatArray:
    """(B,) derivatives of a length of the weighted fit, with a free shape, by the deformations."""
    point = fit.best
    covariance = np.sum([part.covariance for part in parts], axis=0)
    u = path.force_n / fit.top_n
    step = 1e-4 * max(point.shape, 1e-3)
    rest = point.coefficients[1:]
    basis = fit.law.basis(u, point.shape)
    moved = (fit.law.basis(u, point.shape + step) @ rest - basis @ rest) / step
    moved *= float(fit.law.grid.size > 1)  # a law with a single shape does not follow the data
    columns = np.column_stack([np.ones_like(u), basis, moved])
    weight = np.linalg.solve(covariance, columns)
    estimator = np.linalg.pinv(columns.T @ weight) @ weight.T
    gradient = read(fit, point.shape)
    other = read(fit, point.shape + step)
    along = float((other - gradient) @ point.coefficients) / step
    return np.asarray(np.concatenate([gradient, [along]]) @ estimator)


def _lines(parts: Sequence[Component], weights: FloatArray, length_m: float) -> list[Line]:
    return [
        Line(part.source, part.size,
             math.sqrt(max(float(weights @ part.covariance @ weights), 0.0)) / length_m)
        for part in parts
    ]  # fmt: skip


def _made(
    kind: str,
    value: float,
    interval: tuple[float, float],
    from_n: float,
    to_n: float,
    lines: Sequence[Line],
    t: float,
    blocked: Sequence[str],
    remarks: Sequence[str] = (),
) -> Quantity:
    half = (interval[1] - interval[0]) / (2.0 * value)
    why = [*blocked, *remarks]
    if not half <= 1.0 / t:
        why.append(interval_said(half, t))
    if half > HOPELESS or not math.isfinite(half):
        verdict = ResultVerdict.NOT_IDENTIFIABLE
    elif why:
        verdict = ResultVerdict.MARGINAL
    else:
        verdict = ResultVerdict.IDENTIFIED
    return Quantity(kind, value, interval, from_n, to_n, tuple(lines), verdict, tuple(why))


def exponent(read_from: Reading) -> Exponent | None:
    """n of the power law that is nearest to the data, weighed with their covariance; None where no
    figure rests on a power law of free exponent."""
    law_sets = read_from.law_sets
    power = law_sets[middle(len(law_sets))].get(POWER.name) if law_sets else None
    if power is None:
        return None
    value = 1.0 / power.best.shape
    fits = [laws[POWER.name] for laws in law_sets if POWER.name in laws]
    ends = [end for fit in fits for end in shape_interval(fit)]
    low, high = 1.0 / max(ends), 1.0 / min(ends)
    why = [
        *read_from.doubts,
        *read_from.law_doubts,
        *read_from.exponent_doubts,
        *beaten(power, law_sets[middle(len(law_sets))]),
    ]
    if (high - low) / 2.0 > EXPONENT_HALF_WIDTH:
        most = f"up to ±{EXPONENT_HALF_WIDTH:g} counts as identified"
        why.append(f"n = {value:.2f}, 95 % [{low:.2f}, {high:.2f}]; {most}")
    verdict = ResultVerdict.MARGINAL if why else ResultVerdict.IDENTIFIED
    return Exponent(value, (low, high), verdict, tuple(why))
