"""The mass that a force channel measures when the arm shakes, and the verdict on the channel."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np

from stepload.engine.lock_in import ComplexArray
from stepload.envelope.shake import HALF_WIDTH, Shake, ShakenChannel

ROUGH_GAIN = 0.3
"""Largest difference allowed between measured and stated mass, as a share of the stated one."""
ACROSS = 0.5
"""Share of the stated mass that, measured across instead of along the axis, means a wrong axis."""
TURNED = math.tan(math.radians(30.0))
"""Ratio of the quadrature part to the in-phase part that means a delay: late readings look weaker
than they are, then reversed, and their sign cannot be determined."""
NAMES = ("fx", "fy", "fz")


@dataclass(frozen=True, slots=True)
class FeltMass:
    """The mass that one channel measured, as shares of the mass that the plan states.

    `along` is measured along the pressing axis, in phase with the acceleration and positive in the
    sense of pressing; `half_width` is that of its 99 % interval. `late_rad` is the phase lag of the
    force behind the acceleration, from 0 to 2 pi, and `size` the magnitude whatever its phase.
    `across` is the largest share across the axis with its sign, and `across_axis` names that
    component as a plan would; "" for a channel of one component.
    """

    channel: ShakenChannel
    along: float
    half_width: float
    across: float
    across_axis: str
    late_rad: float
    size: float
    omega_rad_s: float

    @property
    def proven(self) -> bool:
        """Whether sign, axis and rough gain are as the plan says."""
        return self.told and abs(self.along - 1.0) <= ROUGH_GAIN and self.size <= 1.0 + ROUGH_GAIN

    @property
    def turned(self) -> bool:
        """Whether the force is neither in phase nor in antiphase with the acceleration."""
        aside = abs(self.size * math.sin(self.late_rad))
        return aside > ROUGH_GAIN and aside > TURNED * abs(self.along)

    @property
    def told(self) -> bool:
        """Whether the mass was measured precisely enough for any verdict."""
        return self.half_width <= HALF_WIDTH * max(1.0, abs(self.along))

    @property
    def problem(self) -> str:
        """What is wrong with the channel, and what to do; "" where it is proven."""
        if self.proven:
            return ""
        channel = self.channel
        felt = (
            f"the {channel.name} felt {self.along * channel.mass_kg:+.3g} kg ±"
            f" {self.half_width * channel.mass_kg:.2g} kg when the arm shook in free air, and"
            f" {channel.key}.tool_mass says {channel.mass_kg:.3g} kg"
        )
        if not self.told:
            return f"{felt}: too uncertain to prove anything; find what shakes or disturbs it"
        if abs(self.across) >= ACROSS > abs(self.along):
            return (
                f"{felt}: it felt {self.across * channel.mass_kg:.3g} kg along"
                f" {self.across_axis} instead, so the axis is wrong, or the sensor is mounted or"
                " wired otherwise; push by hand on the tool to see which (stepload setup)"
            )
        if self.turned:
            return f"{felt}: {self._late}"
        if self.along < -ROUGH_GAIN:
            half_ms = math.pi / self.omega_rad_s * 1e3
            return (
                f"{felt}: the sign is wrong, unless its readings come {half_ms:.0f} ms later than"
                " the plan says; push by hand on the tool, as the plate will, to see it (stepload"
                " setup), and change this channel alone"
            )
        if abs(self.along) <= ROUGH_GAIN:
            return (
                f"{felt}: the channel is dead although its noise lives, or nothing hangs on it;"
                " look at mounting, cable and amplifier"
            )
        return (
            f"{felt}: the gain is wrong by a factor of {self.size:.2g}, or the mass is; look at"
            " units, range and calibration of the sensor, and weigh the tool"
        )

    @property
    def _late(self) -> str:
        """What late readings mean, and what to do."""
        late_ms = self.late_rad / self.omega_rad_s * 1e3
        reversed_ms = (self.late_rad - math.pi) % math.tau / self.omega_rad_s * 1e3
        return (
            f"its readings came {late_ms:.0f} ms later than {self.channel.key}.delay says, or with"
            f" the wrong sign and {reversed_ms:.0f} ms later, at {self.size:.2g} times the mass:"
            " neither sign nor gain can be told; find what holds them back (filter, latency of a"
            " USB adapter, network) or state the delay, and push by hand to see the sign"
        )


def felt_mass(
    shake: Shake,
    channel: ShakenChannel,
    position_m: ComplexArray,
    force_n: ComplexArray,
    along: int,
    sign: float,
) -> FeltMass:
    """The mass a channel felt; arrays of amplitudes, shapes (cycles,) and (cycles, components).

    m = −F/(ω² X) of each cycle, real where the force is in phase; the scatter of the real parts is
    the uncertainty of their mean.
    """
    with np.errstate(invalid="ignore", divide="ignore"):  # NaN proves nothing
        masses = -force_n / (shake.omega_rad_s**2 * position_m[:, None])
    shares = sign * masses.real / channel.mass_kg
    mean = shares.mean(axis=0)
    whole = complex(sign * masses[:, along].mean() / channel.mass_kg)
    scatter = float(shares[:, along].std(ddof=1))
    half_width = shake.coverage * scatter / math.sqrt(len(shares))
    across, name = 0.0, ""
    others = [index for index in range(shares.shape[1]) if index != along]
    if others:
        most = max(others, key=lambda index: abs(mean[index]))
        across = float(mean[most])
        name = ("+" if sign * across > 0.0 else "-") + NAMES[most]
    if not math.isfinite(half_width):
        half_width = math.inf
    return FeltMass(
        channel, float(mean[along]), half_width, across, name,
        -cmath.phase(whole) % math.tau, abs(whole), shake.omega_rad_s,
    )  # fmt: skip
