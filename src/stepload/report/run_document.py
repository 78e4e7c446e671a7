"""The result of a run as a document for people."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from stepload.identification.conditions import BRANCHES
from stepload.identification.identify import Identification
from stepload.identification.quantity import ResultVerdict
from stepload.identification.system_stiffness import SystemStiffnessFit
from stepload.record.outcome import RunStatus
from stepload.record.reader import Recording
from stepload.report.analyse import Evaluation
from stepload.report.certificate import run_certificate
from stepload.report.conditions import planned
from stepload.report.from_file import FromFile
from stepload.report.identified import QuantityRow
from stepload.report.levels import Level, hold_table, levels_of
from stepload.report.model import NOTHING, Document, Mood, Table, Verdict
from stepload.report.provenance import provenance_table
from stepload.report.reasons import reasons_of
from stepload.report.run_figures import figures_of, law_figure
from stepload.report.tables import (
    brief_lines,
    budget_table,
    ending_table,
    identification_tables,
    predicted_table,
    preflight_table,
    run_in_table,
    system_table,
    time_table,
)
from stepload.units import format_quantity as f

MOOD: dict[ResultVerdict, Mood] = {
    ResultVerdict.IDENTIFIED: "good",
    ResultVerdict.MARGINAL: "doubt",
    ResultVerdict.NOT_IDENTIFIABLE: "bad",
}


def identification_document(told: FromFile) -> Document:
    """An identification from a file, with the further results of a record as in a run's report."""
    tables = [*identification_tables(told.found), *budget_table(told.found)]
    if told.run_in is not None:
        tables.append(run_in_table(told.run_in))
    return Document(
        title="Identification",
        subtitle=" · ".join(told.reading.lines()) if told.reading is not None else "",
        verdict=_identified(told.found),
        reasons=(*told.found.reasons, *(f"note: {note}" for note in told.notes)),
        brief=brief_lines(told.found),
        tables=tables,
        simulated=told.simulated,
    )


def system_document(fit: SystemStiffnessFit, *, simulated: bool) -> Document:
    """A system stiffness from a file."""
    return Document(
        "System stiffness",
        _system_measured(fit),
        tables=[system_table(fit)],
        simulated=simulated,
    )


def run_document(run: Evaluation) -> Document:
    """The result of a run: the most important on one sheet, then all details."""
    reasons, levels = _reasons(run), levels_of_run(run)
    system = None if run.system is None else system_table(run.system)
    world = run.recording.metadata.get("world", "")
    kind = "dry run on the simulated rig" if run.dry_run else "run"
    kind += f", world {world}" if world else ""
    doubts = _doubts(run, reasons)
    return Document(
        title=run.preflight.plan.name,
        subtitle=f"{kind} · {run.recording.metadata.get('started', '')} · "
        f"run {run.recording.metadata.get('run_id', '')}",
        verdict=_verdict(run),
        ended=run.outcome.why,
        reasons=reasons,
        doubts=doubts,
        brief=[] if run.identification is None else brief_lines(run.identification),
        tables=_tables(run, levels, system),
        figures=figures_of(run),
        texts=_texts(run.recording),
        simulated=run.dry_run,
        certificate=run_certificate(run, levels, doubts, law_figure(run), system),
    )


def levels_of_run(run: Evaluation) -> tuple[Level, ...]:
    """Every hold of a run; for a system stiffness they include the system's deflection."""
    if run.data is None or run.system is None:
        return run.levels
    conditions = planned(run.preflight)
    sources = replace(conditions.sources, system_stiffness_n_per_m=None)
    return levels_of(run.data, run.recording.events, replace(conditions, sources=sources))


def _reasons(run: Evaluation) -> list[str]:
    """All remarks on the result, and the problem where the verdict does not say it."""
    untold = run.problem and run.problem != _verdict(run).text
    return [*reasons_of(run), *([run.problem] if untold else ())]


def _doubts(run: Evaluation, reasons: Sequence[str]) -> list[str]:
    """The reasons without those that only confirm the result."""
    found = run.identification
    if found is None or found.headline is None:
        return list(reasons)
    confirming = {*found.reasons} - {*found.headline.why}
    return [each for each in reasons if each not in confirming]


def _tables(run: Evaluation, holds: Sequence[Level], system: Table | None) -> list[Table]:
    """Details after the sheet: the budget, the course, the provenance, then the rest."""
    found = run.identification
    tables = [] if found is None else budget_table(found)
    tables += [predicted_table(run), ending_table(run.outcome)]
    tables += [] if run.data is None else [time_table(run.data)]
    tables.append(provenance_table(run.recording.metadata))
    tables.append(hold_table(holds, "travel" if run.system is not None else "deformation"))
    tables += [] if found is None else identification_tables(found)
    tables += [] if system is None else [system]
    if run.run_in is not None:
        tables.append(run_in_table(run.run_in))
    return [*tables, preflight_table(run.preflight)]


def _verdict(run: Evaluation) -> Verdict:
    """Verdict of a run; an incomplete run is bad whatever it has measured."""
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
    verdict, headline = found.verdict, found.headline
    if headline is None:
        return Verdict(MOOD[verdict], verdict.value, found.reasons[0])
    value, known = QuantityRow.model_validate(headline).shown
    known = "no interval" if known == NOTHING else f"95 % {known}"
    return Verdict(
        MOOD[verdict],
        verdict.value,
        f"{_called(found)} {value}, {known}, from "
        f"{f(headline.from_n, 'N')} to {f(headline.to_n, 'N')}",
    )


def _called(found: Identification) -> str:
    """The name of the headline: that of its branch where the contact is not elastic."""
    branch, judged = found.conditions.branch, found.judgement
    if judged is None or (judged.elastic and branch == BRANCHES[0]):
        return "Chord stiffness"
    part = "" if judged.elastic else f" (inelastic part {100.0 * judged.inelastic.share:.2g} %)"
    return f"{branch.capitalize()} chord{part}"


def _system_measured(fit: SystemStiffnessFit) -> Verdict:
    return Verdict(
        "good",
        "system stiffness measured",
        f"System stiffness K_s = {f(fit.stiffness_n_per_m, 'N/m')}"
        f" ± {f(fit.sigma_n_per_m, 'N/m')} (standard uncertainty)",
    )


def _texts(recording: Recording) -> list[tuple[str, str]]:
    texts = []
    for name, content in recording.attachments.items():
        if name.endswith((".yaml", ".json")) and name != "results.json":
            text = content.decode("utf-8", "replace")
            if name.endswith(".json"):
                text = json.dumps(json.loads(text), indent=1, ensure_ascii=False)
            texts.append((name, text))
    return texts
