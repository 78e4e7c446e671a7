"""The whole evaluation: from the cycles of a run to figures with intervals and verdicts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from stepload.contact.law_names import LAW_NAMES
from stepload.errors import DomainError
from stepload.estimators.smooth import NORMAL_95, smooth_lengths
from stepload.evidence import figures
from stepload.evidence.chord import Chord, chord, smoothed
from stepload.evidence.drift import Drift, drift_of, largest_in_holds, without_drift
from stepload.evidence.elastic import Elastic, elastic_of
from stepload.evidence.errors import Component, errors_of, middle, total
from stepload.evidence.gauge import against_arm
from stepload.evidence.inelastic import Inelastic, inelastic_of
from stepload.evidence.jump import jump_of, usual_creep
from stepload.evidence.lawfit import (
    CANNOT_TELL,
    LawFit,
    Whitened,
    chosen_fits,
    fit_law,
    fit_laws,
)
from stepload.evidence.laws import FIXED, POWER
from stepload.evidence.loops import LEAST_STRETCHES, Branch, Loop, loops_of
from stepload.evidence.pressed import Pressed
from stepload.evidence.quantity import Exponent, Line, Quantity, combined
from stepload.evidence.second import against_second
from stepload.units import format_quantity

UPPER_SHARE = 0.7
"""The upper chord begins at this share of the top force."""
UNEVEN = 0.2
"""Standard uncertainty of a drift that was taken out as an even one, as a share of it."""
WHOLE_GAP = 0.62
"""Standard uncertainty of a drift over the gap that it would leave: 95 % hold all of it."""
OF_SIGNS = ("drift that is not even", "drift (one cycle)")
"""Lines whose size is that of a sign of what is not elastic, as far as it may be a drift."""
LOADING = "loading"
REFUSED = 1e-3
"""Probability below which the χ² of the best law refuses all of them."""
UNLOADED = 0.35
"""An unloading that ends above this share of the top force is no check of the loading."""
LEAST_JUMP = 0.005
"""Share of the chord's deformation below which a jump counts for nothing."""
CREPT = 2.0
"""A jump below this multiple of what the holds creep is creep."""
AS_HIGH = 0.95
"""Only cycles that reach this share of the first one's top force are compared."""


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
class Evidence:
    """The evaluation of a run.

    Attributes:
        headline: the chord stiffness of the branch that was asked for.
        quantities: every stiffness by kind, the headline among them.
        exponent: n of the power law; None where no power law fits.
        inelastic: loop, set, creep and rate.
        laws: the laws that were tried, the best first.
        drift_m_per_s: drift that was subtracted; None where it is not known, or without times.
        notes: what this run cannot show, and what was assumed.
    """

    headline: Quantity
    quantities: Mapping[str, Quantity]
    exponent: Exponent | None
    inelastic: Inelastic
    laws: tuple[LawRow, ...]
    drift_m_per_s: float | None
    notes: tuple[str, ...]

    @property
    def elastic(self) -> bool:
        """Whether what is not elastic lies within the interval of the headline."""
        return self.inelastic.share <= self.within

    @property
    def within(self) -> float:
        """Half width of that interval without the lines that tell of the signs themselves."""
        return _within(self.headline)


