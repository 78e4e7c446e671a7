"""Tables of a result: figures, budget, fits, cycles; preflight against run, timing, end."""

from __future__ import annotations

import math
from collections.abc import Callable
from textwrap import fill
from typing import TYPE_CHECKING

from stepload.identification.fit import Missing
from stepload.identification.identify import Identification
from stepload.identification.quantity import Quantity, ResultVerdict
from stepload.identification.run_in import STEADY_CYCLES, RunIn
from stepload.identification.smooth import NORMAL_95
from stepload.identification.system_stiffness import SystemStiffnessFit
from stepload.report.identified import (
    KINDS,
    FitRow,
    Law,
    Line,
    QuantityRow,
    Sign,
    reported_fits,
)
from stepload.report.model import NOTHING, Table
from stepload.report.quality import quality_table, summary
from stepload.report.rows import Show, cells, form, quantity, table
from stepload.report.run_results import Clock, CycleRow, SystemStiffness
from stepload.units import format_quantity as f
from stepload.units import percent

if TYPE_CHECKING:
    from stepload.contact.power_law import ContactLaw
    from stepload.feasibility.preflight import Preflight
    from stepload.record.outcome import RunOutcome
    from stepload.report.analyse import Evaluation
    from stepload.report.press_data import PressData


def stiffness_table(found: Identification) -> Table:
    """Every stiffness with its interval, and the exponent; notes say what is to be known of them.

    Without rows where nothing could be judged.
    """
    judged = found.judgement
    if judged is None:
        return Table("", (), ())
    known, headline = tuple(judged.quantities.values()), judged.headline
    own = [(KINDS[each.kind], each.why) for each in known]
    made = table("Result, secants by (28)", QuantityRow, known)
    rows = [*made.rows]
    if (n := judged.exponent) is not None:
        low, high = n.interval
        ends = f"[{low:.2f}, {high:.2f}]" if math.isfinite(high - low) else NOTHING
        to = rows[0][2] if rows else ""
        rows.append(("exponent n (2)", "touch", to, f"{n.value:.2f}", ends, "", n.verdict.value))
        own.append(("exponent n", n.why))
    notes = [f"{name}: {why}" for name, all_why in own for why in all_why
             if why not in headline.why]  # fmt: skip
    contact = [line] if (line := summary(found.run.alignment.quality)) else []
    return Table(made.title, made.columns, rows, [*notes, *judged.notes, *contact])


def budget_table(found: Identification) -> list[Table]:
    """What the interval of the headline is made of."""
    if (headline := found.headline) is None:
        return []
    total = f"All together {percent(headline.relative, 3)}; the interval is 1.96 times that."
    lines = [line for line in headline.lines if line.relative > 0.0]
    title = "What the headline's interval is made of"
    return [table(title, Line, lines, [total], page_only=True)]


def identification_tables(found: Identification) -> list[Table]:
    """Figures, laws, what is not elastic, the contact, and the fits."""
    tables, why, judged = [stiffness_table(found)], list[str](), found.judgement
    if judged is not None:
        share, half = judged.inelastic.share, judged.within
        word = "Elastic" if judged.elastic else "Not elastic"
        most = percent(half, 2)
        told = (
            f"{word}: {percent(share, 2)} of the deformation is not (up to {most} counts for none)."
        )
        notes = [told]
        if (lost := judged.inelastic.loss) is not None:
            work, sigma = (percent(each, 2) for each in lost)
            notes.append(f"Work lost in the first cycle: {work} of that of its loading ± {sigma}.")
        tables += [
            table("Laws that were tried", Law, judged.laws, page_only=True),
            table("What is not elastic", Sign, judged.inelastic.parts, notes,
                  page_only=True),
        ]  # fmt: skip
        contact = found.run.alignment.quality
        tables += [] if isinstance(contact, Missing) else [quality_table(contact)]
        why.append("Each fit has a zero and a secant of its own; the result is the table above.")
    rows = reported_fits(found)
    why += [f"selected fit {found.selected}: {line}" for line in found.why]
    why += [
        f"doubt about {row.name}: {'; '.join(doubt.message for doubt in row.doubts)}"
        for row in rows
        if row.doubts
    ]
    beyond = found.fit.secant_force_n > 1.02 * found.peak_force_n
    title = f"Fits (* selected), secants at {f(found.fit.secant_force_n, 'N')}"
    return [*tables, table(title + (", beyond the data" if beyond else ""), FitRow, rows, why)]


