"""Checks for contradictions between values of a section, although every key by itself is valid.

Where a check asks for a value that is not known, it ends there; what it has found before counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise

from stepload.contact.elastic import law_for
from stepload.contact.lateral_checks import across_problem
from stepload.contact.limit import no_limit_reason
from stepload.contact.material_range import is_range
from stepload.contact.materials import Material
from stepload.declaration.sections import DERIVED, Key, Kind, keys, known, written
from stepload.errors import DomainError
from stepload.estimators.deflection_rows import table_problem
from stepload.plan.calibration import disagreement
from stepload.plan.derived import MAX_LEVELS
from stepload.plan.impossible import Check, Impossibility, metre, newton, run_checks
from stepload.plan.model import (
    ForceSpec,
    Payload,
    Procedure,
    SecondForce,
    SecondForceSource,
    Simulation,
    SystemStiffness,
)
from stepload.plan.reader import expected
from stepload.units import format_quantity


def impossibilities(section: object) -> Iterator[Impossibility]:
    """Contradictions between the given values of a section's draft and of the sections below it."""
    yield from run_checks(CHECKS.get(type(section), ()), section)
    for key, inner in _below(section):
        for found in impossibilities(inner):
            yield found._replace(path=(key, *found.path))


def _below(section: object) -> Iterator[tuple[str, object]]:
    """The sections right below a section, each with the name of its key."""
    for key in _keys(section):
        if key.sections:
            yield key.name, getattr(section, key.field)


def _keys(section: object) -> tuple[Key, ...]:
    kind: Kind = type(section)
    return keys(kind) if hasattr(kind, "__pydantic_fields__") else ()


def underivable(section: object) -> Iterator[Impossibility]:
    """Keys that the draft of a section leaves out and that did not follow from others."""
    for each in _keys(section):
        if getattr(section, each.field) is DERIVED:
            yield Impossibility(
                (),
                f"missing key {each.name!r}",
                f"it does not follow from the other keys here. {expected(each)}",
            )
    for key, inner in _below(section):
        for found in underivable(inner):
            yield found._replace(path=(key, *found.path))


def _strength(body: Material) -> Iterator[Impossibility]:
    modulus, strength = body.youngs_modulus_pa, body.yield_strength_pa
    if strength is not None and strength >= modulus:
        yield Impossibility(
            ("yield_strength",),
            f"yield strength {format_quantity(strength, 'Pa')} is not below Young's modulus "
            f"{format_quantity(modulus, 'Pa')}",
            "look for a wrong prefix (MPa, GPa) in one of the two",
        )


def _range(body: Material) -> Iterator[Impossibility]:
    if body.yield_strength_pa is not None and is_range(body):
        yield Impossibility(
            ("yield_strength",),
            "a yield strength beside a range: F_c (13) follows from both, and is not known",
            "leave it out and declare the payload's force_limit, or write the modulus itself",
        )


def _roughness(payload: Payload) -> Iterator[Impossibility]:
    """Only of shapes with a radius; they all name it as a sphere does."""
    roughness, radius = payload.roughness_m, getattr(payload.geometry, "radius_m", None)
    if roughness is not None and radius is not None and roughness >= radius:
        yield Impossibility(
            ("roughness",),
            f"roughness {metre(roughness)} is not below the radius {metre(radius)}",
            "roughness is an rms height, some micrometres for machined parts",
        )


def _hardness(payload: Payload) -> Iterator[Impossibility]:
    if payload.micro_hardness_pa is not None and payload.roughness_m is None:
        yield Impossibility(
            ("micro_hardness",),
            "micro-hardness without roughness has no effect",
            "give `roughness` too, or leave both out",
        )


def _theory(payload: Payload) -> Iterator[Impossibility]:
    """Theory must have a contact law, and an elastic limit where none is declared."""
    try:
        bodies = known(payload.geometry, payload.material, payload.plate)
        law_for(*bodies)
        reason = no_limit_reason(*bodies)
    except DomainError as error:
        yield Impossibility(("geometry",), error.message, error.hint)
    except ArithmeticError:
        yield Impossibility(
            ("geometry",),
            "the contact law of this geometry is beyond what can be computed",
            "check its dimensions and their units",
        )
    else:
        if reason and payload.declared_force_limit_n is None:
            yield Impossibility(
                (),
                f"missing key 'force_limit': {reason}",
                "declare the force that must not be exceeded, for example force_limit: 400 N",
            )


