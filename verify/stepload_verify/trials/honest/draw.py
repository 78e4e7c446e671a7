"""Ideal cases: a law, a rig, and errors of exactly the sizes that are declared."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from stepload_verify.trials.honest import laws
from stepload_verify.trials.honest.case import Case, Declared, Faults, squared
from stepload_verify.trials.honest.contact import Contact, Path, nothing
from stepload_verify.trials.honest.course import Procedure
from stepload_verify.trials.honest.laws import FloatArray, Law
from stepload_verify.trials.honest.rig import Rig, between, draw_rig

PERIOD_S = 50.0
"""About a cycle: drifts are drawn per this time."""
LOADING_S = 24.0
"""About a loading: temperatures are known over this time."""


def linear(rate: float) -> Path:
    """A drift of `rate` per second."""
    return lambda at: np.asarray(rate * at)


def spring(stiffness_n_per_m: float) -> Path:
    """A load path with one stiffness."""
    return lambda force: np.asarray(force / stiffness_n_per_m)


def procedure(rig: Rig, rng: np.random.Generator, **changes: Any) -> Procedure:
    """Usually six levels with holds of 3 s, two cycles."""
    white_n = math.hypot(rig.force_noise_n, rig.force_resolution_n / math.sqrt(12.0))
    made = Procedure(
        top_n=rig.top_n,
        levels=int(rng.choice([5, 6, 6, 6, 8])),
        cycles=2,
        hold_s=float(rng.choice([2.0, 3.0, 3.0, 5.0])),
        rate_hz=rig.rate_hz,
        touch_n=max(0.01 * rig.top_n, 8.0 * white_n),
    )
    return replace(made, **changes)


def ideal(world: str, seed: int, rng: np.random.Generator, law: Law, rig: Rig) -> Case:
    """The law seen by the rig, everything as declared, with what no rig is free of.

    That is a loop of up to 3 %, a drift of up to 0.2 % of the depth per cycle, a linear drift of
    the sensor's zero, and a load path that gets warmer as far as is declared.
    """
    plan = procedure(rig, rng)
    growth_m = 0.002 * rig.depth_m * rng.uniform()
    drift_m = 0.002 * rig.depth_m * rng.uniform(-1.0, 1.0)
    warmed_m = growth_m * rng.standard_normal()
    gain = rig.gain_sigma * float(rng.standard_normal())
    contact = Contact(
        law=law,
        system=spring(true_stiffness(rig, gain, rng)),
        loss=rng.uniform(0.0, 0.03),
        drift=linear(drift_m / PERIOD_S + warmed_m / LOADING_S),
        held_force=bool(rng.uniform() < 0.25),
    )
    faults = Faults(
        gain=gain,
        bend=nothing,
        zero=linear(1e-3 * rig.top_n * rng.uniform(-1.0, 1.0) / PERIOD_S),
        lag_s=rig.lag_sigma_s * float(rng.standard_normal()),
        error=squared(rig.smooth_length_n / rig.top_n, rng),
        over_travel=False,
        error_m=rig.smooth_m,
        noise_n=rig.force_noise_n,
    )
    depth_m = float(law.deformation(rig.top_n))
    guess_m = depth_m * between(1 / 1.15, 1.15, rng)
    knows = bool(rng.uniform() < 0.6)
    declared = Declared(
        touch_n=plan.touch_n,
        roughness_m=0.0 if rng.uniform() < 0.5 else None,
        theory_n=law.n if knows else None,
        theory_k=rig.top_n / guess_m**law.n if knows else None,
        elastic_limit_n=rig.top_n * between(1.5, 10.0, rng) if rng.uniform() < 0.5 else None,
        length_n=rig.smooth_length_n,
        table=table(contact.system, rig, gain),
        temperature_sigma_k=0.5,
        position_m_per_k=growth_m / 0.5,
    )
    six_axes = rig.family in ("stvf", "ur") or bool(rng.uniform() < 0.5)
    return Case(world, seed, True, False, rig, plan, contact, faults, declared, six_axes=six_axes)


def true_stiffness(rig: Rig, gain: float, rng: np.random.Generator) -> float:
    """K_s of which a calibration with the same sensor found the declared one.

    The sensor's gain is in the declared K_s as it is in the run, where it cancels.
    """
    return rig.stiffness_n_per_m / (1.0 + gain) / (1.0 + rig.stiffness_sigma * rng.normal())


def table(system: Path, rig: Rig, gain: float) -> tuple[FloatArray, FloatArray]:
    """The load path as a calibration in the same pose finds it with the same sensor.

    Its error is that of K_s: the declared K_s is the slope of the table above 40 % of the top.
    """
    reading = rig.top_n * np.linspace(0.0, 1.1, 23)
    deflection = system(reading / (1.0 + gain))
    ends = system(rig.top_n * np.array([0.4, 1.0]) / (1.0 + gain))
    line = 0.6 * rig.top_n / float(ends[1] - ends[0])
    return reading, deflection * (line / rig.stiffness_n_per_m)


def power_law(rig: Rig, n: float) -> Law:
    """The power law through the rig's depth at its top force."""
    return laws.power(rig.top_n, rig.depth_m, n)


def start(world: str, seed: int, rng: np.random.Generator, n: float | None = None) -> Case:
    """An ideal case to spoil: a sphere, or any exponent."""
    rig = draw_rig(rng)
    if n is None:
        n = 1.5 if rng.uniform() < 0.7 else rng.uniform(1.1, 2.0)
    return ideal(world, seed, rng, power_law(rig, n), rig)


def spoiled(case: Case, story: str, **changes: Any) -> Case:
    """The case with other parts, no longer ideal; keys name a part, values what to replace in it.

    `contact`, `faults`, `declared` and `procedure` take a dict; other keys replace a field of the
    case itself.
    """
    parts: dict[str, Any] = {
        name: replace(getattr(case, name), **changes.pop(name))
        for name in ("contact", "faults", "declared", "procedure")
        if name in changes
    }
    told = f"{case.story}; {story}" if case.story else story
    return replace(case, **{"ideal": False, "story": told, **parts, **changes})


def rough_case(world: str, seed: int, rng: np.random.Generator, share: float, said: bool) -> Case:
    """A rough sphere (10) whose length σ κ^-0.16 is `share` of the smooth depth.

    Where `said`, plan and truth agree on σ_eq within 10 % and on the micro-hardness within 20 %;
    else the plan does not speak of roughness.
    """
    rig = draw_rig(rng)
    scale_m = share * rig.depth_m
    law = laws.rough(rig.top_n, rig.depth_m, scale_m)
    case = ideal(world, seed, rng, law, rig)
    modulus = between(1e8, 1e11, rng)
    hardness = modulus * between(0.02, 0.3, rng)
    k = rig.top_n / rig.depth_m**1.5
    radius_m = (0.75 * k / modulus) ** 2
    sigma_m = (scale_m * (modulus / hardness * math.sqrt(radius_m)) ** 0.16) ** (1.0 / 1.08)
    story = f"scale {share:.3f} of the depth, sigma {sigma_m:.3g} m"
    theory: dict[str, Any] = {"theory_n": 1.5, "theory_k": k * between(1 / 1.2, 1.2, rng)}
    if not said:
        return spoiled(case, story, declared={**theory, "roughness_m": None})
    theory |= {
        "modulus_pa": modulus,
        "roughness_m": sigma_m * (1.0 + 0.1 * rng.standard_normal()),
        "micro_hardness_pa": hardness * between(1 / 1.2, 1.2, rng),
    }
    return replace(spoiled(case, story, declared=theory), ideal=True)
