"""Values shared by all runs of a cell: weights of the signs, thresholds, fixed budget lines.

They are computed by the functions for measured runs, from a run whose only error is the noise of
its force, which decides where stretches end. Runs differ in their noise, but little in the position
of their stretches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stepload.design.course import Course
from stepload.design.whole import pressed_of
from stepload.design.world import Cell
from stepload.errors import DomainError
from stepload.estimators.conditions import Conditions
from stepload.estimators.smooth import smooth_lengths
from stepload.evidence.chord import Chord, chord
from stepload.evidence.drift import Drift, drift_of
from stepload.evidence.elastic import Elastic, elastic_of
from stepload.evidence.errors import errors_of, middle, total
from stepload.evidence.lawfit import LawFit, Whitened, fit_law
from stepload.evidence.laws import POWER, ROUGH
from stepload.evidence.loops import Branch, loops_of
from stepload.evidence.rate import rate_sign
from stepload.evidence.rehearse import QUANTILE, creep_threshold, draws, rate_threshold, thresholds
from stepload.evidence.shape import LEAST_REDUCED_CHI2, rehearse_law
from stepload.evidence.signs import HoldCreep, Sign, branches_of, hold_creep, signs_of

_NEAR, _TRIES = 0.12, 25
_WORSE = 9.0


@dataclass(frozen=True, slots=True)
class Reference:
    """The run without errors other than noise, and the values derived from it once.

    Attributes:
        told: the conditions of the identification.
        branches: its branches in the order of time.
        main, elastic, drift: as in `evidence`.
        signs: every sign by name, "rate" among them.
        allowed_m: threshold of each.
        creep: creep of its holds; `creep_m` is the threshold of their mean.
        fixed_m: uncertainty of the chord's span from the sources, the worst length's.
        data, fit, shapes: the loading with its covariance, the law that is believed, and the shape
            parameters to fit it with.
        allowed_chi2: largest χ² of the best law.
    """

    told: Conditions
    branches: Sequence[Branch]
    main: Chord
    elastic: Elastic
    drift: Drift
    signs: dict[str, Sign]
    allowed_m: dict[str, float]
    creep: HoldCreep
    creep_m: float
    fixed_m: float
    data: Whitened
    fit: LawFit
    shapes: list[float]
    power: float
    allowed_chi2: float


def reference(cell: Cell, course: Course) -> Reference:
    """The reference of a cell.

    Raises:
        DomainError: no stiffness can be determined for this payload on this rig.
    """
    told = cell.conditions
    law = cell.payload.deformation_m(course.force_n, np.array([told.rough_length_m or 0.0]))[0]
    noise_n = told.sources.force_noise_n * np.random.default_rng(12345).standard_normal(law.size)
    run = pressed_of(told, course, course.force_n + noise_n, law + told.bend(course.force_n), 0.0)
    loops = loops_of(run.tracks, told.bend, told.sources.force_noise_n)
    first = loops[0].loading
    main = chord(first)
    elastic = elastic_of(first, main, told.bend)
    drift = drift_of(loops, elastic.at, told.sources)
    creep = hold_creep(loops, main.from_n, elastic)
    rate = rate_sign(loops, elastic)
    if drift is None or creep is None or rate is None:
        raise DomainError("a course of two cycles with holds has drift, creep and rate")
    lengths = smooth_lengths(told.sources.smooth_length_n, elastic.top_n)
    covariances = [total(errors_of(run, first, elastic, drift, each)) for each in lengths]
    here = middle(len(lengths))
    branches = branches_of(loops)
    drawn = draws(branches, elastic, run, lengths[here])
    signs = {sign.name: sign for sign in signs_of(loops, elastic.at)}
    allowed = thresholds(list(signs.values()), branches, drawn)
    allowed["rate"] = rate_threshold(rate, branches, drawn, elastic)
    data = Whitened(first.path.force_n, first.deformation_m, covariances[here])
    fit, shapes, power = _believed(data, told)
    deformation = drawn[0] - elastic.deflection(first.path.force_n)[:, None]
    left = rehearse_law(data, power, near(power.best.shape), deformation, main).chi2
    return Reference(
        told=told,
        branches=branches,
        main=main,
        elastic=elastic,
        drift=drift,
        signs=signs | {"rate": rate},
        allowed_m=allowed,
        creep=creep,
        creep_m=creep_threshold(creep, loops, elastic, told.sources),
        fixed_m=math.sqrt(max(float(main.weights @ each @ main.weights) for each in covariances)),
        data=data,
        fit=fit,
        shapes=shapes,
        power=power.best.shape,
        allowed_chi2=max(float(np.quantile(left, QUANTILE)), LEAST_REDUCED_CHI2 * power.degrees),
    )


def near(shape: float) -> list[float]:
    """Powers to try near a given one."""
    found: list[float] = np.linspace(max(shape - _NEAR, 0.1), shape + _NEAR, _TRIES).tolist()
    return found


def _believed(data: Whitened, told: Conditions) -> tuple[LawFit, list[float], LawFit]:
    """The law that gives the figures, its shapes to try, and the power law.

    Raises:
        DomainError: no power law can be fitted.
    """
    power = fit_law(data, POWER)
    if power is None:
        raise DomainError("no power law can be fitted to this payload")
    if told.rough_length_m:
        rough = fit_law(data, ROUGH, told)
        if rough is not None:
            fair = [p.shape for p in rough.points if p.chi2 <= rough.chi2 + _WORSE]
            return rough, fair, power
    return power, near(power.best.shape), power