def _fineness(key: str, force: ForceSpec) -> Iterator[Impossibility]:
    part: float = getattr(force, f"{key}_n")
    if part >= 0.1 * force.range_n:
        yield Impossibility(
            (key,),
            f"{key} {newton(part)} is more than a tenth of the range {newton(force.range_n)}",
            "such a sensor cannot measure",
        )


def _second_channel(second: SecondForce) -> Iterator[Impossibility]:
    source, sensor = second.source, second.sensor
    if source is SecondForceSource.SENSOR and sensor is None:
        yield Impossibility((), "source is sensor, but there is no `sensor`", "describe it there")
    elif source is not SecondForceSource.SENSOR and sensor is not None:
        yield Impossibility(
            ("sensor",), f"a sensor, but source is {source}", "write source: sensor, or remove it"
        )
    elif source is not SecondForceSource.NONE and second.tolerance_n == 0.0:
        yield Impossibility(
            ("tolerance",),
            "a second channel with a tolerance of 0 N would stop every run",
            "give the difference that its noise and gain error explain",
        )


def _stiffness_is_known(stiffness: SystemStiffness) -> Iterator[Impossibility]:
    value, sigma = written(stiffness.stiffness_n_per_m), written(stiffness.sigma_n_per_m)
    if value is None and stiffness.record is None:
        yield Impossibility(
            (),
            "neither `value` nor `record`",
            "give value and sigma, or the record of a calibration",
        )
    elif (value is None) != (sigma is None):
        yield Impossibility(
            (),
            "`value` and `sigma` belong together",
            "a stiffness without its uncertainty cannot be compensated",
        )


def _stiffness_error(stiffness: SystemStiffness) -> Iterator[Impossibility]:
    value, sigma = stiffness.stiffness_n_per_m, stiffness.sigma_n_per_m
    if sigma >= value:
        yield Impossibility(
            ("sigma",),
            f"uncertainty {format_quantity(sigma, 'N/m')} is not below the stiffness "
            f"{format_quantity(value, 'N/m')}",
            "a stiffness known so badly is not known: calibrate it",
        )


def _ratings(force: ForceSpec) -> Iterator[Impossibility]:
    """Ratings are three numbers, and that of the pressing axis is not below the range."""
    for key, rated in (
        ("rated_force", force.rated_force_n),
        ("rated_torque", force.rated_torque_n_m),
    ):
        if len(rated) not in (0, 3):
            yield Impossibility(
                (key,), f"{len(rated)} ratings, a sensor has three axes", "give all three: x, y, z"
            )
    if len(force.rated_force_n) == 3:
        along_n = force.rated_force_n["xyz".index(force.axis[-1])]
        if force.range_n > along_n:
            yield Impossibility(
                ("range",),
                f"the range {newton(force.range_n)} is above the rated force {newton(along_n)} of "
                f"{force.axis[1:]}",
                "state the rated force of the pressing axis as range",
            )


def _table(stiffness: SystemStiffness) -> Iterator[Impossibility]:
    """The table of the deflection by itself, and with the stiffness that it goes with."""
    rows = stiffness.deflection_force_n, stiffness.deflection_m, stiffness.deflection_sigma_m
    if not any(rows):
        return
    if problem := table_problem(*rows):
        yield Impossibility(
            ("deflection_force",),
            f"table of the deflection: {problem}",
            "give deflection_force, deflection and deflection_sigma of every row, rising",
        )
        return
    value, sigma = stiffness.stiffness_n_per_m, stiffness.sigma_n_per_m
    if problem := disagreement(value, sigma, rows[0], rows[1]):
        yield Impossibility(
            ("deflection",),
            problem,
            "look for a wrong prefix (µm, mm), or give the table that belongs to this value",
        )


def _across(stiffness: SystemStiffness) -> Iterator[Impossibility]:
    """The numbers of the lateral force: two each, and none without its error."""
    told = stiffness.across_m_per_n, stiffness.across_sigma_m_per_n, stiffness.at_share
    if problem := across_problem(*told):
        yield Impossibility(
            ("across",),
            f"lateral force: {problem}",
            "two numbers each, for the sensor's two other axes in the order x, y, z; `stepload "
            "calibrate` measures them",
        )


def _validity(stiffness: SystemStiffness) -> Iterator[Impossibility]:
    first, last = stiffness.measured_on, stiffness.valid_until
    if first and last and last < first:
        yield Impossibility(
            ("valid_until",), f"{last} is before measured_on {first}", "check the two dates"
        )


