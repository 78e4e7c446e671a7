"""What the product's intervals say of a simulated run, and how often they hold the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from stepload.identification.conditions import Conditions, Sources
from stepload.identification.fit import Fit
from stepload.identification.inverse_law import joint
from stepload.identification.loops import Track
from stepload.identification.ls import rs_btls
from stepload.identification.run_data import RunData
from stepload.identification.samples import uniform_in_force
from stepload.identification.verdict import Judgement, judge
from stepload_verify.paper import laws
from stepload_verify.paper.printed import SECANT_FORCE_N, SPHERE
from stepload_verify.paper.rows import Section, number
from stepload_verify.paper.step_load import SCENARIO_C, STVF, RawRun, press

HELD = ("holds the secant from the mean plane", "holds the secant from the touch", "chord, ratio")
_REFERENCE_N = 30.0
_SOURCES = Sources(
    STVF.stiffness_n_per_m,
    system_stiffness_sigma_n_per_m=SCENARIO_C.stiffness_sigma * STVF.stiffness_n_per_m,
    smooth_error_m=SCENARIO_C.smooth_m,
    smooth_length_n=SCENARIO_C.length_n,
    force_noise_n=STVF.force_noise_n,
    force_resolution_n=STVF.force_resolution_n,
    position_resolution_m=STVF.position_resolution_m,
)


def one_run_of(seed: int) -> RawRun:
    """The rough plastic sphere in test 1, with a touch at 3 N."""
    law = laws.measured(SPHERE, laws.Test.ONE)
    return press(law, replace(STVF, rate_hz=200.0), SCENARIO_C, np.random.default_rng(seed))


def truth() -> tuple[float, float, float]:
    """In N/m at 300 N: secant from the mean plane and from the touch F → 0, chord from 30 N."""
    zero, reference, top = laws.with_factors(
        SPHERE, np.array([1e-3, _REFERENCE_N, SECANT_FORCE_N]), roughness=1.0
    )
    chord = (SECANT_FORCE_N - _REFERENCE_N) / (top - reference)
    return SECANT_FORCE_N / top, SECANT_FORCE_N / (top - zero), chord


def held(seed: int) -> tuple[bool, bool, float]:
    """Whether the interval of one run holds either secant; its chord by that of the law."""
    _, free, stated = fits(one_run_of(seed))
    low, high = stated.quantities["secant_from_touch"].interval_n_per_m
    mean_plane, touch, chord = truth()
    return low <= mean_plane <= high, low <= touch <= high, _chord(free) / chord


def fits(run: RawRun) -> tuple[Fit, Fit, Judgement]:
    """RS-BTLS, the joint fit, and the product's judgement."""
    force, deformation = run.loaded_n(), run.deformation_m()
    pick = uniform_in_force(force, 300)
    pick = pick[force[pick] > 0]
    pressed = slice(run.touch, None)
    track = Track(
        run.time_s[pressed], run.force_n[pressed], run.travel_m[pressed],
        np.zeros(run.force_n.size - run.touch, dtype=np.intp),
    )  # fmt: skip
    sources = replace(_SOURCES, system_stiffness_n_per_m=run.stiffness_n_per_m)
    told = Conditions(sources, SECANT_FORCE_N, 0.0, STVF.position_resolution_m)
    chosen = deformation[pick], force[pick]
    return (
        rs_btls(*chosen, secant_force_n=SECANT_FORCE_N),
        joint(*chosen, secant_force_n=SECANT_FORCE_N),
        judge(RunData([(1, track, None)], told)),
    )


def section(counted: Mapping[str, Sequence[float]], seed: int) -> Section:
    """One run identified, and `counted`: what its intervals hold over many, by `HELD`."""
    paper, free, stated = fits(one_run_of(seed))
    secant, n = stated.quantities["secant_from_touch"], stated.exponent
    assert n is not None
    low, high = secant.interval_n_per_m
    values = truth()
    lines = [
        "The rough plastic sphere in test 1; 95 % intervals over the laws that fit:",
        "",
        "| fit | K, N/m^n | n | zero, µm | secant, N/m |",
        "|---|---|---|---|---|",
        *(
            f"| {f.estimator} | {number(f.k)} | {f.n:.2f} | {f.zero_m * 1e6:.2f} "
            f"| {number(f.secant_n_per_m)} |"
            for f in (paper, free)
        ),
        f"| interval | | {n.interval[0]:.2f} to {n.interval[1]:.2f} | "
        f"| {number(low)} to {number(high)} |",
        "",
        "| the law put in, at 300 N | N/m | in this interval | in how many intervals |",
        "|---|---|---|---|",
        *(
            f"| {name} | {number(value)} | {'yes' if low <= value <= high else '**no**'} "
            f"| {100 * counted[key][0]:.0f} % |"
            for name, value, key in zip(
                ("secant from the mean plane, the paper's δ", "secant from the touch, F → 0"),
                values, HELD, strict=False,
            )
        ),
        "",
        f"The chord from {_REFERENCE_N:.0f} to 300 N needs no zero: {number(values[2])} N/m in the "
        f"law, off by {100 * (counted[HELD[2]][0] - 1):+.1f} % in the joint fits (5 to 95 %: "
        f"{100 * (counted[HELD[2]][1] - 1):+.1f} to {100 * (counted[HELD[2]][2] - 1):+.1f} %).",
    ]  # fmt: skip
    return Section("A simulated run, identified", tuple(lines))


def _chord(fit: Fit) -> float:
    top, reference = ((f / fit.k) ** (1.0 / fit.n) for f in (SECANT_FORCE_N, _REFERENCE_N))
    return float((SECANT_FORCE_N - _REFERENCE_N) / (top - reference))
