"""Identification of all runs of a cell at once, by the gates and the budget of a single run.

Stretches, weights and thresholds are those of the cell's `reference`; values, signs, creep in
holds, shift of the touch, shape and the resulting lines are computed for each run. Omitted is what
cannot change the headline: laws other than the believed one (unless none fits), the secants, the
paper's fits. A run is corrected to the forces of the reference by its compliance, to first order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stepload.design.course import Course
from stepload.design.law import Payload
from stepload.design.reference import Reference
from stepload.design.world import Runs
from stepload.estimators.fit import BoolArray, FloatArray
from stepload.estimators.smooth import NORMAL_95
from stepload.evidence.contact_gates import HARMLESS_TOUCH, OF_TWO_CYCLES, SLOW_CREEP
from stepload.evidence.figures import HOPELESS
from stepload.evidence.gates import CREEP_SHARE, FAR, HARMLESS, HARMLESS_DRIFT, HARMLESS_ZERO
from stepload.evidence.lawfit import fit_law
from stepload.evidence.laws import BILINEAR, HERTZ_LINEAR, PLASTIC, ROUGH, STIFFENING
from stepload.evidence.loops import BETWEEN, EARLY
from stepload.evidence.rehearse import TO_SIGMA
from stepload.evidence.shape import rehearse_law

TABLE = "deflection_table"
"""Name of the gate for runs whose forces exceed the rows of the rig's deflection table."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Results of R identifications.

    Attributes:
        value_n_per_m: (R,) the headline; not above 0 where there is none.
        truth_n_per_m: (R,) the chord of the payload between the same forces.
        half_width: (R,) of the 95 % interval, as a share of the value.
        identified: (R,) whether the verdict is IDENTIFIED.
        vetoed: how many runs each gate stopped.
    """

    value_n_per_m: FloatArray
    truth_n_per_m: FloatArray
    half_width: FloatArray
    identified: BoolArray
    vetoed: dict[str, int]


def judge(payload: Payload, course: Course, runs: Runs, own: Reference) -> Judged:
    """Identify every run of a cell."""
    main, elastic = own.main, own.elastic
    travel, deformation = _at_reference(own, course, runs)
    shift = _value(own, "top_shift", travel)
    period_s = _period(own)
    rate = shift / period_s
    start_s = float(own.branches[0].path.time_s[0])
    for branch, each in zip(own.branches, travel, strict=True):
        each -= np.outer(rate, branch.path.time_s - start_s)
    deformation -= np.outer(rate, own.branches[0].path.time_s - start_s)
    span = deformation @ main.weights
    ends = np.array([main.from_n, main.to_n])
    true = np.diff(payload.deformation_m(ends, runs.rough_m), axis=1)[:, 0]
    safe = np.maximum(span, 1e-15)

    signs = {name: _value(own, name, travel) for name in own.signs}
    fires: dict[str, BoolArray] = {}
    for name in (*OF_TWO_CYCLES, "rate"):
        allowed = np.maximum(own.allowed_m[name], HARMLESS * safe)
        fires[name] = np.abs(signs[name]) > allowed
    beyond = np.maximum(np.abs(signs["gap"]) - own.allowed_m["gap"], 0.0) / math.sqrt(3.0)
    time_m = np.max([beyond, *(np.abs(signs[n]) for n in (*OF_TWO_CYCLES, "rate"))], axis=0)
    creep_m = _creep(own, course, runs, rate, safe, fires)
    harm_m = 0.5 * np.abs(runs.zero_step_n) * elastic.at(main.from_n)
    fires["force_zero"] = harm_m > HARMLESS_ZERO * safe
    moved = np.abs(rate) * abs(float(main.weights @ own.branches[0].path.time_s))
    fires["drift"] = moved > HARMLESS_DRIFT * safe
    fires["touch_shift"] = _touch(own, course, runs, rate, safe)
    off = _shape(own, deformation, safe, fires)

    sources = own.told.sources
    relative = np.sqrt(
        (own.fixed_m**2 + time_m**2 + creep_m**2 + harm_m**2 / 3.0) / safe**2
        + (off / 2.0) ** 2
        + own.power**2 * (sources.gain_sigma**2
        + (sources.temperature_sigma_k * sources.modulus_per_k) ** 2)
    )  # fmt: skip
    half = np.sinh(np.minimum(NORMAL_95 * relative, 700.0))
    peaks = runs.force_n[:, course.loading].max(axis=1).tolist()
    fires[TABLE] = np.array([bool(own.told.table_doubts(peak)) for peak in peaks])
    none = span <= 0.0
    stopped = np.any(list(fires.values()), axis=0)
    asked = min(1.0 / own.told.t, HOPELESS)
    return Judged(
        value_n_per_m=np.where(none, 0.0, (main.to_n - main.from_n) / safe),
        truth_n_per_m=(main.to_n - main.from_n) / true,
        half_width=half,
        identified=~stopped & ~none & (half <= asked),
        vetoed={name: int(each.sum()) for name, each in fires.items() if each.any()},
    )


def _at_reference(
    own: Reference, course: Course, runs: Runs
) -> tuple[list[FloatArray], FloatArray]:
    """Travel (R, B) of every branch, deformation of the first, at the reference's forces."""
    zero = runs.travel_m[:, course.touches[0], None]
    found, first = [], np.empty(0)
    for number, branch in enumerate(own.branches):
        path = branch.path
        part = course.branch(number // 2 + 1, loading=number % 2 == 0)
        cuts = part[0].start + np.concatenate([[0], np.cumsum(path.count)[:-1]]).astype(np.intp)
        stop = part[-1].stop
        force = np.add.reduceat(runs.force_n[:, :stop], cuts, axis=1) / path.count
        travel = np.add.reduceat(runs.travel_m[:, :stop], cuts, axis=1) / path.count - zero
        away = force - path.force_n
        found.append(travel - own.elastic.compliance(path.force_n) * away)
        if not number:
            first = found[0] - own.told.bend(path.force_n)
    return found, first


def _value(own: Reference, name: str, travel: list[FloatArray]) -> FloatArray:
    """(R,) a sign of every run."""
    sign = own.signs[name]
    number = {id(branch): i for i, branch in enumerate(own.branches)}
    found = np.full(travel[0].shape[0], sign.value_m)
    for branch, weights in sign.terms:
        i = number[id(branch)]
        found += (travel[i] - own.branches[i].path.travel_m) @ weights
    return found


def _period(own: Reference) -> float:
    """Time between the tops of both cycles, computed as in `drift_of`."""
    later, earlier = (
        float(np.abs(weights) @ branch.path.time_s / np.abs(weights).sum())
        for branch, weights in own.signs["top_shift"].terms
    )
    return later - earlier


def _creep(
    own: Reference, course: Course, runs: Runs, rate: FloatArray, span: FloatArray,
    fires: dict[str, BoolArray],
) -> FloatArray:  # fmt: skip
    """(R,) contribution of creep to the budget; records which runs its gates stop."""
    elastic, deflection = own.elastic, own.told.bend
    loading: list[FloatArray] = []
    unloading: list[FloatArray] = []
    within: list[FloatArray] = []
    for each in course.stretches:
        if not each.held:
            continue
        early = slice(each.start, each.start + max((each.stop - each.start) // EARLY, 1))
        late = slice((each.start + each.stop) // 2, each.stop)
        before, after = (
            (runs.travel_m[:, part].mean(axis=1), runs.force_n[:, part].mean(axis=1))
            for part in (early, late)
        )
        force = float(course.force_n[each.start])
        crept = after[0] - before[0] - (deflection(after[1]) - deflection(before[1]))
        lasted_s = float(course.time_s[each.stop - 1] - course.time_s[each.start])
        crept = crept - BETWEEN * rate * lasted_s
        crept -= elastic.payload_at(force) * (after[1] - before[1])
        (loading if each.loading else unloading).append(crept)
        if each.loading and each.cycle == 1 and force > 0.9 * own.main.from_n:
            within.append(crept)
    longer = own.creep.total_per_mean / math.sqrt(len(within) * len(loading))
    total = longer * np.sum(within, axis=0)
    split = 0.5 * np.abs(np.mean(loading, axis=0) - np.mean(unloading, axis=0))
    limit_m, total_m = own.creep_m, own.creep_m * own.creep.total_per_mean
    fires["hold_split"] = split > np.maximum(limit_m, HARMLESS * span / own.creep.holds)
    fires["hold_creep"] = np.abs(total) > np.maximum(total_m, CREEP_SHARE * span)
    noise_m = total_m / TO_SIGMA
    unseen_m = min(noise_m, SLOW_CREEP * own.allowed_m["reload"] / math.sqrt(3.0))
    found = np.sqrt(np.maximum(total**2 - noise_m**2, 0.0) / 3.0)
    return np.asarray(np.hypot(found, unseen_m))


def _touch(
    own: Reference, course: Course, runs: Runs, rate: FloatArray, span: FloatArray
) -> BoolArray:
    """(R,) whether the touch has moved."""
    first, last = course.touches
    force = runs.force_n[:, [first, last]]
    pressed = own.elastic.travel(np.maximum(force, 0.0))
    elapsed_s = float(course.time_s[last] - course.time_s[first])
    shift = runs.travel_m[:, last] - runs.travel_m[:, first] - np.diff(pressed, axis=1)[:, 0]
    shift = shift - rate * elapsed_s
    sources = own.told.sources
    at_n = np.maximum(force.mean(axis=1), 1e-3 * own.main.to_n)
    noise_m = own.elastic.compliance(at_n) * math.hypot(
        sources.force_noise_n, sources.force_resolution_n / 3.5
    )
    fixed = math.hypot(
        sources.position_resolution_m / math.sqrt(12.0), sources.position_noise_m,
        own.drift.sigma_m_per_s * elapsed_s,
    )  # fmt: skip
    allowed = np.maximum(3.0 * math.sqrt(2.0) * np.hypot(noise_m, fixed), HARMLESS_TOUCH * span)
    return np.asarray(np.abs(shift) > allowed)


def _shape(
    own: Reference, deformation: FloatArray, span: FloatArray, fires: dict[str, BoolArray]
) -> FloatArray:
    """(R,) ln(chord of the law/measured chord); records the runs that no law fits."""
    found = rehearse_law(own.data, own.fit, own.shapes, deformation.T, own.main)
    chi2 = found.chi2.copy()
    far = chi2 > FAR * own.allowed_chi2
    for law in (HERTZ_LINEAR, BILINEAR, STIFFENING, PLASTIC, ROUGH):
        if not far.any():
            break
        if (other := fit_law(own.data, law, own.told)) is not None:
            shapes = [point.shape for point in other.points]
            left = rehearse_law(own.data, other, shapes, deformation.T[:, far], own.main)
            chi2[far] = np.minimum(chi2[far], left.chi2)
            far = chi2 > FAR * own.allowed_chi2
    fires["lack_of_fit"] = far
    return np.where(np.isfinite(found.off), found.off, 1.0)
