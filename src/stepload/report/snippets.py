"""The identified law as contact parameters of a simulator: MuJoCo (MJCF), Drake (SDFormat).

Both know a *linear* spring at a contact point, so the law is linearised about a stated force: the
tangent dF/dδ there, or the chord from 10 % of that force to it.

MuJoCo: with the direct format solref = (−stiffness, −damping) and a constant impedance d one
contact point of mass m obeys, with an elliptic cone or condim 1,

    (m + m d/(1 − d)) a = f_ext − K r − C v,   K = m stiffness/(1 − d),   C = m damping/(1 − d).

So both numbers are divided by the mass and scaled by 1 − d. The default impedance of 0.9 and more
would make the contact 9 times as heavy (MuJoCo documentation, Computation: constraint model).

Drake's point contact is f = k x (1 + d ẋ), with k = k₁k₂/(k₁ + k₂) of the two geometries (Drake
documentation, Modeling Compliant Contact).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from stepload.errors import BadInputError, DomainError
from stepload.identification.identify import Identification
from stepload.identification.quantity import ResultVerdict
from stepload.identification.verdict import judge
from stepload.report.model import SIMULATED
from stepload.units import format_quantity as f
from stepload.units import percent

Simulator = Literal["mujoco", "drake"]
Kind = Literal["tangent", "chord"]
SIMULATORS: tuple[Simulator, ...] = ("mujoco", "drake")
KINDS: tuple[Kind, ...] = ("tangent", "chord")

CHORD_FROM = 0.1
"""A chord begins at this share of the operating force, like the headline's."""
WELL_ABOVE_ZERO = 0.1
"""Below this share of the highest force the fitted zero matters more than the data."""
IMPEDANCE = 0.01
FRICTION_RATIO = 1000
"""MuJoCo's impratio: friction keeps an impedance of 0.91 although the normal one is 0.01."""
STEPS_PER_PERIOD = 20


@dataclass(frozen=True, slots=True)
class Spring:
    """A law linearised.

    Attributes:
        kind: tangent or chord.
        at_n: the operating force.
        from_n: where the chord begins; `at_n` for a tangent.
        stiffness_n_per_m: at or up to that force.
        interval_n_per_m: its 95 % interval; None where the fit has no budget.
        peak_force_n: highest force of the record.
        verdict: of the identification.
        simulated: whether it came from a simulated rig.
        warnings: reasons against using the number, in sentences.
    """

    kind: Kind
    at_n: float
    from_n: float
    stiffness_n_per_m: float
    interval_n_per_m: tuple[float, float] | None
    peak_force_n: float
    verdict: ResultVerdict
    warnings: tuple[str, ...]
    simulated: bool = False


def spring_of(
    found: Identification,
    *,
    at_n: float | None = None,
    kind: Kind = "tangent",
    simulated: bool = False,
) -> Spring:
    """An identified law, linearised; at half of the highest force where `at_n` is None.

    Raises:
        BadInputError: the force is not within the data, or they support no stiffness there.
    """
    peak_n = found.peak_force_n
    at_n = 0.5 * peak_n if at_n is None else at_n
    if not 0.0 < at_n <= peak_n:
        raise BadInputError(
            f"the operating force is {f(at_n, 'N')}; the record reaches {f(peak_n, 'N')} and says "
            "nothing beyond",
            hint="give a force above 0 N and within the record, or press higher",
        )
    from_n = CHORD_FROM * at_n if kind == "chord" else at_n
    run = replace(found.run, conditions=replace(found.run.conditions, secant_force_n=at_n))
    if kind == "chord":
        run = replace(found.run, between_n=(from_n, at_n))
    try:
        read = judge(run).quantities.get(kind)
    except DomainError as error:
        raise BadInputError(error.message, hint=error.hint) from None
    if read is None or not math.isfinite(read.value_n_per_m):
        raise BadInputError(f"the data leave the {kind} at {f(at_n, 'N')} open")
    interval = read.interval_n_per_m
    stated = found.headline is not None and bool(found.headline.lines)
    known = stated and math.isfinite(interval[1])
    warnings = []
    if read.verdict is not ResultVerdict.IDENTIFIED:
        warnings.append(
            f"the result is {read.verdict.value.upper()}, not identified: do not rely on this "
            f"number. {'; '.join(read.why)}"
        )
    if not known:
        warnings.append("there is no interval: the uncertainty of this number is not known")
    if at_n < WELL_ABOVE_ZERO * peak_n:
        warnings.append(
            f"{f(at_n, 'N')} is less than {percent(WELL_ABOVE_ZERO, 2)} of the "
            f"{f(peak_n, 'N')} that were "
            "pressed: the zero decides there, not the data"
        )
    return Spring(
        kind, at_n, from_n, read.value_n_per_m, interval if known else None, peak_n,
        read.verdict, tuple(warnings), simulated,
    )  # fmt: skip


