"""From the cycles of a run, measured or expected, to figures with intervals and verdicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from stepload.errors import DomainError
from stepload.identification import figures
from stepload.identification.branches import (
    OF_SIGNS,
    Read,
    branch_chord,
    kind_of,
    no_branch,
    read_of,
)
from stepload.identification.budget import middle, total
from stepload.identification.channel_checks import against_arm, against_second
from stepload.identification.chord import Chord
from stepload.identification.conditions import BRANCHES
from stepload.identification.elastic import Elastic, jump_of, usual_creep
from stepload.identification.fit import FloatArray
from stepload.identification.inelastic import Inelastic
from stepload.identification.lawfit import CANNOT_TELL, LawFit, Whitened, fit_law, fit_laws
from stepload.identification.laws import FIXED, POWER
from stepload.identification.loops import Branch, Loop
from stepload.identification.quantity import (
    Exponent,
    Quantity,
    combined,
    exponent_without_interval,
    without_interval,
)
from stepload.identification.run_data import RunData
from stepload.identification.smooth import NORMAL_95
from stepload.units import format_quantity, percent

REFUSED = 1e-3
"""Probability below which the χ² of the best law refuses all of them."""
UNLOADED = 0.35
"""An unloading that ends above this share of the top force is no check of the loading."""
LEAST_JUMP = 0.005
"""Share of the chord's deformation below which a jump counts for nothing."""
CREPT = 2.0
"""A jump below this multiple of what the holds creep is creep."""


@dataclass(frozen=True, slots=True)
class LawRow:
    """Fit of one law: χ², degrees of freedom, whether the data cannot distinguish it from the best
    law, and whether the figures may rest on it."""

    name: str
    chi2: float
    degrees: int
    alike: bool
    counts: bool


@dataclass(frozen=True, slots=True)
class Judgement:
    """What the data of a run show.

    Attributes:
        headline: the chord stiffness of the branch that was asked for.
        quantities: every stiffness by kind, the headline among them.
        inelastic: loop, set, creep and rate.
        drift_m_per_s: drift that was subtracted; None where it is not known, or without times.
        exponent: n of the power law; None where no power law fits.
        laws: the laws that were tried, the best first.
        notes: what this run cannot show, and what was assumed.
        covariance: (3, 3) of (ln K, n, δ0) of a power law through the loading, all errors in it;
            None where no power law fits, or nothing is known of the errors.
    """

    headline: Quantity
    quantities: Mapping[str, Quantity]
    inelastic: Inelastic
    drift_m_per_s: float | None
    exponent: Exponent | None = None
    laws: tuple[LawRow, ...] = ()
    notes: tuple[str, ...] = ()
    covariance: FloatArray | None = None

    @property
    def elastic(self) -> bool:
        """Whether what is not elastic lies within the interval of the headline."""
        return self.inelastic.share <= self.within

    @property
    def within(self) -> float:
        """Half width of that interval without the lines that tell of the signs themselves."""
        return _within(self.headline)


def judge(run: RunData, *, laws: bool = True) -> Judgement:
    """Every figure that the data of a run support, with interval and verdict.

    Args:
        run: measured, or expected before it (`stepload.identification.expected`).
        laws: whether laws are fitted and the data searched for doubts. Without, only the headline
            is computed, from the same budget: enough for a run that is expected, which follows its
            law, and for a comparison of runs that were judged.

    Raises:
        DomainError: too little in contact, a deformation that does not rise with the force, or no
            such branch.
    """
    read = read_of(run)
    drift_m_per_s = read.drift.rate_m_per_s if read.drift is not None and run.timed else None
    if not laws:
        headline = _there(branch_chord(run, read, run.conditions.branch), run)
        return Judgement(headline, {headline.kind: headline}, read.inelastic, drift_m_per_s)
    found = _with_laws(run, read, drift_m_per_s)
    if run.errors_known:
        return found
    open_ended = {kind: without_interval(each) for kind, each in found.quantities.items()}
    headline = open_ended[found.headline.kind]
    exponent = None if found.exponent is None else exponent_without_interval(found.exponent)
    return replace(
        found, headline=headline, quantities=open_ended, exponent=exponent, covariance=None
    )


def _there(headline: Quantity | None, run: RunData) -> Quantity:
    if headline is None:
        raise DomainError(no_branch(run, run.conditions.branch))
    return headline