def weigh(run: Pressed) -> Evidence:
    """Compute every figure that the data of the run support.

    Raises:
        DomainError: too little in contact, or a deformation that does not rise with the force.
    """
    told = run.conditions
    loops, elastic, drift = reduced(run)
    first = loops[0].loading
    lowest_n = float(first.path.force_n.min())
    main = chord(first) if run.between_n is None else chord(first, *run.between_n)
    inelastic = inelastic_of(run, loops, main.span_m, main.from_n, elastic, drift)
    of_gauge, said_of_gauge = against_arm(run, main)
    of_second, said_of_second = against_second(run)
    notes, blocking = _cannot_show(run, loops)
    notes += [*said_of_gauge, *said_of_second]
    notes.append(
        "the point of touch is extrapolated by the laws: the data begin at "
        f"{format_quantity(lowest_n, 'N')}, and a film or a seat that gives way below makes a "
        "secant false"
    )
    assumed = smooth_lengths(told.sources.smooth_length_n, elastic.top_n)
    here = middle(len(assumed))
    errors = [errors_of(run, first, elastic, drift, length_n) for length_n in assumed]
    main = smoothed(main, first, total(errors[here]), elastic.q)
    fitted = [_fitted(run, first, parts) for parts in errors]
    data, laws = fitted[here]
    every = [each for _, each in fitted if each]
    chosen = [chosen_fits(data, each, told) for data, each in fitted]
    power = laws.get(POWER.name)
    # A chosen law that cannot be fitted with the middle correlation length is not used at all.
    counting = [each for each in chosen if each and chosen[here]] if told.laws else every
    read_from = figures.Reading(
        main=main,
        upper=chord(first, UPPER_SHARE * main.to_n, main.to_n),
        path=first.path,
        errors=errors,
        law_sets=counting if power is not None else [],
        power=power.best.shape if power is not None else 1.0,
        lines=own_lines(run, loops, main, elastic, drift, inelastic),
        doubts=(
            *run.doubts,
            *of_second,
            *blocking,
            *of_gauge,
            *_jumps(data, every, main, first, elastic),
        ),
        law_doubts=(
            *run.law_doubts,
            *_refused(counting[here] if len(counting) > here else {}, laws),
        ),
    )
    found = figures.quantities(run, read_from)
    found |= _of_branches(run, loops, main, elastic, drift, assumed, read_from)
    headline = _headline(found, told.branch)
    if inelastic.share > _within(headline):
        said_of = f"{inelastic.share:.1%} of the deformation is not elastic ({inelastic.largest})"
        read_from = replace(read_from, exponent_doubts=(said_of,))
    if told.laws:
        unbound = figures.quantities(run, replace(read_from, law_sets=every))
        notes.append(_chosen(told.laws, found, unbound))
    return Evidence(
        headline=headline,
        quantities=found,
        exponent=figures.exponent(read_from),
        inelastic=inelastic,
        laws=_rows(laws, chosen[here], data),
        drift_m_per_s=drift.rate_m_per_s if drift is not None and run.timed else None,
        notes=tuple(notes),
    )


def _within(headline: Quantity) -> float:
    return NORMAL_95 * combined([line for line in headline.lines if line.source not in OF_SIGNS])


def reduced(run: Pressed) -> tuple[tuple[Loop, ...], Elastic, Drift | None]:
    """The cycles of a run, its drift taken out, with the elastic contact and the drift.

    Raises:
        DomainError: too little in contact, or a deformation that does not rise with the force.
    """
    told = run.conditions
    loops = loops_of(run.tracks, told.bend, told.sources.force_noise_n)
    loops = _whole(tuple(_positive(loop) for loop in loops))
    raw = _raw_chord(loops[0].loading)
    elastic = elastic_of(loops[0].loading, raw, told.bend)
    drift = drift_of(loops, elastic.at, told.sources)
    if drift is not None:
        start_s = float(loops[0].loading.path.time_s[0])
        loops = tuple(without_drift(loop, drift.rate_m_per_s, start_s) for loop in loops)
    return loops, elastic, drift


def _of_branches(
    run: Pressed, loops: Sequence[Loop], main: Chord, elastic: Elastic, drift: Drift | None,
    assumed: Sequence[float], loading: figures.Reading,
) -> dict[str, Quantity]:  # fmt: skip
    """The chords of the first unloading and of the second loading, where there are such."""
    branches = {"unloading": loops[0].unloading}
    if len(loops) > 1:
        branches["reloading"] = loops[1].loading
    found = {}
    for name, branch in branches.items():
        if branch is None or branch.path.size < LEAST_STRETCHES:
            continue
        from_n = max(main.from_n, float(branch.path.force_n.min()))
        own = chord(branch, from_n, min(main.to_n, float(branch.path.force_n.max())))
        if not own.span_m > 0.0:
            continue
        errors = [errors_of(run, branch, elastic, drift, length_n) for length_n in assumed]
        own = smoothed(own, branch, total(errors[middle(len(assumed))]), elastic.q)
        reading = replace(
            loading, main=own, upper=own, path=branch.path, errors=errors, law_sets=[]
        )
        kind = f"{name}_chord"
        found[kind] = replace(figures.quantities(run, reading)["chord"], kind=kind)
    return found


