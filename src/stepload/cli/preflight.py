"""The verb `preflight`, and how a preflight is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from typer import Option

from stepload.cli.options import PayloadFile, PlanFile
from stepload.errors import ExitCode
from stepload.report.terminal import AsJson, Output
from stepload.units import percent

if TYPE_CHECKING:
    from stepload.feasibility.limits import RunLimits
    from stepload.feasibility.preflight import Preflight
    from stepload.feasibility.theory import CountedLimit


MOODS = {"go": "good", "warn": "doubt", "refused": "bad"}


def show_verdict(preflight: Preflight, out: Output) -> None:
    """Verdict and findings of a preflight, on a third of a screen."""
    from stepload.report.preflight import finding_lines, headline

    out.line(headline(preflight), word=preflight.verdict.upper(), mood=MOODS[preflight.verdict])
    if found := finding_lines(preflight):
        out.line("\n" + "\n".join(found))


def show_preflight(preflight: Preflight, out: Output) -> None:
    """A preflight on one screen."""
    from stepload.report.preflight import figure_lines, last_lines

    show_verdict(preflight, out)
    out.line("\n" + "\n".join(figure_lines(preflight)) + "\n")
    out.line("\n".join(last_lines(preflight)))


def show_reasons(preflight: Preflight, out: Output) -> None:
    """Every reason with its code."""
    from stepload.report.model import Finding

    for reason in preflight.reasons:
        told = f"{reason.message} [{reason.code}]"
        out.finding(Finding(reason.severity, told, reason.remedy))


def show_figures(preflight: Preflight, out: Output) -> None:
    """Every figure of a preflight, the schedule and the budget of forces."""
    from stepload.feasibility.bounds import common_error
    from stepload.feasibility.reason import PlanVerdict
    from stepload.report.model import Table
    from stepload.report.preflight_results import StageRow, force_budget_table, need_table
    from stepload.report.rows import table
    from stepload.units import format_quantity as f

    theory, found = preflight.theory, preflight.identifiability
    common, source = common_error(preflight.plan.rig)
    safe, top = preflight.largest_safe_force_n, preflight.plan.procedure.top_force_n
    rows = [
        ("elastic limit F_c", f(theory.elastic_limit_n, "N"), theory.limit_equation),
        *_counted_rows(theory.counted),
        ("error common to the force channels", f"{common:.3g}", f"{source}, taken off F_allowed"),
        ("largest safe top force", f(safe, "N"), "F_allowed - headroom, with these steps"),
        ("force limit F_lim (R1)", f(preflight.force_limit_n, "N"), "supervisor"),
        ("top force", f(top, "N"), "plan"),
        *_law_rows(preflight),
    ]
    if found is not None:
        rows += [
            ("K_max", f(found.k_max_n_per_m, "N/m"), f"(34); {found.binding} binds"),
            ("  if K_r ≫ K_s", f(found.limit_stiff_resolution_n_per_m, "N/m"), "(35)"),
            ("  if K_s ≫ K_r", f(found.limit_stiff_system_n_per_m, "N/m"), "(36)"),
        ]
    out.tables(Table("Predicted", ("figure", "value", "from"), rows + _stiffness_rows(preflight)))
    if preflight.verdict is not PlanVerdict.REFUSED:
        out.tables(force_budget_table(preflight))
        title = f"Schedule: about {preflight.duration_s:.0f} s"
        out.tables(table(title, StageRow, preflight.stages))
    if preflight.until is not None:
        out.tables(need_table(preflight.until))


def _stiffness_rows(preflight: Preflight) -> list[tuple[str, str, str]]:
    """The stiffness that a result rests on, and the one that all force bounds use."""
    from stepload.feasibility.bounds import largest_sliding_stiffness, stuck_ratio
    from stepload.units import format_quantity as f

    system = preflight.plan.rig.system_stiffness
    ratio, source = stuck_ratio(preflight.plan.rig)
    sliding = f(largest_sliding_stiffness(system), "N/m")
    rows = [
        ("system stiffness K_s", f(system.stiffness_n_per_m, "N/m"), system.provenance.value),
        ("  K_s, upper bound", sliding, "K_s + 3 sigma, more for a guess"),
    ]
    if ratio != 1.0:
        largest = f(preflight.bounds.stiffness_n_per_m, "N/m")
        rows.append(("  if friction holds the tip", largest, f"that × {ratio:.3g} ({source})"))
    return rows


def _law_rows(preflight: Preflight) -> list[tuple[str, str, str]]:
    """The contact law by theory; for a range both ends."""
    from stepload.units import format_quantity as f

    theory, plan = preflight.theory, preflight.plan
    top_n, secant_n = plan.procedure.top_force_n, plan.identify.secant_force_n
    laws = [theory.softest, theory.stiffest] if theory.is_range else [theory.law]
    k = " to ".join(f"{law.k:.3g}" for law in laws)
    deformation = " to ".join(f(law.deformation(top_n), "m") for law in reversed(laws))
    secant = " to ".join(f(law.secant(secant_n), "N/m") for law in laws)
    return [
        ("law", f"K = {k} N/m^n, n = {theory.law.n:.4g}", theory.law.equation),
        ("deformation at top force", deformation, "(2)"),
        (f"secant at {f(secant_n, 'N')}", secant, "(28)"),
    ]


def _counted_rows(counted: CountedLimit) -> list[tuple[str, str, str]]:
    """Uncertainty of F_c, and the part of it that is relied on."""
    from stepload.units import format_quantity as f

    if counted.sigma_ln == 0.0:
        return []
    most = max(counted.sources, key=lambda source: source.sigma_ln)
    assumed = [f"{source.what} {source.shown}" for source in counted.sources if source.assumed]
    sigma, chance = percent(counted.sigma_ln, 2), f"{counted.probability:.2g}"
    used = f"  F_c used (k = {counted.coverage:g})"
    rows = [
        ("  standard uncertainty of ln F_c", sigma, f"mostly {most.what} {most.shown}"),
        (used, f(counted.lower_n, "N"), f"F_c is lower still with a probability of {chance}"),
    ]
    return rows + ([("  assumed", "", "; ".join(assumed))] if assumed else [])


def show_thresholds(limits: RunLimits, out: Output) -> None:
    """The thresholds at which the supervisor's rules stop a run, by their names in a record."""
    from stepload.units import format_quantity as f

    def shown(value: float, unit: str) -> str:
        return f"{value:g} {unit}" if unit == "samples" else f(value, unit).rstrip()

    rows = []
    for rule, term in limits.judged:
        source, _, at_zero = term.source.partition("; 0: ")
        value = shown(term.value, term.unit) if term.value or not at_zero else "off"
        why = source if value != "off" or at_zero == "off" else at_zero
        rows.append((rule, term.name, value, why))
    out.table("The supervisor stops at", ("rule", "threshold", "value", "from"), rows)
    if limits.off:
        out.line(f"off on this rig: {', '.join(limits.off)} (stepload explain {limits.off[0]})")


def preflight(
    plan: PlanFile,
    payload: PayloadFile = None,
    verbose: Annotated[
        bool, Option("--verbose", help="Every reason and figure, schedule, every threshold.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Say whether a run can succeed. Exit 0: go or warn; 3: refused.

    Example: stepload preflight procedures/plastic-sphere.yaml
    """
    from stepload.feasibility.preflight import preflight_of
    from stepload.feasibility.reason import PlanVerdict
    from stepload.plan.load import load_plan

    out = Output(as_json=as_json)
    preflight = preflight_of(load_plan(plan, payload=payload))
    refused = preflight.verdict is PlanVerdict.REFUSED
    limits = None if refused else preflight.limits
    show_preflight(preflight, out)
    if verbose:
        out.line()
        show_reasons(preflight, out)
        show_figures(preflight, out)
        if limits is not None:
            show_thresholds(limits, out)
    if as_json:
        from stepload.report.preflight_results import preflight_data

        out.result(preflight_data(preflight))
    if refused:
        raise typer.Exit(ExitCode.REFUSED)
