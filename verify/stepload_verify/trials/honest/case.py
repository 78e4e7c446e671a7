"""One case: contact, rig, course, the errors that there are and those that are declared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stepload_verify.trials.honest.contact import Contact, Path
from stepload_verify.trials.honest.course import Procedure
from stepload_verify.trials.honest.laws import Law
from stepload_verify.trials.honest.rig import Rig

FloatArray = NDArray[np.float64]


Curve = Callable[[FloatArray], FloatArray]

MARGIN = 0.1
"""How far a curve is drawn beyond 0 … 1 on either side."""
KNOTS_A_LENGTH = 6


def squared(length: float, rng: np.random.Generator) -> Curve:
    """Unit variance, correlation exp(−½ (Δ/length)²) over arguments 0 … 1 (convolved noise)."""
    step = length / KNOTS_A_LENGTH
    reach = int(np.ceil(4.0 * KNOTS_A_LENGTH))
    kernel = np.exp(-((np.arange(-reach, reach + 1) / KNOTS_A_LENGTH) ** 2))
    kernel /= np.sqrt(np.sum(kernel**2))
    knots = np.arange(-MARGIN, 1.0 + MARGIN + step, step)
    noise = rng.standard_normal(knots.size + 2 * reach)
    values = np.convolve(noise, kernel, "valid")
    return lambda at: np.asarray(np.interp(at, knots, values))


def exponential(length: float, rng: np.random.Generator) -> Curve:
    """Unit variance, correlation exp(−|Δ|/length): rough, with no slope."""
    knots = np.linspace(-MARGIN, 1.0 + MARGIN, 2000)
    keep = float(np.exp(-(knots[1] - knots[0]) / length))
    values = np.empty(knots.size)
    noise = rng.standard_normal(knots.size)
    values[0] = noise[0]
    for i in range(1, knots.size):
        values[i] = keep * values[i - 1] + np.sqrt(1.0 - keep**2) * noise[i]
    return lambda at: np.asarray(np.interp(at, knots, values))


def ripple(period: float, rng: np.random.Generator) -> Curve:
    """A sinusoid of unit variance with a harmonic: a gear, a screw, an encoder."""
    phase, second = rng.uniform(0.0, 2.0 * np.pi, 2)
    share = rng.uniform(0.0, 0.5)
    size = np.sqrt(2.0 / (1.0 + share**2))

    def curve(at: FloatArray) -> FloatArray:
        turn = 2.0 * np.pi * at / period
        return np.asarray(size * (np.sin(turn + phase) + share * np.sin(2.0 * turn + second)))

    return curve


@dataclass(frozen=True, slots=True)
class Faults:
    """What is wrong with the measurement.

    Attributes:
        gain: relative error of the force reading.
        bend: error of the force reading in N over the true force.
        zero: error of the force reading in N over time.
        lag_s: delay of the force.
        error: displacement error in units of `error_m`, over force or travel as shares of the top.
        over_travel: whether over travel; else over force.
        error_m: its sd.
        noise_n: noise of the force per sample.
    """

    gain: float
    bend: Path
    zero: Path
    lag_s: float
    error: Curve
    over_travel: bool
    error_m: float
    noise_n: float


@dataclass(frozen=True, slots=True)
class Declared:
    """What plan, profile and calibration say beside the rig's figures.

    Attributes:
        touch_n: the touch threshold.
        roughness_m: σ_eq; 0 declared smooth, None not said.
        micro_hardness_pa, modulus_pa: for (9).
        theory_k, theory_n: the law expected, None where the plan does not know the shape.
        elastic_limit_n: believed F_c.
        length_n: correlation length of the smooth error, None where nobody has stated it.
        table: (force_n, deflection_m) of the load path measured in the same pose, or None.
        temperature_sigma_k, position_m_per_k: as in `Sources`.
    """

    touch_n: float
    roughness_m: float | None = None
    micro_hardness_pa: float | None = None
    modulus_pa: float | None = None
    theory_k: float | None = None
    theory_n: float | None = None
    elastic_limit_n: float | None = None
    length_n: float | None = None
    table: tuple[FloatArray, FloatArray] | None = None
    temperature_sigma_k: float = 0.0
    position_m_per_k: float = 0.0


@dataclass(frozen=True, slots=True)
class Case:
    """Everything that a run needs, and its truth.

    Attributes:
        world: its name; `seed` with it makes the same case again.
        ideal: a power law or a declared roughness, with errors of the declared sizes.
        unseen: what is wrong leaves no trace in a record of this kind.
        lateral: lateral force over the axial one.
        six_axes: whether the sensor sees it.
        settled: what is as true as the prompt law where a contact creeps faster than it is pressed;
            None: nothing is.
        story: what was drawn, for the reader of one case.
    """

    world: str
    seed: int
    ideal: bool
    undetected: bool
    rig: Rig
    procedure: Procedure
    contact: Contact
    faults: Faults
    declared: Declared
    lateral: float = 0.0
    six_axes: bool = True
    settled: Law | None = None
    story: str = ""

    @property
    def law(self) -> Law:
        """The true loading law of the contact."""
        return self.contact.law
