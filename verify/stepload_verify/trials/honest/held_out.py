"""Worlds not used for tuning: other laws of creep, roughness, stiffening, drift and error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from stepload_verify.trials.honest import laws
from stepload_verify.trials.honest.case import Case
from stepload_verify.trials.honest.contact import Creep, settled
from stepload_verify.trials.honest.draw import PERIOD_S, ideal, linear, spoiled, start
from stepload_verify.trials.honest.errors import ripple
from stepload_verify.trials.honest.laws import FloatArray
from stepload_verify.trials.honest.rig import between, draw_rig
from stepload_verify.trials.honest.worlds import (
    HIGHER_THAN_TOUCH,
    Rng,
    World,
    any_exponent,
    rough_declared,
    sphere,
)


def creep_power(name: str, seed: int, rng: Rng) -> Case:
    """Creep that grows as a power of time (0.1 to 0.4), from 0.5 s to 500 s."""
    exponent, total = rng.uniform(0.1, 0.4), between(0.005, 0.3, rng)
    taus = np.geomspace(0.5, 500.0, 12)
    parts = taus**exponent
    parts *= total / float(parts.sum())
    drawn = Creep(tuple(parts.tolist()), tuple(taus.tolist()), bool(rng.integers(2)))
    story = f"exponent {exponent:.2f}, total {total:.3f}"
    return spoiled(start(name, seed, rng), story, contact={"creep": drawn})


def flow_once(name: str, seed: int, rng: Rng) -> Case:
    """Viscous flow under forces that are new to the body; what has flowed stays."""
    total, tau_s = between(0.005, 0.25, rng), between(1.0, 20.0, rng)
    drawn = Creep((total,), (tau_s,), first_only=True)
    story = f"total {total:.3f}, tau {tau_s:.1f} s"
    return spoiled(start(name, seed, rng), story, contact={"creep": drawn})


def asperities(name: str, seed: int, rng: Rng) -> Case:
    """Exponential asperity heights on a sphere, of which the plan does not speak."""
    rig = draw_rig(rng)
    height, onset = between(0.003, 0.04, rng), between(0.002, 0.1, rng)
    law = laws.asperities(rig.top_n, rig.depth_m, height * rig.depth_m, onset)
    case = ideal(name, seed, rng, law, rig)
    return spoiled(
        case, f"height {height:.3f} of the depth, onset {onset:.3f}",
        declared={"roughness_m": None},
    )  # fmt: skip


def two_stage(name: str, seed: int, rng: Rng) -> Case:
    """Two stops, one after the other."""
    rig = draw_rig(rng)
    n, first, second, ratios, share = 1.0, 0.0, 0.0, (1.0, 1.0), 0.0
    while share < HIGHER_THAN_TOUCH:
        n, first, second = rng.uniform(1.0, 1.5), rng.uniform(0.15, 0.5), rng.uniform(0.5, 0.95)
        ratios = between(0.3, 4.0, rng), between(0.5, 10.0, rng)
        share = first**n / (1.0 + ratios[0] * (1.0 - first) + ratios[1] * (1.0 - second))
    law = laws.two_stage(rig.top_n, rig.depth_m, n, (first, second), ratios)
    story = f"stops {first:.2f}, {second:.2f}; ratios {ratios[0]:.2f}, {ratios[1]:.2f}"
    return spoiled(ideal(name, seed, rng, law, rig), story)


def buckling(name: str, seed: int, rng: Rng) -> Case:
    """The body gets softer as the force rises."""
    rig = draw_rig(rng)
    knee, ratio = rng.uniform(0.3, 0.9), rng.uniform(0.2, 0.9)
    law = laws.softening(rig.top_n, rig.depth_m, knee, ratio)
    return spoiled(ideal(name, seed, rng, law, rig), f"knee {knee:.2f}, slope to {ratio:.2f}")


def seating(name: str, seed: int, rng: Rng) -> Case:
    """A flat face that comes down tilted: n = 2 until it lies, then straight."""
    rig = draw_rig(rng)
    lies = between(0.08, 0.8, rng)
    x = np.concatenate(([0.0], np.geomspace(1e-7, 1.5, 20000)))
    y = np.where(x < lies, x**2 / (2.0 * lies), x - 0.5 * lies)
    law = laws.of_force(x, y, rig.top_n, rig.depth_m, 1.0)
    return spoiled(ideal(name, seed, rng, law, rig), f"lies flat at {lies:.2f} of the path")


def ratcheting(name: str, seed: int, rng: Rng) -> Case:
    """Every cycle leaves a set, and the first flows a little more."""
    case = start(name, seed, rng)
    share = between(0.005, 0.1, rng)
    drawn = Creep((between(0.003, 0.05, rng),), (between(0.5, 5.0, rng),), first_only=True)
    return spoiled(
        case, f"set {share:.3f} of the depth a cycle",
        contact={"ratchet_m": share * case.rig.depth_m, "creep": drawn},
    )  # fmt: skip


def stick_slip(name: str, seed: int, rng: Rng) -> Case:
    """4 to 30 small slips at random forces of the first loading."""
    case = start(name, seed, rng)
    count, total = int(rng.integers(4, 30)), between(0.005, 0.1, rng)
    places = np.sort(rng.uniform(0.02, 1.0, count)) * case.rig.top_n
    sizes = total * rng.dirichlet(np.ones(count)) * case.rig.depth_m
    slips = tuple(zip(places.tolist(), sizes.tolist(), strict=True))
    return spoiled(case, f"{count} slips, {total:.3f} of the depth", contact={"slips": slips})


def walking_drift(name: str, seed: int, rng: Rng) -> Case:
    """The load path wanders: a random walk of 0.3 to 10 % of the depth a cycle."""
    case = start(name, seed, rng)
    share = between(0.003, 0.1, rng)
    knots = np.arange(0.0, 1000.0, 1.0)
    walk = np.cumsum(rng.standard_normal(knots.size)) / np.sqrt(PERIOD_S)
    walk *= share * case.rig.depth_m

    def path(at: FloatArray) -> FloatArray:
        return np.asarray(np.interp(at, knots, walk))

    return spoiled(case, f"{share:.3f} of the depth a cycle", contact={"drift": path})


def cooling(name: str, seed: int, rng: Rng) -> Case:
    """Two thermal time constants of opposite sign: the drift turns round during the run."""
    case = start(name, seed, rng)
    share = between(0.01, 0.2, rng) * float(rng.choice([-1.0, 1.0]))
    fast_s, slow_s = between(5.0, 40.0, rng), between(40.0, 400.0, rng)

    def path(at: FloatArray) -> FloatArray:
        turned = np.exp(-at / slow_s) - np.exp(-at / fast_s)
        return np.asarray(share * case.rig.depth_m * turned)

    story = f"{share:.3f} of the depth, {fast_s:.0f} and {slow_s:.0f} s"
    return spoiled(case, story, contact={"drift": path})


def wandering_zero(name: str, seed: int, rng: Rng) -> Case:
    """The zero of force drifts as a power of time during the run: the tares see the ends only."""
    case = start(name, seed, rng)
    size = between(0.002, 0.05, rng) * float(rng.choice([-1.0, 1.0]))
    exponent = float(rng.choice([0.3, 0.5, 2.0, 3.0]))
    top_n = case.rig.top_n

    def path(at: FloatArray) -> FloatArray:
        return np.asarray(size * top_n * (at / (2.0 * PERIOD_S)) ** exponent)

    return spoiled(case, f"{size:+.4f} of the peak, t^{exponent}", faults={"zero": path})


def gear(name: str, seed: int, rng: Rng) -> Case:
    """The gear's ripple over the travel, of the declared size, its length not stated."""
    case = start(name, seed, rng)
    period = between(0.03, 1.2, rng)
    return spoiled(
        case, f"period {period:.3f} of the travel", declared={"length_n": None},
        faults={"error": ripple(period, rng), "over_travel": True},
    )  # fmt: skip


