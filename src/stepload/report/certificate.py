"""The first sheet of a run's report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import date

from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    Material,
    Profile,
    RoundedCone,
    RoundedPyramid,
    SharpCone,
    Sphere,
)
from stepload.feasibility.preflight import Preflight
from stepload.feasibility.stiffness import known_stiffness
from stepload.identification.identify import Identification
from stepload.plan.model import Payload, Plan, SystemStiffness
from stepload.record.reader import Recording
from stepload.report.analyse import Evaluation
from stepload.report.levels import Level, sheet_table
from stepload.report.model import Certificate, Figure, Table
from stepload.report.quality import summary
from stepload.report.run_record import SavedRun, started_on
from stepload.report.tables import stiffness_table
from stepload.units import format_quantity as f
from stepload.units import percent

NOT_STATED = "not stated"
LONGEST = 100
"""Largest number of characters of a value on the first sheet; the run's table has all of it."""

Facts = list[tuple[str, str]]


def short(text: str, longest: int = LONGEST) -> str:
    """`text` on one line, cut with an ellipsis where it is too long for the first sheet.

    It is cut between words where that leaves most of it.
    """
    line = " ".join(text.split())
    if len(line) <= longest:
        return line
    cut = line[: longest - 1]
    words = cut.rpartition(" ")[0]
    return f"{words if len(words) > longest // 2 else cut}…"


def stated(text: str) -> str:
    """`text` for the first sheet, or a note that it was not stated."""
    return short(text) or NOT_STATED


_NAMES = {"force_sensor": "Force sensor", "calibration": "K_s from"}


def shared_facts(runs: Iterable[SavedRun], *keys: str) -> Facts:
    """What several runs have in common by keys of their metadata, or all their values."""
    facts, told = Facts(), [{**run.metadata, "day": run.metadata.get("started", "")[:10]}
                            for run in runs]  # fmt: skip
    for key in keys:
        every = dict.fromkeys(filter(None, (each.get(key, "") for each in told)))
        facts.append((_NAMES.get(key, key.capitalize()), stated(", ".join(every))))
    return facts


def other_elastic_limit(preflight: Preflight, found: Identification | None) -> float | None:
    """The F_c used for a result, in N, where it differs from the plan's; else None."""
    used_n = None if found is None else found.conditions.elastic_limit_n
    if used_n is None or math.isclose(used_n, preflight.theory.elastic_limit_n, rel_tol=1e-6):
        return None
    return used_n


def specimen_facts(
    preflight: Preflight, recording: Recording, found: Identification | None = None
) -> Facts:
    """What was pressed and against what; `found` provides the F_c of the result."""
    told, payload = recording.metadata, preflight.plan.payload
    counted, limit_n = preflight.theory.counted, preflight.theory.elastic_limit_n
    limit = f"{f(limit_n, 'N')}, {counted.equation}"
    if counted.lower_n < limit_n:
        limit += f", F_c used {f(counted.lower_n, 'N')}"
    if (used_n := other_elastic_limit(preflight, found)) is not None:
        limit = f"{f(used_n, 'N')}, taken for this result; by the plan {limit}"
    return [
        ("Specimen", stated(told.get("specimen", ""))),
        ("Batch", stated(told.get("batch", ""))),
        ("Tags", stated(", ".join(filter(None, told.get("tags", "").split("\n"))))),
        ("Payload", short(payload.name)),
        ("Geometry", geometry(payload.geometry)),
        ("Material", material(payload.material)),
        ("Plate", material(payload.plate)),
        ("Roughness", _roughness(payload)),
        ("Elastic limit F_c", limit),
        ("Force limit", f"{f(preflight.force_limit_n, 'N')}, at which the supervisor stops"),
    ]


