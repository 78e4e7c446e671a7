"""Composes the report of a run: what goes where, in which words."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from stepload.identify.fit import Fit
from stepload.identify.identification import REPORTED, Identification
from stepload.identify.judge import ResultVerdict
from stepload.identify.runin import STEADY_CYCLES, RunIn
from stepload.identify.system import SystemStiffnessFit
from stepload.record.outcome import RunOutcome, RunStatus
from stepload.record.reader import Recording
from stepload.results import comparison_figures as comparison
from stepload.results import figures
from stepload.results.evaluation import Evaluation
from stepload.results.html import Card, Figure, Page, Table
from stepload.results.press_data import PressData
from stepload.units import format_quantity as f

FloatArray = NDArray[np.float64]

MOOD = {
    ResultVerdict.IDENTIFIED: "good",
    ResultVerdict.MARGINAL: "doubt",
    ResultVerdict.NOT_IDENTIFIABLE: "bad",
}


def interval(low: float, high: float, unit: str) -> str:
    """An interval in one unit."""
    return f"[{f(low, unit)}, {f(high, unit)}]"


def smooth_error(size_m: float, degrees: float | None) -> str:
    """A smooth error and how well its size is known."""
    known = "" if degrees is None else f", known with {degrees:.2g} degrees of freedom"
    return f"{f(size_m, 'm')}{known}"


def headline(run: Evaluation) -> tuple[str, str, str]:
    """(mood, verdict, headline) of a run."""
    outcome, found, system = run.outcome, run.identification, run.system
    if outcome.status is not RunStatus.COMPLETED:
        mood, verdict = "bad", outcome.status.value
    elif found is not None:
        mood, verdict = MOOD[found.judgement.verdict], found.judgement.verdict.value
    elif system is not None:
        mood, verdict = "good", "system stiffness measured"
    else:
        mood, verdict = "doubt", "no result"
    if found is not None:
        fit, stated = found.fit, found.budget
        text = (
            f"Secant stiffness {f(fit.secant_n_per_m, 'N/m')} at {f(fit.secant_force_n, 'N')}"
            + (f", 95 % interval {interval(*stated.interval_secant_n_per_m, 'N/m')}" if stated else
               ", no interval")
        )  # fmt: skip
    elif system is not None:
        text = (
            f"System stiffness K_s = {f(system.stiffness_n_per_m, 'N/m')}"
            f" ± {f(system.sigma_n_per_m, 'N/m')} (standard uncertainty)"
        )
    else:
        text = run.problem or "There was no contact to identify."
    return mood, verdict, text


def _cards(run: Evaluation) -> list[Card]:
    outcome, envelope, found = run.outcome, run.envelope, run.identification
    limit_n = envelope.theory.elastic_limit_n
    cards = [
        Card(
            "largest measured force",
            f(outcome.peak_force_n, "N"),
            f"{outcome.peak_force_n / limit_n:.0%} of F_c = {f(limit_n, 'N')}",
        )
    ]
    if found is not None:
        stated = found.budget
        cards += [
            Card(
                "exponent n",
                f"{found.fit.n:.3f}",
                "95 % {:.2f} … {:.2f}".format(*stated.interval_n) if stated else "",
            ),
            Card(
                "K",
                f"{found.fit.k:.3g} N/mⁿ",
                "95 % {:.2g} … {:.2g}".format(*stated.interval_k) if stated else "",
            ),
            Card(
                "fitted zero δ₀",
                f(found.fit.zero_m, "m"),
                "against the detected touch",
            ),
        ]
    cards.append(
        Card(
            "levels done",
            f"{outcome.levels_done}",
            f"of {len(run.envelope.plan.procedure.levels_n) * run.envelope.plan.procedure.cycles}",
        )
    )
    cards.append(
        Card(
            "duration",
            f"{outcome.end_s - outcome.start_s:.0f} s",
            f"preflight said {envelope.duration_s:.0f} s",
        )
    )
    return cards


def _law(fit: Fit) -> Callable[[FloatArray], FloatArray]:
    def law(deformation_m: FloatArray) -> FloatArray:
        return np.asarray(fit.k * np.maximum(deformation_m - fit.zero_m, 0.0) ** fit.n)

    return law


def _figures(run: Evaluation) -> list[Figure]:
    data, found, recording = run.data, run.identification, run.recording
    if data is None or len(data.time_s) < 2:
        return []
    start_s = run.outcome.start_s
    trace = figures.Trace(data.time_s - start_s, data.force_n, data.travel_m, data.phase)
    limit_n = run.envelope.theory.elastic_limit_n
    made = [
        Figure(
            "time", "Force and displacement against time",
            "Tared contact force and travel since touch; colours are the phases of the procedure.",
            "force and displacement over time", figures.over_time(trace),
        ),
        Figure(
            "limit", "Force against F_c",
            "Measured force and the supervisor's predicted peak against the force limit F_lim and "
            "the elastic limit F_c.",
            f"force over time, elastic limit {f(limit_n, 'N')}",
            figures.against_limit(
                trace, recording.ticks.predicted_peak_n, recording.ticks.time_s - start_s,
                {"F_c": limit_n, "F_lim": run.envelope.force_limit_n},
            ),
        ),
    ]  # fmt: skip
    if (system := run.system) is not None:
        made.append(
            Figure(
                "misfit", "What the line leaves",
                "Travel less the fitted line (26), over the forces of the fit. A bend speaks for a "
                "contact that is not settled or for a load path that is not linear.",
                "misfit of the system stiffness over force",
                comparison.misfits({"misfit": (system.misfit_force_n, system.misfit_m)}),
            )
        )  # fmt: skip
    if found is None:
        return made
    laws = {name: _law(found.fits[name]) for name in REPORTED if name in found.fits}
    laws[found.believe] = _law(found.fit)
    x, y = found.deformation_m, found.force_n
    made += [
        Figure(
            "law", "Force against deformation",
            f"Loading data and fits; believed is {found.believe}.",
            "force over deformation with fitted laws",
            figures.force_deformation(x, y, laws, found.believe),
        ),
        Figure(
            "residuals", "Residuals",
            "Measured force minus fitted law. Residuals do not show what a fit has absorbed: the "
            "interval comes from the uncertainty budget.",
            "force residuals over force",
            figures.residuals(y, {name: y - law(x) for name, law in laws.items()}, found.believe),
        ),
    ]  # fmt: skip
    if (stated := found.budget) is not None:
        ln_k, n = stated.ellipse.outline()
        points = [(name, found.fits[name].k, found.fits[name].n) for name in laws]
        made.append(
            Figure(
                "ellipse", "What K and n can be together",
                "K and n are strongly correlated: quote the secant, which is far better known.",
                "joint confidence region of K and n",
                figures.ellipse(np.exp(ln_k), n, points),
            )
        )  # fmt: skip
    return made


def _fit_table(found: Identification) -> Table:
    rows = []
    for name in (*REPORTED, *(n for n in found.fits if n not in REPORTED)):
        if (fit := found.fits.get(name)) is None:
            continue
        stated = found.budgets.get(name)
        rows.append(
            (
                f"{name} ← believed" if name == found.believe else name,
                f"{fit.k:.3g}",
                f"{fit.n:.3f}",
                f(fit.zero_m, "m") if fit.zero_m else "as given",
                f(fit.secant_n_per_m, "N/m"),
                interval(*stated.interval_secant_n_per_m, "N/m") if stated else "–",
                f(fit.force_rms_n, "N"),
                "; ".join(d.message for d in fit.doubts) or "–",
            )
        )
    return Table(
        "Fits",
        ("fit", "K [N/mⁿ]", "n", "zero", "secant", "95 % interval", "rms residual", "doubts"),
        rows,
        "; ".join(found.why),
    )


def _budget_table(found: Identification) -> Table | None:
    if (stated := found.budget) is None:
        return None
    return Table(
        f"Uncertainty budget of {found.believe}",
        ("source", "size", "u(K)/K", "u(n)", "u(secant)/secant"),
        [
            (line.source, line.size, f"{line.ln_k:.2%}", f"{line.n:.4f}",
             f"{line.secant_relative:.2%}")
            for line in stated.lines
        ],
        f"All together: u(n) = {stated.sigma_n:.4f}, u(secant)/secant = "
        f"{stated.sigma_secant_relative:.2%}; intervals are {stated.coverage_factor:.2f} u. "
        f"{'; '.join(found.judgement.reasons)}.",
    )  # fmt: skip


def _predicted_table(run: Evaluation) -> Table:
    envelope, found, outcome = run.envelope, run.identification, run.outcome
    rows = [
        ("duration", f"{envelope.duration_s:.0f} s", f"{outcome.end_s - outcome.start_s:.0f} s"),
        ("largest force", f(envelope.top_force_n, "N"), f(outcome.peak_force_n, "N")),
    ]
    if found is not None:
        fit = found.fit
        top_n = min(envelope.top_force_n, found.peak_force_n)
        rows += [
            ("K [N/mⁿ]", f"{envelope.theory.law.k:.3g}", f"{fit.k:.3g}"),
            ("n", f"{envelope.theory.law.n:.3f}", f"{fit.n:.3f}"),
            (
                f"secant at {f(fit.secant_force_n, 'N')}",
                f(envelope.secant_n_per_m, "N/m"),
                f(fit.secant_n_per_m, "N/m"),
            ),
            (
                f"deformation at {f(top_n, 'N')}",
                f((top_n / envelope.theory.law.k) ** (1.0 / envelope.theory.law.n), "m"),
                f((top_n / fit.k) ** (1.0 / fit.n), "m"),
            ),
        ]
        if envelope.identifiability is not None:
            rows.append(
                (
                    "K_max (34)",
                    f(envelope.identifiability.k_max_n_per_m, "N/m"),
                    f(found.judgement.identifiability.k_max_n_per_m, "N/m"),
                )
            )
    return Table("Preflight predicted, run measured", ("figure", "predicted", "measured"), rows)


def _run_in_table(found: RunIn) -> Table:
    if found.steady:
        steady = f"steady at cycle {found.steady.number}"
    elif len(found.cycles) < STEADY_CYCLES:
        steady = f"fewer than {STEADY_CYCLES} cycles do not show whether it is steady"
    else:
        steady = (
            f"not steady: chord changed by {found.secant_change:.2%} (allowed "
            f"{found.secant_tolerance:.2%}), loop energy by {found.energy_change:.0%} "
            f"(allowed {found.energy_tolerance:.0%}) over the last {STEADY_CYCLES} cycles"
        )
    virgin = (
        f"Cycle {found.virgin.number} is the virgin contact"
        if found.virgin
        else "The virgin contact is not in this record"
    )
    indentation = (
        f"; residual indentation {f(found.residual_indentation_m, 'm')}"
        if found.residual_indentation_m is not None
        else ""
    )
    return Table(
        "Cycles",
        ("cycle", "secant", "n", "chord stiffness", "loop energy", "of stored"),
        [
            (str(c.number), f(c.fit.secant_n_per_m, "N/m"), f"{c.fit.n:.3f}",
             f(c.chord_n_per_m, "N/m"),
             f"{c.loop_energy_j * 1e3:.3g} ± {c.loop_sigma_j * 1e3:.1g} mJ",
             f"{c.loop_energy_j / c.stored_energy_j:.1%}")
            for c in found.cycles
        ],
        f"{virgin}; {steady}; shakedown {f(found.shakedown_m, 'm')}"
        f"{indentation}. Virgin and steady are two results: there is no mean of them.",
    )  # fmt: skip


def _system_table(fit: SystemStiffnessFit) -> Table:
    return Table(
        "System stiffness (26)",
        ("figure", "value"),
        [
            ("K_s", f(fit.stiffness_n_per_m, "N/m")),
            ("standard uncertainty", f(fit.sigma_n_per_m, "N/m")),
            ("upper limit, if the contact is in series", f(fit.stiffness_upper_n_per_m, "N/m")),
            ("C_s, lower bound", f"{fit.damping_lower_bound_n_s_per_m:.3g} N s/m"),
            ("MSDE", f(fit.msde_m, "m")),
            ("smooth position error", smooth_error(fit.smooth_error_m, fit.smooth_degrees)),
            ("nonlinearity", f"{fit.nonlinearity:+.2%} ± {fit.nonlinearity_sigma:.2%}"),
            ("force range", interval(*fit.force_range_n, "N")),
            ("samples", str(fit.points)),
        ],
    )


def _channel_table(data: PressData) -> Table:
    rows = [
        (c.channel, c.how, c.why or "–", f"{c.skew_ppm:.1f} ppm", _us(c.residual_median_us),
         _us(c.residual_p99_us))
        for c in data.clocks
    ]  # fmt: skip
    lag = (
        f"Force lags position by {data.lag.lag_s * 1e3:.2f} ± {data.lag.sigma_s * 1e3:.2f} ms "
        f"({data.lag.how}); {data.lag_corrected_s * 1e3:.2f} ms corrected."
        if math.isfinite(data.lag.lag_s)
        else f"Lag not measured: {data.lag.how}."
    )
    return Table(
        "Time",
        ("channel", "times from", "why", "skew", "residual, median", "residual, 99 %"),
        rows,
        lag,
    )


def _us(value: float) -> str:
    return f"{value:.0f} µs" if math.isfinite(value) else "–"


def _safing_table(outcome: RunOutcome) -> Table:
    return Table(
        "Safing",
        ("action", "sent", "took", "error"),
        [
            (s.name, "yes" if s.sent else "no", f"{s.duration_s * 1e3:.1f} ms", s.error or "–")
            for s in outcome.safing
        ],
        f"Ticks: {outcome.lateness.ticks}, late by more than a period: "
        f"{outcome.lateness.overruns}, worst {outcome.lateness.worst_s * 1e3:.2f} ms.",
    )


def _rig_table(recording: Recording) -> Table:
    shown = {
        key: value
        for key, value in sorted(recording.metadata.items())
        if value and not key.startswith(("sha256", "clock_offset"))
    }
    return Table("Run", ("what", "value"), list(shown.items()))


def _texts(recording: Recording) -> Sequence[tuple[str, str]]:
    texts = []
    for name, content in recording.attachments.items():
        if name.endswith((".yaml", ".json")) and name != "results.json":
            text = content.decode("utf-8", "replace")
            if name.endswith(".json"):
                text = json.dumps(json.loads(text), indent=1, ensure_ascii=False)
            texts.append((name, text))
    return texts


def compose(run: Evaluation) -> Page:
    """The report page of a run."""
    mood, verdict, text = headline(run)
    found, envelope = run.identification, run.envelope
    tables: list[Table | None] = []
    reasons = []
    if found is not None:
        tables += [_fit_table(found), _budget_table(found)]
        reasons += list(found.judgement.reasons)
    if run.system is not None:
        tables.append(_system_table(run.system))
    if run.run_in is not None:
        tables.append(_run_in_table(run.run_in))
    tables.append(_predicted_table(run))
    if run.data is not None:
        tables.append(_channel_table(run.data))
    tables += [
        _safing_table(run.outcome),
        Table(
            "Force budget of the guarded approach",
            ("term", "force", "from"),
            [(term.name, f(term.value, "N"), term.source) for term in envelope.force_budget],
            f"at {f(envelope.guarded_speed_m_s, 'm/s')}",
        ),
        _rig_table(run.recording),
    ]
    reasons += [
        f"preflight: {reason.message}" for reason in envelope.reasons if reason.severity != "note"
    ]
    if run.problem:
        reasons.append(run.problem)
    if resumed := run.recording.metadata.get("resumed"):
        reasons.append(resumed)
    kind = "dry run on the simulated rig" if run.dry_run else "run"
    return Page(
        title=run.envelope.plan.name,
        subtitle=f"{kind} · {run.recording.metadata.get('started', '')} · "
        f"run {run.recording.metadata.get('run_id', '')}",
        mood=mood,
        verdict=verdict,
        headline=text,
        reasons=reasons,
        stopped=run.outcome.why,
        cards=_cards(run),
        figures=_figures(run),
        tables=[table for table in tables if table is not None],
        texts=_texts(run.recording),
    )