def _headline(found: Mapping[str, Quantity], branch: str) -> Quantity:
    """The chord of the branch that was asked for.

    Raises:
        DomainError: the run has none.
    """
    kind = "chord" if branch == LOADING else f"{branch}_chord"
    if kind not in found:
        raise DomainError(f"there is no {branch} to read a chord from")
    return found[kind]


def own_lines(
    run: Pressed, loops: Sequence[Loop], main: Chord, elastic: Elastic, drift: Drift | None,
    inelastic: Inelastic,
) -> list[Line]:  # fmt: skip
    """What the run itself shows of its zero, its drift and its slips."""
    path, sources = loops[0].loading.path, run.conditions.sources
    elapsed_s = float(main.weights @ path.time_s)

    def length(source: str, size: str, size_m: float) -> list[Line]:
        return [Line(source, size, size_m / main.span_m)] if size_m > 0.0 else []

    # Between two tares the zero is within half the step of an even drift.
    moved_n = sources.zero_drift_n_per_s * abs(elapsed_s)
    if run.zero_step_n is not None:
        moved_n = 0.5 * abs(run.zero_step_n)
    found = length(
        "zero of force", format_quantity(moved_n, "N"),
        moved_n * elastic.at(main.from_n) / math.sqrt(3.0),
    )  # fmt: skip
    gap = inelastic.of("gap")
    most_m = abs(elapsed_s) * largest_in_holds(loops, elastic.at, sources)
    if drift is not None:
        # A shift from top to top may have come at once, at a time outside this loading.
        taken_m = abs(drift.rate_m_per_s * elapsed_s)
        uneven_m = math.hypot(UNEVEN * taken_m, min(taken_m / math.sqrt(3.0), most_m))
        again = inelastic.of("reload")
        if again is not None and again.shown_m > 0.0:
            uneven_m = math.hypot(uneven_m, min(abs(again.value_m) / math.sqrt(3.0), most_m))
        found += length(OF_SIGNS[0], format_quantity(uneven_m, "m"), uneven_m)
    elif gap is not None:
        # One cycle: what lies between loading and unloading may be a drift.
        back = (loops[0].unloading or loops[0].loading).path
        up_s, down_s = (each.time_s[each.force_n >= main.from_n] for each in (path, back))
        lasted_s = float(down_s[-1] - up_s[0]) if down_s.size else 0.0
        share = min(abs(elapsed_s) / max(lasted_s, 1e-12), 1.0)
        may_m = min(WHOLE_GAP * share * math.hypot(gap.value_m, gap.sigma_m), most_m)
        found += length(OF_SIGNS[1], format_quantity(may_m, "m"), may_m)
    slipped_m, unseen_m = run.askew.slip_m(main.from_n, main.to_n, elastic.payload_at)
    slip_m = math.hypot(slipped_m, unseen_m) / math.sqrt(3.0)
    return found + length("slip on a tilted plate", format_quantity(slip_m, "m"), slip_m)


def _refused(counting: Mapping[str, LawFit], every: Mapping[str, LawFit]) -> list[str]:
    """That the data refuse every law that counts: by the stated errors, or for another one."""
    if not counting:
        return []
    best = min(counting.values(), key=lambda fit: fit.chi2)
    most = _largest_chi2(best.degrees)
    if best.chi2 > most:
        return [
            f"no law fits: the best one ({best.law.name}) leaves χ² = {best.chi2:.3g}, and the"
            f" stated errors allow {most:.3g}"
        ]
    return figures.beaten(best, every)


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


def _positive(loop: Loop) -> Loop:
    """A cycle without its stretches of zero force."""

    def kept(branch: Branch) -> Branch:
        path, keep = branch.path, branch.path.force_n > 0.0
        if keep.all():
            return branch
        path = replace(path, **{name: getattr(path, name)[keep] for name in path.__slots__})
        return replace(branch, path=path, deformation_m=branch.deformation_m[keep])

    unloading = kept(loop.unloading) if loop.unloading is not None else None
    if unloading is not None and unloading.path.size < 2:
        unloading = None
    return replace(loop, loading=kept(loop.loading), unloading=unloading)