def _simulated_pad(simulation: Simulation) -> Iterator[Impossibility]:
    if (simulation.pad_stiffness_n_per_m is None) != (simulation.pad_depth_m == 0.0):
        yield Impossibility(
            (),
            "`pad_stiffness` and `pad_depth` belong together",
            "a pad is a spring that can be compressed by its depth: give both, or neither",
        )


def _simulated_roughness(simulation: Simulation) -> Iterator[Impossibility]:
    roughness, law = simulation.roughness_m, simulation.law
    if roughness and law not in ("declared", "rough"):
        yield Impossibility(
            ("roughness",),
            f"a roughness, but the simulated law is {law}",
            "write law: rough or law: declared; `yield_force` makes them flow as well",
        )
    elif roughness == 0.0 and law == "rough":
        yield Impossibility(("roughness",), "a rough law without roughness", "write law: smooth")


def _simulated_jkr(simulation: Simulation) -> Iterator[Impossibility]:
    jkr = simulation.adhesion_n > 0.0 and simulation.adhesion_law == "jkr"
    if jkr and (simulation.law == "rough" or simulation.roughness_m):
        yield Impossibility(
            ("adhesion_law",), "jkr adhesion of a rough contact", "asperities part it: use dmt"
        )


def _simulated_cross_talk(simulation: Simulation) -> Iterator[Impossibility]:
    if simulation.cross_talk != 0.0 and simulation.lateral == 0.0:
        yield Impossibility(
            ("cross_talk",),
            "cross-talk without a lateral force has no effect",
            "give `lateral` too, or leave both out",
        )


def _levels(procedure: Procedure) -> Iterator[Impossibility]:
    step, levels = written(procedure.step_n), written(procedure.levels_n)
    if step is None and levels is None:
        yield Impossibility(
            (), "missing key 'step'", "give the load step, or every level in `levels`"
        )
    elif step is not None and levels is not None:
        yield Impossibility(("levels",), "both `step` and `levels`", "give one of the two")
    elif levels is not None:
        yield from _given_levels(procedure)
    elif step > procedure.top_force_n:
        yield Impossibility(
            ("top_force",),
            f"top force {newton(procedure.top_force_n)} is below one step of {newton(step)}",
            "raise top_force or lower step",
        )
    elif procedure.top_force_n / step > MAX_LEVELS:
        yield Impossibility(
            ("step",),
            f"{procedure.top_force_n / step:.0f} load levels",
            f"at most {MAX_LEVELS}: use a larger step",
        )


def _given_levels(procedure: Procedure) -> Iterator[Impossibility]:
    levels, path = procedure.levels_n, ("levels",)
    if not 1 <= len(levels) <= MAX_LEVELS:
        yield Impossibility(path, f"{len(levels)} levels", f"expected 1 to {MAX_LEVELS} levels")
    elif bad := next((pair for pair in pairwise(levels) if pair[1] <= pair[0]), None):
        yield Impossibility(path, f"{newton(bad[1])} after {newton(bad[0])}", "levels must rise")
    elif levels[-1] != procedure.top_force_n:
        yield Impossibility(
            path,
            f"the last level {newton(levels[-1])} is not the top force "
            f"{newton(procedure.top_force_n)}",
            "end the levels with top_force",
        )


def _start(procedure: Procedure) -> Iterator[Impossibility]:
    distance, uncertainty = procedure.surface_distance_m, procedure.surface_uncertainty_m
    if uncertainty > distance:
        yield Impossibility(
            ("surface_uncertainty",),
            f"{metre(uncertainty)} is more than the surface_distance {metre(distance)}: the "
            "payload might touch already at the start",
            "start farther away, or measure the distance better",
        )


def _search(procedure: Procedure) -> Iterator[Impossibility]:
    search, uncertainty = procedure.search_distance_m, procedure.surface_uncertainty_m
    if search < 2.0 * uncertainty:
        yield Impossibility(
            ("search_distance",),
            f"the search ends after {metre(search)}, within the uncertain band of "
            f"2 x {metre(uncertainty)}",
            f"search at least {metre(2.0 * uncertainty)}",
        )


CHECKS: Mapping[Kind, tuple[Check, ...]] = {
    Material: (_strength, _range),
    Payload: (_roughness, _hardness, _theory),
    ForceSpec: (partial(_fineness, "resolution"), partial(_fineness, "noise"), _ratings),
    SecondForce: (_second_channel,),
    SystemStiffness: (_stiffness_error, _stiffness_is_known, _validity, _table, _across),
    Simulation: (_simulated_pad, _simulated_roughness, _simulated_jkr, _simulated_cross_talk),
    Procedure: (_levels, _start, _search),
}
