"""The result of a run for people: what goes where, in which words."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from stepload.contact.power_law import ContactLaw
from stepload.envelope.envelope import Envelope
from stepload.estimators.judge import ResultVerdict
from stepload.estimators.runin import STEADY_CYCLES, RunIn
from stepload.estimators.system import SystemStiffnessFit
from stepload.evidence.identification import Identification
from stepload.evidence.quantity import Quantity
from stepload.record.outcome import RunOutcome, RunStatus
from stepload.record.reader import Recording
from stepload.results import fields
from stepload.results.analyse import Evaluation, beyond_theory
from stepload.results.extras import Extras, extras_tables
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
from stepload.results.remarks import alive, levels, remarks
from stepload.results.run_figures import figures_of
from stepload.results.run_snippets import snippet_texts
from stepload.units import format_quantity as f

MOOD: dict[ResultVerdict, Mood] = {
    ResultVerdict.IDENTIFIED: "good",
    ResultVerdict.MARGINAL: "doubt",
    ResultVerdict.NOT_IDENTIFIABLE: "bad",
}


def identification_document(
    found: Identification,
    notes: Sequence[str] = (),
    run_in: RunIn | None = None,
    extras: Extras | None = None,
    simulated: bool = False,
) -> Document:
    """An identification from a file; `notes` say what had to be assumed.

    `run_in` and `extras` are what a record of ours says beside the law, as a run's report does.
    """
    tables = _identification_tables(found)
    if run_in is not None:
        tables.append(_run_in_table(run_in))
    if extras is not None:
        tables += extras_tables(extras)
    return Document(
        title="Identification",
        verdict=_identified(found),
        reasons=(*found.judgement.reasons, *(f"note: {note}" for note in notes)),
        tables=tables,
        simulated=simulated,
    )


def system_document(fit: SystemStiffnessFit, *, simulated: bool = False) -> Document:
    """A system stiffness from a file."""
    return Document(
        "System stiffness",
        _system_measured(fit),
        tables=[_system_table(fit)],
        simulated=simulated,
    )


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
    if run.extras is not None:
        tables += extras_tables(run.extras)
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
    if run.data is not None:
        reasons += [
            *remarks(run.data),
            *alive(run.recording.events),
            *levels(run.recording.events),
            *beyond_theory(run),
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
        texts=[*snippet_texts(run), *_texts(run.recording)],
        simulated=run.dry_run,
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
    verdict, headline = found.judgement.verdict, found.headline
    if headline is None:
        return Verdict(MOOD[verdict], verdict.value, "The data bear no stiffness.")
    low, high = headline.interval_n_per_m
    known = (
        f"95 % interval {interval('N/m')((low, high))}" if math.isfinite(high) else "no interval"
    )
    return Verdict(
        MOOD[verdict],
        verdict.value,
        f"Chord stiffness {f(headline.value_n_per_m, 'N/m')} from {f(headline.from_n, 'N')} to "
        f"{f(headline.to_n, 'N')}, {known}",
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
    procedure, theory = envelope.plan.procedure, envelope.theory
    limit_n, counted_n = theory.elastic_limit_n, theory.counted.lower_n
    of_limit = f"{outcome.peak_force_n / counted_n:.0%} of the {f(counted_n, 'N')} counted on"
    if counted_n < limit_n:
        of_limit += f" of F_c = {f(limit_n, 'N')}"
    cards = [Card("largest measured force", f(outcome.peak_force_n, "N"), of_limit)]
    if found is not None:
        cards += _stiffness_cards(found)
    levels = len(procedure.levels_n) * procedure.cycles
    took = f"{outcome.end_s - outcome.start_s:.0f} s"
    return [
        *cards,
        Card("levels done", f"{outcome.levels_done}", f"of {levels}"),
        Card("duration", took, f"preflight said {envelope.duration_s:.0f} s"),
    ]


def _stiffness_cards(found: Identification) -> list[Card]:
    evidence = found.evidence
    if evidence is None:
        return []
    cards = [
        Card(
            fields.KINDS[each.kind].strip(" *"), f(each.value_n_per_m, "N/m"),
            f"±{each.half_width:.1%}, {each.verdict.value}",
        )
        for each in evidence.quantities.values()
        if math.isfinite(each.half_width)
    ]  # fmt: skip
    if (n := evidence.exponent) is not None:
        cards.append(
            Card("exponent n", f"{n.value:.2f}", "95 % {:.2f} … {:.2f}".format(*n.interval))
        )
    return cards


def _doubts(rows: Sequence[fields.NamedFit]) -> list[str]:
    return [
        f"doubt about {row.name}: {'; '.join(doubt.message for doubt in row.fit.doubts)}"
        for row in rows
        if row.fit.doubts
    ]


def _identification_tables(found: Identification) -> list[Table]:
    rows, others = fields.fits_of(found), fields.fits_of(found, reported=False)
    why = [f"best of the fits is {found.believe}: {line}" for line in found.why]
    at = f(found.fit.secant_force_n, "N")
    beyond = found.fit.secant_force_n > 1.02 * found.peak_force_n
    title = f"Fits (* best of them), secants at {at}" + (", beyond the data" if beyond else "")
    tables = [
        *_evidence_tables(found),
        table(title, fields.FIT, rows, [*why, *_doubts(rows)]),
    ]
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


def _evidence_tables(found: Identification) -> list[Table]:
    """The stiffnesses, the lines of the headline's interval, the laws and the gates."""
    evidence = found.evidence
    if evidence is None:
        return []
    headline = evidence.headline
    notes = [
        f"{fields.KINDS[each.kind].strip(' *')}: {why}"
        for each in evidence.quantities.values()
        for why in each.why
        if why not in headline.why
    ]
    if (n := evidence.exponent) is not None:
        low, high = n.interval
        notes.append(f"exponent n = {n.value:.2f}, 95 % [{low:.2f}, {high:.2f}], {n.verdict.value}")
    total = f"All together {headline.relative:.2%}; the interval is 1.96 times that."
    return [
        table("Stiffness (* headline)", fields.QUANTITY, evidence.quantities.values(),
              [*notes, *evidence.notes], headline=True),
        table("What the headline's interval is made of", fields.LINE,
              [line for line in headline.lines if line.relative > 0.0], [total], page_only=True),
        table("Laws that were tried", fields.LAW, evidence.laws, page_only=True),
        table("Signs that the contact is not elastic", fields.GATE, evidence.gates,
              [gate.sentence for gate in evidence.gates if gate.fires], page_only=True),
    ]  # fmt: skip


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
        rows += [
            (
                f"{fields.KINDS[each.kind].strip(' *')}, {newton(each.from_n)} to "
                f"{newton(each.to_n)}",
                stiffness, _smooth(law, each), each.value_n_per_m,
            )
            for each in found.quantities.values()
            if each.kind in ("chord", "secant_from_touch")
        ]  # fmt: skip
        if seen is not None:
            reached = found.judgement.k_max_n_per_m
            rows.append(("K_max (34)", stiffness, seen.k_max_n_per_m, reached))
    texts = [(label, show(one), show(other)) for label, show, one, other in rows]
    columns = ("figure", "predicted", "measured")
    return Table(
        "Theory of the smooth contact predicted, run measured", columns, texts, page_only=True
    )


def _smooth(law: ContactLaw, each: Quantity) -> float:
    """The same stiffness of the smooth law."""
    return (each.to_n - each.from_n) / (law.deformation(each.to_n) - law.deformation(each.from_n))


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
        f"; the touch has moved by {f(found.residual_indentation_m, 'm')}, found to a quantum each"
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
        f"({lag.how}); {press.lag_corrected_s * 1e3:.2f} ms corrected; a force that comes early is "
        "damping or creep and stays in the data."
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