def _whole(loops: tuple[Loop, ...]) -> tuple[Loop, ...]:
    """The first cycle and the others that reach its top force: an interrupted one shows nothing."""
    top_n = float(loops[0].loading.path.force_n.max())
    later = (loop for loop in loops[1:] if float(loop.loading.path.force_n.max()) > AS_HIGH * top_n)
    return (loops[0], *later)


def _raw_chord(first: Branch) -> Chord:
    """The chord before any correction.

    Raises:
        DomainError: there is none.
    """
    if first.path.size < LEAST_STRETCHES:
        raise DomainError(
            f"the loading has {first.path.size} places of different force; at least "
            f"{LEAST_STRETCHES} are needed",
            hint="record more samples on the way up, or press further",
        )
    raw = chord(first)
    if not raw.span_m > 0.0:
        raise DomainError(
            f"the deformation does not rise with the force (by {raw.span_m:.3g} m from "
            f"{raw.from_n:.3g} N to {raw.to_n:.3g} N)",
            hint="check the sign of the channels and the system stiffness used in (27)",
        )
    return raw


def _fitted(
    run: Pressed, first: Branch, parts: Sequence[Component]
) -> tuple[Whitened, dict[str, LawFit]]:
    data = Whitened(first.path.force_n, first.deformation_m, total(parts))
    return data, fit_laws(data, run.conditions, adhesive=run.adhesive)


def _rows(
    laws: Mapping[str, LawFit], chosen: Mapping[str, LawFit], data: Whitened
) -> tuple[LawRow, ...]:
    """All laws and the exponents that theory knows, the best first."""
    fixed = [fit for law in FIXED if (fit := fit_law(data, law)) is not None]
    every = {**{fit.law.name: fit for fit in fixed}, **laws, **chosen}
    lowest = min((fit.chi2 for fit in every.values()), default=0.0)
    counts = chosen or laws
    return tuple(
        LawRow(name, fit.chi2, fit.degrees, fit.chi2 <= lowest + CANNOT_TELL, name in counts)
        for name, fit in sorted(every.items(), key=lambda item: item[1].chi2)
    )


def _chosen(
    words: Sequence[str], found: Mapping[str, Quantity], unbound: Mapping[str, Quantity]
) -> str:
    """Remarks on what the choice of laws assumes and changes."""
    names = " or ".join(LAW_NAMES[word] for word in words)
    touch = "secant_from_touch"
    if touch not in found:
        return f"law chosen: {names}: it cannot be fitted to this loading, no figure rests on it"
    low, high = (format_quantity(end, "N/m") for end in unbound[touch].interval_n_per_m)
    return (
        f"law chosen: {names}: an assumption, not a finding; without it the 95 % interval of the "
        f"secant from touch is {low} to {high}"
    )


def _cannot_show(run: Pressed, loops: Sequence[Loop]) -> tuple[list[str], list[str]]:
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
                f"an unloading that ends at {format_quantity(left_n, 'N')}, {left_n / top_n:.0%} of"
                f" the top force (up to {UNLOADED:.0%} counts)"
            )
        blocking.append(
            f"{shown}: creep, drift, slip and yield cannot be told from elastic deformation"
        )
    elif not repeated:
        notes.append(
            "one cycle: drift cannot be told from creep, and what the first loading changed is "
            "seen only as a gap between loading and unloading"
        )
    if not any(loop.loading.holds for loop in loops[:2]):
        notes.append(
            "no holds while loading: creep, damping and a drift that turns with the load are seen "
            "only as far as unloading lies elsewhere"
        )
    if run.zero_step_n is None:
        notes.append(
            "the force's zero was not looked at twice in free air: how far it drifts under load is "
            "not known"
        )
    if note := run.conditions.sources.system_stiffness_note:
        notes.append(note)
    if run.sideways.share is None or run.sideways.rule == "unknown":
        notes.append(run.sideways.note)
    notes += run.askew.notes
    return notes, blocking
