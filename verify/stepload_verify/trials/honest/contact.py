"""What the contact and the load path do over a run: deformation that remembers, and drifts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from stepload.record.rows import Phase
from stepload_verify.trials.honest.course import HOLDS, Course
from stepload_verify.trials.honest.laws import Law

FloatArray = NDArray[np.float64]
Path = Callable[[FloatArray], FloatArray]
"""Times (N,) in s, or forces (N,) in N → metres (N,)."""

UNLOADING = (Phase.UNLOAD, Phase.UNLOAD_HOLD, Phase.RETRACT)
ROUNDS = 4


def nothing(values: FloatArray) -> FloatArray:
    """No error."""
    return np.zeros_like(values)


@dataclass(frozen=True, slots=True)
class Creep:
    """Delayed deformation: shares `parts` that follow with times `taus_s`.

    `of_force` False: each share is of the prompt deformation; True: of the force that the law is
    put to (a linear viscoelastic body under Hertz pressure). `first_only`: only where the force is
    higher than ever before (a body that is run in by its first load).
    """

    parts: tuple[float, ...]
    taus_s: tuple[float, ...]
    of_force: bool = False
    first_only: bool = False


@dataclass(frozen=True, slots=True)
class Contact:
    """The contact and all that moves with it; lengths in m, forces in N.

    Attributes:
        law: the virgin loading, the truth.
        yields: whether what is deformed beyond `limit_n` stays (unloading after Etsion 2005).
        limit_n, limit_m: true F_c and δ_c where it yields.
        creep: None: prompt.
        loss: energy lost in a loop, as a share of what is stored.
        slips: (force, length) of single slips in the first loading.
        ratchet_m: set that every cycle adds, before its loading begins.
        system: deflection of the load path over force.
        drift: displacement over time.
        backlash_m: what the reading loses where the motion turns.
        held_force: whether holds keep the force; else they keep the position.
        damping_s: time within which a Kelvin-Voigt body follows its force: F = K (δ + t δ̇)ⁿ.
        load_drift_m_per_n_s: drift that turns with the force, as of motors that get warm by it.
    """

    law: Law
    system: Path
    limit_n: float | None = None
    limit_m: float = 0.0
    creep: Creep | None = None
    loss: float = 0.0
    slips: tuple[tuple[float, float], ...] = ()
    ratchet_m: float = 0.0
    drift: Path = nothing
    backlash_m: float = 0.0
    held_force: bool = False
    damping_s: float = 0.0
    load_drift_m_per_n_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Pressed:
    """What happened: forces and displacements (N,), without any error of measurement."""

    force_n: FloatArray
    travel_m: FloatArray


def press(contact: Contact, course: Course, retract_m: float) -> Pressed:
    """Run the course; in holds at a position the force relaxes, and the next ramp begins there."""
    force = course.forces()
    travel = deformed(contact, course, force)
    if not contact.held_force:
        holds = [each for each in course.segments if each.phase in HOLDS]
        numbers = [i for i, each in enumerate(course.segments) if each.phase in HOLDS]
        ends = np.array([each.to_n for each in course.segments])
        relaxed = [np.zeros(each.stop - each.start) for each in holds]
        levels = np.array([each.from_n for each in holds])
        step_n = 0.01 * float(levels.max())
        system = contact.system(levels) - contact.system(levels - step_n)
        stiffness = 1.0 / (contact.law.compliance(levels) + system / step_n)
        for _ in range(ROUNDS):
            for i, each in enumerate(holds):
                moved = travel[each.start : each.stop] - travel[each.start - 1]
                relaxed[i] = relaxed[i] - stiffness[i] * moved
                ends[numbers[i]] = each.to_n + float(relaxed[i][-1])
            force = course.forces(ends)
            for i, each in enumerate(holds):
                force[each.start : each.stop] += relaxed[i]
            travel = deformed(contact, course, force)
    return Pressed(np.where(course.gap > 0.0, 0.0, force), travel - course.gap * retract_m)


def deformed(contact: Contact, course: Course, force: FloatArray) -> FloatArray:
    """Displacement (N,) of the arm that such a course of force takes."""
    unloading = np.isin(course.phase, UNLOADING)
    body = _prompt(contact, force)
    if contact.loss:
        body = body + _loop(contact, course, force, unloading)
    creep = contact.creep
    if creep is not None:
        source = np.maximum(force, 0.0) if creep.of_force else body
        late = _late(source, creep, course)
        body = _prompt(contact, force + late) if creep.of_force else body + late
    if contact.damping_s:
        body = _late(body, Creep((1.0,), (contact.damping_s,)), course)
    if contact.load_drift_m_per_n_s:
        dt_s = float(course.time_s[1] - course.time_s[0])
        body = body + contact.load_drift_m_per_n_s * dt_s * np.cumsum(np.maximum(force, 0.0))
    for at_n, length_m in contact.slips:
        body = body + length_m * np.maximum.accumulate(force >= at_n)
    if contact.ratchet_m:
        body = body + contact.ratchet_m * (course.cycle - 1)
    back = contact.backlash_m * unloading
    return body + contact.system(force) + contact.drift(course.time_s) - back


def _late(source: FloatArray, creep: Creep, course: Course) -> FloatArray:
    """Delayed deformation (N,): every share follows through a first-order lag of its own."""
    dt_s = float(course.time_s[1] - course.time_s[0])
    if creep.first_only:
        source = np.maximum.accumulate(source)
    late = np.zeros_like(source)
    for part, tau_s in zip(creep.parts, creep.taus_s, strict=True):
        keep = float(np.exp(-dt_s / tau_s))
        late += part * lfilter([1.0 - keep], [1.0, -keep], source)
    return late


def _prompt(contact: Contact, force: FloatArray) -> FloatArray:
    """Deformation (N,) without delay; after a yield along the unloading from the highest force."""
    if contact.limit_n is None:
        return contact.law.deformation(force)
    highest = np.maximum.accumulate(np.maximum(force, 0.0))
    loaded = contact.law.deformation(highest)
    ratio = np.maximum(loaded / contact.limit_m, 1.0)
    left = loaded * (1.0 - ratio**-0.28) * (1.0 - ratio**-0.69)
    exponent = 1.5 * ratio**-0.0331
    share = np.divide(np.maximum(force, 0.0), highest, out=np.zeros_like(force), where=highest > 0)
    return np.asarray(left + (loaded - left) * share ** (1.0 / exponent))


def _loop(
    contact: Contact, course: Course, force: FloatArray, unloading: NDArray[np.bool_]
) -> FloatArray:
    """How much further down the unloading lies: 4 H e^q (1 − e^q), q = 1/n, e of the top force."""
    top_n = float(force.max())
    q = 1.0 / contact.law.n
    depth = float(contact.law.deformation(top_n))
    area = 4.0 * (1.0 / (q + 1.0) - 1.0 / (2.0 * q + 1.0))
    height_m = contact.loss * depth / ((contact.law.n + 1.0) * area)
    share = np.clip(force / top_n, 0.0, 1.0) ** q
    return np.asarray(np.where(unloading, 4.0 * height_m * share * (1.0 - share), 0.0))


def settled(law: Law, creep: Creep) -> Law:
    """The loading law once all delayed deformation is there."""
    late = 1.0 + sum(creep.parts)
    if not creep.of_force:
        return replace(law, deformation_m=late * law.deformation_m)
    inside = law.force_n * late <= law.force_n[-1]
    force = law.force_n[inside]
    return replace(law, force_n=force, deformation_m=law.deformation(late * force))