def brief_lines(found: Identification) -> list[str]:
    """The other stiffnesses, the exponent and the widest errors, a line each."""
    judged = found.judgement
    if judged is None:
        return []
    headline, rows = judged.headline, []
    for each in judged.quantities.values():
        if each.kind != headline.kind and math.isfinite(each.value_n_per_m):
            kind, _, zero = KINDS[each.kind].partition(", ")
            at = f"{f(each.from_n, 'N')} to " if "chord" in each.kind else "at "
            at = f"{kind} {at}{f(each.to_n, 'N')}{f', {zero}' if zero else ''}"
            value, known = QuantityRow.model_validate(each).shown
            known += _beside(each.verdict, headline.verdict)
            rows.append((at, value, known.removeprefix(NOTHING)))
    if (n := judged.exponent) is not None:
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
    rows = [cell for cell in cells(SystemStiffness, fit) if cell[1] != NOTHING]
    return Table("System stiffness (26)", ("figure", "value"), rows)


def run_in_table(found: RunIn) -> Table:
    """The cycles of a run, the virgin and the steady one named."""
    if found.steady:
        steady = f"steady at cycle {found.steady.number}"
    elif len(found.cycles) < STEADY_CYCLES:
        steady = f"fewer than {STEADY_CYCLES} cycles do not show whether it is steady"
    else:
        steady = (
            f"not steady: chord changed by {percent(found.secant_change, 3)} (allowed "
            f"{percent(found.secant_tolerance, 3)}), loop energy by "
            f"{percent(found.energy_change, 2)} "
            f"(allowed {percent(found.energy_tolerance, 2)}) over the last {STEADY_CYCLES} cycles"
        )
    virgin = "The virgin contact is not in this record"
    if found.virgin:
        virgin = f"Cycle {found.virgin.number} is the virgin contact"
    note = f"{virgin}; {steady}; shakedown {f(found.shakedown_m, 'm')}"
    if found.residual_indentation_m is not None:
        note += f"; the touch has moved by {f(found.residual_indentation_m, 'm')}"
    return table("Cycles", CycleRow, found.cycles, [f"{note}."])


