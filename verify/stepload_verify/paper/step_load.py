"""The paper's experiment as a simulation: an arm presses in force steps, with its own errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_KNOTS = 121
Law = Callable[[FloatArray], FloatArray]
"""Forces (N,) in N ≥ 0 → deformation (N,) in m."""


@dataclass(frozen=True, slots=True)
class StepRig:
    """A rig as the paper describes it; `force_noise_n` is the white noise before quantisation."""

    stiffness_n_per_m: float = 3.49e6
    damping_n_s_per_m: float = 3.87e4
    position_resolution_m: float = 2e-6
    force_resolution_n: float = 1.5
    force_noise_n: float = 0.5
    top_force_n: float = 300.0
    step_n: float = 50.0
    ramp_s: float = 1.0
    hold_s: float = 3.0
    rate_hz: float = 1000.0


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors of the measurement beyond noise and quanta.

    `touch_force_n` is the threshold at which the zero of position is taken (None: zero known),
    `stiffness_sigma` the relative error of the believed K_s, `smooth_m` the sd of the kinematic
    error with its correlation `length_n`.
    """

    touch_force_n: float | None = 3.0
    stiffness_sigma: float = 0.0
    smooth_m: float = 0.0
    length_n: float = 50.0


SCENARIO_C = Errors(stiffness_sigma=0.02, smooth_m=0.54e-6)
STVF = StepRig()
INSTRON = StepRig(
    stiffness_n_per_m=1.62e7,
    damping_n_s_per_m=0.0,
    position_resolution_m=1e-6,
    force_resolution_n=1.0,
    force_noise_n=0.3,
)
STVF_MSDE_M, INSTRON_MSDE_M = 5.42e-7, 1.31e-6
"""Printed rms misfits of the linear K_s (26)."""


class RawRun(NamedTuple):
    """Time, travel and force (N,) as recorded, travel from the zero; `touch` is its first sample.

    `stiffness_n_per_m` is the K_s that the evaluation believes.
    """

    time_s: FloatArray
    travel_m: FloatArray
    force_n: FloatArray
    touch: int
    stiffness_n_per_m: float

    def deformation_m(self) -> FloatArray:
        """Payload deformation (27) from the touch on."""
        return self.travel_m[self.touch :] - self.loaded_n() / self.stiffness_n_per_m

    def loaded_n(self) -> FloatArray:
        """Force from the touch on."""
        return self.force_n[self.touch :]


def press(law: Law, rig: StepRig, errors: Errors, rng: np.random.Generator) -> RawRun:
    """One loading run in steps, begun in free air; the same `rng` state gives the same run."""
    force = _force_course(rig)
    smooth = smooth_error(force, errors, rng)
    rate = np.gradient(force) * rig.rate_hz
    system = (force - rig.damping_n_s_per_m * rate / rig.stiffness_n_per_m) / rig.stiffness_n_per_m
    contact = int(np.argmax(force > 0.0))
    gap = np.zeros_like(force)
    gap[:contact] = np.linspace(-10e-6, 0.0, contact)
    true_travel = law(force) + np.where(force > 0, system, 0.0) + smooth + gap
    offset = rng.uniform(0.0, 1.0) * rig.position_resolution_m
    travel = _quantised(true_travel + offset, rig.position_resolution_m) - offset
    noise = rng.normal(0.0, rig.force_noise_n, force.size)
    read = _quantised(force + noise, rig.force_resolution_n)
    touch = contact
    if errors.touch_force_n is not None:
        touch = int(np.argmax(read >= errors.touch_force_n))
        travel = travel - travel[touch]
    expected = rig.stiffness_n_per_m * (1.0 + errors.stiffness_sigma * rng.standard_normal())
    return RawRun(np.arange(force.size) / rig.rate_hz, travel, read, touch, expected)


def smooth_error(force_n: FloatArray, errors: Errors, rng: np.random.Generator) -> FloatArray:
    """A draw (N,) of the kinematic error in m: one function of force for the whole run."""
    top = float(force_n.max())
    draw = _root(errors.length_n / top) @ rng.standard_normal(_KNOTS)
    knots = np.linspace(0.0, top, _KNOTS)
    return np.asarray(errors.smooth_m * np.interp(force_n, knots, draw))


@cache
def _root(length: float) -> FloatArray:
    """Square root of the correlation over a range of 1."""
    knots = np.linspace(0.0, 1.0, _KNOTS)
    distance = np.abs(np.subtract.outer(knots, knots)) / length
    value, vector = np.linalg.eigh(np.exp(-0.5 * distance**2))
    return np.asarray(vector * np.sqrt(np.clip(value, 0.0, None)))


def _force_course(rig: StepRig) -> FloatArray:
    ramp_points, hold_points = round(rig.ramp_s * rig.rate_hz), round(rig.hold_s * rig.rate_hz)
    ramp = rig.step_n * np.arange(1, ramp_points + 1) / ramp_points
    parts = [np.zeros(ramp_points)]
    for level in np.arange(0.0, rig.top_force_n, rig.step_n):
        parts += [level + ramp, np.full(hold_points, level + rig.step_n)]
    return np.concatenate(parts)


def _quantised(values: FloatArray, quantum: float) -> FloatArray:
    return np.asarray(np.round(values / quantum) * quantum if quantum > 0 else values)