def rig_facts(
    preflight: Preflight, recording: Recording, found: Identification | None = None
) -> Facts:
    """Rig and operator; `found` provides the K_s that was subtracted, the plan's or another."""
    plan, told = preflight.plan, recording.metadata
    facts = [("Rig", short(plan.rig.name))]
    facts += [
        (name, short(told[role]))
        for name, role in (("Arm", "arm"), ("Force sensor", "force_sensor"))
        if told.get(role)
    ]
    facts += _stiffness_facts(plan, told, found)
    if plan.identify.temperature_c is not None:
        facts.append(("Temperature", f"{plan.identify.temperature_c:g} °C"))
    return [*facts, *((name, stated(told.get(name.lower(), ""))) for name in ("Operator", "Notes"))]


def _stiffness_facts(plan: Plan, told: Mapping[str, str], found: Identification | None) -> Facts:
    """The K_s that was subtracted from the travel, with its standard uncertainty and origin."""
    if plan.rig.displacement is not None:
        gauge = told.get("displacement_sensor", plan.rig.displacement.driver)
        across = "not in the result: travel is measured across the contact"
        return [("Gauge", stated(gauge)), ("K_s", across)]
    if plan.identify.kind == "system":
        return [("K_s", "what this run measures")]
    stiffness, known = plan.rig.system_stiffness, known_stiffness(plan)
    value: float | None = stiffness.stiffness_n_per_m
    sigma = known.sigma_n_per_m
    origin = source_of(stiffness, started_on(told.get("started", "")))
    table = ", and a table of the deflection" if known.table is not None else ""
    if found is not None:
        sources = found.conditions.sources
        used = sources.system_stiffness_n_per_m, sources.system_stiffness_sigma_n_per_m
        if used != (value, sigma):
            (value, sigma), table = used, ""
            origin = "stated when the record was identified again, not by the plan"
    if value is None:
        return [("K_s", "none was taken out of the travel"), ("K_s from", origin)]
    size = f"{f(value, 'N/m')} ± {f(sigma, 'N/m')} (standard uncertainty){table}"
    return [("K_s", size), ("K_s from", origin)]


def source_of(stiffness: SystemStiffness, day: date | None) -> str:
    """Origin of K_s, and its age on the day of the run."""
    told = [str(stiffness.provenance)]
    if stiffness.record is not None:
        told.append(f"record {stiffness.record.name}")
    if (measured := stiffness.measured_on) is None:
        told.append("day of the measurement not stated, so its age is not known")
    else:
        told.append(f"measured on {measured}")
        if day is not None and (days := (day - measured).days) != 0:
            number, when = abs(days), "before" if days > 0 else "after"
            told.append(f"{number} day{'s' if number > 1 else ''} {when} the run")
    if stiffness.valid_until is not None:
        told.append(f"valid until {stiffness.valid_until}")
    if stiffness.simulated:
        told.append("made in a dry run")
    if stiffness.validity_problem:
        told.append(stiffness.validity_problem)
    return short(", ".join(told))


def _pm(value: float, sigma: float | None, unit: str) -> str:
    text = f(value, unit)
    return text if sigma is None else f"{text} ± {f(sigma, unit)}"


def geometry(shape: Geometry) -> str:
    """The shape with its sizes."""
    if isinstance(shape, SharpCone):
        return f"sharp cone, {f(shape.slope_rad, 'rad')} between flank and plate"
    if isinstance(shape, Profile):
        points, terms = len(shape.table_m), len(shape.exponents)
        return f"profile, {points} points" if points else f"profile, {terms} powers of r"
    if isinstance(shape, RoundedCone | RoundedPyramid):
        kind = "cone" if isinstance(shape, RoundedCone) else "pyramid"
        angle = f"{math.degrees(shape.half_angle_rad):.4g}°"
        tip = _pm(shape.radius_m, shape.radius_sigma_m, "m")
        return f"rounded {kind}, half angle {angle}, radius of the tip {tip}"
    if not isinstance(shape, Sphere | BluntTip | FlatPunch):
        return f"gap in proportion to r^{shape.exponent:g}"
    radius = _pm(shape.radius_m, shape.radius_sigma_m, "m")
    if isinstance(shape, BluntTip):
        return f"{shape.kind}, radius of the tip {radius}"
    text = f"{'sphere' if isinstance(shape, Sphere) else 'flat punch'}, radius {radius}"
    if isinstance(shape, Sphere) and shape.counter_radius_m is not None:
        other = _pm(shape.counter_radius_m, shape.counter_radius_sigma_m, "m")
        text += f", on a sphere of radius {other}"
    return text