def bigger_error(name: str, seed: int, rng: Rng) -> Case:
    """The smooth error is two to four times what is declared."""
    case = start(name, seed, rng)
    times = rng.uniform(2.0, 4.0)
    return spoiled(
        case, f"{times:.1f} times", unseen=True, faults={"error_m": times * case.rig.smooth_m}
    )


def creep_against_drift(name: str, seed: int, rng: Rng) -> Case:
    """Creep, and a drift against it: together the tops stand still."""
    case = start(name, seed, rng)
    total = between(0.01, 0.15, rng)
    drawn = Creep((total,), (between(5.0, 60.0, rng),))
    rate = -total * rng.uniform(0.1, 0.6) * case.rig.depth_m / PERIOD_S
    story = f"creep {total:.3f}, drift {rate * PERIOD_S / case.rig.depth_m:.3f} a cycle"
    return spoiled(case, story, contact={"creep": drawn, "drift": linear(rate)})


def adhesive_creep(name: str, seed: int, rng: Rng) -> Case:
    """Soft and sticky: JKR with creep."""
    rig = draw_rig(rng)
    pull, total = between(0.005, 0.1, rng), between(0.003, 0.1, rng)
    law = laws.adhesive(rig.top_n, rig.depth_m, pull * rig.top_n)
    case = ideal(name, seed, rng, law, rig)
    drawn = Creep((total,), (between(0.5, 20.0, rng),))
    return spoiled(case, f"pull {pull:.3f}, creep {total:.3f}", contact={"creep": drawn})


