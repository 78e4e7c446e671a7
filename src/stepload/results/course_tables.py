"""Course of a run, as tables: compared with the prediction, its timing, its end, the rig."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from stepload.results import fields
from stepload.results.model import NOTHING, Show, Table, number, quantity, table
from stepload.units import format_quantity as f

if TYPE_CHECKING:
    from stepload.contact.power_law import ContactLaw
    from stepload.envelope.envelope import Envelope
    from stepload.record.outcome import RunOutcome
    from stepload.results.analyse import Evaluation
    from stepload.results.press_data import PressData


def force_budget_table(envelope: Envelope) -> Table:
    """Possible contributions of the guarded approach to the force, term by term."""
    title = f"Force budget at the guarded speed of {f(envelope.guarded_speed_m_s, 'm/s')}"
    return table(title, fields.FORCE_TERM, envelope.force_budget)


def predicted_table(run: Evaluation) -> Table:
    """Predictions of preflight and theory, and the measured values."""
    envelope, found, outcome = run.envelope, run.identification, run.outcome
    theory, procedure, limits = envelope.theory, envelope.plan.procedure, envelope.limits
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

    add("duration [s]", number(".0f"), envelope.duration_s, outcome.end_s - outcome.start_s)
    levels = len(procedure.levels_n) * procedure.cycles
    add("levels held on the way up", number(".0f"), levels, outcome.levels_done)
    add("largest force", newton, procedure.top_force_n, outcome.peak_force_n)
    if (data := run.data) is not None:
        planned_n = limits.noise_n if limits else envelope.bounds.noise_n
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
                label = f"{fields.KINDS[each.kind]}, {newton(low_n)} to {newton(top_n)}"

                def smooth(law: ContactLaw, low_n: float = low_n, top_n: float = top_n) -> float:
                    return (top_n - low_n) / (law.deformation(top_n) - law.deformation(low_n))

                by_law(label, "N/m", smooth, each.value_n_per_m)
        if (seen := envelope.identifiability) is not None:
            k_max = found.judgement.k_max_n_per_m
            add("K_max (34)", stiffness, seen.k_max_n_per_m, k_max)
    columns = ("figure", "predicted", "measured")
    verdict = (
        f"Preflight said {envelope.verdict.value.upper()}. Theory is that of the smooth contact."
    )
    return Table("Preflight predicted, run measured", columns, rows, (verdict,), page_only=True)


def preflight_table(envelope: Envelope) -> Table:
    """Every reason of the preflight, with its remedy."""
    rows = [(r.severity.value, r.code, r.message, r.remedy) for r in envelope.reasons]
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
    return table("Time", fields.CLOCK, press.clocks, [note], page_only=True)


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
