"""The result of a run for people: what goes where, in which words."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from stepload.envelope.envelope import Envelope
from stepload.identify.identification import Identification
from stepload.identify.judge import ResultVerdict
from stepload.identify.runin import STEADY_CYCLES, RunIn
from stepload.identify.system import SystemStiffnessFit
from stepload.record.outcome import RunOutcome, RunStatus
from stepload.record.reader import Recording
from stepload.results import fields
from stepload.results.analyse import Evaluation
from stepload.results.model import (
    Card,
    Document,
    Mood,
    Show,
    Table,
    Verdict,
    interval,
    number,
    quantity,
    table,
)
from stepload.results.press_data import PressData
from stepload.results.run_figures import figures_of
from stepload.units import format_quantity as f

MOOD: dict[ResultVerdict, Mood] = {
    ResultVerdict.IDENTIFIED: "good",
    ResultVerdict.MARGINAL: "doubt",
    ResultVerdict.NOT_IDENTIFIABLE: "bad",
}


def identification_document(found: Identification, notes: Sequence[str] = ()) -> Document:
    """An identification from a file; `notes` say what had to be assumed."""
    return Document(
        title="Identification",
        verdict=_identified(found),
        reasons=(*found.judgement.reasons, *(f"note: {note}" for note in notes)),
        tables=_identification_tables(found),
    )


def system_document(fit: SystemStiffnessFit) -> Document:
    """A system stiffness from a file."""
    return Document("System stiffness", _system_measured(fit), tables=[_system_table(fit)])


def run_document(run: Evaluation) -> Document:
    """The result of a run, from its verdict to the plan that it ran."""
    verdict, found, envelope = _verdict(run), run.identification, run.envelope
    tables: list[Table] = []
    if found is not None:
        tables += _identification_tables(found)
    if run.system is not None:
        tables.append(_system_table(run.system))
    if run.run_in is not None:
        tables.append(_run_in_table(run.run_in))
    tables.append(_predicted_table(run))
    if run.data is not None:
        tables.append(_channel_table(run.data))
    tables += [
        _safing_table(run.outcome),
        force_budget_table(envelope, page_only=True),
        _rig_table(run.recording),
    ]
    reasons = list(found.judgement.reasons) if found is not None else []
    reasons += [
        f"preflight: {reason.message}" for reason in envelope.reasons if reason.severity != "note"
    ]
    if run.problem and run.problem != verdict.text:
        reasons.append(run.problem)
    if resumed := run.recording.metadata.get("resumed"):
        reasons.append(resumed)
    kind = "dry run on the simulated rig" if run.dry_run else "run"
    return Document(
        title=envelope.plan.name,
        subtitle=f"{kind} · {run.recording.metadata.get('started', '')} · "
        f"run {run.recording.metadata.get('run_id', '')}",
        verdict=verdict,
        ended=run.outcome.why,
        reasons=reasons,
        tables=tables,
        cards=_cards(run),
        figures=figures_of(run),
        texts=_texts(run.recording),
    )


def force_budget_table(envelope: Envelope, *, page_only: bool = False) -> Table:
    """What the guarded approach may add to the force, term by term."""
    return table(
        f"Force budget at the guarded speed of {f(envelope.guarded_speed_m_s, 'm/s')}",
        fields.FORCE_TERM, envelope.force_budget, page_only=page_only,
    )  # fmt: skip


def _verdict(run: Evaluation) -> Verdict:
    """What a run comes to; one that was not completed is bad whatever it has measured."""
    if run.identification is not None:
        verdict = _identified(run.identification)
    elif run.system is not None:
        verdict = _system_measured(run.system)
    else:
        text = run.problem or "There was no contact to identify."
        verdict = Verdict("doubt", "no result", text)
    status = run.outcome.status
    return verdict if status is RunStatus.COMPLETED else Verdict("bad", status.value, verdict.text)


def _identified(found: Identification) -> Verdict:
    fit, stated = found.fit, found.budget
    known = (
        f"95 % interval {interval('N/m')(stated.interval_secant_n_per_m)}"
        if stated
        else "no interval"
    )
    return Verdict(
        MOOD[found.judgement.verdict],
        found.judgement.verdict.value,
        f"Secant stiffness {f(fit.secant_n_per_m, 'N/m')} at {f(fit.secant_force_n, 'N')}, {known}",
    )


def _system_measured(fit: SystemStiffnessFit) -> Verdict:
    return Verdict(
        "good",
        "system stiffness measured",
        f"System stiffness K_s = {f(fit.stiffness_n_per_m, 'N/m')}"
        f" ± {f(fit.sigma_n_per_m, 'N/m')} (standard uncertainty)",
    )


def _cards(run: Evaluation) -> list[Card]:
    outcome, envelope, found = run.outcome, run.envelope, run.identification
    procedure, limit_n = envelope.plan.procedure, envelope.theory.elastic_limit_n
    of_limit = f"{outcome.peak_force_n / limit_n:.0%} of F_c = {f(limit_n, 'N')}"
    cards = [Card("largest measured force", f(outcome.peak_force_n, "N"), of_limit)]
    if found is not None:
        fit, stated = found.fit, found.budget
        n = "95 % {:.2f} … {:.2f}".format(*stated.interval_n) if stated else ""
        k = "95 % {:.2g} … {:.2g}".format(*stated.interval_k) if stated else ""
        cards += [
            Card("exponent n", f"{fit.n:.3f}", n),
            Card("K", f"{fit.k:.3g} N/mⁿ", k),
            Card("fitted zero δ₀", f(fit.zero_m, "m"), "against the detected touch"),
        ]
    levels = len(procedure.levels_n) * procedure.cycles
    took = f"{outcome.end_s - outcome.start_s:.0f} s"
    return [
        *cards,
        Card("levels done", f"{outcome.levels_done}", f"of {levels}"),
        Card("duration", took, f"preflight said {envelope.duration_s:.0f} s"),
    ]


def _doubts(rows: Sequence[fields.NamedFit]) -> list[str]:
    return [
        f"doubt about {row.name}: {'; '.join(doubt.message for doubt in row.fit.doubts)}"
        for row in rows
        if row.fit.doubts
    ]


def _identification_tables(found: Identification) -> list[Table]:
    rows, others = fields.fits_of(found), fields.fits_of(found, reported=False)
    why = [f"believe {found.believe}: {line}" for line in found.why]
    at = f(found.fit.secant_force_n, "N")
    title = f"Fits (* believed), secants at {at}"
    tables = [table(title, fields.FIT, rows, [*why, *_doubts(rows)])]
    if others:
        title = "Fits of the other estimators"
        tables.append(table(title, fields.FIT, others, _doubts(others), page_only=True))
    if (stated := found.budget) is not None:
        note = (
            f"All together: u(n) = {stated.sigma_n:.4f}, u(secant)/secant = "
            f"{stated.sigma_secant_relative:.2%}; intervals are {stated.coverage_factor:.2f} u."
        )
        title = f"Uncertainty budget of {found.believe}"
        tables.append(table(title, fields.BUDGET_LINE, stated.lines, [note], page_only=True))
    return tables


def _system_table(fit: SystemStiffnessFit) -> Table:
    shown = [field for field in fields.SYSTEM + fields.SYSTEM_REST if field.label]
    rows = [(field.label, field.text(fit)) for field in shown]
    return Table("System stiffness (26)", ("figure", "value"), rows)


def _predicted_table(run: Evaluation) -> Table:
    envelope, found, outcome = run.envelope, run.identification, run.outcome
    law, seen = envelope.theory.law, envelope.identifiability
    newton, stiffness = quantity("N"), quantity("N/m")
    rows: list[tuple[str, Show, float, float]] = [
        ("duration [s]", number(".0f"), envelope.duration_s, outcome.end_s - outcome.start_s),
        ("largest force", newton, envelope.top_force_n, outcome.peak_force_n),
    ]
    if found is not None:
        fit, top_n = found.fit, min(envelope.top_force_n, found.peak_force_n)
        deep_m = [(top_n / k) ** (1.0 / n) for k, n in ((law.k, law.n), (fit.k, fit.n))]
        secant = f"secant at {newton(fit.secant_force_n)}"
        rows += [
            ("K [N/mⁿ]", number(".3g"), law.k, fit.k),
            ("n", number(".3f"), law.n, fit.n),
            (secant, stiffness, envelope.secant_n_per_m, fit.secant_n_per_m),
            (f"deformation at {newton(top_n)}", quantity("m"), deep_m[0], deep_m[1]),
        ]
        if seen is not None:
            reached = found.judgement.identifiability.k_max_n_per_m
            rows.append(("K_max (34)", stiffness, seen.k_max_n_per_m, reached))
    texts = [(label, show(one), show(other)) for label, show, one, other in rows]
    columns = ("figure", "predicted", "measured")
    return Table("Preflight predicted, run measured", columns, texts, page_only=True)


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
    note = (
        f"{virgin}; {steady}; shakedown {f(found.shakedown_m, 'm')}{indentation}. "
        "Virgin and steady are two results: there is no mean of them."
    )
    return table("Cycles", fields.CYCLE, found.cycles, [note])


def _channel_table(press: PressData) -> Table:
    lag = press.lag
    note = (
        f"Force lags position by {lag.lag_s * 1e3:.2f} ± {lag.sigma_s * 1e3:.2f} ms "
        f"({lag.how}); {press.lag_corrected_s * 1e3:.2f} ms corrected."
        if math.isfinite(lag.lag_s)
        else f"Lag not measured: {lag.how}."
    )
    return table("Time", fields.CLOCK, press.clocks, [note], page_only=True)


def _safing_table(outcome: RunOutcome) -> Table:
    late = outcome.lateness
    note = (
        f"Ticks: {late.ticks}, late by more than a period: {late.overruns}, "
        f"worst {late.worst_s * 1e3:.2f} ms."
    )
    return table("Safing", fields.SAFING, outcome.safing, [note], page_only=True)


def _rig_table(recording: Recording) -> Table:
    rows = [
        (key, value)
        for key, value in sorted(recording.metadata.items())
        if value and not key.startswith(("sha256", "clock_offset"))
    ]
    return Table("Run", ("what", "value"), rows, page_only=True)


def _texts(recording: Recording) -> list[tuple[str, str]]:
    texts = []
    for name, content in recording.attachments.items():
        if name.endswith((".yaml", ".json")) and name != "results.json":
            text = content.decode("utf-8", "replace")
            if name.endswith(".json"):
                text = json.dumps(json.loads(text), indent=1, ensure_ascii=False)
            texts.append((name, text))
    return texts