def predicted_table(run: Evaluation) -> Table:
    """Predictions of preflight and theory, and the measured values."""
    preflight, found, outcome = run.preflight, run.identification, run.outcome
    theory, procedure, limits = preflight.theory, preflight.plan.procedure, preflight.limits
    newton, stiffness = quantity("N"), quantity("N/m")
    rows: list[tuple[str, str, str]] = []

    def add(label: str, show: Show, predicted: float, measured: float) -> None:
        shown = [show(x) if math.isfinite(x) else NOTHING for x in (predicted, measured)]
        rows.append((label, shown[0], shown[1]))

    def by_law(label: str, unit: str, figure: Callable[[ContactLaw], float], x: float) -> None:
        """A figure of theory, or both ends of its range, the lower one first."""
        laws = (theory.softest, theory.stiffest) if theory.is_range else (theory.law,)
        ends = " to ".join(f(each, unit) for each in sorted(map(figure, laws)))
        rows.append((label, ends, f(x, unit) if math.isfinite(x) else NOTHING))

    add("duration [s]", form(".0f"), preflight.duration_s, outcome.duration_s)
    levels = len(procedure.levels_n) * procedure.cycles
    add("levels held on the way up", form(".0f"), levels, outcome.levels_done)
    add("largest force", newton, procedure.top_force_n, outcome.peak_force_n)
    if (data := run.data) is not None:
        planned_n = limits.noise_n if limits else preflight.bounds.noise_n
        add("noise of the force, with its resolution", newton, planned_n, data.noise_n)
        shift_n = abs(data.zero_shift_n)
        add("shift of the force's zero, at the most", newton, procedure.max_drift_n, shift_n)
        if limits and limits.cross_check:
            second = "shift of the second channel's zero, at the most"
            add(second, newton, limits.second_zero_n, abs(data.second_zero_shift_n))
    if found is not None:
        deepest_m, peak_n = float(found.deformation_m.max()), found.peak_force_n
        label = "deformation at the largest force"
        by_law(label, "m", lambda law: law.deformation(peak_n), deepest_m)
        for each in found.quantities.values():
            if each.kind in ("chord", "secant_from_touch"):
                low_n, top_n = each.from_n, each.to_n
                label = f"{KINDS[each.kind]}, {newton(low_n)} to {newton(top_n)}"

                def smooth(law: ContactLaw, low_n: float = low_n, top_n: float = top_n) -> float:
                    return (top_n - low_n) / (law.deformation(top_n) - law.deformation(low_n))

                by_law(label, "N/m", smooth, each.value_n_per_m)
        if (seen := preflight.identifiability) is not None:
            k_max = found.k_max_n_per_m
            add("K_max (34)", stiffness, seen.k_max_n_per_m, k_max)
    columns = ("figure", "predicted", "measured")
    verdict = (
        f"Preflight said {preflight.verdict.value.upper()}. Theory is that of the smooth contact."
    )
    return Table("Preflight predicted, run measured", columns, rows, (verdict,), page_only=True)


def preflight_table(preflight: Preflight) -> Table:
    """Every reason of the preflight, with its remedy."""
    rows = [(r.severity.value, r.code, r.message, r.remedy) for r in preflight.reasons]
    columns = ("severity", "code", "finding", "remedy")
    return Table("Preflight", columns, rows, page_only=True)


def time_table(press: PressData) -> Table:
    """The origin of the times of the streams, and the lag of the force."""
    lag, note = press.lag, f"Lag not measured: {press.lag.how}."
    if math.isfinite(lag.lag_s):
        note = (
            f"Force lags position by {lag.lag_s * 1e3:.2f} ± {lag.sigma_s * 1e3:.2f} ms "
            f"({lag.how}); {press.lag_corrected_s * 1e3:.2f} ms corrected."
        )
    return table("Time", Clock, press.clocks, [note], page_only=True)


def ending_table(outcome: RunOutcome) -> Table:
    """How the run ended: the rule that stopped it with its figures, timing, safing, errors."""
    late = outcome.lateness
    rows = [
        ("status", outcome.status.value),
        ("ticks", f"{late.ticks}, {late.overruns} late by more than a period, the latest by "
                  f"{late.worst_s * 1e3:.2f} ms, {late.mean_s * 1e3:.3f} ms on average"),
    ]  # fmt: skip
    if (cause := outcome.cause) is not None:
        rows += [("rule", cause.rule), ("because", f"{cause.message}{cause.numbers}")]
        rows.append(("at", f"{cause.time_s - outcome.start_s:.3f} s"))
    if outcome.signal_number:
        rows.append(("signal", f"{outcome.signal_number}"))
    for each in outcome.safing:
        done = "sent" if each.sent else "NOT sent"
        rows.append((f"safing, {each.name}", f"{done}, took {each.duration_s * 1e3:.1f} ms"
                     + (f": {each.error}" if each.error else "")))  # fmt: skip
    rows += [("error on the way", error) for error in outcome.errors]
    return Table("How it ended", ("what", "which"), rows, page_only=True)