def snippet(spring: Spring, simulator: Simulator, *, mass_kg: float | None = None) -> str:
    """Contact parameters for a simulator, as text that its parser takes.

    Args:
        spring: the law linearised.
        simulator: which one.
        mass_kg: effective mass along the normal, for MuJoCo; None: 1 kg, with a remark.

    Raises:
        BadInputError: the mass is not finite and positive, or given where none is used.
    """
    if mass_kg is not None and simulator != "mujoco":
        raise BadInputError("a mass is given; Drake's contact stiffness does not depend on it")
    if mass_kg is not None and not 0.0 < mass_kg < math.inf:
        raise BadInputError(f"the mass is {mass_kg:g} kg; it must be finite and greater than 0 kg")
    return _drake(spring) if simulator == "drake" else _mujoco(spring, mass_kg)


def _commented(spring: Spring, lines: list[str], content: str) -> str:
    """XML under a comment; double hyphens, which would end it, are replaced."""
    at, stiffness = f(spring.at_n, "N"), f(spring.stiffness_n_per_m, "N/m")
    chord = f"chord from {f(spring.from_n, 'N')} to {at}"
    what = chord if spring.kind == "chord" else f"tangent dF/dδ at {at}"
    ends = spring.interval_n_per_m
    known = f"95 % interval {f(ends[0], 'N/m')} to {f(ends[1], 'N/m')}" if ends else "no interval"
    head = [
        *([SIMULATED] if spring.simulated else []),
        *(f"WARNING: {warning}" for warning in spring.warnings),
        f"Contact of payload and plate: {what} = {stiffness}, {known}.",
        f"The result is {spring.verdict.value}. The law is not linear: this number is for that "
        f"force. Measured up to {f(spring.peak_force_n, 'N')}.",
    ]
    safe = [line.replace("--", "−−").rstrip("-") for line in (*head, *lines)]
    return "\n".join(["<!--", *(f"  {line}" for line in safe), "-->", content, ""])


def _mujoco(spring: Spring, mass_kg: float | None) -> str:
    mass = 1.0 if mass_kg is None else mass_kg
    stiffness = spring.stiffness_n_per_m * (1.0 - IMPEDANCE) / mass
    period_s = 2.0 * math.pi * math.sqrt(mass / (1.0 - IMPEDANCE) / spring.stiffness_n_per_m)
    lines = [
        f"solref = (−stiffness, −damping) is divided by the effective mass: it is for {mass:g} kg.",
        f"Timestep: at most {period_s / STEPS_PER_PERIOD:.2g} s, a {STEPS_PER_PERIOD}th of the "
        f"period of {mass:g} kg on this spring.",
        "Damping is not measured: 0 is a perfectly elastic contact.",
    ]
    if mass_kg is None:
        lines.append("NO MASS WAS GIVEN: divide both numbers of solref by your effective mass.")
    return _commented(
        spring,
        lines,
        f"""<mujoco>
  <option cone="elliptic" impratio="{FRICTION_RATIO}"/>
  <contact>
    <pair geom1="payload" geom2="plate" condim="3"
          solref="{-stiffness:.6g} 0" solreffriction="0.02 1"
          solimp="{IMPEDANCE:g} {IMPEDANCE:g} 0.001 0.5 2"/>
  </contact>
</mujoco>""",
    )


def _drake(spring: Spring) -> str:
    doubled = 2.0 * spring.stiffness_n_per_m
    lines = [
        f"Goes into <collision> of both bodies: Drake combines k = k1 k2/(k1 + k2), so each has "
        f"{f(doubled, 'N/m')}, twice the contact's stiffness.",
        "Point contact only. Dissipation is not measured: Drake's default counts.",
    ]
    tag = f"  <drake:point_contact_stiffness>{doubled:.6g}</drake:point_contact_stiffness>"
    head = '<drake:proximity_properties xmlns:drake="http://drake.mit.edu">'
    return _commented(spring, lines, f"{head}\n{tag}\n</drake:proximity_properties>")