def material(body: Material) -> str:
    """A material with the numbers that theory takes."""
    modulus = _pm(body.youngs_modulus_pa, body.youngs_modulus_sigma_pa, "Pa")
    if ends_pa := body.youngs_modulus_ends_pa:
        modulus = f"{f(ends_pa[0], 'Pa')} to {f(ends_pa[1], 'Pa')}, not known better"
    ratio = " to ".join(f"{x:g}" for x in body.poisson_ratio_ends or (body.poisson_ratio,))
    if body.poisson_ratio_sigma is not None:
        ratio += f" ± {body.poisson_ratio_sigma:g}"
    text = f"{short(body.name)}: E {modulus}, ν {ratio}"
    if body.yield_strength_pa is not None:
        text += f", Y {_pm(body.yield_strength_pa, body.yield_strength_sigma_pa, 'Pa')}"
    return text


def _roughness(payload: Payload) -> str:
    if payload.roughness_m is None:
        return NOT_STATED
    if payload.roughness_m == 0.0:
        return "declared smooth"
    return f"σ_eq {_pm(payload.roughness_m, payload.roughness_sigma_m, 'm')} (8)"


MOST_REMARKS, LONGEST_REMARK = 3, 170
"""Largest number of reasons on the first sheet; all of them are on the next."""


def run_certificate(
    run: Evaluation,
    levels: Sequence[Level],
    reasons: Sequence[str],
    law: Figure | None,
    system: Table | None,
) -> Certificate:
    """The sheet of a run.

    Args:
        run: its evaluation.
        levels: its holds.
        reasons: all remarks on the result.
        law: the figure that shows the result; None where there is none.
        system: the table of the system stiffness where the run measures that.
    """
    preflight, recording = run.preflight, run.recording
    tables = []
    if run.identification is not None:
        tables.append(replace(stiffness_table(run.identification), notes=()))
    if system is not None:
        tables.append(system)
    beside = None
    if levels and run.data is not None:
        arm, gauge = preflight.plan.rig.arm, preflight.plan.rig.displacement
        resolution_m = gauge.resolution_m if gauge else arm.position_resolution_m
        way = "travel" if run.system is not None else "deformation"
        beside = sheet_table(levels, run.data.touches, resolution_m, way)
    told, found, peak_n = recording.metadata, run.identification, run.outcome.peak_force_n
    limit_n = other_elastic_limit(preflight, found) or preflight.theory.counted.lower_n
    contact = "" if found is None else summary(found.run.alignment.quality)
    system_run = preflight.plan.identify.kind == "system"
    return Certificate(
        heading="Test report: system stiffness of a rig"
        if system_run
        else "Test report: contact stiffness of a payload",
        facts=(
            [
                *specimen_facts(preflight, recording, found),
                (
                    "Largest force",
                    f"{f(peak_n, 'N')}, {percent(peak_n / limit_n, 2)} of the F_c used",
                ),
            ],
            [
                *rig_facts(preflight, recording, found),
                *([("Contact", contact.removeprefix("contact: "))] if contact else []),
            ],
        ),
        tables=tables,
        levels=beside,
        figure=law,
        remarks=few(reasons),
        signatures=(("Operator", short(told.get("operator", ""))[:60]), ("Checked by", "")),
        foot=f"stepload {told.get('stepload', '')} · run {told.get('run_id') or 'without an id'}",
    )


def few(reasons: Sequence[str]) -> list[str]:
    """The first reasons, shortened, and how many more there are."""
    shown = [short(reason, LONGEST_REMARK) for reason in reasons[:MOST_REMARKS]]
    cut = any(len(reason) > len(each) for reason, each in zip(reasons, shown, strict=False))
    left = len(reasons) - len(shown)
    if left or cut:
        more = f"{left} more" if left else "In full"
        shown.append(f"{more} below, under what is to be said about this result.")
    return shown
