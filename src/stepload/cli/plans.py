"""Verbs that look at a plan and move nothing: preflight, schema, profiles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stepload.cli.output import Output
from stepload.errors import ExitCode

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stepload.contact.press import Term
    from stepload.feasibility.preflight import Preflight
    from stepload.plan.model import Plan

SUPERVISED = (*(f"R{number}" for number in range(1, 11)), "R1, R2", "speed cap")
"""How the source of a threshold begins if a rule stops at it."""
PlanFile = Annotated[Path, typer.Argument(help="Plan (YAML).", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")]
PayloadFile = Annotated[
    Path | None, typer.Option("--payload", help="Another payload file than the plan's.")
]


def preflight_data(check: Preflight) -> dict[str, Any]:
    """The JSON object of a preflight."""
    found = check.identifiability
    return {
        "verdict": check.verdict,
        "reasons": check.reasons,
        "elastic_limit_n": check.theory.elastic_limit_n,
        "elastic_limit_equation": check.theory.limit_equation,
        "k": check.theory.law.k,
        "n": check.theory.law.n,
        "top_force_n": check.top_force_n,
        "largest_safe_force_n": check.largest_safe_force_n,
        "force_limit_n": check.force_limit_n,
        "deformation_m": check.deformation_m,
        "secant_n_per_m": check.secant_n_per_m,
        "secant_force_n": check.secant_force_n,
        "k_max_n_per_m": found.k_max_n_per_m if found else None,
        "identifiability": found,
        "guarded_speed_m_s": check.guarded_speed_m_s,
        "fast_speed_m_s": check.fast_speed_m_s,
        "force_budget": [
            {"name": term.name, "value_n": term.value, "source": term.source}
            for term in check.force_budget
        ],
        "schedule": [
            {"name": stage.name, "each_s": stage.each_s, "repeats": stage.repeats}
            for stage in check.stages
        ],
        "duration_s": check.duration_s,
    }


def show_preflight(check: Preflight, out: Output) -> None:
    """A preflight as text: verdict and reasons first, then the figures behind them."""
    from stepload.units import format_quantity as f

    out.line(f"preflight: {check.verdict.upper()}")
    for reason in check.reasons:
        out.line(f"  {reason.severity}: {reason.message}")
        if reason.remedy:
            out.line(f"      -> {reason.remedy}")
    theory, found = check.theory, check.identifiability
    rows = [
        ("elastic limit F_c", f(theory.elastic_limit_n, "N"), theory.limit_equation),
        ("largest safe top force", f(check.largest_safe_force_n, "N"), "F_allowed less headroom"),
        ("force limit F_lim (R1)", f(check.force_limit_n, "N"), "supervisor"),
        ("top force", f(check.top_force_n, "N"), "plan"),
    ]
    rows += [
        ("law", f"K = {theory.law.k:.3g} N/m^n, n = {theory.law.n:.4g}", theory.law.equation),
        ("deformation at top force", f(check.deformation_m, "m"), "(2)"),
        (f"secant at {f(check.secant_force_n, 'N')}", f(check.secant_n_per_m, "N/m"), "(28)"),
    ]
    if found is not None:
        rows += [
            ("K_max", f(found.k_max_n_per_m, "N/m"), f"(34); {found.binding} binds"),
            ("  if K_r ≫ K_s", f(found.limit_stiff_resolution_n_per_m, "N/m"), "(35)"),
            ("  if K_s ≫ K_r", f(found.limit_stiff_system_n_per_m, "N/m"), "(36)"),
        ]
    out.table("predicted", ("figure", "value", "from"), rows)
    out.table(
        f"force budget at the guarded speed of {f(check.guarded_speed_m_s, 'm/s')}",
        ("term", "force", "from"),
        [(term.name, f(term.value, "N"), term.source) for term in check.force_budget],
    )
    out.table(
        f"schedule: about {check.duration_s:.0f} s",
        ("stage", "each", "times", "total"),
        [
            (stage.name, f"{stage.each_s:.1f} s", str(stage.repeats), f"{stage.total_s:.1f} s")
            for stage in check.stages
        ],
    )


def thresholds(plan: Plan, check: Preflight) -> tuple[Term, ...]:
    """Everything the run is supervised by; nothing for a plan that may not run."""
    from stepload.feasibility.verdict import Verdict
    from stepload.run.limits import derive_limits

    if check.verdict is Verdict.REFUSED:
        return ()
    return derive_limits(plan, elastic_limit_n=check.theory.elastic_limit_n).terms


def show_thresholds(terms: Sequence[Term], out: Output) -> None:
    """Those that a rule of the supervisor stops at, by the names they have in a record."""
    from stepload.units import format_quantity as f

    rows = []
    for term in terms:
        rule, _, source = term.source.partition(": ")
        if rule not in SUPERVISED or (rule == "R5" and not term.value):
            continue
        value = (
            f"{term.value:g} {term.unit}" if term.unit == "samples" else f(term.value, term.unit)
        )
        rows.append((rule, term.name, value.rstrip(), source))
    if rows:
        out.table("the supervisor stops at", ("rule", "threshold", "value", "from"), rows)


def preflight(plan: PlanFile, payload: PayloadFile = None, as_json: AsJson = False) -> None:
    """Say before the run whether payload and rig can succeed. Exit 0: go or warn; 3: refused."""
    from stepload.feasibility.preflight import preflight as judge
    from stepload.feasibility.verdict import Verdict
    from stepload.plan.load import load_plan

    out = Output(as_json=as_json)
    loaded = load_plan(plan, payload=payload)
    check = judge(loaded)
    show_preflight(check, out)
    terms = thresholds(loaded, check)
    show_thresholds(terms, out)
    out.result(preflight_data(check) | {"limits": terms})
    if check.verdict is Verdict.REFUSED:
        raise typer.Exit(ExitCode.REFUSED)


def schema() -> None:
    """Print the JSON Schema of a plan, for editors."""
    from stepload.plan.load import json_schema

    print(json.dumps(json_schema(), indent=2))


def profiles() -> None:
    """List the rig profiles that come with stepload."""
    from stepload.plan.load import profiles as names

    for name in names():
        print(name)


def register(app: typer.Typer) -> None:
    """Add this room's verbs."""
    app.command()(preflight)
    app.command()(schema)
    app.command()(profiles)
