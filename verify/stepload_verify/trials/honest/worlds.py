"""The worlds.

Each makes a case from a seed. What is ideal obeys a power law, or a roughness that is declared,
and its errors have the declared sizes; what is spoiled violates what its name says.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from stepload_verify.trials.honest import laws
from stepload_verify.trials.honest.case import Case, exponential, ripple, squared
from stepload_verify.trials.honest.contact import Creep
from stepload_verify.trials.honest.draw import (
    PERIOD_S,
    ideal,
    linear,
    rough_case,
    spoiled,
    spring,
    start,
    table,
    true_stiffness,
)
from stepload_verify.trials.honest.laws import FloatArray
from stepload_verify.trials.honest.rig import between, draw_rig

World = Callable[[str, int, np.random.Generator], Case]
Rng = np.random.Generator
HIGHER_THAN_TOUCH = 0.04
"""A knee lies above this share of the top force: what is over before the touch is seen (1 % and
more) is in no record, and a secant from the first touch of such a contact cannot be known."""


def sphere(name: str, seed: int, rng: Rng) -> Case:
    """n = 1.5."""
    return start(name, seed, rng, 1.5)


def any_exponent(name: str, seed: int, rng: Rng) -> Case:
    """n between 1.2 and 2."""
    return start(name, seed, rng, float(rng.uniform(1.2, 2.0)))


def flat(name: str, seed: int, rng: Rng) -> Case:
    """n = 1."""
    return start(name, seed, rng, 1.0)


def rough_declared(name: str, seed: int, rng: Rng) -> Case:
    """A rough sphere of which the plan knows σ and micro-hardness."""
    return rough_case(name, seed, rng, between(0.007, 0.076, rng), True)


def rough_silent(name: str, seed: int, rng: Rng) -> Case:
    """A rough sphere of a plan that does not speak of roughness."""
    return rough_case(name, seed, rng, between(0.007, 0.076, rng), False)


def bilinear(name: str, seed: int, rng: Rng) -> Case:
    """A pad over a stiff body."""
    rig = draw_rig(rng)
    knee, ratio, share = 0.0, 1.0, 0.0
    while share < HIGHER_THAN_TOUCH:
        knee, ratio = rng.uniform(0.15, 0.85), between(1.5, 8.0, rng)
        share = knee / (knee + ratio * (1.0 - knee))
    law = laws.bilinear(rig.top_n, rig.depth_m, knee, ratio)
    return spoiled(ideal(name, seed, rng, law, rig), f"knee {knee:.2f}, ratio {ratio:.2f}")


def stiffening(name: str, seed: int, rng: Rng) -> Case:
    """A sphere that meets a stop."""
    rig = draw_rig(rng)
    stop, ratio, share = 0.0, 1.0, 0.0
    while share < HIGHER_THAN_TOUCH:
        stop, ratio = rng.uniform(0.2, 0.9), between(0.5, 10.0, rng)
        share = stop**1.5 / (1.0 + ratio * (1.0 - stop) ** 1.2)
    law = laws.stiffening(rig.top_n, rig.depth_m, 1.5, stop, ratio)
    return spoiled(ideal(name, seed, rng, law, rig), f"stop {stop:.2f}, ratio {ratio:.2f}")


def plastic(name: str, seed: int, rng: Rng) -> Case:
    """A sphere that yields below the F_c believed, or where none is known."""
    rig = draw_rig(rng)
    over = between(1.0, 7.0, rng)
    limit_n, limit_m = rig.top_n / over, rig.depth_m / over ** (2.0 / 3.0)
    law = laws.flowing(rig.top_n, limit_n, limit_m)
    case = ideal(name, seed, rng, law, rig)
    expected = rig.top_n * between(1.1, 4.0, rng) if rng.uniform() < 0.6 else None
    return spoiled(
        case,
        f"peak {over:.2f} F_c",
        contact={"limit_n": limit_n, "limit_m": limit_m},
        declared={"elastic_limit_n": expected},
    )


def _creep(total: float, rng: Rng) -> Creep:
    count = int(rng.integers(1, 4))
    shares = total * rng.dirichlet(np.ones(count))
    taus = np.exp(rng.uniform(0.0, np.log(30.0), count))
    return Creep(tuple(shares.tolist()), tuple(taus.tolist()), bool(rng.uniform() < 0.5))


def creep(name: str, seed: int, rng: Rng) -> Case:
    """0.5 to 35 % of the deformation comes late, within 1 to 30 s."""
    total = between(0.005, 0.35, rng)
    drawn = _creep(total, rng)
    return spoiled(start(name, seed, rng), f"{drawn}", contact={"creep": drawn})


def creep_log(name: str, seed: int, rng: Rng) -> Case:
    """Creep without a time of its own: equal shares from 1 s to 1000 s."""
    total = between(0.01, 0.5, rng)
    taus = np.geomspace(1.0, 1000.0, 10)
    drawn = Creep((total / taus.size,) * taus.size, tuple(taus.tolist()), bool(rng.integers(2)))
    return spoiled(start(name, seed, rng), f"total {total:.3f}", contact={"creep": drawn})


def creep_long_holds(name: str, seed: int, rng: Rng) -> Case:
    """Creep, and holds of 20 s."""
    return spoiled(creep(name, seed, rng), "holds 20 s", procedure={"hold_s": 20.0})


def creep_short_holds(name: str, seed: int, rng: Rng) -> Case:
    """Creep of 2 to 15 % within 5 to 40 s, and holds of half a second or one."""
    drawn = Creep((between(0.02, 0.15, rng),), (between(5.0, 40.0, rng),))
    hold_s = float(rng.choice([0.5, 1.0]))
    case = start(name, seed, rng)
    return spoiled(
        case, f"{drawn}, holds {hold_s} s", contact={"creep": drawn}, procedure={"hold_s": hold_s}
    )  # fmt: skip


def viscous(name: str, seed: int, rng: Rng) -> Case:
    """A Kelvin-Voigt body that follows its force within 10 to 300 ms."""
    damping_s = between(0.01, 0.3, rng)
    case = start(name, seed, rng)
    return spoiled(case, f"follows within {damping_s:.3f} s", contact={"damping_s": damping_s})


def load_drift(name: str, seed: int, rng: Rng) -> Case:
    """A drift that turns with the force, 0.5 to 30 % of the depth a cycle; half have no holds."""
    case = start(name, seed, rng)
    share = between(0.005, 0.3, rng) * float(rng.choice([-1.0, 1.0]))
    rate = share * case.rig.depth_m / PERIOD_S / (0.5 * case.rig.top_n)
    hold_s = 0.0 if rng.integers(2) else case.procedure.hold_s
    return spoiled(
        case, f"{share:.3f} of the depth a cycle, holds {hold_s} s",
        contact={"load_drift_m_per_n_s": rate}, procedure={"hold_s": hold_s},
    )  # fmt: skip


def drift(name: str, seed: int, rng: Rng) -> Case:
    """The whole load path drifts by 0.5 to 30 % of the depth a cycle."""
    case = start(name, seed, rng)
    share = between(0.005, 0.3, rng) * float(rng.choice([-1.0, 1.0]))
    path = linear(share * case.rig.depth_m / PERIOD_S)
    return spoiled(case, f"{share:.3f} of the depth a cycle", contact={"drift": path})


def temperature(name: str, seed: int, rng: Rng) -> Case:
    """The rig warms up: fast, then ever more slowly, nothing of it declared."""
    case = start(name, seed, rng)
    share = between(0.01, 0.2, rng) * float(rng.choice([-1.0, 1.0]))
    tau_s = between(30.0, 600.0, rng)
    size_m = share * case.rig.depth_m / (1.0 - np.exp(-PERIOD_S / tau_s))

    def path(at: FloatArray) -> FloatArray:
        return np.asarray(size_m * (1.0 - np.exp(-at / tau_s)))

    return spoiled(
        case, f"{share:.3f} of the depth in a cycle, tau {tau_s:.0f} s",
        contact={"drift": path}, declared={"temperature_sigma_k": 0.0},
    )  # fmt: skip


def hysteresis(name: str, seed: int, rng: Rng) -> Case:
    """A loop that loses 3 to 15 % of the stored energy."""
    loss = rng.uniform(0.03, 0.15)
    return spoiled(start(name, seed, rng), f"loss {loss:.3f}", contact={"loss": loss})


def slip(name: str, seed: int, rng: Rng) -> Case:
    """The payload slips once in its first loading."""
    case = start(name, seed, rng)
    at, length = rng.uniform(0.05, 0.98), between(0.01, 0.1, rng)
    slips = ((at * case.rig.top_n, length * case.rig.depth_m),)
    return spoiled(case, f"{length:.3f} of the depth at {at:.2f}", contact={"slips": slips})


def backlash(name: str, seed: int, rng: Rng) -> Case:
    """The reading loses some of the way where the motion turns."""
    case = start(name, seed, rng)
    share = between(0.003, 0.05, rng)
    return spoiled(
        case, f"{share:.3f} of the depth", contact={"backlash_m": share * case.rig.depth_m}
    )


def _soft(name: str, seed: int, rng: Rng) -> Case:
    """A load path that is softer at low force, declared by a line above 40 % of the top."""
    case = start(name, seed, rng)
    rig, gain = case.rig, case.faults.gain
    extra, reach = between(0.02, 0.3, rng), between(0.05, 0.4, rng)
    true_k_s = true_stiffness(rig, gain, rng)
    size_m, over_n = extra * rig.bend_m, reach * rig.top_n

    def path(force: FloatArray) -> FloatArray:
        seating = np.sign(force) * (1.0 - np.exp(-np.abs(force) / over_n))
        return np.asarray(force / true_k_s + size_m * seating)

    ends = path(rig.top_n * np.array([0.4, 1.0]) / (1.0 + gain))
    straight = rig.top_n * 0.6 / true_k_s / (1.0 + gain)
    line = rig.stiffness_n_per_m * straight / float(ends[1] - ends[0])
    return spoiled(
        case, f"extra {extra:.3f} within {reach:.2f} of the top",
        rig=replace(rig, stiffness_n_per_m=line), contact={"system": path},
    )  # fmt: skip


def soft_path(name: str, seed: int, rng: Rng) -> Case:
    """K_s(F) is softer at low force; K_s comes from a line above 40 %, there is no table."""
    return spoiled(_soft(name, seed, rng), "no table", declared={"table": None}, undetected=True)


def soft_path_table(name: str, seed: int, rng: Rng) -> Case:
    """K_s(F) is softer at low force, and a table of it was measured in the same pose."""
    case = _soft(name, seed, rng)
    measured = table(case.contact.system, case.rig, case.faults.gain)
    return spoiled(case, "with a table", declared={"table": measured})


def wrong_stiffness(name: str, seed: int, rng: Rng) -> Case:
    """K_s is 4 to 10 % off what is stated to about 1 %: another pose, an old calibration."""
    case = start(name, seed, rng)
    off = rng.uniform(0.04, 0.1) * float(rng.choice([-1.0, 1.0]))
    path = spring(case.rig.stiffness_n_per_m * (1.0 + off))
    return spoiled(
        case, f"K_s {100 * off:+.1f} %", undetected=True, contact={"system": path},
        declared={"table": None},
    )  # fmt: skip


def wrong_stiffness_table(name: str, seed: int, rng: Rng) -> Case:
    """K_s is 4 to 10 % wrong, but a table was measured in the pose of the run."""
    case = wrong_stiffness(name, seed, rng)
    force = case.rig.top_n * np.linspace(0.0, 1.1, 23)
    error = 1.0 + case.rig.stiffness_sigma * rng.normal()
    measured = force, error * case.contact.system(force / (1.0 + case.faults.gain))
    return spoiled(case, "with a table", undetected=False, declared={"table": measured})


def lateral(name: str, seed: int, rng: Rng) -> Case:
    """A lateral force, which bends the arm along it; one sensor in five does not see it."""
    case = replace(start(name, seed, rng), six_axes=bool(rng.uniform() < 0.8))
    share, coupling = rng.uniform(0.0, 0.3), rng.uniform(0.05, 0.6) * float(rng.choice([-1, 1]))
    straight = case.contact.system
    bend = share * coupling / case.rig.stiffness_n_per_m

    def path(force: FloatArray) -> FloatArray:
        return np.asarray(straight(force) + bend * force)

    return spoiled(
        case, f"share {share:.3f}, coupling {coupling:.2f}, six axes {case.six_axes}",
        lateral=share, undetected=not case.six_axes, contact={"system": path},
    )  # fmt: skip


def adhesion(name: str, seed: int, rng: Rng) -> Case:
    """JKR, pull-off 1 to 20 % of the peak."""
    rig = draw_rig(rng)
    pull = between(0.01, 0.2, rng)
    law = laws.adhesive(rig.top_n, rig.depth_m, pull * rig.top_n)
    return spoiled(ideal(name, seed, rng, law, rig), f"pull-off {pull:.3f} of the peak")


def wrong_gain(name: str, seed: int, rng: Rng) -> Case:
    """The force reads 0.5 to 2 % wrong, far beyond its certificate, or another axis leaks into it.

    In half of the cases it was already wrong when K_s was measured.
    """
    case = start(name, seed, rng)
    gain = between(0.005, 0.02, rng) * float(rng.choice([-1.0, 1.0]))
    always = bool(rng.integers(2))
    path = spring(true_stiffness(case.rig, gain if always else 0.0, rng))
    when = "always" if always else "since the calibration"
    return spoiled(
        case, f"gain {gain:+.3f} {when}", undetected=True, faults={"gain": gain},
        contact={"system": path},
    )  # fmt: skip


def bent_sensor(name: str, seed: int, rng: Rng) -> Case:
    """The sensor is not linear: 0.5 to 2 % of the peak, at one side or in the middle."""
    case = start(name, seed, rng)
    top_n, size = case.rig.top_n, between(0.005, 0.02, rng) * float(rng.choice([-1.0, 1.0]))
    cubic = bool(rng.integers(2))

    def path(force: FloatArray) -> FloatArray:
        e = force / top_n
        shape = 10.39 * e * (e - 0.5) * (1.0 - e) * 2.0 if cubic else 4.0 * e * (1.0 - e)
        return np.asarray(size * top_n * shape)

    form = "cubic" if cubic else "bow"
    return spoiled(case, f"{form} {size:+.4f}", undetected=True, faults={"bend": path})


def noisy(name: str, seed: int, rng: Rng) -> Case:
    """Force noise of 0.5 to 3 % of the peak, declared."""
    case = start(name, seed, rng)
    share = between(0.005, 0.03, rng)
    noise_n = share * case.rig.top_n
    touch_n = max(case.procedure.touch_n, 8.0 * noise_n)
    return spoiled(
        case, f"noise {share:.4f}", rig=replace(case.rig, force_noise_n=noise_n),
        faults={"noise_n": noise_n}, declared={"touch_n": touch_n},
        procedure={"touch_n": touch_n},
    )  # fmt: skip


def late_force(name: str, seed: int, rng: Rng) -> Case:
    """The force comes 5 to 60 ms late."""
    lag_s = between(0.005, 0.06, rng)
    return spoiled(start(name, seed, rng), f"lag {lag_s:.4f} s", faults={"lag_s": lag_s})


def late_touch(name: str, seed: int, rng: Rng) -> Case:
    """The touch is seen at 3 to 15 % of the peak, the threshold is said to be lower."""
    case = start(name, seed, rng)
    share = between(0.03, 0.15, rng)
    return spoiled(
        case, f"touch at {share:.3f} of the peak", procedure={"touch_n": share * case.rig.top_n}
    )


def length(name: str, seed: int, rng: Rng) -> Case:
    """The smooth error's length is anything from a thirtieth of the peak to all of it, unstated."""
    case = start(name, seed, rng)
    share = between(1.0 / 30.0, 1.0, rng)
    return spoiled(
        case, f"length {share:.3f} of the peak", declared={"length_n": None},
        faults={"error": squared(share, rng), "over_travel": bool(rng.integers(2))},
    )  # fmt: skip


