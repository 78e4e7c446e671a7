"""One simulated run of the paper's experiment, what identification makes of it, and how often the
intervals hold the truth; every draw is seeded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stepload.identification.conditions import Conditions, Sources
from stepload.identification.estimators import confidence_band
from stepload.identification.fit import Fit
from stepload.identification.inverse_law import joint
from stepload.identification.loops import Track
from stepload.identification.ls import rs_btls, smallest_direction
from stepload.identification.recursive import RsRtls
from stepload.identification.run_data import RunData
from stepload.identification.samples import uniform_in_force
from stepload.identification.verdict import Judgement, judge
from stepload_verify.paper import laws
from stepload_verify.paper.chart import Line, chart
from stepload_verify.paper.printed import PAYLOADS, SECANT_FORCE_N
from stepload_verify.paper.rows import number
from stepload_verify.paper.section import Section
from stepload_verify.paper.step_load import SCENARIO_C, STVF, FloatArray, RawRun, press

RUNS = 100
SEED = 2009
RIG = replace(STVF, rate_hz=200.0)
_REFERENCE_FORCE_N = 30.0
_SOURCES = Sources(
    STVF.stiffness_n_per_m,
    system_stiffness_sigma_n_per_m=SCENARIO_C.stiffness_sigma * STVF.stiffness_n_per_m,
    smooth_error_m=SCENARIO_C.smooth_m,
    smooth_length_n=SCENARIO_C.length_n,
    force_noise_n=STVF.force_noise_n,
    force_resolution_n=STVF.force_resolution_n,
    position_resolution_m=STVF.position_resolution_m,
)


def one_run_of(seed: int = SEED) -> RawRun:
    """The rough plastic sphere, pressed in scenario C."""
    return press(laws.measured(PAYLOADS[0]), RIG, SCENARIO_C, np.random.default_rng(seed))


def one_run(run: RawRun) -> Section:
    """The experiment as recorded."""
    pick = slice(None, None, 10)
    time = run.time_s[pick]
    figure = chart(
        "One run: force and travel over time",
        "time, s",
        "force, N; travel, µm",
        [
            Line("force, N", time, run.force_n[pick]),
            Line("travel from touch, µm", time, run.travel_m[pick] * 1e6),
        ],
    )
    lines = (
        "The rough plastic sphere on the STVF rig, scenario C, quanta of 2 µm and 1.5 N.",
        "",
        "![run](paper/run.svg)",
    )
    return Section("A simulated run", lines, files={"run.svg": figure})


def one_fit(run: RawRun) -> Section:
    """Force over deformation, both fits and the band; and the truth beside the intervals."""
    paper, free, stated = _fits(run)
    secant, n = stated.quantities["secant_from_touch"], stated.exponent
    assert stated.covariance is not None
    assert n is not None
    deformation, force = _points(run)
    contact = np.linspace(0.5e-6, float(deformation.max()) - free.zero_m, 100)
    lower_n, upper_n = confidence_band(free, stated.covariance, contact)
    inside = upper_n < 330.0
    drawn = [
        Line("points", deformation * 1e6, force, dots=True),
        Line("RS-BTLS", *_curve(paper, contact)),
        Line("joint (K, n, zero)", *_curve(free, contact + free.zero_m)),
        Line("95 % band", (contact + free.zero_m)[inside] * 1e6, upper_n[inside], dashed=True),
        Line("", (contact + free.zero_m) * 1e6, lower_n, dashed=True),
    ]
    figure = chart("Force over deformation (27)", "deformation from touch, µm", "force, N", drawn)
    truth = _Truth()
    low, high = secant.interval_n_per_m
    held = [_held(run_seed, truth) for run_seed in range(SEED, SEED + RUNS)]
    mean_plane, touch = (sum(each[i] for each in held) for i in (0, 1))
    chords = np.quantile([each[2] / truth.chord - 1.0 for each in held], [0.05, 0.5, 0.95])
    lines = [
        "![fit](paper/fit.svg)",
        "",
        "| fit | K, N/m^n | n | zero, µm | secant, N/m | rms force, N |",
        "|---|---|---|---|---|---|",
        *(
            f"| {f.estimator} | {number(f.k)} | {f.n:.3f} | {f.zero_m * 1e6:.2f} "
            f"| {number(f.secant_n_per_m)} | {f.force_rms_n:.2f} |"
            for f in (paper, free)
        ),
        "",
        f"95 % intervals over the laws that fit: n {n.interval[0]:.2f} to {n.interval[1]:.2f}, "
        f"secant {number(low)} to {number(high)} N/m. The payload is rough (10), no power law. Its "
        "secant depends on the zero:",
        "",
        f"| the law put in, at 300 N | N/m | in this interval | in the intervals of {RUNS} runs |",
        "|---|---|---|---|",
        f"| secant from the mean plane, the paper's δ | {number(truth.mean_plane)} "
        f"| {_yes(low <= truth.mean_plane <= high)} | {mean_plane} |",
        f"| secant from the first touch, F → 0 | {number(truth.touch)} "
        f"| {_yes(low <= truth.touch <= high)} | {touch} |",
        "",
        f"The chord from {_REFERENCE_FORCE_N:.0f} to 300 N needs no zero: {number(truth.chord)} "
        f"N/m in the law, {number(_chord(free))} N/m in this fit; over the {RUNS} runs it is off "
        f"by {100 * chords[1]:+.1f} % (5 to 95 %: {100 * chords[0]:+.1f} to "
        f"{100 * chords[2]:+.1f} %).",
    ]
    return Section("A simulated run, identified", tuple(lines), files={"fit.svg": figure})


def recursion(run: RawRun) -> Section:
    """The course of the recursive estimate, and what forgetting does in a hold."""
    drawn = []
    for label, forgetting, band in (
        ("λ = 0.999, frozen at rest", 0.999, 3.0),
        ("λ = 0.99, not frozen", 0.99, -1.0),
    ):
        fit = RsRtls(forgetting, SECANT_FORCE_N, rest_band_n=band)
        time, exponent = [], []
        deformation, force = run.deformation_m()[::2], run.loaded_n()[::2]
        for i, (d, f) in enumerate(zip(deformation.tolist(), force.tolist(), strict=True)):
            fit.update(d, f)
            if i > 60 and i % 6 == 0:
                time.append(i * 2 / RIG.rate_hz)
                exponent.append(smallest_direction(fit.triangle())[1])
        course = np.clip(np.nan_to_num(np.array(exponent), nan=0.0), 0.0, 4.0)
        drawn.append(Line(label, np.array(time), course))
    figure = chart(
        "RS-RTLS: exponent over time, 100 Hz", "time from touch, s", "n̂ (cut at 4)", drawn
    )
    lines = (
        "Without freezing, a hold of 3 s at λ = 0.99 forgets the ramp, and the exponent is "
        "fitted to noise.",
        "",
        "![recursion](paper/recursion.svg)",
    )
    return Section("The recursive estimate (RS-RTLS)", lines, files={"recursion.svg": figure})


class _Truth:
    """Stiffnesses in N/m of the rough plastic sphere at 300 N, by (10)."""

    def __init__(self) -> None:
        contact = laws.rough(PAYLOADS[0])
        top = contact.deformation(SECANT_FORCE_N)
        reference = contact.deformation(_REFERENCE_FORCE_N)
        self.mean_plane = SECANT_FORCE_N / top
        self.touch = SECANT_FORCE_N / (top - contact.deformation(0.0))
        self.chord = (SECANT_FORCE_N - _REFERENCE_FORCE_N) / (top - reference)


def _held(seed: int, truth: _Truth) -> tuple[bool, bool, float]:
    """Whether the interval holds the secant from the mean plane and from the first touch; and the
    joint fit's chord stiffness in N/m."""
    _, free, stated = _fits(one_run_of(seed))
    low, high = stated.quantities["secant_from_touch"].interval_n_per_m
    return low <= truth.mean_plane <= high, low <= truth.touch <= high, _chord(free)


