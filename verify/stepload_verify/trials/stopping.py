"""Whether ending a loading on what was measured makes its interval miss more often.

python -m stepload_verify.trials.stopping [N]

Only the errors that a budget states, and many draws of them: for payloads from two fifths of the
believed deformation to two and a half times it, N loadings each are drawn with the covariance that
the evidence states for the rig. Every loading is read at the top force, and at the level at which
the run would have ended it, with and without the line that such a run has in its budget. Whole
runs, with what contacts do of their own, are `stepload_verify.trials.until`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.design.binomial import share
from stepload.envelope.theory import Theory, theory_of
from stepload.envelope.until import Until, sources_only, until_of
from stepload.estimators.smooth import NORMAL_95, smooth_lengths
from stepload.evidence.chord import chord
from stepload.evidence.elastic import elastic_of
from stepload.evidence.errors import errors_of, middle, total
from stepload.evidence.expected import loading, without_error
from stepload.evidence.figures import TWO_LOOKS
from stepload.evidence.loops import Branch, loops_of
from stepload.plan.model import Plan
from stepload_verify.trials.until import ASKED, plan_of

FloatArray = NDArray[np.float64]
FACTORS = np.geomspace(0.4, 2.5, 24)
"""Deformation of the payload over the believed one."""
PROMISED, WORST = 0.95, 0.945
"""Least share of intervals that hold the truth: over all payloads, and of each payload."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """Loadings of one payload (N,): how far the logarithm of the chord is from the true one, in the
    standard uncertainties that are stated, at the top and where the loading ended; and at which
    level that was."""

    whole: FloatArray
    ended: FloatArray
    level: NDArray[np.intp]


WAYS: dict[str, Callable[[Drawn], NDArray[np.bool_]]] = {
    "to the top": lambda each: each.whole <= NORMAL_95,
    "until": lambda each: each.ended <= TWO_LOOKS,
    "until, without the line": lambda each: each.ended <= NORMAL_95,
}


def draw(plan: Plan, theory: Theory, until: Until, factor: float, count: int) -> Drawn:
    """Loadings of a payload that gives way `factor` times as much as believed."""
    conditions, levels = until.conditions, np.array(plan.procedure.levels_n)
    course = loading(
        levels,
        from_n=min(plan.procedure.touch_force_n, 0.5 * levels[0]),
        rate_n_per_s=plan.procedure.load_rate_n_per_s,
        hold_s=plan.procedure.hold_s,
    )
    law_m = np.array([factor * theory.law.deformation(each) for each in course[1]])
    run = sources_only(conditions, without_error(course, law_m + conditions.bend(course[1])))
    first = loops_of(run.tracks, run.conditions.bend, 0.0)[0].loading
    elastic = elastic_of(first, chord(first), run.conditions.bend)
    lengths = smooth_lengths(run.conditions.sources.smooth_length_n, elastic.top_n)
    covariances = [total(errors_of(run, first, elastic, None, each)) for each in lengths]
    rng = np.random.default_rng(round(1000.0 * factor))
    root = np.linalg.cholesky(covariances[middle(len(lengths))])
    drawn = first.deformation_m[:, None] + root @ rng.standard_normal((root.shape[0], count))

    away, spans = [], []
    for number in range(1, len(levels) + 1):
        weights = _chord_weights(first, number)
        span = weights @ drawn
        sigma = max(float(np.sqrt(weights @ each @ weights)) for each in covariances)
        true = float(weights @ first.deformation_m)
        seen = np.maximum(span, 1e-12)
        away.append(np.abs(np.log(seen / true)) * seen / sigma)
        spans.append(span)
    enough = np.array([
        [need.is_enough(i, value) for value in span]
        for i, (need, span) in enumerate(zip(until.needs, spans, strict=True))
    ])  # fmt: skip
    enough[-1] = True
    level = np.argmax(enough, axis=0)
    every = np.array(away)
    return Drawn(every[-1], every[level, np.arange(count)], level)


def _chord_weights(first: Branch, number: int) -> FloatArray:
    """(B,) weights of the chord of a loading that ends with this hold."""
    path = first.path
    end = int(np.flatnonzero(path.held == number)[-1]) + 1
    short = replace(path, **{name: getattr(path, name)[:end] for name in path.__slots__})
    weights = np.zeros(path.size)
    weights[:end] = chord(
        replace(first, path=short, deformation_m=first.deformation_m[:end])
    ).weights
    return weights


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("draws", type=int, nargs="?", default=4000, help="of every payload")
    parser.add_argument("--asked", type=float, default=ASKED, help="half width, as a share")
    options = parser.parse_args()
    plan = plan_of(options.asked)
    theory = theory_of(plan.payload)
    until = until_of(plan, theory)
    assert until is not None
    found = [draw(plan, theory, until, factor, options.draws) for factor in FACTORS.tolist()]
    levels = plan.procedure.levels_n
    print("share of loadings with the truth in the interval; `until` with the line for two looks")
    print("deformation   to the top   until   without the line   ended at")
    for factor, each in zip(FACTORS, found, strict=True):
        ends = {levels[i]: float(np.mean(each.level == i)) for i in np.unique(each.level).tolist()}
        places = ", ".join(f"{level:.0f} N {part:.0%}" for level, part in ends.items())
        held = [float(np.mean(way(each))) for way in WAYS.values()]
        print(f"x {factor:9.2f}   {held[0]:10.1%}   {held[1]:5.1%}   {held[2]:16.1%}   {places}")
    good = True
    for name, way in WAYS.items():
        every = np.concatenate([way(each) for each in found])
        got = share(int(every.sum()), every.size)
        worst = min(float(np.mean(way(each))) for each in found)
        print(
            f"{name}: {got.count} of {got.of}, {got.value:.2%} [{got.low:.2%}, {got.high:.2%}]; "
            f"worst payload {worst:.1%}"
        )
        if name == "until":
            good = got.high >= PROMISED and worst >= WORST
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