def periodic_drift(name: str, seed: int, rng: Rng) -> Case:
    """A drift that comes back in the time of about a cycle: air conditioning, a pump, the sun."""
    case = start(name, seed, rng)
    share, period_s = between(0.002, 0.05, rng), PERIOD_S * rng.uniform(0.5, 2.0)
    phase = rng.uniform(0.0, 2.0 * np.pi)

    def path(at: FloatArray) -> FloatArray:
        return np.asarray(share * case.rig.depth_m * np.sin(2.0 * np.pi * at / period_s + phase))

    return spoiled(case, f"{share:.4f} of the depth in {period_s:.0f} s", contact={"drift": path})


def joint_click(name: str, seed: int, rng: Rng) -> Case:
    """A joint of the arm takes up its lost motion at some force, in every cycle; no table."""
    case = start(name, seed, rng)
    at, share = rng.uniform(0.1, 0.9), between(0.005, 0.06, rng)
    straight, rig = case.contact.system, case.rig

    def path(force: FloatArray) -> FloatArray:
        through = np.clip((force / rig.top_n - at) / 0.01 + 0.5, 0.0, 1.0)
        return np.asarray(straight(force) + share * rig.depth_m * through)

    return spoiled(
        case, f"{share:.4f} of the depth at {at:.2f} of the top",
        contact={"system": path}, declared={"table": None},
    )  # fmt: skip


def quick_creep(name: str, seed: int, rng: Rng) -> Case:
    """Creep that is over within a ramp or a little more: 0.1 to 1 s."""
    total, tau_s = between(0.01, 0.2, rng), between(0.1, 1.0, rng)
    drawn = Creep((total,), (tau_s,), bool(rng.integers(2)))
    case = start(name, seed, rng)
    return spoiled(
        case, f"total {total:.3f}, tau {tau_s:.2f} s",
        contact={"creep": drawn}, settled=settled(case.law, drawn),
    )  # fmt: skip


def offset_in_contact(name: str, seed: int, rng: Rng) -> Case:
    """The zero of force in contact is not that of free air: 0.2 to 3 % of the peak, from 1 % on."""
    case = start(name, seed, rng)
    size = between(0.002, 0.03, rng) * float(rng.choice([-1.0, 1.0]))
    top_n = case.rig.top_n

    def path(force: FloatArray) -> FloatArray:
        return np.asarray(size * top_n * (1.0 - np.exp(-np.maximum(force, 0.0) / (0.01 * top_n))))

    return spoiled(case, f"{size:+.4f} of the peak", unseen=True, faults={"bend": path})


def sensor_creep(name: str, seed: int, rng: Rng) -> Case:
    """The force reading lags by 0.1 to 1 % of itself: a strain gauge that creeps, in 5 to 60 s."""
    case = start(name, seed, rng)
    share, tau_s = between(0.001, 0.01, rng), between(5.0, 60.0, rng)
    rate_hz = case.rig.rate_hz
    keep = float(np.exp(-1.0 / (rate_hz * tau_s)))

    def path(force: FloatArray) -> FloatArray:
        return np.asarray(share * lfilter([1.0 - keep], [1.0, -keep], force))

    return spoiled(case, f"{share:.4f}, tau {tau_s:.0f} s", faults={"bend": path})


def slow_sphere(name: str, seed: int, rng: Rng) -> Case:
    """An ideal run of another protocol: other levels, holds, ramps, cycles and sample rates."""
    case = start(name, seed, rng, float(rng.uniform(1.0, 2.2)))
    made = replace(
        case.procedure,
        levels=int(rng.choice([3, 4, 10])),
        hold_s=float(rng.choice([1.0, 1.5, 8.0])),
        rate_hz=float(rng.choice([20.0, 50.0, case.rig.rate_hz])),
        ramp_s=float(rng.choice([0.5, 2.0])),
        cycles=int(rng.choice([2, 3])),
    )
    return replace(case, procedure=made)


HELD_OUT_IDEAL: dict[str, tuple[World, float]] = {
    "sphere": (sphere, 0.25),
    "any-exponent": (any_exponent, 0.25),
    "rough-declared": (rough_declared, 0.2),
    "slow-sphere": (slow_sphere, 0.3),
}

HELD_OUT: dict[str, World] = {
    "creep-power": creep_power,
    "flow-once": flow_once,
    "asperities": asperities,
    "two-stage": two_stage,
    "buckling": buckling,
    "seating": seating,
    "ratcheting": ratcheting,
    "stick-slip": stick_slip,
    "walking-drift": walking_drift,
    "cooling": cooling,
    "wandering-zero": wandering_zero,
    "gear": gear,
    "bigger-error": bigger_error,
    "creep-against-drift": creep_against_drift,
    "adhesive-creep": adhesive_creep,
    "periodic-drift": periodic_drift,
    "joint-click": joint_click,
    "quick-creep": quick_creep,
    "offset-in-contact": offset_in_contact,
    "sensor-creep": sensor_creep,
}
