"""The chords of a run and the budget of each, as far as no law is needed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from stepload.errors import DomainError
from stepload.identification import figures
from stepload.identification.budget import SYSTEM, errors_of, middle, total
from stepload.identification.chord import Chord, chord, smooth_of, smoothed
from stepload.identification.conditions import BRANCHES
from stepload.identification.drift import (
    Drift,
    drift_of,
    largest_in_holds,
    stated_drift,
    without_drift,
)
from stepload.identification.elastic import Elastic, elastic_of
from stepload.identification.inelastic import Inelastic, inelastic_of
from stepload.identification.loops import LEAST_STRETCHES, Branch, Loop, Path, loops_of
from stepload.identification.quantity import Line, Quantity
from stepload.identification.run_data import RunData
from stepload.identification.smooth import smooth_lengths
from stepload.units import format_quantity

UNEVEN = 0.2
"""Standard uncertainty of a drift that was taken out as an even one, as a share of it."""
WHOLE_GAP = 0.62
"""Standard uncertainty of a drift over the gap that it would leave: 95 % hold all of it."""
OF_SIGNS = ("drift that is not even", "drift (one cycle)")
"""Lines whose size is that of a sign of what is not elastic, as far as it may be a drift."""
AS_HIGH = 0.95
"""Only cycles that reach this share of the first one's top force are compared."""


@dataclass(frozen=True, slots=True)
class Read:
    """What the data say before any law.

    Attributes:
        loops: the cycles, drift taken out.
        elastic: the elastic contact with which they are compared.
        drift: that was taken out; None where it is not known.
        inelastic: loop, set, creep and rate.
        local: chord of the first loading, read at its two ends.
        reading: the input of the figures of the first loading; its chord is the smoothed one.
    """

    loops: tuple[Loop, ...]
    elastic: Elastic
    drift: Drift | None
    inelastic: Inelastic
    local: Chord
    reading: figures.Reading


def read_of(run: RunData) -> Read:
    """Read the first loading of a run.

    Raises:
        DomainError: too little in contact, or a deformation that does not rise with the force.
    """
    loops, elastic, drift = _reduced(run)
    first = loops[0].loading
    local = chord(first) if run.between_n is None else chord(first, *run.between_n)
    inelastic = inelastic_of(run, loops, local.span_m, local.from_n, elastic, drift)
    reading = _reading(run, loops, first, local, elastic, drift, inelastic)
    return Read(loops, elastic, drift, inelastic, local, reading)


def kind_of(branch: str) -> str:
    """The kind of stiffness that the chord of a branch is."""
    return "chord" if branch == BRANCHES[0] else f"{branch}_chord"


def no_branch(run: RunData, branch: str) -> str:
    """Why a run has no chord of a branch."""
    if branch == BRANCHES[2] and len(run.tracks) == 1:
        return "There is one cycle: a reloading is the second loading"
    return f"There is no {branch} to read a chord from"


def branch_chord(
    run: RunData, read: Read, name: str, doubts: Sequence[str] = ()
) -> Quantity | None:
    """The chord of a branch of the first two cycles; None where there is none.

    Args:
        name: loading, unloading (the first one) or reloading (the second loading).
        doubts: sentences that block it.
    """
    loops, reading, kind = read.loops, read.reading, kind_of(name)
    if kind != "chord":
        branch = loops[0].unloading
        if name == "reloading":
            branch = loops[1].loading if len(loops) > 1 else None
        if branch is None or branch.path.size < LEAST_STRETCHES:
            return None
        from_n = max(reading.main.from_n, float(branch.path.force_n.min()))
        to_n = min(reading.main.to_n, float(branch.path.force_n.max()))
        local = chord(branch, from_n, to_n)
        if not local.span_m > 0.0:
            return None
        reading = _reading(run, loops, branch, local, read.elastic, read.drift, read.inelastic)
    found = figures.quantities(run, replace(reading, doubts=doubts))["chord"]
    return replace(found, kind=kind)


def _reading(
    run: RunData, loops: Sequence[Loop], branch: Branch, local: Chord, elastic: Elastic,
    drift: Drift | None, inelastic: Inelastic,
) -> figures.Reading:  # fmt: skip
    """The input of the figures of a branch, no law in it."""
    lengths = smooth_lengths(run.conditions.sources.smooth_length_n, elastic.top_n)
    errors = [errors_of(run, branch, elastic, drift, length_n) for length_n in lengths]
    # The shape of the fit must not tell K_s: its error is not among those that weigh the data.
    weighing = total([part for part in errors[middle(len(lengths))] if part.source != SYSTEM])
    smooth = smooth_of(branch, weighing, elastic.q)
    main = smoothed(local, branch, weighing, smooth)
    return figures.Reading(
        main=main,
        smooth=smooth,
        branch=branch,
        errors=errors,
        law_sets=[],
        power=elastic.q,
        lines=_own_lines(run, loops, main, branch.path, elastic, drift, inelastic),
        seat_m=_seat_m(inelastic),
    )


def _seat_m(inelastic: Inelastic) -> float:
    """Shift at the foot of the first loading that is not there at the lowest hold, in m."""
    seat, gap = inelastic.of("seat"), inelastic.of("gap")
    if seat is None:
        return 0.0
    return max(seat.shown_m - (0.0 if gap is None else abs(gap.value_m)), 0.0)


def _reduced(run: RunData) -> tuple[tuple[Loop, ...], Elastic, Drift | None]:
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


def _own_lines(
    run: RunData, loops: Sequence[Loop], main: Chord, path: Path, elastic: Elastic,
    drift: Drift | None, inelastic: Inelastic,
) -> list[Line]:  # fmt: skip
    """What the run itself shows of its zero, its drift and its slips."""
    sources = run.conditions.sources
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
    stated = stated_drift(loops, drift, elastic.at, sources)
    stated_m = math.inf if stated is None else stated * abs(elapsed_s)
    if drift is not None:
        # A shift from top to top may have come at once, at a time outside this loading.
        taken_m = abs(drift.rate_m_per_s * elapsed_s)
        uneven_m = math.hypot(UNEVEN * taken_m, min(taken_m / math.sqrt(3.0), most_m))
        again = inelastic.of("reload")
        if again is not None and again.shown_m > 0.0:
            uneven_m = math.hypot(uneven_m, min(abs(again.value_m) / math.sqrt(3.0), most_m))
        uneven_m = min(uneven_m, stated_m)
        found += length(OF_SIGNS[0], format_quantity(uneven_m, "m"), uneven_m)
    elif stated is not None:
        found += length("drift as stated", format_quantity(stated_m, "m"), stated_m)
    elif gap is not None:
        # One cycle: what lies between loading and unloading may be a drift.
        share = min(abs(elapsed_s) / max(gap.elapsed_s, 1e-12), 1.0)
        may_m = min(WHOLE_GAP * share * math.hypot(gap.value_m, gap.sigma_m), most_m)
        found += length(OF_SIGNS[1], format_quantity(may_m, "m"), may_m)
    slipped_m, undetected_m = run.alignment.slip_m(main.from_n, main.to_n, elastic.payload_at)
    slip_m = math.hypot(slipped_m, undetected_m) / math.sqrt(3.0)
    return found + length("slip on a tilted plate", format_quantity(slip_m, "m"), slip_m)


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
