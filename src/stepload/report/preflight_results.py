"""Figures of a preflight, as they stand in its JSON."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

from stepload.feasibility.preflight import Preflight
from stepload.feasibility.press import Term
from stepload.feasibility.reason import PlanVerdict
from stepload.feasibility.theory import chance_of_yield
from stepload.feasibility.until import MARGIN, Until
from stepload.identification.quantity import Quantity
from stepload.report.identified import QuantityRow
from stepload.report.model import Table
from stepload.report.preflight import expected_of
from stepload.report.rows import Cell, Row, column, data, figure, part, quantity, schema_of, table
from stepload.report.run_results import ElasticLimit
from stepload.units import format_quantity as f
from stepload.units import percent


class ReasonRow(Row):
    """One reason for the verdict."""

    code: str = figure("Code; `stepload explain CODE` says what it means.")
    severity: str = figure("note, warn or refuse.")
    message: str = figure("What was found.")
    remedy: str = figure("What to do.")
    value: int | float | None = figure("The value that was judged.")
    limit: int | float | None = figure("Its limit.")
    unit: str = figure("Of both.")
    cost: float | None = figure("By how much it widens the interval, relative.")
    key: str = figure("The key of the plan that changes it.")


class IdentifiabilityRow(Row):
    """Stiffest contact that can be identified."""

    k_max_n_per_m: float | None = figure("K_max (34).")
    resolution_stiffness_n_per_m: float | None = figure("K_r = F_max/δ_Δ.")
    limit_stiff_resolution_n_per_m: float | None = figure("(35), K_r ≫ K_s.")
    limit_stiff_system_n_per_m: float | None = figure("(36), K_s ≫ K_r.")
    binding: str = figure("Which of the two rules binds.")


class ForceTerm(Row):
    """One contribution to the force of the guarded approach."""

    name: str = figure("What contributes.", "term")
    value_n: float = figure("Its size.", "force", at="value")
    source: str = figure("Where it comes from.", "from")


class StageRow(Row):
    """One stage of the schedule."""

    name: str = figure("Of the stage.", "stage")
    each_s: Annotated[float, lambda s: f"{s:.1f} s"] = figure("Duration of one.", "each")
    repeats: int = figure("How often.", "times")
    total_s: Annotated[float, lambda s: f"{s:.1f} s"] = column("total")


class NeedRow(Row):
    """The deformation that one level needs, from 10 % of the level to the level."""

    level_n: float = figure("The level.", "level")
    needed_m: Annotated[
        float | None, lambda m: quantity("m")(m) if math.isfinite(m) else "none is enough"
    ] = figure("Deformation that is enough; null where none is.", "deformation needed")
    least_m: float | None = figure("The same without the margin: less cannot be enough.")
    sigma_m: float | None = figure("Standard uncertainty of the expected deformation.")
    expected_m: float = figure("Deformation by theory.", "deformation by theory")
    half_width: Annotated[float | None, lambda half: f"±{percent(half, 2)}"] = figure(
        "Half width of the interval there, as a share.", "half width by theory"
    )
    enough: Annotated[None, Cell(lambda row: "yes" if row.expected_m >= row.needed_m else "no")] = (
        column("enough by theory")
    )


class UntilRow(Row):
    """How far to load for the interval that the plan asks for."""

    requested: float = figure("Half width that the plan asks for, as a share.")
    expected_level_n: float | None = figure("Level at which the loading ends by theory.")
    levels: tuple[NeedRow, ...] = figure("What every level needs.", at="needs")


class LimitTerm(Row):
    """One threshold of the supervisor."""

    name: str = figure("Of the threshold.")
    value: int | float | None = figure("Its size.")
    unit: str = figure("SI unit, or samples.")
    source: str = figure("Where it comes from.")


class PreflightResults(Row):
    """JSON of `stepload preflight`, version 1. SI units; NaN and infinities are null."""

    verdict: PlanVerdict = figure("go, warn or refused.", at="preflight.verdict")
    reasons: tuple[ReasonRow, ...] = figure("Every reason.", at="preflight.reasons")
    elastic_limit_n: float = figure("F_c.", at="preflight.theory.elastic_limit_n")
    elastic_limit_equation: str = figure("Its origin.", at="preflight.theory.limit_equation")
    elastic_limit: ElasticLimit = figure(
        "The elastic limit, and the part of it that is used.", at="preflight.theory.counted"
    )
    k: float = figure("K in N/mⁿ by theory.", at="preflight.theory.law.k")
    n: float = figure("Exponent n by theory.", at="preflight.theory.law.n")
    k_softest: float = figure("Lower end of K.", at="preflight.theory.softest.k")
    k_stiffest: float = figure("Upper end of K.", at="preflight.theory.stiffest.k")
    top_force_n: float = figure("Highest level.", at="preflight.plan.procedure.top_force_n")
    largest_safe_force_n: float | None = figure(
        "Largest top force that is allowed.", at="preflight.largest_safe_force_n"
    )
    force_limit_n: float = figure("F_lim: a run is stopped there.", at="preflight.force_limit_n")
    deformation_m: float | None = figure("At the top force.", at="preflight.deformation_m")
    secant_n_per_m: float | None = figure("Secant (28).", at="preflight.secant_n_per_m")
    secant_force_n: float = figure("Its force.", at="preflight.plan.identify.secant_force_n")
    k_max_n_per_m: Annotated[float | None, part("k_max_n_per_m")] = figure(
        "K_max (34).", at="preflight.identifiability"
    )
    identifiability: IdentifiabilityRow | None = figure(
        "Stiffest contact that can be identified.", at="preflight.identifiability"
    )
    guarded_speed_m_s: float | None = figure(
        "Speed of the guarded approach.", at="preflight.guarded_speed_m_s"
    )
    fast_speed_m_s: float | None = figure("Speed before it.", at="preflight.fast_speed_m_s")
    force_budget: tuple[ForceTerm, ...] = figure(
        "Force of the guarded approach, term by term.", at="preflight.force_budget"
    )
    chance_of_yield: float | None = figure("Probability that F_c is below the forces planned.")
    expected: QuantityRow | None = figure("The result that is expected.")
    schedule: tuple[StageRow, ...] = figure("Stages of the run.", at="preflight.stages")
    duration_s: float | None = figure("Of the run.")
    until: UntilRow = figure("Where the plan has procedure.until.", default=None)
    limits: tuple[LimitTerm, ...] = figure("Thresholds of the supervisor; none where refused.")


def preflight_schema() -> dict[str, Any]:
    """The JSON Schema of a preflight."""
    return schema_of(PreflightResults, "preflight")


class _Told(NamedTuple):
    preflight: Preflight
    chance_of_yield: float | None
    expected: Quantity | None
    duration_s: float | None
    limits: tuple[Term, ...]


def preflight_data(preflight: Preflight) -> dict[str, Any]:
    """The JSON object of a preflight."""
    expected = expected_of(preflight) if preflight.stages else None
    top_n = max(preflight.plan.procedure.top_force_n, preflight.force_limit_n)
    refused = preflight.verdict is PlanVerdict.REFUSED
    limits = None if refused else preflight.limits
    made = data(PreflightResults, _Told(
        preflight,
        chance_of_yield(preflight.plan.payload, preflight.theory, top_n),
        expected.chord if expected else None,
        preflight.duration_s if preflight.stages else None,
        limits.terms if limits else (),
    ))  # fmt: skip
    return made if preflight.until is None else made | {"until": data(UntilRow, preflight.until)}


def force_budget_table(preflight: Preflight) -> Table:
    """Possible contributions of the guarded approach to the force, term by term."""
    title = f"Force budget at the guarded speed of {f(preflight.guarded_speed_m_s, 'm/s')}"
    return table(title, ForceTerm, preflight.force_budget)


def need_table(until: Until) -> Table:
    """Requirements of every level before the run."""
    top, expected = f(until.needs[-1].level_n, "N"), "By theory "
    if (level_n := until.expected_level_n) is None:
        expected += f"no level up to {top} is enough"
    else:
        expected += f"the loading ends at {f(level_n, 'N')} of {top}"
    notes = [
        f"{expected}; the run goes by the deformation that it measures.",
        "Deformation is that of the payload from 10 % of a level to the level. Half width is that "
        f"of the 95 % interval of the chord, {MARGIN:g} times what the known errors give.",
    ]
    return table(f"How far to load for ±{100.0 * until.requested:g} %", NeedRow, until.needs, notes)