def _with_laws(run: RunData, read: Read, drift_m_per_s: float | None) -> Judgement:
    told = run.conditions
    loops, elastic, inelastic = read.loops, read.elastic, read.inelastic
    first = loops[0].loading
    of_gauge, said_of_gauge = against_arm(run, read.local)
    of_second, said_of_second = against_second(run)
    notes, blocking = _cannot_show(run, loops)
    notes += [*said_of_gauge, *said_of_second]
    begin = format_quantity(float(first.path.force_n.min()), "N")
    notes.append(f"the first reading in contact is at {begin}; below it the curve is extrapolated")
    main, errors = read.reading.main, read.reading.errors
    here = middle(len(errors))
    loadings = [Whitened(first.path.force_n, first.deformation_m, total(each)) for each in errors]
    fitted = [fit_laws(each, told, adhesive=run.adhesive) for each in loadings]
    data, laws = loadings[here], fitted[here]
    every = [each for each in fitted if each]
    power = laws.get(POWER.name)
    read_from = replace(
        read.reading,
        law_sets=every if power is not None else [],
        power=power.best.shape if power is not None else 1.0,
        doubts=(
            *run.doubts,
            *of_second,
            *blocking,
            *of_gauge,
            *_jumps(data, every, main, first, elastic),
        ),
        law_doubts=(*run.law_doubts, *_refused(laws)),
    )
    found = figures.quantities(run, read_from)
    for name in BRANCHES[1:]:
        if (own := branch_chord(run, read, name, read_from.doubts)) is not None:
            found[own.kind] = own
    headline = _there(found.get(kind_of(told.branch)), run)
    if inelastic.share > _within(headline):
        said_of = (
            f"{percent(inelastic.share, 2)} of the deformation is not elastic ({inelastic.largest})"
        )
        read_from = replace(read_from, exponent_doubts=(said_of,))
    return Judgement(
        headline=headline,
        quantities=found,
        inelastic=inelastic,
        drift_m_per_s=drift_m_per_s,
        exponent=figures.exponent(read_from),
        laws=_rows(laws, data),
        notes=tuple(notes),
        covariance=(None if power is None else figures.parameter_covariance(run, read_from, power)),
    )


def _within(headline: Quantity) -> float:
    return NORMAL_95 * combined([line for line in headline.lines if line.source not in OF_SIGNS])


def _refused(laws: Mapping[str, LawFit]) -> list[str]:
    """That the data, by their stated errors, refuse every law."""
    if not laws:
        return []
    best = min(laws.values(), key=lambda fit: fit.chi2)
    most = _largest_chi2(best.degrees)
    if best.chi2 <= most:
        return []
    return [
        f"no law fits: the best one ({best.law.name}) leaves χ² = {best.chi2:.3g}, and the stated"
        f" errors allow {most:.3g}"
    ]


def _jumps(
    data: Whitened, fitted: Sequence[Mapping[str, LawFit]], main: Chord, first: Branch,
    elastic: Elastic,
) -> list[str]:  # fmt: skip
    """A jump within the chord: the deformation of a contact rises steadily with the force.

    In a hold it may go on as it does in most holds of this loading: that is creep.
    """
    laws = fitted[middle(len(fitted))] if fitted else {}
    if not laws:
        return []
    found = jump_of(data, min(laws.values(), key=lambda fit: fit.chi2))
    if found is None or not main.from_n < found.at_n < main.to_n:
        return []
    least_m = max(CREPT * usual_creep(first, elastic, found.at_n), LEAST_JUMP * main.span_m)
    if abs(found.size_m) < least_m:
        return []
    size, at = format_quantity(found.size_m, "m"), format_quantity(found.at_n, "N")
    return [f"the travel jumps by {size} at {at}: something slipped or clicked"]


@cache
def _largest_chi2(degrees: int) -> float:
    from scipy.special import chdtri

    return float(chdtri(max(degrees, 1), REFUSED))


def _rows(laws: Mapping[str, LawFit], data: Whitened) -> tuple[LawRow, ...]:
    """All laws and the exponents that theory knows, the best first."""
    fixed = [fit for law in FIXED if (fit := fit_law(data, law)) is not None]
    every = {**{fit.law.name: fit for fit in fixed}, **laws}
    lowest = min((fit.chi2 for fit in every.values()), default=0.0)
    return tuple(
        LawRow(name, fit.chi2, fit.degrees, fit.chi2 <= lowest + CANNOT_TELL, name in laws)
        for name, fit in sorted(every.items(), key=lambda item: item[1].chi2)
    )


def _cannot_show(run: RunData, loops: Sequence[Loop]) -> tuple[list[str], list[str]]:
    """What this run cannot show: remarks, and doubts that block every figure."""
    notes = list(run.notes)
    blocking: list[str] = []
    first, repeated = loops[0], len(loops) > 1
    left_n = math.inf if first.unloading is None else float(first.unloading.path.force_n.min())
    top_n = float(first.loading.path.force_n.max())
    if not repeated and left_n > UNLOADED * top_n:
        shown = "only a loading"
        if first.unloading is not None:
            shown = (
                f"an unloading that ends at {format_quantity(left_n, 'N')}, "
                f"{percent(left_n / top_n, 2)} of"
                f" the top force (up to {percent(UNLOADED, 2)} counts)"
            )
        blocking.append(
            f"{shown}: creep, drift, slip and yield cannot be separated from elastic deformation"
        )
    elif not repeated:
        notes.append(
            "one cycle: drift cannot be separated from creep; a set of the first loading shows "
            "only as a gap between loading and unloading"
        )
    if not any(loop.loading.holds for loop in loops[:2]):
        notes.append(
            "no holds in the loading: creep and damping show only as a gap between loading and "
            "unloading"
        )
    if run.zero_step_n is None:
        notes.append(
            "only one tare in free air: the drift of the force's zero under load is not known"
        )
    if note := run.conditions.sources.system_stiffness_note:
        notes.append(note)
    if run.lateral_force.share is None or run.lateral_force.rule == "unknown":
        notes.append(run.lateral_force.note)
    notes += run.alignment.notes
    return notes, blocking