def kernel(name: str, seed: int, rng: Rng) -> Case:
    """The smooth error is no Gaussian process of the stated kind: no slope, or a gear's ripple."""
    case = start(name, seed, rng)
    share = between(1.0 / 15.0, 0.5, rng)
    rippled = bool(rng.integers(2))
    curve = ripple(2.5 * share, rng) if rippled else exponential(share, rng)
    form = "ripple" if rippled else "exponential"
    return spoiled(
        case, f"{form} {share:.3f}",
        rig=replace(case.rig, smooth_length_n=share * case.rig.top_n),
        declared={"length_n": share * case.rig.top_n if rng.integers(2) else None},
        faults={"error": curve, "over_travel": bool(rng.integers(2))},
    )  # fmt: skip


def one_cycle(name: str, seed: int, rng: Rng) -> Case:
    """A single cycle, half of them with creep, drift, slip or yield."""
    if rng.integers(2):
        case = start(name, seed, rng)
    else:
        makers = (creep, drift, slip, plastic)
        case = makers[int(rng.integers(len(makers)))](name, seed, rng)
    return spoiled(case, "one cycle", procedure={"cycles": 1})


def two_at_once(name: str, seed: int, rng: Rng) -> Case:
    """Two of creep, drift, slip, loop and a lateral force, each so small as hardly to be seen."""
    case = start(name, seed, rng)
    rig = case.rig
    kinds = rng.choice(5, size=2, replace=False).tolist()
    if 0 in kinds:
        case = spoiled(case, "creep", contact={"creep": _creep(between(0.005, 0.06, rng), rng)})
    if 1 in kinds:
        rate = between(0.003, 0.05, rng) * rig.depth_m / PERIOD_S * float(rng.choice([-1, 1]))
        case = spoiled(case, "drift", contact={"drift": linear(rate)})
    if 2 in kinds:
        slips = ((rng.uniform(0.1, 0.9) * rig.top_n, between(0.005, 0.04, rng) * rig.depth_m),)
        case = spoiled(case, "slip", contact={"slips": slips})
    if 3 in kinds:
        case = spoiled(case, "loop", contact={"loss": rng.uniform(0.03, 0.1)})
    if 4 in kinds and case.six_axes:
        share = rng.uniform(0.0, 0.06)
        straight, bend = case.contact.system, share * rng.uniform(-0.5, 0.5) / rig.stiffness_n_per_m

        def path(force: FloatArray) -> FloatArray:
            return np.asarray(straight(force) + bend * force)

        case = spoiled(case, "lateral", lateral=share, contact={"system": path})
    return case


