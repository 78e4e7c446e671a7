"""What was identified, as tables: evidence, fits, system stiffness, cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from textwrap import fill

from stepload.estimators.cycles import STEADY_CYCLES, RunIn
from stepload.estimators.fit import Missing
from stepload.estimators.smooth import NORMAL_95
from stepload.estimators.system import SystemStiffnessFit
from stepload.evidence.answer import Evidence
from stepload.evidence.identification import Identification
from stepload.evidence.quantity import Quantity, ResultVerdict
from stepload.results import fields
from stepload.results.model import Table, interval, table
from stepload.results.quality import quality_table, summary
from stepload.units import format_quantity as f

BESIDE = (
    "beside the answer in the table of stiffnesses: each fit has a zero and a secant of its own"
)
HEADLINE_BUDGET = "What the headline's interval is made of"


def _doubts(rows: Sequence[fields.NamedFit]) -> list[str]:
    return [
        f"doubt about {row.name}: {'; '.join(doubt.message for doubt in row.fit.doubts)}"
        for row in rows
        if row.fit.doubts
    ]


def identification_tables(found: Identification) -> list[Table]:
    """Evidence and fits of an identification."""
    rows, others = fields.fits_of(found), fields.fits_of(found, reported=False)
    why = [f"best of the fits is {found.believe}: {line}" for line in found.why]
    if found.evidence is not None:
        why.insert(0, BESIDE)
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
    return tables


def _evidence_tables(found: Identification) -> list[Table]:
    """The stiffnesses, the lines of the headline's interval, the laws and what is not elastic."""
    evidence = found.evidence
    if evidence is None:
        return []
    headline = evidence.headline
    notes = [
        f"{fields.KINDS[each.kind]}: {why}"
        for each in evidence.quantities.values()
        for why in each.why
        if why not in headline.why
    ]
    if (n := evidence.exponent) is not None:
        low, high = n.interval
        own = [why for why in n.why if why not in headline.why]
        why = f": {'; '.join(own)}" if own else ""
        notes.append(
            f"exponent n = {n.value:.2f}, 95 % [{low:.2f}, {high:.2f}], {n.verdict.value}{why}"
        )
    contact = found.run.alignment.quality
    told = [line] if (line := summary(contact)) else []
    total = f"All together {headline.relative:.2%}; the interval is 1.96 times that."
    return [
        table("Stiffness, secant (28)", fields.QUANTITY, evidence.quantities.values(),
              [*notes, *evidence.notes, *told]),
        table(HEADLINE_BUDGET, fields.LINE,
              [line for line in headline.lines if line.relative > 0.0], [total], page_only=True),
        table("Laws that were tried", fields.LAW, evidence.laws, page_only=True),
        table("What is not elastic", fields.PART, evidence.inelastic.parts, [told_of(evidence)],
              page_only=True),
        *([] if isinstance(contact, Missing) else [quality_table(contact)]),
    ]  # fmt: skip


def told_of(evidence: Evidence) -> str:
    """What the loading may be called."""
    share, half = evidence.inelastic.share, evidence.within
    if evidence.elastic:
        return f"Elastic: {share:.1%} of the deformation is not, up to {half:.1%} counts for none."
    return f"Not elastic: {share:.1%} of the deformation (up to {half:.1%} counts for none)."


def brief_lines(found: Identification) -> list[str]:
    """The other stiffnesses, the exponent and the widest errors, a line each."""
    evidence = found.evidence
    if evidence is None:
        return []
    headline, rows = evidence.headline, []
    for each in evidence.quantities.values():
        if each.kind != headline.kind and math.isfinite(each.value_n_per_m):
            kind, _, zero = fields.KINDS[each.kind].partition(", ")
            at = f"{f(each.from_n, 'N')} to " if "chord" in each.kind else "at "
            at = f"{kind} {at}{f(each.to_n, 'N')}{f', {zero}' if zero else ''}"
            ends = each.interval_n_per_m
            known = interval("N/m")(ends) if all(map(math.isfinite, ends)) else ""
            known += _beside(each.verdict, headline.verdict)
            rows.append((at, f(each.value_n_per_m, "N/m"), known))
    if (n := evidence.exponent) is not None:
        low, high = n.interval
        known = f"[{low:.2f}, {high:.2f}]" if math.isfinite(high - low) else ""
        known += _beside(n.verdict, headline.verdict)
        rows.append(("exponent n", f"{n.value:.2f}", known))
    lines = [f"  {name:<38}{value:<12}{known}".rstrip() for name, value, known in rows]
    return [*lines, *_widest(found, headline)]


def _beside(verdict: ResultVerdict, headline: ResultVerdict) -> str:
    """The verdict of a figure where it is not that of the headline."""
    return "" if verdict is headline else f"  {verdict.value}"


def _widest(found: Identification, headline: Quantity) -> list[str]:
    """The two largest lines of the budget, each with one thing to do and its gain."""
    help_for = {each.line: each for each in found.narrowing}
    lines = []
    for line in sorted(headline.lines, key=lambda line: -line.relative)[:2]:
        said = f"  widest: {line.source} ±{100.0 * NORMAL_95 * line.relative:.2g} %"
        if (way := help_for.get(line.source)) is not None:
            said += f"; {way.todo}: ±{100.0 * way.half_width:.2g} % in all"
        lines.append(fill(said, 80, subsequent_indent=" " * 10))
    return lines


def system_table(fit: SystemStiffnessFit) -> Table:
    """A system stiffness with all its figures."""
    shown = [field for field in fields.SYSTEM + fields.SYSTEM_REST if field.label]
    rows = [(field.label, field.text(fit)) for field in shown]
    return Table("System stiffness (26)", ("figure", "value"), rows)


def run_in_table(found: RunIn) -> Table:
    """The cycles of a run, the virgin and the steady one named."""
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