def _fits(run: RawRun) -> tuple[Fit, Fit, Judgement]:
    deformation, force = _points(run)
    pressed = slice(run.touch, None)
    track = Track(
        run.time_s[pressed], run.force_n[pressed], run.travel_m[pressed],
        np.zeros(run.force_n.size - run.touch, dtype=np.intp),
    )  # fmt: skip
    sources = replace(_SOURCES, system_stiffness_n_per_m=run.stiffness_n_per_m)
    told = Conditions(sources, SECANT_FORCE_N, 0.0, STVF.position_resolution_m)
    free = joint(deformation, force, secant_force_n=SECANT_FORCE_N)
    return (
        rs_btls(deformation, force, secant_force_n=SECANT_FORCE_N),
        free,
        judge(RunData([(1, track, None)], told)),
    )


def _chord(fit: Fit) -> float:
    top, reference = ((f / fit.k) ** (1.0 / fit.n) for f in (SECANT_FORCE_N, _REFERENCE_FORCE_N))
    return float((SECANT_FORCE_N - _REFERENCE_FORCE_N) / (top - reference))


def _points(run: RawRun) -> tuple[FloatArray, FloatArray]:
    force, deformation = run.loaded_n(), run.deformation_m()
    pick = uniform_in_force(force, 300)
    pick = pick[force[pick] > 0]
    return deformation[pick], force[pick]


def _curve(fit: Fit, deformation_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Micrometres and newtons of a fit, for a chart."""
    return deformation_m * 1e6, fit.k * np.maximum(deformation_m - fit.zero_m, 0.0) ** fit.n


def _yes(held: bool) -> str:
    return "yes" if held else "**no**"