IDEAL: dict[str, tuple[World, float]] = {
    "sphere": (sphere, 0.4),
    "any-exponent": (any_exponent, 0.3),
    "flat": (flat, 0.1),
    "rough-declared": (rough_declared, 0.2),
}
"""Ideal worlds with their shares of the ideal half."""

SPOILED: dict[str, World] = {
    "rough-silent": rough_silent,
    "bilinear": bilinear,
    "stiffening": stiffening,
    "plastic": plastic,
    "creep": creep,
    "creep-log": creep_log,
    "creep-long-holds": creep_long_holds,
    "creep-short-holds": creep_short_holds,
    "viscous": viscous,
    "load-drift": load_drift,
    "drift": drift,
    "temperature": temperature,
    "hysteresis": hysteresis,
    "slip": slip,
    "backlash": backlash,
    "soft-path": soft_path,
    "soft-path-table": soft_path_table,
    "wrong-stiffness": wrong_stiffness,
    "wrong-stiffness-table": wrong_stiffness_table,
    "lateral": lateral,
    "adhesion": adhesion,
    "wrong-gain": wrong_gain,
    "bent-sensor": bent_sensor,
    "noisy": noisy,
    "late-force": late_force,
    "late-touch": late_touch,
    "length": length,
    "kernel": kernel,
    "one-cycle": one_cycle,
    "two-at-once": two_at_once,
}


def make(worlds: dict[str, World], name: str, seed: int) -> Case:
    """The case of a world and a seed."""
    rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
    return worlds[name](name, seed, rng)


KNOWN: dict[str, World] = {**{name: world for name, (world, _) in IDEAL.items()}, **SPOILED}
