"""Course of a run, as tables: compared with the prediction, its timing, its end, the rig."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from stepload.results import fields
from stepload.results.model import NOTHING, Show, Table, number, quantity, table
from stepload.units import format_quantity as f

if TYPE_CHECKING:
    from stepload.contact.power_law import ContactLaw
    from stepload.envelope.envelope import Envelope
    from stepload.evidence.quantity import Quantity
    from stepload.record.outcome import RunOutcome
    from stepload.results.analyse import Evaluation
    from stepload.results.press_data import PressData


def force_budget_table(envelope: Envelope, *, page_only: bool = False) -> Table:
    """Possible contributions of the guarded approach to the force, term by term."""
    return table(
        f"Force budget at the guarded speed of {f(envelope.guarded_speed_m_s, 'm/s')}",
        fields.FORCE_TERM, envelope.force_budget, page_only=page_only,
    )  # fmt: skip


def predicted_table(run: Evaluation) -> Table:
    """Predictions of preflight and theory, and the measured values."""
    envelope, found, outcome = run.envelope, run.identification, run.outcome
    theory, seen, procedure = envelope.theory, envelope.identifiability, envelope.plan.procedure
    newton, stiffness = quantity("N"), quantity("N/m")

    def by_law(figure: Callable[[ContactLaw], float]) -> float | tuple[float, float]:
        if theory.is_range:
            return figure(theory.softest), figure(theory.stiffest)
        return figure(theory.law)

    data, limits = run.data, envelope.limits
    rows: list[tuple[str, Show, float | tuple[float, float], float]] = [
        ("duration [s]", number(".0f"), envelope.duration_s, outcome.end_s - outcome.start_s),
        (
            "levels held on the way up", number(".0f"),
            len(procedure.levels_n) * procedure.cycles, outcome.levels_done,
        ),
        ("largest force", newton, procedure.top_force_n, outcome.peak_force_n),
    ]  # fmt: skip
    if data is not None:
        planned_n = limits.noise_n if limits else envelope.bounds.noise_n
        shift_n = abs(data.zero_shift_n)
        rows += [
            ("noise of the force, with its resolution", newton, planned_n, data.noise_n),
            ("shift of the force's zero, at the most", newton, procedure.max_drift_n, shift_n),
        ]
        if limits and limits.cross_check:
            second = "shift of the second channel's zero, at the most"
            rows.append((second, newton, limits.second_zero_n, abs(data.second_zero_shift_n)))
    if found is not None:
        deepest = by_law(lambda law: law.deformation(found.peak_force_n))
        most_m = float(found.deformation_m.max())
        rows.append(("deformation at the largest force", quantity("m"), deepest, most_m))
        for each in found.quantities.values():
            if each.kind in ("chord", "secant_from_touch"):
                label = f"{fields.KINDS[each.kind]}, {newton(each.from_n)} to {newton(each.to_n)}"
                smooth = by_law(partial(_smooth, each))
                rows.append((label, stiffness, smooth, each.value_n_per_m))
        if seen is not None:
            k_max = found.judgement.k_max_n_per_m
            rows.append(("K_max (34)", stiffness, seen.k_max_n_per_m, k_max))
    texts = [(label, _shown(show, one), _shown(show, other)) for label, show, one, other in rows]
    columns = ("figure", "predicted", "measured")
    verdict = (
        f"Preflight said {envelope.verdict.value.upper()}. Theory is that of the smooth contact."
    )
    return Table("Preflight predicted, run measured", columns, texts, (verdict,), page_only=True)


def _shown(show: Show, value: float | tuple[float, float]) -> str:
    """A figure, or both ends of its range, the lower one first."""
    if isinstance(value, tuple):
        return " to ".join(_shown(show, each) for each in sorted(value))
    return show(value) if math.isfinite(value) else NOTHING


def _smooth(each: Quantity, law: ContactLaw) -> float:
    """The stiffness of the same kind from the smooth law."""
    return (each.to_n - each.from_n) / (law.deformation(each.to_n) - law.deformation(each.from_n))


def preflight_table(envelope: Envelope) -> Table:
    """Every reason of the preflight, with its remedy."""
    rows = [(r.severity.value, r.code, r.message, r.remedy) for r in envelope.reasons]
    columns = ("severity", "code", "finding", "remedy")
    return Table("Preflight", columns, rows, page_only=True)


def health_tables(run: Evaluation) -> list[Table]:
    """Whether the loop was in time, and the origin of the times of the streams."""
    late = run.outcome.lateness
    rows = [
        ("ticks", f"{late.ticks}"),
        ("ticks late by more than a period", f"{late.overruns}"),
        ("latest tick", f"{late.worst_s * 1e3:.2f} ms"),
        ("ticks late on average by", f"{late.mean_s * 1e3:.3f} ms"),
    ]
    made = [Table("Timing health", ("figure", "value"), rows, page_only=True)]
    if run.data is not None:
        made.append(_clock_table(run.data))
    return made


def _clock_table(press: PressData) -> Table:
    lag = press.lag
    note = (
        f"Force lags position by {lag.lag_s * 1e3:.2f} ± {lag.sigma_s * 1e3:.2f} ms "
        f"({lag.how}); {press.lag_corrected_s * 1e3:.2f} ms corrected; a force that comes early is "
        "damping or creep and stays in the data."
        if math.isfinite(lag.lag_s)
        else f"Lag not measured: {lag.how}."
    )
    return table("Time", fields.CLOCK, press.clocks, [note], page_only=True)


def ending_table(outcome: RunOutcome) -> Table:
    """How the run ended: the rule that stopped it with its figures, and further errors."""
    rows = [("status", outcome.status.value), ("why", outcome.why)]
    if (cause := outcome.cause) is not None:
        rows += [("rule", cause.rule), ("because", f"{cause.message}{cause.numbers}")]
        rows.append(("at", f"{cause.time_s - outcome.start_s:.3f} s"))
    if outcome.signal_number:
        rows.append(("signal", f"{outcome.signal_number}"))
    rows += [("error on the way", error) for error in outcome.errors]
    return Table("How it ended", ("what", "which"), rows, page_only=True)
